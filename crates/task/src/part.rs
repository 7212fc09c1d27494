//! A part of a scene and its name, and the random shift of several.

use serde::{Deserialize, Serialize};

/// A part of a scene; tools, balls, boxes and subgoals by their index in the task's lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The target ball.
    Target,
    /// The marker ball.
    Marker,
    /// The goal.
    Goal,
    /// One of the other balls.
    Ball(usize),
    /// One of the boxes.
    Box(usize),
    /// One of the tools.
    Tool(usize),
    /// One of the target's subgoals.
    Subgoal(usize),
    /// One of the marker's subgoals.
    MarkerSubgoal(usize),
}

/// Makes a part from its index in a list.
type Indexed = fn(usize) -> Part;

/// Indexed parts by their names in commands, where indices count from 1.
const NAMES: [(&str, Indexed); 5] = [
    ("ball", Part::Ball),
    ("box", Part::Box),
    ("tool", Part::Tool),
    ("subgoal", Part::Subgoal),
    ("marker-subgoal", Part::MarkerSubgoal),
];

impl std::fmt::Display for Part {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let index = match *self {
            Self::Target => return f.write_str("target"),
            Self::Marker => return f.write_str("marker"),
            Self::Goal => return f.write_str("goal"),
            Self::Ball(index)
            | Self::Box(index)
            | Self::Tool(index)
            | Self::Subgoal(index)
            | Self::MarkerSubgoal(index) => index,
        };
        let name = NAMES.iter().find(|(_, part)| part(index) == *self).map_or("", |(name, _)| name);
        write!(f, "{name}-{}", index.saturating_add(1))
    }
}

impl std::str::FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let single = [Self::Target, Self::Marker, Self::Goal].into_iter().find(|part| part.to_string() == text);
        let numbered = || {
            let (name, number) = text.rsplit_once('-')?;
            let (_, part) = NAMES.iter().find(|(known, _)| *known == name)?;
            Some(part(number.parse::<usize>().ok()?.checked_sub(1)?))
        };
        single.or_else(numbered).ok_or_else(|| {
            format!(
                "`{text}` is not a part: use target, marker, goal, ball-N, box-N, tool-N, subgoal-N or marker-subgoal-N"
            )
        })
    }
}

/// A random shift shared by several parts, normalised.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shift {
    /// The parts that are shifted.
    pub parts: Vec<Part>,
    /// The distance of the shift.
    pub by: Offset,
}

/// How a shift is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Offset {
    /// Uniform between two numbers, for x and for y.
    Uniform { x: [f32; 2], y: [f32; 2] },
    /// One of these.
    OneOf(Vec<[f32; 2]>),
}
