//! What waits for one watcher: a bounded queue of lines that are shared with the others.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::Arc;

/// A line that is ready to be sent, shared by all who get it.
pub(crate) type SharedLine = Arc<Vec<u8>>;

/// Frames that may wait for one watcher: two seconds of them.
const MAX_FRAMES: usize = 40;
/// Answers that may wait beside them.
const MAX_ANSWERS: usize = 16;

/// Lines on their way to one watcher.
#[derive(Debug, Default)]
pub(crate) struct Outbox {
    lines: VecDeque<SharedLine>,
    /// How much of the first line is sent.
    sent: usize,
    lost: u64,
}

/// A watcher takes nothing, and asks for ever more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Overflow;

impl Outbox {
    /// Adds a frame, unless too much waits: then it is lost, and so is every further one until all that waits is sent.
    pub(crate) fn add_frame(&mut self, line: &SharedLine) {
        if self.lost > 0 || self.lines.len() >= MAX_FRAMES {
            self.lost += 1;
        } else {
            self.lines.push_back(Arc::clone(line));
        }
    }

    /// Adds a line that must not get lost.
    pub(crate) fn add(&mut self, line: SharedLine) -> Result<(), Overflow> {
        if self.lines.len() >= MAX_FRAMES + MAX_ANSWERS {
            return Err(Overflow);
        }
        self.lines.push_back(line);
        Ok(())
    }

    /// How many frames were lost, once everything else is sent and there can be new ones.
    pub(crate) fn take_lost(&mut self) -> Option<u64> {
        (self.lost > 0 && self.lines.is_empty()).then(|| std::mem::take(&mut self.lost))
    }

    /// Whether frames are being lost.
    pub(crate) fn is_losing(&self) -> bool {
        self.lost > 0
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Writes what the stream takes without waiting; returns whether it took anything.
    pub(crate) fn write(&mut self, stream: &mut impl Write) -> io::Result<bool> {
        let mut progress = false;
        while let Some(line) = self.lines.front() {
            match stream.write(&line[self.sent..]) {
                Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
                Ok(count) => {
                    progress = true;
                    self.sent += count;
                    if self.sent == line.len() {
                        self.lines.pop_front();
                        self.sent = 0;
                    }
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(progress)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reader that takes so many bytes, and then no more.
    struct Reader {
        read: Vec<u8>,
        room: usize,
    }

    impl Write for Reader {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let count = bytes.len().min(self.room).min(7);
            if count == 0 {
                return Err(io::ErrorKind::WouldBlock.into());
            }
            self.room -= count;
            self.read.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_stalled_reader_loses_frames_whole_and_learns_how_many() {
        let mut outbox = Outbox::default();
        let mut reader = Reader {
            read: Vec::new(),
            room: 25,
        };
        let line = |number: u64| Arc::new(format!("frame {number:03}\n").into_bytes());
        for number in 0..100 {
            outbox.add_frame(&line(number));
            outbox.write(&mut reader).expect("takes or not");
            assert_eq!(outbox.take_lost(), None, "not while something waits");
        }
        assert!(outbox.is_losing());
        reader.room = usize::MAX;
        assert!(outbox.write(&mut reader).expect("takes"));
        let text = String::from_utf8(reader.read).expect("text");
        let whole: Vec<_> = (0..42).map(|number| format!("frame {number:03}")).collect();
        assert!(text.lines().eq(whole), "{text}");
        assert_eq!(outbox.take_lost(), Some(58));
        assert_eq!(outbox.take_lost(), None);
        assert!(outbox.is_empty());
    }

    #[test]
    fn who_asks_and_never_reads_is_cut_off() {
        let mut outbox = Outbox::default();
        let answer = Arc::new(b"answer\n".to_vec());
        let taken = (0..1000)
            .take_while(|_| outbox.add(Arc::clone(&answer)).is_ok())
            .count();
        assert_eq!(taken, MAX_FRAMES + MAX_ANSWERS);
    }
}
