//! What every report begins with.

use serde::Serialize;

use super::machine::Machine;
use super::scene::SceneSummary;

/// What was measured where.
#[derive(Clone, Debug, Serialize)]
pub struct Head {
    /// Name and version of this format.
    pub schema: &'static str,
    /// The machine.
    pub machine: Machine,
    /// The scene.
    pub scene: SceneSummary,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
}
