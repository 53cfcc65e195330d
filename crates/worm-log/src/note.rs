//! Notes in a log: what a reader should know and no message says, as metadata records.

use std::collections::BTreeMap;

/// Name of the metadata records that are notes.
pub(super) const NOTE: &str = "note";
/// The entry with the text.
const TEXT: &str = "text";

/// Something that whoever reads a log should know, and that no message says. Readers repeat its text among their warnings.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Note {
    /// One sentence for people, without a full stop.
    pub text: String,
    /// The same as single values for programs, by their names.
    pub values: BTreeMap<String, String>,
}

impl Note {
    /// A note that is only a sentence.
    pub fn of(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            values: BTreeMap::new(),
        }
    }

    /// As the entries of a metadata record.
    pub(super) fn entries(&self) -> BTreeMap<String, String> {
        let mut entries = self.values.clone();
        entries.insert(TEXT.to_owned(), self.text.clone());
        entries
    }

    /// As a metadata record: its name and its entries.
    #[must_use]
    pub fn record(&self) -> (&'static str, BTreeMap<String, String>) {
        (NOTE, self.entries())
    }

    /// The note in a metadata record.
    pub(super) fn from_entries(mut values: BTreeMap<String, String>) -> Self {
        let text = values.remove(TEXT).unwrap_or_default();
        Self { text, values }
    }
}
