//! Edits of the task on the Scene and the Edit screen: what a key or the mouse makes of
//! the selected object, and proposed subgoals.

use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::facts::Level;
use crate::tui::layers::{Chooser, Deed, Layer, Prompt, Then};
use crate::tui::scene::Object;

/// The direction and distance of a moving action.
pub fn direction(action: Action, near: f32, far: f32) -> Option<[f32; 2]> {
    Some(match action {
        Action::Left => [-near, 0.0],
        Action::Right => [near, 0.0],
        Action::Up => [0.0, near],
        Action::Down => [0.0, -near],
        Action::FarLeft => [-far, 0.0],
        Action::FarRight => [far, 0.0],
        Action::FarUp => [0.0, far],
        Action::FarDown => [0.0, -far],
        _ => return None,
    })
}

/// A position moved and kept on the screen, to three decimals.
pub(super) fn moved(position: [f32; 2], by: [f32; 2]) -> [f32; 2] {
    std::array::from_fn(|axis| ((position[axis] + by[axis]).clamp(-1.0, 1.0) * 1000.0).round() / 1000.0)
}

/// Edits of the selected object; false if the action is no edit.
pub(super) fn edit(app: &mut App, action: Action) -> bool {
    let task = app.desk.facts().task.clone();
    let step = direction(action, 0.01, 0.1);
    match action {
        Action::AddSubgoal => {
            let last = task.subgoals.last().map_or(task.ball.position, |subgoal| subgoal.position);
            let middle: [f32; 2] = std::array::from_fn(|axis| (last[axis] + task.goal.position[axis]) / 2.0);
            let [x, y] = moved(middle, [0.0; 2]);
            app.line(&format!("subgoal add {x} {y}"));
            app.scene.selected = Some(Object::Subgoal(task.subgoals.len()));
            return true;
        }
        Action::AddTool => {
            choose_tool(app);
            return true;
        }
        Action::Propose => {
            ask_for_proposals(app);
            return true;
        }
        Action::AcceptProposals | Action::RejectProposals => {
            answer_proposals(app, action == Action::AcceptProposals);
            return true;
        }
        Action::Coordinates
        | Action::DeleteObject
        | Action::Grow
        | Action::Shrink
        | Action::Earlier
        | Action::Later => {}
        _ if step.is_some() => {}
        _ => return false,
    }
    let objects = app.desk.facts().objects();
    let Some(object) = app.scene.selected.filter(|object| objects.has(*object)) else {
        let key = app.keymap.key_for(Action::NextObject, Context::Scene);
        app.say(Level::Info, format!("nothing is selected: {key} or a click selects an object"));
        return true;
    };
    let (Some(position), size, name) = (objects.position(object), objects.size(object), objects.name(object)) else {
        return true;
    };
    if let Some(by) = step {
        let [x, y] = moved(position, by);
        app.line(&format!("{} {x} {y}", object.verb("move")));
        return true;
    }
    match (action, object) {
        (Action::Coordinates, _) => {
            let [x, y] = position;
            let then = Then::Command(object.verb("move"));
            let prompt = Prompt::new(name, "x and y from -1 to 1", format!("{x} {y}"), then);
            app.layers.push(Layer::Prompt(prompt));
        }
        (Action::Grow | Action::Shrink, Object::Ball) => app.say(Level::Info, "the ball has a fixed size"),
        (Action::Grow | Action::Shrink, _) => {
            let by = if action == Action::Grow { 0.5 } else { -0.5 };
            let size = (size.unwrap_or(0.0) + by).max(0.5);
            app.line(&format!("{} {size}", object.verb("size")));
        }
        (Action::DeleteObject, Object::Ball | Object::Goal) => {
            app.say(Level::Info, "a task needs its ball and its goal");
        }
        (Action::DeleteObject, _) => app.line(&object.verb("delete")),
        (_, Object::Subgoal(index)) => reorder(app, index, action == Action::Later, task.subgoals.len()),
        _ => app.say(Level::Info, "only subgoals have an order"),
    }
    true
}

fn reorder(app: &mut App, index: usize, later: bool, count: usize) {
    let other = if later { index + 1 } else { index.wrapping_sub(1) };
    if other >= count {
        return app.say(Level::Info, if later { "it is the last one" } else { "it is the first one" });
    }
    app.line(&format!("subgoal swap {} {}", index + 1, other + 1));
    app.scene.selected = Some(Object::Subgoal(other));
}

/// Asks how many subgoals are to be proposed: as many as there are, to start with.
fn ask_for_proposals(app: &mut App) {
    let facts = app.desk.facts();
    let hint = format!(
        "how many subgoals, found by the model `{}`; they are only shown until you accept them",
        facts.settings.model
    );
    let count = facts.task.subgoals.len().max(1).to_string();
    let then = Then::Command("propose".to_owned());
    app.layers.push(Layer::Prompt(Prompt::new("propose subgoals", hint, count, then)));
}

/// Accepts or rejects the selected proposal, or all of them.
fn answer_proposals(app: &mut App, accept: bool) {
    if app.desk.facts().proposed.is_empty() {
        let key = app.keymap.key_for(Action::Propose, Context::Scene);
        return app.say(Level::Info, format!("nothing is proposed: {key} lets the model propose subgoals"));
    }
    let verb = if accept { "accept" } else { "delete" };
    match app.scene.selected {
        Some(proposal @ Object::Proposal(_)) => {
            let last = app.desk.facts().task.subgoals.len();
            app.line(&proposal.verb(verb));
            app.scene.selected = Some(Object::Subgoal(last)).filter(|_| accept);
        }
        _ => app.line(&format!("proposal {verb}")),
    }
}

fn choose_tool(app: &mut App) {
    let deed = |kind: crate::physics::ToolKind| Deed::Line(format!("tool add {kind} 0 0"));
    let about =
        |kind: crate::physics::ToolKind| format!("size {} units, in the middle of the scene", kind.default_size());
    let kinds = crate::physics::ToolKind::ALL;
    let items = kinds.into_iter().map(|kind| (kind.name().to_owned(), about(kind), deed(kind))).collect();
    app.layers.push(Layer::Chooser(Chooser {
        title: "add a tool".to_owned(),
        items,
        selected: 0,
        shown: Default::default(),
    }));
    app.scene.selected = Some(Object::Tool(app.desk.facts().task.tools.len()));
}

/// Ends a drag: the object stays where it was let go.
pub fn drop_object(app: &mut App) {
    if let Some((object, to)) = app.scene.drag.take() {
        let [x, y] = moved(to, [0.0; 2]);
        app.line(&format!("{} {x} {y}", object.verb("move")));
    }
}
