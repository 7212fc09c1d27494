//! The objects of a scene that can be selected and edited.

use mge_physics::to_units;
use mge_task::{BallSpec, Edit, Part, Region, Task};

/// An object of the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Object {
    /// The start of the ball.
    Ball,
    /// A subgoal, counted from 0.
    Subgoal(usize),
    /// A proposed subgoal, counted from 0.
    Proposal(usize),
    /// The final goal.
    Goal,
    /// A static tool, counted from 0.
    Tool(usize),
    /// Another object of CREATE's levels: the marker, its subgoals, other balls, moving boxes.
    Part(Part),
}

impl Object {
    /// The edit that moves it.
    pub fn moved_to(self, position: [f32; 2]) -> Edit {
        match self {
            Self::Ball => Edit::MoveBall { position },
            Self::Goal => Edit::MoveGoal { position },
            Self::Subgoal(index) => Edit::MoveSubgoal { index, position },
            Self::Proposal(index) => Edit::MoveProposal { index, position },
            Self::Tool(index) => Edit::MoveTool { index, position },
            Self::Part(part) => Edit::MovePart { part, position },
        }
    }

    /// The edit that changes its radius, in units. None for objects of fixed size, and for tools, whose size
    /// is one of their properties.
    pub fn resized(self, radius: f32) -> Option<Edit> {
        match self {
            Self::Ball | Self::Part(_) | Self::Tool(_) => None,
            Self::Goal => Some(Edit::ResizeGoal { radius }),
            Self::Subgoal(index) => Some(Edit::ResizeSubgoal { index, radius }),
            Self::Proposal(index) => Some(Edit::ResizeProposal { index, radius }),
        }
    }

    /// The edit that deletes it. None for objects that cannot be deleted.
    pub fn deleted(self) -> Option<Edit> {
        match self {
            Self::Ball | Self::Goal | Self::Part(_) => None,
            Self::Subgoal(index) => Some(Edit::DeleteSubgoal { index }),
            Self::Proposal(index) => Some(Edit::DeleteProposal { index: Some(index) }),
            Self::Tool(index) => Some(Edit::DeleteTool { index }),
        }
    }
}

/// The objects of a task, including its proposed subgoals.
#[derive(Debug, Clone, Copy)]
pub struct Objects<'a> {
    /// The task.
    pub task: &'a Task,
    /// Proposed subgoals.
    pub proposed: &'a [Region],
}

impl Objects<'_> {
    /// All of them, in the order of selection.
    pub fn all(self) -> Vec<Object> {
        let subgoals = (0..self.task.subgoals.len()).map(Object::Subgoal);
        let proposals = (0..self.proposed.len()).map(Object::Proposal);
        let tools = (0..self.task.tools.len()).map(Object::Tool);
        let parts = self.task.parts().into_iter().filter(|part| self.part(*part).is_some()).map(Object::Part);
        subgoals.chain(proposals).chain([Object::Goal, Object::Ball]).chain(parts).chain(tools).collect()
    }

    /// Position, and radius or half side, of a part that has no other variant of [`Object`].
    fn part(self, part: Part) -> Option<([f32; 2], f32)> {
        let ball = |ball: &BallSpec| (ball.position, ball.radius);
        let marker = self.task.marker.as_ref();
        match part {
            Part::Marker => marker.map(|marker| ball(&marker.ball)),
            Part::MarkerSubgoal(index) => marker?.subgoals.get(index).map(|subgoal| (subgoal.position, subgoal.radius)),
            Part::Ball(index) => self.task.balls.get(index).map(ball),
            Part::Box(index) => self.task.boxes.get(index).map(|moving| (moving.position, moving.size / 2.0)),
            Part::Target | Part::Goal | Part::Subgoal(_) | Part::Tool(_) => None,
        }
    }

    /// Display name, counted from 1.
    pub fn name(self, object: Object) -> String {
        match object {
            Object::Ball => "ball".to_owned(),
            Object::Goal => "goal".to_owned(),
            Object::Subgoal(index) => format!("subgoal {}", index + 1),
            Object::Proposal(index) => format!("proposal {}", index + 1),
            Object::Part(part) => part.to_string(),
            Object::Tool(index) => self
                .task
                .tools
                .get(index)
                .map_or_else(String::new, |tool| format!("tool {} ({})", index + 1, tool.kind)),
        }
    }

    /// Normalised position.
    pub fn position(self, object: Object) -> Option<[f32; 2]> {
        match object {
            Object::Ball => Some(self.task.ball.position),
            Object::Goal => Some(self.task.goal.position),
            Object::Subgoal(index) => self.task.subgoals.get(index).map(|subgoal| subgoal.position),
            Object::Proposal(index) => self.proposed.get(index).map(|proposal| proposal.position),
            Object::Tool(index) => self.task.tools.get(index).map(|tool| tool.position),
            Object::Part(part) => self.part(part).map(|(position, _)| position),
        }
    }

    /// Radius or size in units.
    pub fn size(self, object: Object) -> Option<f32> {
        match object {
            Object::Ball => Some(self.task.ball.radius),
            Object::Goal => Some(self.task.goal.radius),
            Object::Subgoal(index) => self.task.subgoals.get(index).map(|subgoal| subgoal.radius),
            Object::Proposal(index) => self.proposed.get(index).map(|proposal| proposal.radius),
            Object::Tool(index) => self.task.tools.get(index).map(|tool| tool.tool().size as f32),
            Object::Part(part) => self.part(part).map(|(_, radius)| radius),
        }
    }

    /// The nearest object to a normalised position, within `reach` units.
    pub fn at(self, position: [f32; 2], reach: f32) -> Option<Object> {
        let point = to_units(position);
        let distance = |object: Object| {
            let centre = to_units(self.position(object)?);
            let from_centre = (centre[0] - point[0]).hypot(centre[1] - point[1]);
            Some(match object {
                Object::Tool(index) => self.task.tools[index].tool().surface(point).0,
                _ => from_centre - self.size(object)?,
            })
        };
        let near = self.all().into_iter().filter_map(|object| Some((distance(object)?, object)));
        near.filter(|(distance, _)| *distance <= reach).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, object)| object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_found_where_they_are() {
        let task = mge_task::load("task1").unwrap();
        let proposed = [Region { position: [-0.9, -0.9], radius: 3.0 }];
        let objects = Objects { task: &task, proposed: &proposed };
        for object in objects.all() {
            assert_eq!(objects.at(objects.position(object).unwrap(), 0.0), Some(object));
        }
        assert_eq!(objects.at([0.9, 0.9], 1.0), None);
    }

    #[test]
    fn the_nearer_of_two_objects_within_reach_is_found() {
        let mut task = mge_task::load("task1").unwrap();
        let beside = |by: f32| [task.goal.position[0] + by, task.goal.position[1]];
        let [left, right] = [beside(-0.5), beside(0.5)];
        task.subgoals = vec![Region { position: left, radius: 1.0 }, Region { position: right, radius: 1.0 }];
        let objects = Objects { task: &task, proposed: &[] };
        assert_eq!(objects.at(right, 100.0), Some(Object::Subgoal(1)));
    }

    #[test]
    fn an_object_is_found_up_to_a_distance_from_its_edge() {
        let task = mge_task::load("task1").unwrap();
        let objects = Objects { task: &task, proposed: &[] };
        let goal = task.goal;
        let beside = |units: f32| [goal.position[0] - (goal.radius + units) / 42.0, goal.position[1]];
        assert_eq!(objects.at(beside(1.5), 2.0), Some(Object::Goal));
        assert_eq!(objects.at(beside(3.0), 2.0), None);
    }
}
