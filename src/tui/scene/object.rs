//! The objects of a scene that a person can select and edit.

use crate::physics::{Tool, to_normalised, to_units};
use crate::task::Task;

/// Something in the scene with a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Object {
    /// The ball's start.
    Ball,
    /// A subgoal, from 0.
    Subgoal(usize),
    /// The final goal.
    Goal,
    /// A static tool, from 0.
    Tool(usize),
}

impl Object {
    /// All objects of a task, in the order of selection.
    pub fn all(task: &Task) -> Vec<Self> {
        let subgoals = (0..task.subgoals.len()).map(Self::Subgoal);
        let tools = (0..task.tools.len()).map(Self::Tool);
        subgoals.chain([Self::Goal, Self::Ball]).chain(tools).collect()
    }

    /// Whether the task has the object.
    pub fn is_in(self, task: &Task) -> bool {
        match self {
            Self::Ball | Self::Goal => true,
            Self::Subgoal(index) => index < task.subgoals.len(),
            Self::Tool(index) => index < task.tools.len(),
        }
    }

    /// Name for people, counted from 1.
    pub fn name(self, task: &Task) -> String {
        match self {
            Self::Ball => "ball".to_owned(),
            Self::Goal => "goal".to_owned(),
            Self::Subgoal(index) => format!("subgoal {}", index + 1),
            Self::Tool(index) => {
                task.tools.get(index).map_or_else(String::new, |tool| format!("tool {} ({})", index + 1, tool.kind))
            }
        }
    }

    /// The words of the command language that begin an edit of it.
    pub fn verb(self, what: &str) -> String {
        match self {
            Self::Ball => format!("ball {what}"),
            Self::Goal => format!("goal {what}"),
            Self::Subgoal(index) => format!("subgoal {what} {}", index + 1),
            Self::Tool(index) => format!("tool {what} {}", index + 1),
        }
    }

    /// Normalised place.
    pub fn position(self, task: &Task) -> Option<[f32; 2]> {
        match self {
            Self::Ball => Some(task.ball.position),
            Self::Goal => Some(task.goal.position),
            Self::Subgoal(index) => task.subgoals.get(index).map(|subgoal| subgoal.position),
            Self::Tool(index) => task.tools.get(index).map(|tool| tool.position),
        }
    }

    /// Radius or size in units.
    pub fn size(self, task: &Task) -> Option<f32> {
        match self {
            Self::Ball => Some(task.ball.radius),
            Self::Goal => Some(task.goal.radius),
            Self::Subgoal(index) => task.subgoals.get(index).map(|subgoal| subgoal.radius),
            Self::Tool(index) => task.tools.get(index).map(|tool| tool.tool().size),
        }
    }

    /// The object at a normalised position, the nearest of those within reach, which is
    /// given in units.
    pub fn at(task: &Task, position: [f32; 2], reach: f32) -> Option<Self> {
        let point = to_units(position);
        let distance = |object: &Self| {
            let centre = to_units(object.position(task)?);
            let from_centre = (centre[0] - point[0]).hypot(centre[1] - point[1]);
            Some(match *object {
                Self::Tool(index) => task.tools[index].tool().surface(point).0,
                _ => from_centre - object.size(task)?,
            })
        };
        let near = Self::all(task).into_iter().filter_map(|object| Some((distance(&object)?, object)));
        near.filter(|(distance, _)| *distance <= reach).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, object)| object)
    }
}

/// The corners of a tool, normalised, with the thickness of segments drawn out.
pub fn corners(tool: &Tool) -> Vec<[f32; 2]> {
    let vertices = tool.vertices();
    let corners = match vertices[..] {
        [from, to] => {
            let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
            let length = dx.hypot(dy).max(f32::EPSILON);
            let (along, across) = (
                [dx / length * tool.radius, dy / length * tool.radius],
                [-dy / length * tool.radius, dx / length * tool.radius],
            );
            let corner = |point: [f32; 2], end: f32, side: f32| {
                [point[0] + end * along[0] + side * across[0], point[1] + end * along[1] + side * across[1]]
            };
            vec![corner(from, -1.0, -1.0), corner(to, 1.0, -1.0), corner(to, 1.0, 1.0), corner(from, -1.0, 1.0)]
        }
        _ => vertices,
    };
    corners.into_iter().map(to_normalised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ToolKind;

    #[test]
    fn objects_are_found_where_they_are() {
        let task = crate::task::load("task1").unwrap();
        for object in Object::all(&task) {
            assert_eq!(Object::at(&task, object.position(&task).unwrap(), 0.0), Some(object));
        }
        assert_eq!(Object::at(&task, [0.9, 0.9], 1.0), None);
    }

    #[test]
    fn a_wall_has_its_thickness_and_rounded_ends_as_a_rectangle() {
        let tool = Tool::new(ToolKind::Wall, [42.0, 42.0]).with_size(20.0);
        let corners = corners(&tool);
        let width = corners.iter().map(|c| c[0]).fold(f32::MIN, f32::max);
        let height = corners.iter().map(|c| c[1]).fold(f32::MIN, f32::max);
        assert!((width - 1.0 / 42.0).abs() < 1e-6 && (height - 11.0 / 42.0).abs() < 1e-6);
    }
}
