//! Who answers: the configured servo and tracker, others, or nobody.

use std::time::Instant;

use super::{LinkSettings, QUIET_TIME, StartupError};
use crate::link::operations::REPLY_TIME;
use crate::link::packet::DeviceId;
use crate::link::{Identity, Port, TransactionError, WormBus, servo};

pub(super) fn identify_servo<P: Port>(bus: &mut WormBus<P>, settings: &LinkSettings) -> Result<Identity, StartupError> {
    let found = identify(bus, settings, "servo", settings.servo_id, settings.servo_model);
    let Err(StartupError::Silent { .. }) = found else {
        return found;
    };
    // The tracker answers: it is not the baud rate.
    let mut answers = |id| bus.ping(id, Instant::now() + REPLY_TIME).is_ok();
    if settings.tracker.is_some_and(|tracker| answers(tracker.id)) {
        return found;
    }
    let mut rate_found = None;
    for rate in servo::BAUD_RATES.into_iter().filter(|&rate| rate != settings.baud) {
        // An adapter need not have every rate.
        if bus.port_mut().set_baud_rate(rate).is_err() {
            continue;
        }
        bus.settle(Instant::now() + QUIET_TIME)?;
        if bus.ping(settings.servo_id, Instant::now() + REPLY_TIME).is_ok() {
            rate_found = Some(rate);
            break;
        }
    }
    bus.port_mut().set_baud_rate(settings.baud)?;
    match rate_found {
        Some(rate) => Err(StartupError::OtherBaudRate {
            found: rate,
            configured: settings.baud,
        }),
        None => found,
    }
}

pub(super) fn identify<P: Port>(
    bus: &mut WormBus<P>,
    settings: &LinkSettings,
    device: &'static str,
    id: DeviceId,
    expected: u16,
) -> Result<Identity, StartupError> {
    let mut asked = bus.ask_again(|bus, deadline| bus.ping(id, deadline));
    let mut present = Vec::new();
    if !matches!(asked, Ok(_) | Err(TransactionError::Port(_))) {
        present = who_is_there(bus);
        if present.iter().any(|(there, _)| *there == id) {
            // It was only late, as behind a computer that paused.
            bus.settle(Instant::now() + QUIET_TIME)?;
            asked = bus.ask_again(|bus, deadline| bus.ping(id, deadline));
        }
    }
    match asked {
        Ok(identity) if identity.model == expected => Ok(identity),
        Ok(Identity { model: found, .. }) => Err(StartupError::WrongModel {
            device,
            id,
            found,
            expected,
        }),
        Err(TransactionError::Port(error)) => Err(error.into()),
        Err(_) => Err(StartupError::Silent {
            device,
            id,
            baud: settings.baud,
            present: in_words(&present),
        }),
    }
}

/// IDs and models of all that answer a broadcast ping; nobody where the port fails, of which the next thing to be asked will tell.
fn who_is_there<P: Port>(bus: &mut WormBus<P>) -> Vec<(DeviceId, u16)> {
    let mut present = Vec::new();
    let listened = bus.broadcast_ping(Instant::now() + 4 * REPLY_TIME, |id, who| {
        present.push((id, who.model));
    });
    listened.map_or_else(|_| Vec::new(), |_| present)
}

/// For an error.
fn in_words(present: &[(DeviceId, u16)]) -> String {
    if present.is_empty() {
        return "nobody does".into();
    }
    let each: Vec<String> = present
        .iter()
        .map(|(id, model)| format!("{id} (model {model})"))
        .collect();
    format!("these IDs do: {}", each.join(", "))
}
