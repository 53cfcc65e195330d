//! Campaigns that lie in folders, each with `campaign.toml` and `truth.json`: whatever test bed wrote them, one program explains
//! them and one score judges the answers.

use super::answer::Answer;
use super::assessment::{Assessment, compare};
use super::campaign::HiddenCampaign;
use super::follow_up::ExtraRun;
use super::truth::Truth;
use serde_json::{Value, json};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use worm_analysis::recording::write_csv;

/// The truth beside a campaign.
const TRUTH: &str = "truth.json";

/// A campaign in a folder.
#[derive(Debug, Clone)]
pub struct CampaignFolder {
    pub path: PathBuf,
    pub truth: Truth,
}

/// Every campaign under a folder, by name.
///
/// # Errors
/// When the folder cannot be read or a truth is not one; the text names the file.
pub fn campaigns(root: &Path) -> Result<Vec<CampaignFolder>, String> {
    let problem = |path: &Path, error: io::Error| format!("{}: {error}", path.display());
    let mut found = Vec::new();
    for entry in fs::read_dir(root).map_err(|error| problem(root, error))? {
        let path = entry.map_err(|error| problem(root, error))?.path();
        let file = path.join(TRUTH);
        if !file.is_file() {
            continue;
        }
        let text = fs::read_to_string(&file).map_err(|error| problem(&file, error))?;
        let truth = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        found.push(CampaignFolder { path, truth });
    }
    if found.is_empty() {
        return Err(format!("{}: no folder in it has a {TRUTH}", root.display()));
    }
    found.sort_by(|one, other| one.truth.case.cmp(&other.truth.case));
    Ok(found)
}

impl CampaignFolder {
    /// Has a `wormd` explain the campaign, and keeps its JSON beside it as `file` where a name is given; of a failure
    /// `{"error": "..."}`.
    pub fn assess(&self, wormd: &Path, file: Option<&str>) -> Assessment {
        self.compare(self.explain(wormd, file))
    }

    /// Judges the JSON that was kept beside the campaign.
    pub fn assess_file(&self, file: &str) -> Assessment {
        let path = self.path.join(file);
        let text = fs::read(&path).map_err(|error| format!("{}: {error}", path.display()));
        self.compare(text.and_then(|text| answer(&text)))
    }

    fn compare(&self, answer: Result<Answer, String>) -> Assessment {
        let answer = answer.unwrap_or_else(|problem| {
            eprintln!("{}: {problem}", self.truth.case);
            Answer::failed()
        });
        compare(&self.truth, &answer)
    }

    fn explain(&self, wormd: &Path, file: Option<&str>) -> Result<Answer, String> {
        let output = Command::new(wormd)
            .arg("explain")
            .arg(self.path.join("campaign.toml"))
            .arg("--json")
            .output()
            .map_err(|error| format!("{}: {error}: name a built wormd", wormd.display()))?;
        let json = if output.status.success() {
            output.stdout
        } else {
            // Kept as well: a refusal is scored, too.
            let error = String::from_utf8_lossy(&output.stderr);
            json!({ "error": error.trim() }).to_string().into_bytes()
        };
        if let Some(file) = file {
            fs::write(self.path.join(file), &json).map_err(|error| format!("{file}: {error}"))?;
        }
        answer(&json)
    }
}

fn answer(json: &[u8]) -> Result<Answer, String> {
    let report: Value = serde_json::from_slice(json).map_err(|error| error.to_string())?;
    match report["error"].as_str() {
        Some(error) => Err(error.to_owned()),
        None => Answer::from_json(&report),
    }
}

/// Whether a campaign lies in a folder: its truth is what is written last.
pub fn is_written(path: &Path) -> bool {
    path.join(TRUTH).is_file()
}

/// Writes a campaign into a folder, which is created: `campaign.toml`, `worm.toml`, a recording for each run, and the truth.
///
/// # Errors
/// When a file cannot be written; the text names it.
pub fn write(campaign: &HiddenCampaign, path: &Path) -> Result<(), String> {
    let written = |name: &str, content: &[u8]| {
        let file = path.join(name);
        fs::write(&file, content).map_err(|error| format!("{}: {error}", file.display()))
    };
    fs::create_dir_all(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let worm = &campaign.config.worm;
    written(
        "worm.toml",
        format!(
            "# The worm as it is believed to be.\n[worm]\ncells = {}\nmass_kg = {}\nstep_order = {:?}\n\n[gait]\ncycle_s = {}\n\n\
             # Fast enough for a cycle of 0.8 s.\n[servo]\nvelocity_limit_rev_per_min = 100.0\n",
            worm.cells, worm.mass_kg, worm.step_order, campaign.cycle_s
        )
        .as_bytes(),
    )?;
    let mut runs = "worm = \"worm.toml\"\n".to_owned();
    for (run, (recording, slope_deg)) in campaign.recordings.iter().zip(&campaign.slopes_deg).enumerate() {
        let name = format!("run{}.csv", run + 1);
        let mut text = Vec::new();
        write_csv(recording, &mut text).map_err(|error| format!("{name}: {error}"))?;
        written(&name, &text)?;
        runs.push_str(&format!(
            "\n[[run]]\nrecording = \"{name}\"\nslope_deg = {slope_deg:?}\ncycle_s = {:?}\n",
            campaign.cycle_s
        ));
    }
    written("campaign.toml", runs.as_bytes())?;
    let truth = serde_json::to_vec_pretty(&campaign.truth).map_err(|error| error.to_string())?;
    written(TRUTH, &truth)
}

/// Writes a further run of a campaign's worm beside the campaign, as a campaign of its own: `unseen.toml`.
///
/// # Errors
/// When a file cannot be written; the text names it.
pub fn write_unseen(run: &ExtraRun, path: &Path) -> Result<(), String> {
    let mut text = Vec::new();
    write_csv(&run.recording, &mut text).map_err(|error| format!("unseen.csv: {error}"))?;
    let condition = run.condition;
    let campaign = format!(
        "worm = \"worm.toml\"\n\n[[run]]\nrecording = \"unseen.csv\"\nslope_deg = {:?}\ncycle_s = {:?}\n",
        condition.slope_deg, condition.cycle_s
    );
    for (name, content) in [("unseen.csv", &text[..]), ("unseen.toml", campaign.as_bytes())] {
        let file = path.join(name);
        fs::write(&file, content).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    Ok(())
}
