//! What a check found.

/// Something that a check found out of order, and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What is out of order.
    pub what: String,
    /// What was done about it when [`corrected`](Self::corrected), or else what is to be done.
    pub remedy: String,
    /// It has been put in order.
    pub corrected: bool,
}

impl Finding {
    /// Something that has been put in order.
    pub fn corrected(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
            corrected: true,
        }
    }

    /// Something that a person has to put in order.
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
