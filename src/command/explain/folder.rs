//! The folder of an explanation. Files of an earlier one are replaced, each at once; other files are left alone.

use crate::command::Failure;
use serde::Serialize;
use serde_json::json;
use std::fmt::{self, Display};
use std::path::{Path, PathBuf};
use worm_analysis::experiment::RecordedRun;
use worm_analysis::explain::Answer;
use worm_analysis::explain::model_update::{self, ModelText};
use worm_analysis::explain::servo::ServoAnswer;
use worm_analysis::report;

/// A folder that can be written to.
pub(super) struct Folder(PathBuf);

impl Folder {
    /// Makes the folder if necessary and checks that it can be written to, before a long search.
    ///
    /// # Errors
    /// [`Failure::Unusable`].
    pub(super) fn prepare(dir: &Path) -> Result<Self, Failure> {
        report::prepare(dir).map_err(Failure::unusable)?;
        Ok(Self(dir.to_owned()))
    }

    /// `report.json`: what `--json` prints.
    pub(super) fn write_answer(&self, answer: &Answer) -> Result<(), Failure> {
        self.write_json(answer)
    }

    /// `report.json` where there is no answer: why not, the stage that the search had reached, and its recordings.
    pub(super) fn write_failure(
        &self,
        failure: &Failure,
        stage: &str,
        runs: &[RecordedRun<'_>],
    ) -> Result<(), Failure> {
        let run = |run: &RecordedRun<'_>| {
            json!({
                "recording": run.recording.source.display().to_string(),
                "slope_deg": run.slope_deg,
                "payload_kg": run.payload_kg,
                "cycle_s": run.cycle_s,
                "warnings": run.recording.warnings,
                "repairs": run.recording.repairs,
            })
        };
        let runs: Vec<_> = runs.iter().map(run).collect();
        self.write_json(&json!({ "error": failure.to_string(), "stage": stage, "runs": runs }))
    }

    /// `model.toml` and `model.diff`.
    pub(super) fn write_model(&self, model: &ModelText) -> Result<(), Failure> {
        self.write(model_update::FILE, &model.text)?;
        self.write("model.diff", &model.unified)
    }

    /// `report.html` of a servo.
    pub(super) fn write_servo_page(&self, answer: &ServoAnswer, title: &str) -> Result<(), Failure> {
        report::servo::write(answer, title, &self.0)
            .map(drop)
            .map_err(Failure::failed)
    }

    /// `report.html`.
    pub(super) fn write_page(&self, answer: &Answer, title: &str) -> Result<(), Failure> {
        report::explain::write(answer, title, &self.0)
            .map(drop)
            .map_err(Failure::failed)
    }

    pub(super) fn write_json(&self, value: &impl Serialize) -> Result<(), Failure> {
        let text = serde_json::to_string_pretty(value).map_err(Failure::failed)?;
        self.write("report.json", &(text + "\n"))
    }

    fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        report::replace_file(self.0.join(name), text.as_bytes())
            .map(drop)
            .map_err(Failure::failed)
    }
}

impl Display for Folder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let folder = self.0.display();
        write!(
            f,
            "{folder}/report.html: look at it in a browser; the model is {folder}/{}, what is new in it {folder}/model.diff",
            model_update::FILE
        )
    }
}
