//! The tracker at the start: who it is, what it tracks, and whether it has what is asked of it.

use super::identify::identify;
use super::{LinkSettings, StartupError, TRACKER, TrackerSettings};
use crate::link::operations::OperationError;
use crate::link::{Finding, Identity, Port, TransactionError, WormBus, tracker};

/// Finds the configured tracker: who it is, and how many cells it tracks. Nothing where it is silent and may be.
pub(super) fn find_tracker<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    wanted: &TrackerSettings,
    findings: &mut Vec<Finding>,
) -> Result<Option<(Identity, u8)>, StartupError> {
    let identity = match identify(bus, settings, TRACKER, wanted.id, wanted.model) {
        Err(StartupError::Silent { id, .. }) if wanted.may_be_silent => {
            let (device, without) = match wanted.cells {
                0 => ("inertial sensor", "a measured slope"),
                _ => ("tracker", "positions"),
            };
            findings.push(Finding::open(
                format!("the {device} (ID {id}) does not answer: the worm goes without {without}"),
                "look at its power and its cable; it is used as soon as it answers",
            ));
            return Ok(None);
        }
        found => found?,
    };
    let cells = bus.register(wanted.id, tracker::register::CELL_COUNT)? as u8;
    if usize::from(cells) < wanted.cells {
        return Err(StartupError::TooFewCells {
            found: cells,
            configured: wanted.cells,
        });
    }
    let optional = [
        (
            wanted.emergency_stop_mask.is_some(),
            tracker::register::SWITCHES,
            StartupError::NoEmergencyStop,
        ),
        (wanted.pitch, tracker::register::PITCH, StartupError::NoInertialSensor),
    ];
    for (is_wanted, register, missing) in optional {
        if !is_wanted {
            continue;
        }
        match bus.register(wanted.id, register) {
            Err(OperationError::Transaction {
                error: TransactionError::Refused { .. },
                ..
            }) => return Err(missing),
            read => read?,
        };
    }
    Ok(Some((identity, cells)))
}
