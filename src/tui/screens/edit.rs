//! Edits of the task on the Scene and Edit screens: what to choose tasks and tools from, changes to the selected object and
//! to properties of tools, by keys and mouse, and proposed subgoals.

use super::scene::{Scene, moved};
use super::{Screens, Ui};
use crate::tui::effect::Effect;
use crate::tui::layers::{Item, Picker};
use crate::tui::scene::{picture, task_picture};
use mge_physics::{NO_OP, Tool, ToolKind, catalogue_tool};
use mge_task::{Draft, Edit, Object, Part, Property, STANDARD_RADIUS, Task, Values};
use mge_workbench::{Command, command};

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
    if let Some(effects) = step_property(&screens.scene, ui, None, steps) {
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

/// The index and the type of the selected tool.
pub fn selected(scene: &Scene, task: &Task) -> Option<(usize, ToolKind)> {
    match scene.selected()? {
        Object::Part(Part::Tool(index)) => Some((index, task.tools.get(index)?.kind)),
        _ => None,
    }
}

/// The size and the other properties of a tool as a command writes them, each only if it is not the default.
fn written(tool: &Tool) -> (Option<f32>, Values) {
    let (size, others): (Values, Values) =
        Property::unusual(tool).into_iter().partition(|(property, _)| *property == Property::Size);
    (size.first().map(|(_, size)| *size as f32), others)
}

/// Opens the picker of tasks.
pub fn choose_task(ui: &Ui) -> Vec<Effect> {
    let item = |(name, task): &(String, Task)| Item {
        name: name.clone(),
        variant: None,
        about: task.description.clone(),
        of: task.clone(),
    };
    let open = |item: &Item<Task>| Effect::apply(command::Task(item.name.clone()));
    vec![Effect::open(Picker::new(
        "open a task",
        ui.view.tasks.iter().map(item).collect(),
        (7, |task, area, theme, buffer| task_picture(task, None, area, theme, buffer)),
        open,
    ))]
}

/// Opens the picker to add a tool. It is added at the valid place that is nearest to the middle.
pub fn choose_tool(ui: &Ui) -> Vec<Effect> {
    let draft = Draft { task: Task::clone(&ui.view.task), proposed: ui.view.proposed.clone(), search_actions: 0 };
    choose_of("add a tool", move |tool| {
        let (size, values) = written(tool);
        let at = |position| Edit::AddTool { kind: tool.kind, position, size, values: values.clone() };
        let place = places().find(|place| at(*place).apply(&draft).is_ok());
        let added = Effect::select(Some(Object::Part(Part::Tool(draft.task.tools.len()))));
        Effect::all(vec![Effect::apply(at(place.unwrap_or_default())), added])
    })
}

/// Opens a picker of tools.
fn choose_of(title: &str, choose: impl Fn(&Tool) -> Effect + 'static) -> Vec<Effect> {
    vec![Effect::open(Picker::new(title, tools(), (4, picture), move |item| choose(&item.of)))]
}

/// A grid of places over the scene, those near the middle first.
fn places() -> impl Iterator<Item = [f32; 2]> {
    let mut all: Vec<[f32; 2]> = (-3..=3).flat_map(|x| (-3..=3).map(move |y| [x, y].map(|n| n as f32 / 4.0))).collect();
    all.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    all.into_iter()
}

/// Opens the picker to choose the tool that the agent places.
pub fn choose_placeable() -> Vec<Effect> {
    choose_of("the agent's tool", |tool| {
        let (size, values) = written(tool);
        Effect::apply(Edit::SetPlaceable { kind: tool.kind, size, values })
    })
}

/// Opens the palette with the properties of the selected tool.
pub fn type_properties(scene: &Scene, ui: &Ui) -> Vec<Effect> {
    let Some((index, kind)) = selected(scene, &ui.view.task) else {
        return vec![Effect::info(ui.text("no tool is selected: {next-object} or a click selects one"))];
    };
    let tool = ui.view.task.tools[index].tool();
    let values = Property::of_kind(kind).map(|property| (property, property.of(&tool))).collect();
    vec![Effect::palette(Command::from(Edit::SetTool { index, values }))]
}

/// Changes a property of the selected tool by some steps: `property` if the tool has it, or else its first. None if no
/// tool is selected.
pub fn step_property(scene: &Scene, ui: &Ui, property: Option<Property>, steps: f64) -> Option<Vec<Effect>> {
    let (index, kind) = selected(scene, &ui.view.task)?;
    let own = || Property::of_kind(kind);
    let property = own().find(|own| Some(*own) == property).or_else(|| own().next())?;
    let value = property.stepped(&ui.view.task.tools[index].tool(), steps);
    Some(vec![Effect::apply(Edit::SetTool { index, values: vec![(property, value)] })])
}

/// Every type of tool, then the tools of CREATE's catalogue as variants of it.
pub fn tools() -> Vec<Item<Tool>> {
    let item = |of: Tool, is_variant: bool| {
        let name = of.kind.to_string();
        let variant = is_variant.then(|| tool_text(&of, false).replacen(&name, "", 1));
        Item { name, variant, about: tool_text(&of, true), of }
    };
    let usual = ToolKind::ALL.into_iter().map(|kind| item(Tool::new(kind, [0.0; 2]), false));
    usual.chain((0..NO_OP).filter_map(|number| Some(item(*catalogue_tool(number)?, true)))).collect()
}

/// The type of a tool, its size and its unusual properties, with the names of the properties or only their initials.
pub fn tool_text(tool: &Tool, named: bool) -> String {
    let size = Some((Property::Size, Property::Size.of(tool))).filter(|_| tool.kind.has_size());
    let others = Property::unusual(tool).into_iter().filter(|(property, _)| *property != Property::Size);
    let word = |(property, value): (Property, f64)| match property {
        _ if named => format!(" {property} {value}"),
        Property::Size => format!(" {value}"),
        _ => format!(" {}{value}", &property.name()[..1]),
    };
    tool.kind.to_string() + &size.into_iter().chain(others).map(word).collect::<String>()
}
