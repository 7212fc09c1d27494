//! Edits of the task on the Scene and Edit screens: changes to the selected object by keys and mouse, and
//! proposed subgoals.

use super::scene::{Scene, moved};
use super::{Ui, tools};
use crate::tui::actions::UiAction;
use crate::tui::effect::Effect;
use crate::tui::layers::Prompt;
use crate::tui::scene::Object;
use mge_task::{Edit, STANDARD_RADIUS};

/// The effects of an editing action; None for any other action.
pub(super) fn edit(scene: &mut Scene, ui: &Ui, action: UiAction) -> Option<Vec<Effect>> {
    let step = action.direction(0.01, 0.1);
    match action {
        UiAction::AddSubgoal => Some(add_subgoal(ui)),
        UiAction::AddTool => Some(vec![tools::choose_tool(ui)]),
        UiAction::Placeable => Some(vec![tools::choose_placeable()]),
        UiAction::Properties => Some(vec![tools::ask_for_properties(scene, ui)]),
        UiAction::Propose => Some(vec![ask_for_proposals(ui)]),
        UiAction::AcceptProposals | UiAction::RejectProposals => {
            Some(answer_proposals(scene, ui, action == UiAction::AcceptProposals))
        }
        UiAction::Coordinates
        | UiAction::DeleteObject
        | UiAction::Grow
        | UiAction::Shrink
        | UiAction::Earlier
        | UiAction::Later => Some(edit_selected(scene, ui, action, step)),
        _ => step.map(|_| edit_selected(scene, ui, action, step)),
    }
}

fn edit_selected(scene: &mut Scene, ui: &Ui, action: UiAction, step: Option<[f32; 2]>) -> Vec<Effect> {
    let objects = ui.view.objects();
    let selected = scene.selected().and_then(|object| Some((object, objects.position(object)?)));
    let Some((object, position)) = selected else {
        return vec![Effect::info(ui.text("nothing is selected: {next-object} or a click selects an object"))];
    };
    if let Some(by) = step {
        return vec![Effect::apply(object.moved_to(moved(position, by)))];
    }
    match (action, object) {
        (UiAction::Coordinates, _) => vec![ask_for_coordinates(object, objects.name(object), position)],
        (UiAction::Grow | UiAction::Shrink, Object::Tool(_)) => {
            let steps = if action == UiAction::Grow { 1.0 } else { -1.0 };
            tools::step_property(scene, ui, None, steps).unwrap_or_default()
        }
        (UiAction::Earlier | UiAction::Later, Object::Tool(_)) => {
            if let Some((_, kind)) = tools::selected(scene, &ui.view.task) {
                tools::choose_property(scene, kind, action == UiAction::Later);
                let text = format!("{{shrink}} and {{grow}} change the {} of the {kind}", scene.property(kind));
                return vec![Effect::info(ui.text(&text))];
            }
            Vec::new()
        }
        (UiAction::Grow | UiAction::Shrink, _) => {
            let by = if action == UiAction::Grow { 0.5 } else { -0.5 };
            let size = (objects.size(object).unwrap_or(0.0) + by).max(0.5);
            match object.resized(size) {
                Some(edit) => vec![Effect::apply(edit)],
                None => vec![Effect::info(format!("{} has a fixed size", objects.name(object)))],
            }
        }
        (UiAction::DeleteObject, _) => match object.deleted() {
            Some(edit) => vec![Effect::apply(edit)],
            None if matches!(object, Object::Part(_)) => {
                vec![Effect::info("it is part of the level and can only be removed in its file")]
            }
            None => vec![Effect::info("a task needs its ball and its goal")],
        },
        (_, Object::Subgoal(index)) => reorder(index, action == UiAction::Later, ui.view.task.subgoals.len()),
        _ => vec![Effect::info("only subgoals have an order")],
    }
}

fn add_subgoal(ui: &Ui) -> Vec<Effect> {
    let task = &ui.view.task;
    let last = task.subgoals.last().map_or(task.ball.position, |subgoal| subgoal.position);
    let middle: [f32; 2] = std::array::from_fn(|axis| (last[axis] + task.goal.position[axis]) / 2.0);
    let added = Object::Subgoal(task.subgoals.len());
    let edit = Edit::AddSubgoal { position: moved(middle, [0.0; 2]), radius: STANDARD_RADIUS };
    vec![Effect::apply(edit), Effect::Select(Some(added))]
}

fn ask_for_coordinates(object: Object, name: String, [x, y]: [f32; 2]) -> Effect {
    let read = move |text: &str| Ok(Effect::apply(object.moved_to(read_position(text)?)));
    Effect::open(Prompt::new(name, "x and y; the screen is from -1 to 1", format!("{x} {y}"), read))
}

fn read_position(text: &str) -> Result<[f32; 2], String> {
    let number = |word: &str| word.parse::<f32>().map_err(|_| format!("`{word}` is not a coordinate"));
    match text.split_whitespace().map(number).collect::<Result<Vec<f32>, String>>()?[..] {
        [x, y] => Ok([x, y]),
        _ => Err("write two coordinates, x and y".to_owned()),
    }
}

/// Swaps a subgoal with its neighbour in the order; it stays selected.
fn reorder(index: usize, later: bool, count: usize) -> Vec<Effect> {
    let other = if later { index + 1 } else { index.wrapping_sub(1) };
    if other >= count {
        return vec![Effect::info(if later { "it is the last one" } else { "it is the first one" })];
    }
    let swap = Edit::SwapSubgoals { first: index, second: other };
    vec![Effect::apply(swap), Effect::Select(Some(Object::Subgoal(other)))]
}

/// Asks how many subgoals to propose; the default is the present number of subgoals.
fn ask_for_proposals(ui: &Ui) -> Effect {
    let hint = format!(
        "how many subgoals, found by the model `{}`; they are only shown until you accept them",
        ui.view.model_name()
    );
    let count = ui.view.task.subgoals.len().max(1).to_string();
    Effect::open(Prompt::arguments("propose", "propose subgoals", hint, count))
}

/// Accepts or rejects the selected proposal, or all of them.
fn answer_proposals(scene: &Scene, ui: &Ui, accept: bool) -> Vec<Effect> {
    if ui.view.proposed.is_empty() {
        return vec![Effect::info(ui.text("nothing is proposed: {propose-subgoals} lets the model propose subgoals"))];
    }
    let index = match scene.selected() {
        Some(Object::Proposal(index)) => Some(index),
        _ => None,
    };
    let edit = if accept { Edit::AcceptProposal { index } } else { Edit::DeleteProposal { index } };
    let mut effects = vec![Effect::apply(edit)];
    if index.is_some() {
        let accepted = Object::Subgoal(ui.view.task.subgoals.len());
        effects.push(Effect::Select(Some(accepted).filter(|_| accept)));
    }
    effects
}

/// Ends a drag: moves the object to where it was dropped.
pub fn drop_object(scene: &mut Scene) -> Vec<Effect> {
    let dropped = scene.drop_dragged();
    dropped.map(|(object, to)| Effect::apply(object.moved_to(moved(to, [0.0; 2])))).into_iter().collect()
}
