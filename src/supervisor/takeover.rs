//! Taking over a worm whose earlier `wormd up` was killed.
//!
//! Its controller goes on holding the worm. Where that is safe, it is asked to end in order, so that nobody has to clean up by hand.

use crate::attendance::{Request, StopError, ask};
use crate::failure::Failure;
use crate::topics::{Controller, Estimator, Instance, Role, RoleLock};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use worm_estimator::config::{Config, IdleDisarm};
use worm_estimator::message::Mode;

/// How long orphans may take to end, beyond the ramp. The estimator looks for its controller a few times a second.
const TIMEOUT: Duration = Duration::from_secs(5);

/// How often it is looked whether they have.
const POLL: Duration = Duration::from_millis(20);

/// Ends what a killed parent has left running of the worm. Processes that somebody else attends to are left alone: starting beside
/// them fails, with their names.
///
/// # Errors
/// [`Failure::Unusable`] for a worm that is held on a slope, where it would slip without torque.
pub(crate) fn end_orphans(config: &Config, instance: &Instance, end: &AtomicBool) -> Result<(), Failure> {
    let is_attended = match ask(config, &Request::Status.into()) {
        Ok(answer) if answer.is_orphaned() => {
            let has_torque = !matches!(Mode::try_from(answer.mode), Ok(Mode::Disarmed | Mode::Fault));
            if has_torque && answer.slope_deg.abs() > IdleDisarm::LEVEL_DEG {
                return Err(Failure::unusable(format!(
                    "{} is held on a slope of {:.0} degrees by a controller (process {}) whose parent was killed; without torque it \
                     may slip: secure it, then `wormd command stop`, and start again",
                    config.worm.name, answer.slope_deg, answer.pid
                )));
            }
            tracing::warn!(
                "the last parent of {} was killed: its controller (process {}) ends before this one starts",
                config.worm.name,
                answer.pid
            );
            if let Err(error) = ask(config, &Request::End.into()) {
                // It may have ended by itself.
                tracing::debug!("{error}");
            }
            false
        }
        Ok(_) => true,
        Err(StopError::NoSocket { .. }) => false,
        Err(error) => {
            tracing::debug!("{error}");
            false
        }
    };
    if !is_attended {
        let timeout = TIMEOUT + Duration::from_secs_f64(config.gait.ramp_s);
        wait_until_free::<Controller>(instance, timeout, end);
        wait_until_free::<Estimator>(instance, timeout, end);
    }
    Ok(())
}

/// Waits until nobody has the role. Who still has it after the timeout is named by the process that then wants it.
fn wait_until_free<R: Role>(instance: &Instance, timeout: Duration, end: &AtomicBool) {
    let begun = Instant::now();
    while RoleLock::<R>::holder(instance).is_some() && begun.elapsed() < timeout && !end.load(Ordering::Relaxed) {
        std::thread::sleep(POLL);
    }
}
