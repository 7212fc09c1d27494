//! The parts of a scene, their order, and their random shifts.

use rand::Rng;
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};

use super::schema::Task;

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

impl Task {
    /// The scene's parts in the order in which they are added to the world.
    pub fn parts(&self) -> Vec<Part> {
        let mut parts = self.order.clone();
        let missing: Vec<Part> = self.default_parts().filter(|part| !parts.contains(part)).collect();
        parts.extend(missing);
        parts
    }

    /// The scene's parts in the order of a task that sets none.
    pub(crate) fn default_parts(&self) -> impl Iterator<Item = Part> {
        let marker_subgoals = self.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
        [Part::Target]
            .into_iter()
            .chain(self.marker.is_some().then_some(Part::Marker))
            .chain([Part::Goal])
            .chain((0..self.balls.len()).map(Part::Ball))
            .chain((0..self.boxes.len()).map(Part::Box))
            .chain((0..self.subgoals.len()).map(Part::Subgoal))
            .chain((0..marker_subgoals).map(Part::MarkerSubgoal))
            .chain((0..self.tools.len()).map(Part::Tool))
    }

    /// Removes a deleted tool or subgoal from the order and the random shifts; later indices move down by one.
    pub(super) fn forget(&mut self, gone: Part) {
        for parts in self.shifts.iter_mut().map(|shift| &mut shift.parts).chain([&mut self.order]) {
            parts.retain(|part| *part != gone);
            for part in parts {
                match (part, gone) {
                    (Part::Tool(index), Part::Tool(gone)) | (Part::Subgoal(index), Part::Subgoal(gone))
                        if *index > gone =>
                    {
                        *index -= 1;
                    }
                    _ => {}
                }
            }
        }
    }

    /// Draws the random shifts, in order, normalised.
    pub fn draw_shifts(&self, rng: &mut impl Rng) -> Vec<[f32; 2]> {
        let draw = |shift: &Shift| match &shift.by {
            Offset::Uniform { x, y } => [x, y].map(|[low, high]| rng.gen_range(*low..=*high)),
            Offset::OneOf(choices) => choices.choose(rng).copied().unwrap_or_default(),
        };
        self.shifts.iter().map(draw).collect()
    }

    /// The task with its random shifts applied; shifts without an offset are dropped.
    pub fn shifted(&self, offsets: &[[f32; 2]]) -> Self {
        let mut task = self.clone();
        for (shift, [x, y]) in std::mem::take(&mut task.shifts).into_iter().zip(offsets) {
            for part in shift.parts {
                if let Some(position) = task.position_mut(part) {
                    *position = [position[0] + x, position[1] + y];
                }
            }
        }
        task
    }

    /// The position of a part, mutable; None if there is no such part.
    pub fn position_mut(&mut self, part: Part) -> Option<&mut [f32; 2]> {
        match part {
            Part::Target => Some(&mut self.ball.position),
            Part::Marker => self.marker.as_mut().map(|marker| &mut marker.ball.position),
            Part::Goal => Some(&mut self.goal.position),
            Part::Ball(index) => self.balls.get_mut(index).map(|ball| &mut ball.position),
            Part::Box(index) => self.boxes.get_mut(index).map(|moving| &mut moving.position),
            Part::Tool(index) => self.tools.get_mut(index).map(|tool| &mut tool.position),
            Part::Subgoal(index) => self.subgoals.get_mut(index).map(|region| &mut region.position),
            Part::MarkerSubgoal(index) => self
                .marker
                .as_mut()
                .and_then(|marker| marker.subgoals.get_mut(index))
                .map(|region| &mut region.position),
        }
    }
}
