//! Why a tool cannot be placed, in words.

use super::action::{Action, Placement};
use super::episode::{Snapshot, ball_names, first_subgoal, goal_object};
use mge_physics::{ObjectId, Tool};
use mge_task::Task;

impl Snapshot {
    /// Why a tool cannot be placed at `action`, such as "box here would overlap the bucket". None if it can.
    pub fn refusal(&self, tool: &Tool, action: Action) -> Option<String> {
        let kind = tool.kind;
        match self.check_tool(tool, action) {
            Placement::Placed | Placement::NoOp => None,
            Placement::Invalid => Some(format!("{kind} needs a finite position")),
            Placement::Overlap => Some(format!("{kind} here would be too close to an earlier one")),
            Placement::Collision => {
                let object = self.obstruction(tool, action);
                let what = object.map_or_else(|| "something".to_owned(), |object| name(self.task(), object));
                Some(format!("{kind} here would overlap {what}"))
            }
        }
    }
}

/// An object of the world of a task, in words.
fn name(task: &Task, object: ObjectId) -> String {
    match object {
        _ if object == goal_object(task) => "the goal".to_owned(),
        ObjectId::Ball(0) => "the ball".to_owned(),
        ObjectId::Ball(index) => {
            format!("the {}", ball_names(task).get(index).map_or("ball", String::as_str).replace('_', " "))
        }
        ObjectId::Sensor(index) => {
            let place = index.saturating_sub(first_subgoal(task));
            match place.checked_sub(task.subgoals.len()) {
                None => format!("subgoal {}", place + 1),
                Some(of_marker) => format!("subgoal {} of the marker", of_marker + 1),
            }
        }
        ObjectId::Tool(index) => match task.tools.get(index) {
            Some(tool) if task.tools.iter().filter(|other| other.kind == tool.kind).count() > 1 => {
                format!("the {} (tool {})", tool.kind, index + 1)
            }
            Some(tool) => format!("the {}", tool.kind),
            None => "the tool placed before".to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::Environment;

    #[test]
    fn the_obstructing_object_is_named() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let mut env = Environment::new(task.clone());
        let tool = task.placeable.tool([0.0; 2]);
        let refusal = |env: &Environment, at: Action| env.snapshot().refusal(&tool, at);
        for (index, tool) in task.tools.iter().enumerate() {
            let said = refusal(&env, tool.position).unwrap();
            let own = format!("{} here would overlap the {}", task.placeable.kind, tool.kind);
            assert!(said.starts_with(&own), "tool {index}: {said}");
        }
        assert!(refusal(&env, task.ball.position).unwrap().ends_with("overlap the ball"));
        assert!(refusal(&env, task.goal.position).unwrap().ends_with("overlap the goal"));
        assert!(refusal(&env, task.subgoals[0].position).unwrap().ends_with("overlap subgoal 1"));
        assert!(refusal(&env, [f32::NAN, 0.0]).unwrap().ends_with("needs a finite position"));
        let free = [-0.9, 0.9];
        assert_eq!(refusal(&env, free), None);
        env.step(free).unwrap();
        assert!(refusal(&env, free).unwrap().ends_with("too close to an earlier one"));
        let beside = [free[0] + task.rules.overlap_threshold + 0.01, free[1]];
        let said = refusal(&env, beside);
        assert!(said.is_none_or(|said| said.ends_with("placed before")));
    }
}
