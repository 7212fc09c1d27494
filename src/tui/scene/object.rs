//! The objects of a scene that can be selected and edited.

use mge_physics::to_units;
use mge_task::{BallSpec, Object, Part, Region, Task};

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
        let subgoals = (0..self.task.subgoals.len()).map(Part::Subgoal);
        let proposals = (0..self.proposed.len()).map(Object::Proposal);
        let other = |part: &Part| matches!(part, Part::Marker | Part::MarkerSubgoal(_) | Part::Ball(_) | Part::Box(_));
        let others = self.task.parts().into_iter().filter(other);
        let tools = (0..self.task.tools.len()).map(Part::Tool);
        let later = [Part::Goal, Part::Target].into_iter().chain(others).chain(tools);
        subgoals.map(Object::Part).chain(proposals).chain(later.map(Object::Part)).collect()
    }

    /// Normalised position, and radius, half side or size of a tool, in units.
    fn place(self, object: Object) -> Option<([f32; 2], f32)> {
        let ball = |ball: &BallSpec| (ball.position, ball.radius);
        let region = |region: &Region| (region.position, region.radius);
        let (task, marker) = (self.task, self.task.marker.as_ref());
        match object {
            Object::Proposal(index) => self.proposed.get(index).map(region),
            Object::Part(Part::Target) => Some(ball(&task.ball)),
            Object::Part(Part::Goal) => Some((task.goal.position, task.goal.radius)),
            Object::Part(Part::Subgoal(index)) => task.subgoals.get(index).map(region),
            Object::Part(Part::Marker) => marker.map(|marker| ball(&marker.ball)),
            Object::Part(Part::MarkerSubgoal(index)) => marker?.subgoals.get(index).map(region),
            Object::Part(Part::Ball(index)) => task.balls.get(index).map(ball),
            Object::Part(Part::Box(index)) => task.boxes.get(index).map(|moving| (moving.position, moving.size / 2.0)),
            Object::Part(Part::Tool(index)) => task.tools.get(index).map(|it| (it.position, it.tool().size as f32)),
        }
    }

    /// Display name, counted from 1.
    pub fn name(self, object: Object) -> String {
        match object {
            Object::Proposal(index) => format!("proposal {}", index + 1),
            Object::Part(Part::Target) => "ball".to_owned(),
            Object::Part(Part::Subgoal(index)) => format!("subgoal {}", index + 1),
            Object::Part(Part::Tool(index)) => self
                .task
                .tools
                .get(index)
                .map_or_else(String::new, |tool| format!("tool {} ({})", index + 1, tool.kind)),
            Object::Part(part) => part.to_string(),
        }
    }

    /// Normalised position.
    pub fn position(self, object: Object) -> Option<[f32; 2]> {
        self.place(object).map(|(position, _)| position)
    }

    /// Radius or size in units.
    pub fn size(self, object: Object) -> Option<f32> {
        self.place(object).map(|(_, size)| size)
    }

    /// The nearest object to a normalised position, within `reach` units.
    pub fn at(self, position: [f32; 2], reach: f32) -> Option<Object> {
        let point = to_units(position);
        let distance = |object: Object| {
            let centre = to_units(self.position(object)?);
            let from_centre = (centre[0] - point[0]).hypot(centre[1] - point[1]);
            Some(match object {
                Object::Part(Part::Tool(index)) => self.task.tools[index].tool().surface(point).0,
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
        assert_eq!(objects.at(right, 100.0), Some(Object::Part(Part::Subgoal(1))));
    }

    #[test]
    fn an_object_is_found_up_to_a_distance_from_its_edge() {
        let task = mge_task::load("task1").unwrap();
        let objects = Objects { task: &task, proposed: &[] };
        let goal = task.goal;
        let beside = |units: f32| [goal.position[0] - (goal.radius + units) / 42.0, goal.position[1]];
        assert_eq!(objects.at(beside(1.5), 2.0), Some(Object::Part(Part::Goal)));
        assert_eq!(objects.at(beside(3.0), 2.0), None);
    }
}
