use super::super::log_head::LogClock;
use super::*;
use std::time::SystemTime;
use worm_estimator::message::{RecordingProblem, State};
use worm_log::{Origin, messages};

/// A recording of states in a folder of its own.
struct Recording {
    folder: tempfile::TempDir,
    series: Option<FileSeries>,
    progress: Arc<Progress>,
    next_sequence: u64,
}

impl Recording {
    fn begin(limits: FileOptions) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let first = folder.path().join("run.mcap");
        let progress = Arc::new(Progress::default());
        let origin = Origin {
            worm: "tester".to_owned(),
            cells: 4,
            config: Some("[worm]\n".to_owned()),
            begun: SystemTime::now(),
            begun_ns: 0,
        };
        let head = LogHead {
            origin,
            clock: LogClock::Own,
            notes: Vec::new(),
        };
        let file = LogFile::create(&first, false, &progress).expect("an empty folder");
        let series = FileSeries::begin(&first, file, false, head, limits, &progress).expect("there is room");
        Self {
            folder,
            series: Some(series),
            progress,
            next_sequence: 0,
        }
    }

    /// Writes a batch of `count` states at `now`, and waits until it is on the disk.
    fn write(&mut self, count: u64, now: Instant) -> Result<(), SeriesError> {
        let sequences = self.next_sequence..self.next_sequence + count;
        self.next_sequence = sequences.end;
        let states: Vec<State> = sequences
            .map(|sequence| State {
                sequence,
                time_ns: 1 + sequence,
                // What does not compress well.
                phase: (sequence as f64).sqrt(),
                motor_current_a: (sequence as f64).sin(),
                ..State::unknown(4)
            })
            .collect();
        let mut series = self.series.take().expect("no error so far").prepared(now)?;
        series.write(&states)?;
        series.sync()?;
        self.series = Some(series);
        Ok(())
    }

    fn finish(&mut self) {
        let counts = self
            .series
            .take()
            .expect("no error so far")
            .finish()
            .expect("there is room");
        let states = counts.iter().find(|(channel, _)| *channel == Channel::State);
        assert_eq!(
            states.map(|(_, count)| *count),
            Some(self.next_sequence),
            "counted over all files"
        );
    }

    fn path(&self, number: u64) -> PathBuf {
        numbered(&self.folder.path().join("run.mcap"), number)
    }

    /// Numbers of the states in a file, which must be complete.
    fn states_in(&self, number: u64) -> Vec<u64> {
        let log = messages(&self.path(number)).expect("a log");
        assert_eq!(log.warnings, Vec::<String>::new(), "file {number} is complete");
        assert_eq!(log.config.as_deref(), Some("[worm]\n"));
        assert_eq!(log.metadata["worm"], "tester");
        log.states.iter().map(|state| state.sequence).collect()
    }

    fn files(&self) -> Vec<String> {
        let names = std::fs::read_dir(self.folder.path()).expect("is there");
        let mut names: Vec<String> = names
            .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }
}

#[test]
fn every_message_is_in_one_file_and_each_file_is_whole() {
    let max_bytes = 60_000;
    let mut recording = Recording::begin(FileOptions {
        max_bytes: Some(max_bytes),
        ..FileOptions::default()
    });
    let now = Instant::now();
    for _ in 0..60 {
        recording.write(50, now).expect("there is room");
    }
    recording.finish();
    let files = recording.progress.files();
    assert!(files >= 3, "{files} files");
    let all: Vec<u64> = (0..files).flat_map(|number| recording.states_in(number)).collect();
    assert!(all.iter().copied().eq(0..3000), "in order, none lost, none doubled");
    let mut sum = 0;
    for number in 0..files {
        let length = recording.path(number).metadata().expect("is there").len();
        // A batch of 50 states, and the index, which repeats the schemas.
        assert!(length < max_bytes + 40_000, "file {number} has {length} bytes");
        sum += length;
    }
    assert_eq!(recording.progress.bytes(), sum);
}

#[test]
fn a_file_that_is_old_is_followed_by_another_when_there_is_something_to_write() {
    let mut recording = Recording::begin(FileOptions {
        max_age: Some(Duration::from_secs(10)),
        ..FileOptions::default()
    });
    let begun = Instant::now();
    for at_s in [100, 105, 109, 110, 115, 200, 201] {
        recording
            .write(1, begun + Duration::from_secs(at_s))
            .expect("there is room");
    }
    recording.finish();
    let files: Vec<_> = (0..recording.progress.files())
        .map(|number| recording.states_in(number))
        .collect();
    assert_eq!(
        files,
        [vec![0, 1, 2], vec![3, 4], vec![5, 6]],
        "the wait for the first message does not count"
    );
}

#[test]
fn only_the_newest_are_kept_and_only_own_files_are_removed() {
    let mut recording = Recording::begin(FileOptions {
        max_age: Some(Duration::from_secs(1)),
        keep: Some(2),
        ..FileOptions::default()
    });
    let foreign = "of an earlier recording";
    std::fs::write(recording.path(2), foreign).expect("can be written");
    let begun = Instant::now();
    for at_s in 0..4 {
        recording
            .write(1, begun + Duration::from_secs(at_s))
            .expect("there is room");
    }
    assert_eq!(
        recording.files(),
        ["run.2.mcap", "run.3.mcap", "run.4.mcap"],
        "2 was left out"
    );
    // Somebody puts another file in the place of one that is to be removed next.
    std::fs::rename(recording.path(3), recording.folder.path().join("moved")).expect("is there");
    std::fs::write(recording.path(3), foreign).expect("can be written");
    recording
        .write(1, begun + Duration::from_secs(4))
        .expect("there is room");
    recording.finish();
    assert_eq!(
        recording.files(),
        ["moved", "run.2.mcap", "run.3.mcap", "run.4.mcap", "run.5.mcap"]
    );
    for number in [2, 3] {
        let text = std::fs::read_to_string(recording.path(number)).expect("is there");
        assert_eq!(text, foreign, "file {number}");
    }
    assert_eq!((recording.states_in(4), recording.states_in(5)), (vec![3], vec![4]));
}

#[test]
fn a_file_that_cannot_be_removed_is_tried_again_with_the_next() {
    let mut recording = Recording::begin(FileOptions {
        max_age: Some(Duration::from_secs(1)),
        keep: Some(2),
        ..FileOptions::default()
    });
    // The oldest file lies in a folder that cannot be entered for a while.
    let [folder, aside] = ["folder", "aside"].map(|name| recording.folder.path().join(name));
    std::fs::create_dir(&folder).expect("can be made");
    let path = folder.join("old.mcap");
    let file = LogFile::create(&path, false, &recording.progress).expect("an empty folder");
    let oldest = file.identity(&path).expect("is there");
    recording.series.as_mut().expect("is open").kept.push_front(oldest);
    std::fs::rename(&folder, &aside).expect("is there");
    std::fs::write(&folder, "in the way").expect("can be written");
    let begun = Instant::now();
    let mut write_at = |at_s| {
        recording
            .write(1, begun + Duration::from_secs(at_s))
            .expect("there is room");
        recording.files()
    };
    write_at(0);
    write_at(1);
    assert_eq!(
        write_at(2),
        ["aside", "folder", "run.1.mcap", "run.2.mcap"],
        "the others are removed all the same"
    );
    assert!(aside.join("old.mcap").exists());
    std::fs::remove_file(&folder).expect("is there");
    std::fs::rename(&aside, &folder).expect("is there");
    assert_eq!(write_at(3), ["folder", "run.2.mcap", "run.3.mcap"]);
    assert!(!path.exists(), "removed as soon as that was possible");
    recording.finish();
}

#[test]
fn a_file_that_cannot_be_begun_leaves_the_one_before_complete() {
    let mut recording = Recording::begin(FileOptions {
        max_age: Some(Duration::from_secs(1)),
        ..FileOptions::default()
    });
    recording.series.as_mut().expect("is open").overwrite = true;
    let begun = Instant::now();
    recording.write(7, begun).expect("there is room");
    std::fs::create_dir(recording.path(1)).expect("can be made");
    let error = recording
        .write(1, begun + Duration::from_secs(2))
        .expect_err("a folder is no file");
    assert!(
        error
            .to_string()
            .contains("run.1.mcap: cannot be created: Is a directory"),
        "{error}"
    );
    assert_eq!(recording.progress.problem(), RecordingProblem::WriteError);
    assert_eq!(recording.states_in(0).len(), 7);
}

#[test]
fn a_removed_file_stops_the_recording() {
    let mut recording = Recording::begin(FileOptions::default());
    recording.write(1, Instant::now()).expect("there is room");
    std::fs::remove_file(recording.path(0)).expect("is there");
    let error = recording
        .write(1, Instant::now())
        .expect_err("nobody can read it any more");
    assert!(
        error.to_string().contains("was removed while it was recorded"),
        "{error}"
    );
    assert_eq!(recording.progress.problem(), RecordingProblem::FileRemoved);
}

#[test]
fn a_file_that_another_process_writes_is_not_overwritten() {
    let mut recording = Recording::begin(FileOptions::default());
    recording.write(3, Instant::now()).expect("there is room");
    let error = LogFile::create(&recording.path(0), true, &recording.progress).expect_err("is in use");
    assert_eq!(error.kind(), io::ErrorKind::ResourceBusy);
    recording.finish();
    assert_eq!(recording.states_in(0), [0, 1, 2]);
}

#[test]
fn names_are_numbered_before_the_extension() {
    for (first, third) in [
        ("a/run.mcap", "a/run.3.mcap"),
        ("run", "run.3"),
        ("a.b/x.y.mcap", "a.b/x.y.3.mcap"),
    ] {
        assert_eq!(numbered(Path::new(first), 3), Path::new(third));
        assert_eq!(numbered(Path::new(first), 0), Path::new(first));
    }
}
