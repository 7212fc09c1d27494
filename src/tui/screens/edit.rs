//! Edits of the task on the Scene and Edit screens: changes to the selected object by keys and mouse, and
//! proposed subgoals.

use super::scene::{Scene, moved};
use super::{Screens, Ui, tools};
use crate::tui::effect::Effect;
use mge_task::{Edit, Object, Part, STANDARD_RADIUS};
use mge_workbench::Command;

/// The effects of an edit of the selected object, given its position.
pub(super) fn on_selected(scene: &Scene, ui: &Ui, edit: impl FnOnce(Object, [f32; 2]) -> Effect) -> Vec<Effect> {
    let selected = scene.selected().and_then(|object| Some((object, ui.view.objects().position(object)?)));
    vec![match selected {
        Some((object, position)) => edit(object, position),
        None => Effect::info(ui.text("nothing is selected: {next-object} or a click selects an object")),
    }]
}

/// Makes the selected object larger or smaller by some steps; of a tool, changes its first property.
pub fn resize(screens: &mut Screens, ui: &Ui, steps: f64) -> Vec<Effect> {
    if let Some(effects) = tools::step_property(&screens.scene, ui, None, steps) {
        return effects;
    }
    on_selected(&screens.scene, ui, |object, _| {
        let objects = ui.view.objects();
        let size = (objects.size(object).unwrap_or(0.0) + 0.5 * steps as f32).max(0.5);
        match object {
            Object::Proposal(index) => Effect::apply(Edit::ResizeProposal { index, radius: size }),
            Object::Part(Part::Goal) => Effect::apply(Edit::ResizeGoal { radius: size }),
            Object::Part(Part::Subgoal(index)) => Effect::apply(Edit::ResizeSubgoal { index, radius: size }),
            Object::Part(_) => Effect::info(format!("{} has a fixed size", objects.name(object))),
        }
    })
}

/// Deletes the selected object.
pub fn delete(screens: &mut Screens, ui: &Ui) -> Vec<Effect> {
    on_selected(&screens.scene, ui, |object, _| match object {
        Object::Proposal(index) => Effect::apply(Edit::DeleteProposal { index: Some(index) }),
        Object::Part(Part::Subgoal(index)) => Effect::apply(Edit::DeleteSubgoal { index }),
        Object::Part(Part::Tool(index)) => Effect::apply(Edit::DeleteTool { index }),
        Object::Part(Part::Target | Part::Goal) => Effect::info("a task needs its ball and its goal"),
        Object::Part(_) => Effect::info("it is part of the level and can only be removed in its file"),
    })
}

/// Swaps the selected subgoal with its neighbour in the order.
pub fn reorder(scene: &Scene, ui: &Ui, later: bool) -> Vec<Effect> {
    let count = ui.view.task.subgoals.len();
    on_selected(scene, ui, |object, _| match object {
        Object::Part(Part::Subgoal(first)) => {
            let second = if later { first + 1 } else { first.wrapping_sub(1) };
            if second >= count {
                return Effect::info(if later { "it is the last one" } else { "it is the first one" });
            }
            let swap = Effect::apply(Edit::SwapSubgoals { first, second });
            Effect::all(vec![swap, Effect::select(Some(Object::Part(Part::Subgoal(second))))])
        }
        _ => Effect::info("only subgoals have an order"),
    })
}

/// Adds the selected proposal to the subgoals, or else one between the last one, or the ball, and the goal.
pub fn add_subgoal(scene: &Scene, ui: &Ui) -> Vec<Effect> {
    let task = &ui.view.task;
    let last = task.subgoals.last().map_or(task.ball.position, |subgoal| subgoal.position);
    let middle: [f32; 2] = std::array::from_fn(|axis| (last[axis] + task.goal.position[axis]) / 2.0);
    let added = Object::Part(Part::Subgoal(task.subgoals.len()));
    let edit = match scene.selected() {
        Some(Object::Proposal(index)) => Edit::AcceptProposal { index: Some(index) },
        _ => Edit::AddSubgoal { position: moved(middle, [0.0; 2]), radius: Some(STANDARD_RADIUS) },
    };
    vec![Effect::apply(edit), Effect::select(Some(added))]
}

/// Opens the palette with the command that moves the selected object to where it is.
pub fn type_coordinates(screens: &mut Screens, ui: &Ui) -> Vec<Effect> {
    on_selected(&screens.scene, ui, |object, position| Effect::palette(Command::from(Edit::Move { object, position })))
}

/// Accepts or rejects all proposals.
pub fn answer_proposals(ui: &Ui, answer: Edit) -> Vec<Effect> {
    vec![match (ui.view.proposed.is_empty(), ui.view.proposing) {
        (false, _) => Effect::apply(answer),
        (true, Some(_)) => Effect::info("nothing is proposed yet: the model is looking for subgoals"),
        (true, None) => {
            Effect::info(ui.text("nothing is proposed: {propose-subgoals} lets the model propose subgoals"))
        }
    }]
}
