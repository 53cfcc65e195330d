//! Logs put together from chunks in memory, and logs that were cut off and completed.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::time::SystemTime;
use worm_estimator::message::State;
use worm_log::{ChunkWriter, Origin, complete, head, messages, metadata_record, outline};

const SECOND_NS: u64 = 1_000_000_000;

fn origin() -> Origin {
    Origin {
        worm: "chunks".to_owned(),
        cells: 4,
        config: Some("[worm]\nname = \"chunks\"\n".to_owned()),
        begun: SystemTime::UNIX_EPOCH,
        begun_ns: 7,
    }
}

fn state(sequence: u64) -> State {
    State {
        sequence,
        time_ns: SECOND_NS + sequence * 1_000_000,
        ..State::unknown(4)
    }
}

/// A head with a metadata record, ten chunks of 100 states each, and a last record.
fn parts() -> (Vec<u8>, Vec<Vec<u8>>, Vec<u8>) {
    let about = BTreeMap::from([("reason".to_owned(), "alarm motor-stall".to_owned())]);
    let mut writer = ChunkWriter::new(0).expect("a compressor");
    let chunks = (0..10).map(|chunk| {
        for sequence in chunk * 100..(chunk + 1) * 100 {
            writer.write(&state(sequence)).expect("in memory");
        }
        let made = writer.take().expect("in memory").expect("states");
        assert_eq!(made.first_ns, state(chunk * 100).time_ns);
        assert_eq!(made.last_ns, state(chunk * 100 + 99).time_ns);
        made.bytes().to_vec()
    });
    let chunks = chunks.collect();
    let head = head(&origin(), &[("about", about)]).expect("in memory");
    (
        head,
        chunks,
        metadata_record("end", BTreeMap::new()).expect("in memory"),
    )
}

fn file_of(bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    File::create(&path)
        .and_then(|mut file| file.write_all(bytes))
        .expect("room");
    (folder, path)
}

fn completed(path: &std::path::Path) -> worm_log::Outline {
    let mut file = File::options().read(true).write(true).open(path).expect("is there");
    complete(&mut file).expect("it can be completed")
}

#[test]
fn chunks_of_any_minute_make_a_complete_log() {
    let (head, chunks, end) = parts();
    // The first three are older than what is kept.
    let bytes = [head, chunks[3..].concat(), end].concat();
    let (_folder, path) = file_of(&bytes);
    assert!(
        !outline(&mut File::open(&path).expect("is there"))
            .expect("readable")
            .is_complete
    );
    completed(&path);
    let log = messages(&path).expect("a log");
    assert_eq!(log.warnings, Vec::<String>::new());
    assert!(log.states.iter().map(|state| state.sequence).eq(300..1000));
    assert_eq!(log.config, origin().config);
    let held = outline(&mut File::open(&path).expect("is there")).expect("readable");
    assert_eq!(held.metadata["about"]["reason"], "alarm motor-stall");
    assert!(held.is_complete && held.metadata.contains_key("end"));
    assert_eq!(
        (held.messages, held.first_ns, held.last_ns),
        (700, state(300).time_ns, state(999).time_ns)
    );
    // Once more changes nothing.
    let before = std::fs::read(&path).expect("readable");
    completed(&path);
    assert!(before == std::fs::read(&path).expect("readable"));
}

#[test]
fn wherever_a_log_is_cut_off_its_whole_chunks_stay() {
    let (head, chunks, end) = parts();
    let whole = [head.clone(), chunks.concat(), end].concat();
    let ends: Vec<usize> = chunks
        .iter()
        .scan(head.len(), |at, chunk| {
            *at += chunk.len();
            Some(*at)
        })
        .collect();
    for cut in (head.len()..whole.len()).step_by(37).chain([whole.len()]) {
        let (_folder, path) = file_of(&whole[..cut]);
        completed(&path);
        let log = messages(&path).expect("a log");
        let chunks = ends.iter().filter(|&&end| end <= cut).count() as u64;
        assert!(
            log.states.iter().map(|state| state.sequence).eq(0..chunks * 100),
            "cut at {cut}"
        );
        assert_eq!(log.warnings, Vec::<String>::new(), "cut at {cut}");
        let held = outline(&mut File::open(&path).expect("is there")).expect("readable");
        assert_eq!(held.messages, chunks * 100, "cut at {cut}");
    }
    // Zeros that the disk had allocated and never got, and something else.
    let (_folder, path) = file_of(&[whole[..ends[4]].to_vec(), vec![0; 5000]].concat());
    completed(&path);
    assert_eq!(messages(&path).expect("a log").states.len(), 500);
    let (_folder, path) = file_of(b"no log");
    assert!(outline(&mut File::open(&path).expect("is there")).is_err());
}
