//! The full model, and three models without one of the structural assumptions of section 4.1.

use serde::{Deserialize, Serialize};

use super::config::{Coordinates, EdgeActivation, EdgeFunctions, ModelConfig};
use mge_base::by_name;

/// A model with at most one structural assumption switched off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Variant {
    /// `full`: all three assumptions.
    Full,
    /// `shared-edges`: one edge function for all pairs of object types.
    SharedEdges,
    /// `fully-connected`: all edges always active.
    FullyConnected,
    /// `absolute`: positions on the screen, not relative to the ball.
    Absolute,
}

impl Variant {
    /// The four variants.
    pub const ALL: [Variant; 4] = [Self::Full, Self::SharedEdges, Self::FullyConnected, Self::Absolute];

    /// The name in commands and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::SharedEdges => "shared-edges",
            Self::FullyConnected => "fully-connected",
            Self::Absolute => "absolute",
        }
    }

    /// The name in tables and legends.
    pub fn label(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::SharedEdges => "shared edge function",
            Self::FullyConnected => "fully connected",
            Self::Absolute => "absolute coordinates",
        }
    }

    /// The configuration with this assumption switched off.
    pub fn apply(self, mut config: ModelConfig) -> ModelConfig {
        match self {
            Self::Full => {}
            Self::SharedEdges => config.edge_functions = EdgeFunctions::Shared,
            Self::FullyConnected => config.edges = EdgeActivation::FullyConnected,
            Self::Absolute => config.coordinates = Coordinates::Absolute,
        }
        config
    }
}

by_name!(Variant, "variant");
