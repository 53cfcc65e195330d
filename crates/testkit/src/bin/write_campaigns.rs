//! Writes the campaigns of a split as folders, each with its recordings and its truth, as `score_campaigns` reads them.
//!
//! ```text
//! cargo run --release -p testkit --bin write_campaigns -- development FOLDER [WHAT ...]
//! ```
//! With WHAT (clean, discrepant, outside, pair, triple, twin, onset or the name of an effect) only such cases are written. Campaigns
//! that are there already are left as they are. Those of the split `laws` have a further run, on a slope between the steepest two. `WORMD_CASES` scales how many there are of each kind.

use std::path::Path;
use std::process::ExitCode;
use testkit::hidden_effects::campaign::HiddenCampaign;
use testkit::hidden_effects::folders::{is_written, write, write_unseen};
use testkit::hidden_effects::split::{Case, Split, scale_from_environment, split};

const USAGE: &str =
    "usage: write_campaigns development|test|search|sample|laws|current|current-library FOLDER [WHAT ...]";

fn main() -> ExitCode {
    match run(&std::env::args().skip(1).collect::<Vec<String>>()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &[String]) -> Result<(), String> {
    let [name, folder, kinds @ ..] = arguments else {
        return Err(USAGE.to_owned());
    };
    let which = Split::named(name).ok_or(USAGE)?;
    if let Some(unknown) = kinds.iter().find(|kind| !Case::words().any(|word| word == *kind)) {
        return Err(format!("{unknown} is nothing that can be hidden\n{USAGE}"));
    }
    let is_wanted = |case: &Case| kinds.is_empty() || kinds.iter().any(|kind| kind == case.what());
    for case in split(which, scale_from_environment()).into_iter().filter(is_wanted) {
        let name = format!("{}-{}", case.what(), case.seed);
        let path = Path::new(folder).join(&name);
        if is_written(&path) {
            continue;
        }
        let campaign = case.draw();
        let truth = &campaign.truth;
        write(&campaign, &path)?;
        if which == Split::Laws {
            write_between(&campaign, &path)?;
        }
        println!("{name}: {:.1} sigma, {:.1} %", truth.sigma, 100.0 * truth.impact());
    }
    Ok(())
}

/// Writes a run of the same worm on a slope between the steepest two; it crawls on both.
fn write_between(campaign: &HiddenCampaign, path: &Path) -> Result<(), String> {
    let [.., gentler_deg, steepest_deg] = campaign.slopes_deg[..] else {
        return Err("a campaign of one slope has none between".to_owned());
    };
    let condition = campaign.usual(0.5 * (gentler_deg + steepest_deg));
    let run = campaign.follow_up(condition, 1);
    let run = run.map_err(|_| {
        format!(
            "{}: the worm does not crawl between the steepest two slopes",
            path.display()
        )
    })?;
    write_unseen(&run, path)
}
