//! Why a subcommand failed, and the exit status that follows from it.

use std::process::ExitCode;
use worm_estimator::config::ConfigError;

/// The reason behind a [`Failure`]: an error with its own sources, or a sentence.
type Cause = Box<dyn std::error::Error + Send + Sync>;

/// Why a subcommand did not do its job. The variant decides the exit status.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Arguments, configuration or input cannot be used: exit status 2.
    #[error(transparent)]
    Unusable(Cause),
    /// It failed while running: exit status 1.
    #[error(transparent)]
    Failed(Cause),
}

impl Failure {
    /// Arguments, configuration or input cannot be used, because of `cause`.
    pub fn unusable(cause: impl Into<Cause>) -> Self {
        Self::Unusable(cause.into())
    }

    /// It failed while running, because of `cause`.
    pub fn failed(cause: impl Into<Cause>) -> Self {
        Self::Failed(cause.into())
    }

    /// The exit status.
    pub fn exit_code(&self) -> ExitCode {
        match self {
            Self::Unusable(_) => ExitCode::from(2),
            Self::Failed(_) => ExitCode::FAILURE,
        }
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Self::unusable(error)
    }
}
