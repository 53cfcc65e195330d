//! The model's file with the answer in it.

use super::answer::ServoAnswer;
use crate::bench::ServoModel;
use crate::explain::model_update::{ModelText, difference};

/// The model's file after an answer, and how it differs from the nominal one.
pub fn model(nominal: &ServoModel, nominal_text: Option<&str>, answer: &ServoAnswer) -> ModelText {
    let old = nominal_text.map_or_else(|| nominal.to_toml(), str::to_owned);
    difference(&old, answer.figures.model.to_toml())
}
