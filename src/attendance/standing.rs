//! Where the controller stands, for the threads beside its loop.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use worm_estimator::message::{Fault, Mode};

/// Bits of a code of [`Mode`] or [`Fault`], of which there are few.
const CODE_BITS: u32 = 8;
const CODE: u64 = (1 << CODE_BITS) - 1;

/// Tick, mode and fault in one word, so that they belong together: the loop writes it, anybody reads it.
#[derive(Debug, Clone, Default)]
pub struct Standing(Arc<AtomicU64>);

impl Standing {
    /// Notes how the controller stands after so many ticks.
    pub(super) fn note(&self, ticks: u64, mode: Mode, fault: Fault) {
        let word = ticks << (2 * CODE_BITS) | u64::from(fault.code()) << CODE_BITS | u64::from(mode.code());
        self.0.store(word, Ordering::Relaxed);
    }

    /// Ticks so far.
    pub(crate) fn ticks(&self) -> u64 {
        self.0.load(Ordering::Relaxed) >> (2 * CODE_BITS)
    }

    /// The codes of mode and fault.
    pub(crate) fn codes(&self) -> (u32, u32) {
        let word = self.0.load(Ordering::Relaxed);
        ((word & CODE) as u32, (word >> CODE_BITS & CODE) as u32)
    }

    /// Mode, or fault, in words.
    pub(crate) fn words(&self) -> String {
        let (mode, fault) = self.codes();
        match (Mode::try_from(mode), Fault::try_from(fault)) {
            (Ok(Mode::Fault), Ok(fault)) => format!("fault: {fault}"),
            (Ok(mode), _) => mode.to_string(),
            (Err(unknown), _) => unknown.to_string(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_and_fault_is_read_as_it_was_noted() {
        let standing = Standing::default();
        assert_eq!((standing.ticks(), standing.words().as_str()), (0, "disarmed"));
        for &mode in Mode::ALL {
            for &fault in Fault::ALL {
                // A worm that runs for three years at the highest rate.
                standing.note(1_000_000_000_000, mode, fault);
                assert_eq!(
                    (standing.ticks(), standing.codes()),
                    (1_000_000_000_000, (mode.code(), fault.code()))
                );
            }
        }
        standing.note(1, Mode::Fault, Fault::LinkLost);
        assert_eq!(standing.words(), "fault: link-lost");
    }
}
