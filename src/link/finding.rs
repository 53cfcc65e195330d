//! What a check found.

/// Something that a check found out of order, and what came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What is out of order.
    pub what: String,
    /// What was done about it when [`mended`](field@Self::mended), or else what is to be done.
    pub remedy: String,
    /// It has been put in order.
    pub mended: bool,
}

impl Finding {
    pub(super) fn mended(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
            mended: true,
        }
    }

    pub(super) fn open(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            remedy: remedy.into(),
            mended: false,
        }
    }
}

impl core::fmt::Display for Finding {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let mark = if self.mended { "mended" } else { "to do" };
        write!(f, "{} ({mark}: {})", self.what, self.remedy)
    }
}
