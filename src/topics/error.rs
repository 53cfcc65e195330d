//! Ports that could not be created.

use std::fmt::Debug;

/// A port that could not be created.
#[derive(Debug, thiserror::Error)]
pub enum PortError {
    /// Every place is taken.
    #[error("{service}: all {places} places for a {port} are taken: stop a process that has one")]
    Full {
        /// The service.
        service: String,
        /// What was to be created.
        port: &'static str,
        /// How many there can be.
        places: usize,
    },
    /// The role is that of another worm.
    #[error("{service}: the role that was taken is that of {worm}: take the role on the hub's own instance")]
    OtherWorm {
        /// The service.
        service: String,
        /// Whose role it is.
        worm: String,
    },
    /// iceoryx2 refused.
    #[error(
        "{service}: no {port} could be created ({reason}): is there room in /dev/shm, and in the limit of open files?"
    )]
    Refused {
        /// The service.
        service: String,
        /// What was to be created.
        port: &'static str,
        /// iceoryx2's reason.
        reason: String,
    },
}

impl PortError {
    /// Turns iceoryx2's error into ours; `full` is its error for "no place left".
    pub(super) fn from_iceoryx<E: Debug + PartialEq>(
        service: String,
        port: &'static str,
        places: usize,
        full: E,
    ) -> impl FnOnce(E) -> Self {
        move |error| {
            if error == full {
                Self::Full { service, port, places }
            } else {
                let reason = format!("{error:?}");
                Self::Refused { service, port, reason }
            }
        }
    }
}
