//! Types of objects (paper, section 4.1). The ball is the receiver of all edges.

use serde::{Deserialize, Serialize};

use mge_physics::ToolKind;

/// The type of an object: the ball or a tool type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectType {
    /// The moving ball.
    Ball,
    /// A static tool.
    Tool(ToolKind),
}

impl ObjectType {
    /// Length of the one-hot encoding.
    pub const COUNT: usize = 1 + ToolKind::PAPER.len();

    /// Index in the one-hot encoding: the ball, then [`ToolKind::PAPER`].
    pub fn index(self) -> usize {
        match self {
            Self::Ball => 0,
            Self::Tool(kind) => 1 + kind.index(),
        }
    }

    /// The one-hot encoding; all zeros for tool types outside [`ToolKind::PAPER`].
    pub(super) fn one_hot(self) -> [f32; Self::COUNT] {
        std::array::from_fn(|slot| f32::from(u8::from(slot == self.index())))
    }
}

impl std::fmt::Display for ObjectType {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Ball => "ball",
            Self::Tool(kind) => kind.name(),
        })
    }
}
