//! Findings of a check.

/// Something that is not as it should be, and what was done about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What is wrong.
    pub what: String,
    /// What was done about it if [`corrected`](Self::corrected), otherwise what to do.
    pub remedy: String,
    /// It has been corrected.
    pub corrected: bool,
}

impl Finding {
    /// Something that has been corrected.
    pub fn corrected(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
            corrected: true,
        }
    }

    /// Something that a person has to correct.
    pub fn open(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
            corrected: false,
        }
    }
}

impl core::fmt::Display for Finding {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mark = if self.corrected { "corrected" } else { "to do" };
        write!(f, "{} ({mark}: {})", self.what, self.remedy)
    }
}
