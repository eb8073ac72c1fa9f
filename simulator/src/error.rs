//! What can be wrong with a scenario.

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{key}: {message}")]
pub struct ScenarioError {
    /// Which key, as a document of the scenario has it.
    pub key: String,
    /// The value and its limits.
    pub message: String,
}

/// All that is wrong with a scenario.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct ScenarioErrors(pub Vec<ScenarioError>);
