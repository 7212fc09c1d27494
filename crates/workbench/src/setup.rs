//! The task being edited and the settings of the next run.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::listing::folder::OF_SWEEP;
use super::{Command, OF_RUN, SessionError, free_name};
use mge_base::atomic::{Target, parent_of};
use mge_base::validation::ValidationError;
use mge_task::{Edit, Editor, Task, file_of, load_regular, save_as};
use mge_trainer::{RunConfig, check_model};

/// Task and settings of the next run.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    pub editor: Editor,
    /// The task's file, if it is not a shipped one.
    pub file: Option<PathBuf>,
    /// The settings; their task is a copy of the editor's.
    pub config: RunConfig,
    /// The settings that were set explicitly, by path.
    pub set: BTreeSet<String>,
    /// The number of episodes to which continuing extends a run that has fewer.
    pub extends_to: Option<u32>,
    /// The folder for new runs.
    pub folder: PathBuf,
}

/// Checks commands on the settings of the next run, without carrying them out and without its model, which takes long.
///
/// # Errors
/// Why the first of them would be refused.
pub fn check_settings(config: &RunConfig, folder: &Path, commands: &[Command]) -> Result<(), SessionError> {
    let mut setup = Setup { config: config.clone(), ..Setup::new(Task::clone(&config.task), folder.to_owned()) };
    commands.iter().try_for_each(|command| match command {
        Command::Train(_) => Ok(command.check_room(&setup).map(|()| setup.config.validate())??),
        _ => setup.try_command(command),
    })
}

impl Setup {
    pub fn new(task: Task, folder: PathBuf) -> Self {
        let config = RunConfig::usual_for(Arc::new(task.clone()));
        Self { editor: Editor::new(task), file: None, config, set: BTreeSet::new(), extends_to: None, folder }
    }

    /// Where a new run goes: a name alone is that of a folder in the folder for runs.
    pub fn place(&self, folder: &Path) -> PathBuf {
        if folder.file_name() == Some(folder.as_os_str()) { self.folder.join(folder) } else { self.listed(folder) }
    }

    /// The path by which the folder for runs lists a run, which may be written in another way, such as `./runs/a`.
    pub fn listed(&self, run: &Path) -> PathBuf {
        let place = parent_of(run).canonicalize().ok();
        let is_there = |folder: &PathBuf| place.is_some() && folder.canonicalize().ok() == place;
        let folder = [self.folder.clone(), self.folder.join(OF_SWEEP)].into_iter().find(is_there);
        folder.zip(run.file_name()).map_or_else(|| run.to_owned(), |(folder, name)| folder.join(name))
    }

    /// An unused folder of this name in the folder for runs, with a number appended if needed.
    pub fn free_folder(&self, name: &str) -> PathBuf {
        self.folder.join(free_name(&self.folder, name, OF_RUN))
    }

    pub fn open_task(&mut self, name: &str) -> Result<String, SessionError> {
        (self.editor, self.file) = (Editor::new(load_regular(name)?), file_of(name));
        self.config.task = Arc::new(self.editor.task().clone());
        Ok(format!("task {}: {}", self.config.task.name, self.config.task.description))
    }

    pub fn save_task(&mut self, to: Option<&Target>) -> Result<String, SessionError> {
        let mut task = self.editor.task().clone();
        let own = |path: &Path| Target { path: path.to_owned(), force: true };
        let to = match (to, &self.file) {
            (Some(to), Some(file)) if to.path == *file => own(file),
            (Some(to), _) => {
                if let Some(stem) = to.path.file_stem() {
                    task.name = stem.to_string_lossy().into_owned();
                }
                to.clone()
            }
            (None, Some(file)) if self.was_changed_outside(file) => {
                let problem = "was changed by another program: `task FILE` loads it, `save FILE` replaces it";
                return Err(format!("{} {problem}", file.display()).into());
            }
            (None, Some(file)) => own(file),
            (None, None) => {
                let problem = "has no file: name one to save to, such as `save my-task.json`";
                return Err(format!("{} {problem}", task.name).into());
            }
        };
        save_as(&task, &to)?;
        self.editor.mark_saved(task.name);
        self.task_changed();
        let report = format!("saved to {}", to.path.display());
        self.file = Some(to.path);
        Ok(report)
    }

    /// Whether the task's file no longer has the task as it was loaded or saved.
    fn was_changed_outside(&self, file: &Path) -> bool {
        file.exists() && !load_regular(&file.to_string_lossy()).is_ok_and(|task| task == *self.editor.saved())
    }

    pub fn step_history(
        &mut self,
        step: fn(&mut Editor) -> bool,
        name: &'static str,
        report: &str,
    ) -> Result<String, SessionError> {
        if !step(&mut self.editor) {
            return Err(nothing_to(name));
        }
        self.task_changed();
        Ok(report.to_owned())
    }

    pub fn edit(&mut self, edit: &Edit) -> Result<String, SessionError> {
        let (own, proposed) = (self.editor.task().subgoals.len(), self.editor.proposed().len());
        self.editor.apply(edit).map_err(|error| ValidationError::new(on_screen(&error.path), error.message))?;
        self.task_changed();
        Ok(match edit {
            Edit::AcceptProposal { index: Some(_) } => format!("subgoal {} was proposed", own + 1),
            Edit::AcceptProposal { index: None } => {
                format!("{proposed} proposed in place of {own} before: `undo` reverts it")
            }
            Edit::DeleteProposal { .. } => "rejected: `undo` reverts it".to_owned(),
            _ => "task edited".to_owned(),
        })
    }

    pub fn set(&mut self, key: &str, value: &str) -> Result<String, SessionError> {
        self.config = self.config.with_setting(key, value)?;
        self.set.insert(key.to_owned());
        Ok(format!("{key} = {value}"))
    }

    /// Checks that a run can start with the settings.
    pub fn check(&self) -> Result<(), SessionError> {
        self.config.validate()?;
        Ok(check_model(&self.config).map_err(|error| error.to_string())?)
    }

    /// Checks a command as far as possible without its work, and makes its changes of the task and the settings.
    pub fn try_command(&mut self, command: &Command) -> Result<(), SessionError> {
        command.check_room(self)?;
        command.as_execute().check(self)
    }

    /// Takes over the edited task, unless it is unchanged: a new `Arc` restarts hand play.
    fn task_changed(&mut self) {
        if *self.config.task != *self.editor.task() {
            self.config.task = Arc::new(self.editor.task().clone());
        }
    }
}

/// The place of a value in a task as the screens name it: `tools[0].position[1]` is `tool 1 y`.
fn on_screen(path: &str) -> String {
    let word = |step: &str| match step.trim_end_matches(']').split_once('[') {
        Some(("position", axis)) => if axis == "0" { "x" } else { "y" }.to_owned(),
        Some((list, index)) => {
            let one = if list == "boxes" { "box" } else { list.trim_end_matches('s') };
            format!("{one} {}", index.parse().map_or(0, |index: usize| index) + 1)
        }
        None => step.to_owned(),
    };
    path.split('.').map(word).collect::<Vec<_>>().join(" ")
}

/// That there is nothing to undo, redo or restore.
pub(super) fn nothing_to(what: &str) -> SessionError {
    format!("there is nothing to {what}").into()
}
