//! `wormd explain` for the campaign of a servo on a bench.

use super::folder::Folder;
use super::{ExplainArgs, print_answer, title};
use crate::command::progress::Progress;
use crate::command::{Failure, log_line};
use std::path::Path;
use worm_analysis::bench::BenchCampaign;
use worm_analysis::experiment::Progress as Step;
use worm_analysis::explain::Options;
use worm_analysis::explain::servo::{Bench, explain_servo, model_update};
use worm_analysis::report;

/// Searches, writes and prints the answer.
pub(super) fn run(args: &ExplainArgs, campaign: &Path) -> Result<(), Failure> {
    args.source.refuse_conditions(campaign)?;
    let mut progress = Progress::begin();
    let campaign = BenchCampaign::load(campaign).map_err(Failure::unusable)?;
    let recordings = campaign.open_all().map_err(Failure::unusable)?;
    let folder = args.out.as_deref().map(Folder::prepare).transpose()?;
    let options = args.options(Options::of_servo());
    let bench = Bench::new(&campaign, &recordings);
    let mut report_step = |step: Step| progress.tell(step.stage, step.fraction);
    let mut answer = explain_servo(&bench, &options, &mut report_step).map_err(Failure::unusable)?;
    let model = model_update::model(&campaign.model, campaign.model_text.as_deref(), &answer);
    answer.figures.model_diff.clone_from(&model.diff);
    let written = folder.as_ref().map(|folder| {
        progress.tell("report", 1.0);
        folder.write_json(&answer)?;
        folder.write_model(&model)?;
        folder.write_servo_page(&answer, &title(&campaign.file))
    });
    drop(progress);
    let text = || report::servo::text(&answer);
    print_answer(args.json, &answer, &answer.warnings, text)?;
    written.transpose()?;
    if let Some(folder) = &folder {
        log_line(folder);
    }
    Ok(())
}
