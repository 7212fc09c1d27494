//! Editing a task in small steps that keep it valid, with undo and redo.

use std::collections::VecDeque;

use super::{Form, Part, Placeable, Property, Region, STANDARD_RADIUS, Task, ToolSpec, Values};
use mge_base::validation::ValidationError;
use mge_physics::{ToolKind, exact};

/// What can be moved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Object {
    /// A part of the task.
    Part(Part),
    /// A proposed subgoal.
    Proposal(usize),
}

/// One change of a task. Indices of subgoals and tools count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Appends a subgoal, before the goal; without a radius, of the usual one.
    AddSubgoal { position: [f32; 2], radius: Option<f32> },
    /// Moves the start of a part, or a proposed subgoal.
    Move { object: Object, position: [f32; 2] },
    /// Resizes a subgoal.
    ResizeSubgoal { index: usize, radius: f32 },
    /// Swaps two subgoals in the order.
    SwapSubgoals { first: usize, second: usize },
    /// Deletes a subgoal.
    DeleteSubgoal { index: usize },
    /// Resizes the goal.
    ResizeGoal { radius: f32 },
    /// Adds a static tool to the scene.
    AddTool { kind: ToolKind, position: [f32; 2], size: Option<f32>, values: Values },
    /// Resizes a static tool.
    ResizeTool { index: usize, size: f32 },
    /// Changes properties of a static tool.
    SetTool { index: usize, values: Values },
    /// Deletes a static tool.
    DeleteTool { index: usize },
    /// Gives the agent another tool to place.
    SetPlaceable { kind: ToolKind, size: Option<f32>, values: Values },
    /// Resizes a proposed subgoal.
    ResizeProposal { index: usize, radius: f32 },
    /// Appends a proposed subgoal to the task's own; without an index, all proposals replace the task's own subgoals.
    AcceptProposal { index: Option<usize> },
    /// Rejects a proposed subgoal, or all of them.
    DeleteProposal { index: Option<usize> },
}

/// A task with proposed subgoals that have been neither accepted nor rejected.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// The task.
    pub task: Task,
    /// Proposed subgoals, in the order in which they are to be reached.
    pub proposed: Vec<Region>,
    /// Real actions of the searches that proposed them; the task is charged for them once one is accepted.
    pub search_actions: u64,
}

impl Edit {
    /// The task after the change.
    ///
    /// # Errors
    /// When there is no such object, or the result is not playable.
    pub fn apply(&self, draft: &Draft) -> Result<Draft, ValidationError> {
        let Draft { mut task, mut proposed, mut search_actions } = draft.clone();
        if matches!(self, Self::AcceptProposal { .. }) {
            task.search_actions += std::mem::take(&mut search_actions);
        }
        match *self {
            Self::AddSubgoal { position, radius } => {
                task.subgoals.push(Region { position, radius: radius.unwrap_or(STANDARD_RADIUS) });
            }
            Self::Move { object, position } => {
                let missing = |part| ValidationError::new(part, "the task has no such part");
                *match object {
                    Object::Proposal(index) => &mut entry(&mut proposed, "proposal", index)?.position,
                    Object::Part(Part::Subgoal(index)) => &mut entry(&mut task.subgoals, "subgoal", index)?.position,
                    Object::Part(Part::Tool(index)) => &mut entry(&mut task.tools, "tool", index)?.position,
                    Object::Part(part) => task.position_mut(part).ok_or_else(|| missing(part))?,
                } = position;
            }
            Self::ResizeSubgoal { index, radius } => entry(&mut task.subgoals, "subgoal", index)?.radius = radius,
            Self::SwapSubgoals { first, second } => {
                entry(&mut task.subgoals, "subgoal", first)?;
                entry(&mut task.subgoals, "subgoal", second)?;
                task.subgoals.swap(first, second);
            }
            Self::DeleteSubgoal { index } => {
                entry(&mut task.subgoals, "subgoal", index)?;
                task.subgoals.remove(index);
                task.forget(Part::Subgoal(index));
            }
            Self::ResizeGoal { radius } => task.goal.radius = radius,
            Self::AddTool { kind, position, size, ref values } => {
                task.tools.push(ToolSpec { kind, position, form: form(kind, size, values)? });
                // An order that contains tools contains all of them.
                if task.order.iter().any(|part| matches!(part, Part::Tool(_))) {
                    task.order.push(Part::Tool(task.tools.len() - 1));
                }
            }
            Self::ResizeTool { index, size } => entry(&mut task.tools, "tool", index)?.form.size = Some(exact(size)),
            Self::SetTool { index, ref values } => {
                let tool = entry(&mut task.tools, "tool", index)?;
                tool.form = tool.form.with(tool.kind, values)?;
            }
            Self::DeleteTool { index } => {
                entry(&mut task.tools, "tool", index)?;
                task.tools.remove(index);
                task.forget(Part::Tool(index));
            }
            Self::SetPlaceable { kind, size, ref values } => {
                task.placeable = Placeable { kind, form: form(kind, size, values)? };
            }
            Self::ResizeProposal { index, radius } => entry(&mut proposed, "proposal", index)?.radius = radius,
            Self::AcceptProposal { index } => match taken(&mut proposed, index)? {
                regions if index.is_none() => task = task.with_subgoals(regions),
                regions => task.subgoals.extend(regions),
            },
            Self::DeleteProposal { index } => _ = taken(&mut proposed, index)?,
        }
        task.validate()?;
        // Proposals must be acceptable together.
        task.clone().with_subgoals(proposed.clone()).validate()?;
        Ok(Draft { task, proposed, search_actions })
    }
}

/// The form of a tool of a type, with a size and properties.
fn form(kind: ToolKind, size: Option<f32>, values: &[(Property, f64)]) -> Result<Form, ValidationError> {
    Form { size: size.map(exact), ..Form::default() }.with(kind, values)
}

/// Removes and returns one of the proposals, or all of them.
fn taken(proposed: &mut Vec<Region>, index: Option<usize>) -> Result<Vec<Region>, ValidationError> {
    match index {
        Some(index) => {
            entry(proposed, "proposal", index)?;
            Ok(vec![proposed.remove(index)])
        }
        None if proposed.is_empty() => Err(ValidationError::new("proposals", "there are none: `propose` makes some")),
        None => Ok(std::mem::take(proposed)),
    }
}

/// The object at an index, from 0. The error message counts from 1.
fn entry<'a, T>(list: &'a mut [T], name: &str, index: usize) -> Result<&'a mut T, ValidationError> {
    let choice = match list.len() {
        0 => "there is none".to_owned(),
        1 => "there is only one: choose 1".to_owned(),
        count => format!("there are only {count}: choose one from 1 to {count}"),
    };
    list.get_mut(index).ok_or_else(|| ValidationError::new(format_args!("{name} {}", index.saturating_add(1)), choice))
}

/// Largest number of changes that can be undone.
const MAX_UNDO: usize = 1000;

/// A task being edited, with its undo and redo history.
#[derive(Debug, Clone)]
pub struct Editor {
    now: Draft,
    saved: Task,
    past: VecDeque<Draft>,
    future: Vec<Draft>,
}

impl Editor {
    /// Starts with a task as it was loaded.
    pub fn new(task: Task) -> Self {
        let now = Draft { task: task.clone(), proposed: Vec::new(), search_actions: 0 };
        Self { now, saved: task, past: VecDeque::new(), future: Vec::new() }
    }

    /// The current task.
    pub fn task(&self) -> &Task {
        &self.now.task
    }

    /// Subgoals proposed for it.
    pub fn proposed(&self) -> &[Region] {
        &self.now.proposed
    }

    /// The task with the proposed subgoals in place of its own, charged for the search for them.
    pub fn with_proposals(&self) -> Task {
        let Draft { task, proposed, search_actions } = self.now.clone();
        Task { search_actions: task.search_actions + search_actions, ..task.with_subgoals(proposed) }
    }

    /// Applies a change and clears the redo history.
    ///
    /// # Errors
    /// When the resulting task is not playable; then nothing is changed.
    pub fn apply(&mut self, edit: &Edit) -> Result<(), ValidationError> {
        let changed = edit.apply(&self.now)?;
        // Moving something to where it is, for example, is nothing to undo or to save.
        if changed != self.now {
            self.go_to(changed);
            self.future.clear();
        }
        Ok(())
    }

    /// Replaces the proposed subgoals by those of a search that took this many real actions. The change can be undone
    /// like others but, because it does not come from the user, it keeps the redo history.
    pub fn propose(&mut self, regions: Vec<Region>, actions: u64) {
        let search_actions = self.now.search_actions + actions;
        let changed = Draft { proposed: regions, search_actions, ..self.now.clone() };
        self.go_to(changed);
    }

    /// Switches to another version; the current one becomes the latest to undo.
    fn go_to(&mut self, version: Draft) {
        if self.past.len() == MAX_UNDO {
            self.past.pop_front();
        }
        self.past.push_back(std::mem::replace(&mut self.now, version));
    }

    /// Undoes the latest change. False if there is none.
    pub fn undo(&mut self) -> bool {
        let Some(before) = self.past.pop_back() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        true
    }

    /// Redoes the change that was undone last. False if there is none.
    pub fn redo(&mut self) -> bool {
        let Some(after) = self.future.pop() else { return false };
        self.go_to(after);
        true
    }

    /// The version last loaded or saved.
    pub fn saved(&self) -> &Task {
        &self.saved
    }

    /// Whether the task differs from the version last loaded or saved.
    pub fn is_dirty(&self) -> bool {
        self.now.task != self.saved
    }

    /// Records that the task was saved under this name, which undone and redone versions keep.
    pub fn mark_saved(&mut self, name: String) {
        for version in self.past.iter_mut().chain(&mut self.future) {
            version.task.name.clone_from(&name);
        }
        self.now.task.name = name;
        self.saved = self.now.task.clone();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load;

    fn editor() -> Editor {
        Editor::new(load("task2").unwrap())
    }

    fn moved(part: Part, position: [f32; 2]) -> Edit {
        Edit::Move { object: Object::Part(part), position }
    }

    #[test]
    fn undo_and_redo_walk_through_all_versions() {
        let mut editor = editor();
        let mut versions = vec![editor.task().clone()];
        for x in [0.1, 0.2, 0.3] {
            editor.apply(&moved(Part::Subgoal(0), [x, 0.5])).unwrap();
            versions.push(editor.task().clone());
        }
        for version in versions.iter().rev().skip(1) {
            assert!(editor.undo());
            assert_eq!(editor.task(), version);
        }
        assert!(!editor.undo() && !editor.is_dirty());
        for version in &versions[1..] {
            assert!(editor.redo());
            assert_eq!(editor.task(), version);
        }
        assert!(!editor.redo() && editor.is_dirty());
    }

    #[test]
    fn the_latest_thousand_changes_can_be_undone() {
        let mut editor = editor();
        for step in 0..MAX_UNDO + 2 {
            let position = [step as f32 / 10_000.0, 0.5];
            editor.apply(&moved(Part::Subgoal(0), position)).unwrap();
        }
        assert!((0..MAX_UNDO).all(|_| editor.undo()) && !editor.undo());
        assert_eq!(editor.task().subgoals[0].position, [0.0001, 0.5]);
    }

    #[test]
    fn a_refused_edit_changes_nothing() {
        let mut editor = editor();
        let before = editor.task().clone();
        for edit in [
            moved(Part::Subgoal(9), [0.0; 2]),
            moved(Part::Target, [0.6, -0.85]),
            Edit::ResizeGoal { radius: 0.0 },
            moved(Part::Goal, [f32::NAN, 0.0]),
        ] {
            assert!(editor.apply(&edit).is_err(), "{edit:?}");
            assert_eq!(editor.task(), &before);
            assert!(editor.past.is_empty());
        }
    }

    #[test]
    fn a_missing_object_is_named_by_its_number_from_1() {
        let check = |editor: &mut Editor, edit: &Edit, expected: &str| {
            assert_eq!(editor.apply(edit).unwrap_err().to_string(), expected);
        };
        let mut editor = editor();
        assert_eq!(editor.task().subgoals.len(), 2);
        check(&mut editor, &Edit::DeleteSubgoal { index: 8 }, "subgoal 9: there are only 2: choose one from 1 to 2");
        check(&mut editor, &Edit::DeleteProposal { index: Some(0) }, "proposal 1: there is none");
        editor.apply(&Edit::DeleteSubgoal { index: 0 }).unwrap();
        let swap = Edit::SwapSubgoals { first: 0, second: 1 };
        check(&mut editor, &swap, "subgoal 2: there is only one: choose 1");
    }

    #[test]
    fn an_edit_that_changes_nothing_leaves_the_history_alone() {
        let mut editor = editor();
        editor.apply(&moved(Part::Goal, [0.1, 0.3])).unwrap();
        editor.undo();
        editor.apply(&Edit::SwapSubgoals { first: 0, second: 0 }).unwrap();
        assert!(editor.redo() && editor.undo() && !editor.undo());
    }

    #[test]
    fn a_new_edit_clears_the_redo_history_and_redone_edits_can_be_undone() {
        let mut editor = editor();
        let before = editor.task().clone();
        let [first, second] = [0.1, 0.2].map(|x| moved(Part::Goal, [x, 0.3]));
        editor.apply(&first).unwrap();
        assert!(editor.undo() && editor.redo() && editor.undo());
        assert_eq!(editor.task(), &before);
        editor.apply(&second).unwrap();
        let edited = editor.task().clone();
        assert!(!editor.redo(), "the first edit is forgotten");
        assert_eq!(editor.task(), &edited);
        assert!(editor.undo() && !editor.undo());
        assert_eq!(editor.task(), &before);
    }

    #[test]
    fn a_task_is_dirty_until_it_is_saved_and_after_an_undo_from_there() {
        let mut editor = editor();
        assert!(!editor.is_dirty());
        editor.apply(&moved(Part::Goal, [0.1, 0.3])).unwrap();
        assert!(editor.is_dirty());
        editor.mark_saved("mine".to_owned());
        assert!(!editor.is_dirty() && editor.task().name == "mine");
        editor.undo();
        assert!(editor.is_dirty());
    }

    #[test]
    fn proposals_are_accepted_one_by_one_or_all_and_every_step_can_be_undone() {
        let mut editor = editor();
        let own = editor.task().subgoals.clone();
        let regions = [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]].map(|position| Region { position, radius: 4.0 });
        editor.propose(regions.to_vec(), 120);
        editor.apply(&Edit::Move { object: Object::Proposal(1), position: [0.0, 0.1] }).unwrap();
        editor.apply(&Edit::AcceptProposal { index: Some(1) }).unwrap();
        assert_eq!(editor.task().subgoals.last().unwrap().position, [0.0, 0.1]);
        assert_eq!(editor.task().subgoals.len(), own.len() + 1, "after the task's own");
        assert_eq!(editor.task().search_actions, 120, "the search is charged once one is accepted");
        editor.apply(&Edit::DeleteProposal { index: Some(0) }).unwrap();
        editor.apply(&Edit::AcceptProposal { index: None }).unwrap();
        assert_eq!(editor.task().subgoals, [regions[2]], "in place of the task's own");
        assert!(editor.proposed().is_empty() && editor.task().search_actions == 120);
        for index in [None, Some(0)] {
            assert!(editor.apply(&Edit::AcceptProposal { index }).is_err());
        }
        for left in [1, 2, 3, 3, 0] {
            assert!(editor.undo());
            assert_eq!(editor.proposed().len(), left);
        }
        assert!(!editor.undo() && editor.task().subgoals == own && editor.task().search_actions == 0);
    }

    #[test]
    fn proposals_take_the_place_of_subgoals_that_the_order_names() {
        let mut editor = Editor::new(crate::load("create/Basket").unwrap());
        assert!(editor.task().order.contains(&Part::Subgoal(1)));
        editor.propose(vec![Region { position: [0.0; 2], radius: 4.0 }], 5);
        let task = editor.with_proposals();
        task.validate().unwrap();
        assert_eq!((task.subgoals.len(), task.search_actions), (1, 5));
        assert!(!task.with_subgoals(Vec::new()).parts().iter().any(|part| matches!(part, Part::Subgoal(_))));
    }

    #[test]
    fn a_tool_is_added_with_its_size_and_a_proposal_must_stay_acceptable() {
        let mut editor = editor();
        let add = |size| Edit::AddTool { kind: ToolKind::Box, position: [-0.9, 0.9], size, values: Vec::new() };
        editor.apply(&add(Some(5.0))).unwrap();
        assert_eq!(editor.task().tools.last().unwrap().form.size, Some(5.0));
        editor.propose(vec![Region { position: [0.0; 2], radius: 4.0 }], 0);
        assert!(editor.apply(&Edit::Move { object: Object::Proposal(0), position: [3.0, 0.0] }).is_err());
        assert_eq!(editor.proposed()[0].position, [0.0; 2]);
    }

    #[test]
    fn every_level_keeps_its_order_when_edited_and_loads_as_saved() {
        for name in crate::level_names() {
            let level = load(&format!("create/{name}-random")).unwrap();
            let mut editor = Editor::new(level.clone());
            let (kind, position) = (ToolKind::Ramp, [-0.99, 0.99]);
            let values = vec![(Property::Angle, 45.0)];
            editor.apply(&Edit::AddTool { kind, position, size: Some(6.0), values }).unwrap();
            let added = editor.task().tools.len() - 1;
            editor.apply(&Edit::SetTool { index: added, values: vec![(Property::Elasticity, 1.2)] }).unwrap();
            let tool = editor.task().tools[added].tool();
            assert_eq!((tool.size, tool.angle, tool.elasticity), (6.0, std::f64::consts::FRAC_PI_4, 1.2), "{name}");
            let parts = editor.task().parts();
            let others: Vec<Part> = parts.into_iter().filter(|part| *part != Part::Tool(added)).collect();
            assert_eq!(others, level.parts(), "{name}");
            for part in editor.task().parts() {
                if matches!(part, Part::Marker | Part::Ball(_) | Part::Box(_)) {
                    let position =
                        editor.task().clone().position_mut(part).map(|position| [position[0] + 0.001, position[1]]);
                    editor.apply(&moved(part, position.unwrap())).unwrap();
                    assert_eq!(Ok(part), part.to_string().parse());
                }
            }
            let saved = crate::to_json(editor.task());
            assert_eq!(*editor.task(), crate::parse(&saved, name).unwrap(), "{name}");
            while editor.undo() {}
            assert_eq!(*editor.task(), level, "{name}");
            while editor.redo() {}
            editor.apply(&Edit::DeleteTool { index: 0 }).unwrap();
            assert_eq!(editor.task().parts().len(), level.parts().len(), "{name}");
        }
    }

    #[test]
    fn the_placeable_tool_is_replaced_and_invalid_ones_are_refused() {
        let mut editor = editor();
        let give = |size, values| Edit::SetPlaceable { kind: ToolKind::Cannon, size, values };
        editor.apply(&give(None, vec![(Property::Force, 70.0)])).unwrap();
        let given = editor.task().placeable.tool([0.0; 2]);
        assert_eq!((given.kind, given.force), (ToolKind::Cannon, 70.0));
        let check = |editor: &mut Editor, edit: &Edit, expected: &str| {
            let before = editor.task().clone();
            assert_eq!(editor.apply(edit).unwrap_err().to_string(), expected);
            assert_eq!(*editor.task(), before);
        };
        check(&mut editor, &give(None, vec![(Property::Velocity, 1.0)]), "vel: a cannon has none: it has angle, force");
        let force = "placeable.force: is NaN, but must be a number from -10000 to 10000";
        check(&mut editor, &give(None, vec![(Property::Force, f64::NAN)]), force);
        let nobody = moved(Part::Ball(7), [0.0; 2]);
        check(&mut editor, &nobody, "ball-8: the task has no such part");
        assert!(editor.undo() && editor.task().placeable.kind != ToolKind::Cannon);
    }

    #[test]
    fn arriving_proposals_keep_the_redo_history() {
        let mut editor = editor();
        editor.apply(&moved(Part::Goal, [0.1, 0.1])).unwrap();
        let edited = editor.task().clone();
        editor.undo();
        editor.propose(vec![Region { position: [0.0; 2], radius: 4.0 }], 0);
        assert!(editor.redo());
        assert_eq!(editor.task(), &edited);
    }
}
