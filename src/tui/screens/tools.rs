//! The task and its tools on the Scene and Edit screens: what to choose from, and changes to properties of tools.

use super::Ui;
use super::scene::Scene;
use crate::tui::effect::Effect;
use crate::tui::layers::{Item, Picker, tools};
use crate::tui::scene::{picture, task_picture};
use mge_physics::{Tool, ToolKind};
use mge_task::{Draft, Edit, Object, Part, Property, Task, Values};
use mge_workbench::{Command, command};

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
