//! Follows a running worm: one line for each gait cycle, and one for each alarm as it is raised or cleared.
//!
//! ```sh
//! cargo run --release -- up --plain &            # or any other running worm
//! cargo run --release --example subscribe        # another worm: -- NAME, or -- NAME CONFIG.toml
//! ```
//!
//! Sleeps until the estimator announces a new alarm, or for a tenth of a second. The worm never waits for a subscriber: one that
//! reads too seldom loses the oldest messages, and [`wormd::topics::Subscriber::lost`] counts them.

use std::error::Error;
use std::path::Path;
use std::time::Duration;
use worm_estimator::config::Config;
use worm_estimator::message::{Alarm, AlarmKind, Cycle, State};
use wormd::topics::{Hub, Instance};

/// How long the worm may publish nothing before this program ends.
const SILENCE: Duration = Duration::from_secs(3);
const WAIT: Duration = Duration::from_millis(100);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next();
    let mut config = match arguments.next() {
        Some(file) => Config::load(Path::new(&file))?,
        None => Config::default(),
    };
    if let Some(name) = name {
        config.worm.name = name;
    }

    let hub = Hub::open(&Instance::of(&config)?)?;
    let alarm_listener = hub.listener::<Alarm>()?;
    let mut alarms = hub.subscriber::<Alarm>()?;
    let mut cycles = hub.subscriber::<Cycle>()?;
    let mut states = hub.subscriber::<State>()?;

    let mut silence = Duration::ZERO;
    while silence < SILENCE {
        let announced = alarm_listener.wait(WAIT)?;
        while let Some(alarm) = alarms.next()? {
            let kind = AlarmKind::try_from(alarm.kind)?;
            let change = if alarm.raised == 1 { "raised" } else { "cleared" };
            println!(
                "alarm {kind} {change}: {:.3} against a threshold of {:.3}",
                alarm.value, alarm.threshold
            );
        }
        while let Some(cycle) = cycles.next()? {
            println!(
                "cycle {}: {:.2} mm forward, {:.1} mJ of work, {:.0} mJ from the battery",
                cycle.index,
                1e3 * cycle.advance_m,
                1e3 * cycle.energy_actuator_net_j,
                1e3 * cycle.energy_electrical_j,
            );
        }
        let is_alive = states.latest()?.is_some() || announced > 0;
        silence = if is_alive { Duration::ZERO } else { silence + WAIT };
    }
    println!(
        "the worm {} has published nothing for {} s",
        config.worm.name,
        SILENCE.as_secs()
    );
    Ok(())
}
