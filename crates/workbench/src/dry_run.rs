//! A check of a whole script before it is run, so that a mistake on its last line is found before
//! the first training starts.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::SessionError;
use super::command::Command;
use super::setup::Setup;
use mge_base::paths::expanded;
use mge_trainer::{PriorSource, check_model, warnings};

/// The state that is known before anything is computed, trained or written.
pub(super) struct DryRun {
    /// The task and the settings at this point of the script.
    pub setup: Setup,
    /// Files that the script will have written by now.
    written: BTreeSet<PathBuf>,
    /// Whether the task is one that the script itself writes or searches for; nothing can be checked from there on.
    pub task_unknown: bool,
    /// Whether subgoals have been proposed; edits cannot be checked from there on.
    pub proposed: bool,
    /// Warnings about the settings of the latest run.
    pub warnings: Vec<String>,
}

impl DryRun {
    /// Starts with a session's task and settings.
    pub fn new(setup: Setup) -> Self {
        Self { setup, written: BTreeSet::new(), task_unknown: false, proposed: false, warnings: Vec::new() }
    }

    /// Opens a task.
    pub fn open_task(&mut self, name: &str) -> Result<(), SessionError> {
        if self.will_be_written(&expanded(name)) {
            self.task_unknown = true;
        } else {
            self.setup.open_task(name)?;
            self.proposed = false;
        }
        Ok(())
    }

    /// Whether the script will have written a file by now.
    pub fn will_be_written(&self, file: &Path) -> bool {
        self.written.contains(file)
    }

    /// Changes a setting.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SessionError> {
        self.setup.set(key, value).map(drop)
    }

    /// Edits the task or the proposals.
    pub fn edit(&mut self, edit: impl FnOnce(&mut Setup) -> Result<String, SessionError>) -> Result<(), SessionError> {
        if self.proposed { Ok(()) } else { edit(&mut self.setup).map(drop) }
    }

    /// Notes the file that a command writes.
    pub fn writes(&mut self, command: &Command) {
        self.written.extend(command.with_output(|to, _| to.path.clone()));
    }

    /// Checks that a run can start with the settings.
    pub fn check_settings(&mut self) -> Result<(), SessionError> {
        let config = &self.setup.config;
        config.validate()?;
        self.warnings = warnings([(config, &self.setup.set)]);
        match &config.prior {
            PriorSource::ModelFile(file) if self.will_be_written(&file.path) => Ok(()),
            _ => check_model(config).map_err(|error| SessionError::Failed(error.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Script, Session};
    use mge_task as task;

    fn dry_run(text: &str) -> Result<(), String> {
        let session = Session::new(task::load("task1").unwrap(), "nowhere".into());
        Script::parse(text, "s", &[]).unwrap().dry_run(&session).map(drop).map_err(|error| error.to_string())
    }

    #[test]
    fn mistakes_after_long_work_are_found_beforehand() {
        for (line, expected) in [
            ("set ddpg.gama 0.9", "did you mean `ddpg.gamma`?"),
            ("set ddpg.gamma 7", "ddpg.gamma: is 7"),
            ("task tsk3", "did you mean `task3`?"),
            ("subgoal move 3 0 0", "subgoal"),
            ("undo", "nothing to undo"),
            ("redo", "nothing to redo"),
            ("figure dashboard a.jpeg", "`.png`, `.svg` or `.pdf`"),
            ("figure episode a.png", "`.gif`"),
            ("figure scene a.png width=single", "only the figure `learning`"),
            ("model nowhere.safetensors\ntrain b", "nowhere.safetensors"),
        ] {
            let error = dry_run(&format!("episodes 9\ntrain a\nwait\n{line}")).unwrap_err();
            assert!(error.starts_with("s:4: ") || error.starts_with("s:5: "), "{error}");
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn files_and_proposals_made_by_the_script_itself_are_accepted() {
        let text = "subgoal add 0 0\nsave mine.json\nmodel train box,bucket a.safetensors 3\nwait\n\
                    model a.safetensors\ntrain\nwait\ntask mine.json\nsubgoal move 9 0 0\nfigure episode a.gif";
        assert_eq!(dry_run(text), Ok(()));
        assert_eq!(dry_run("propose 1\nwait\nproposal accept 1\nundo"), Ok(()));
        assert!(dry_run("propose 1\nwait\ntask task1\nundo").unwrap_err().starts_with("s:4: "));
        assert!(!std::path::Path::new("mine.json").exists());
    }
}
