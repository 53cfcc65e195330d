//! A load beside the loop: what a busy on-board computer does, and no more than that.

use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Memory that is walked through, in 8-byte words: 64 MiB, more than most caches.
const WORDS: usize = 8 << 20;

/// Bytes written at a time, and how often before the file begins anew: 16 MiB.
const WRITE_BYTES: usize = 1 << 20;
const WRITES: usize = 16;

/// Rest after each file, so that a disk that is shared is not worn out.
const REST: Duration = Duration::from_millis(50);

/// Running load: a thread for each CPU that computes, one that walks through memory, one that writes a file and has it put on
/// the disk. All of ordinary priority. It ends when dropped.
pub struct Stress {
    end: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl Stress {
    /// Starts the load; the file is a nameless one in `dir`.
    ///
    /// # Errors
    /// When there is no thread, or no file to be had.
    pub fn start(dir: &Path) -> std::io::Result<Self> {
        let cpus = std::thread::available_parallelism().map_or(1, usize::from);
        let file = nameless_file(dir)?;
        let mut stress = Self {
            end: Arc::default(),
            threads: Vec::new(),
        };
        for _ in 0..cpus {
            stress.spawn("load: CPU", compute)?;
        }
        stress.spawn("load: memory", walk)?;
        stress.spawn("load: disk", |end| write(file, end))?;
        Ok(stress)
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce(&AtomicBool) + Send + 'static) -> std::io::Result<()> {
        let end = Arc::clone(&self.end);
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || work(&end))?;
        self.threads.push(thread);
        Ok(())
    }
}

impl Drop for Stress {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A load that panicked has said so itself.
            let _ = thread.join();
        }
    }
}

/// A file without a name, which is gone with its descriptor.
fn nameless_file(dir: &Path) -> std::io::Result<File> {
    let path = dir.join(format!("wormd-load-{}", std::process::id()));
    let file = File::create_new(&path)?;
    std::fs::remove_file(&path)?;
    Ok(file)
}

fn compute(end: &AtomicBool) {
    let mut number = 1.0_f64;
    while !end.load(Ordering::Relaxed) {
        for _ in 0..10_000 {
            number = std::hint::black_box((number + 1.0).sqrt());
        }
    }
}

fn walk(end: &AtomicBool) {
    let mut words = vec![0_u64; WORDS];
    let mut place = 0;
    while !end.load(Ordering::Relaxed) {
        for _ in 0..10_000 {
            words[place] += 1;
            // A large odd stride: no two steps on one cache line, and every word in its turn.
            place = (place + 7_919) % WORDS;
        }
    }
    std::hint::black_box(&words);
}

fn write(mut file: File, end: &AtomicBool) {
    let bytes = vec![0x5a; WRITE_BYTES];
    while !end.load(Ordering::Relaxed) {
        // A full disk ends this part of the load, not the measurement.
        let round = file
            .seek(SeekFrom::Start(0))
            .and_then(|_| (0..WRITES).try_for_each(|_| file.write_all(&bytes)))
            .and_then(|()| file.sync_data());
        if let Err(error) = round {
            tracing::warn!("the load writes no more: {error}");
            return;
        }
        std::thread::sleep(REST);
    }
}
