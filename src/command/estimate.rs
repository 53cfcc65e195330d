//! `wormd estimate`: the estimator alone, beside a running controller.

use super::{Failure, WormArgs, end_on_signal, print, report_grants};
use crate::attendance::{RoundCounter, ServiceManager, end_after_controller};
use crate::estimator;
use crate::topics::{Estimator, Hub, Instance, RoleLock};
use clap::Args;

/// Arguments of `wormd estimate`.
#[derive(Debug, Args)]
pub struct EstimateArgs {
    #[command(flatten)]
    worm: WormArgs,
    /// Standard input is a pipe from the process that watches over the worm
    #[arg(long, hide = true)]
    supervised: bool,
}

/// Runs `wormd estimate` until a signal ends it. Prints the line "ready" on standard output once it listens.
///
/// # Errors
/// [`Failure::Unusable`] for a configuration or worm that cannot be used; [`Failure::Failed`] when the topics fail.
pub fn run(args: &EstimateArgs) -> Result<(), Failure> {
    print::log_in_background()?;
    let config = args.worm.load()?;
    let end = end_on_signal()?;
    let instance = Instance::of(&config).map_err(Failure::unusable)?;
    let rounds = RoundCounter::default();
    let _service = if args.supervised {
        end_after_controller(&instance, &end)?;
        None
    } else {
        Some(ServiceManager::inform_of_rounds(&end, &rounds)?)
    };
    let role = RoleLock::<Estimator>::take(&instance).map_err(Failure::unusable)?;
    let hub = Hub::open(&instance).map_err(Failure::failed)?;
    let ready = |grants: &[_]| {
        report_grants(grants);
        print::ready();
    };
    estimator::run(&config, &hub, &role, &end, &rounds, ready, |_| {})
}
