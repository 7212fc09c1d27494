//! Scripts: files of commands, one per line.

use std::path::Path;

use super::SessionError;
use super::command::{Command, Model, Task, WaitFor};
use super::session::{Notice, Session};
use mge_base::bounded;
use mge_base::paths::expanded;
use mge_run::RunError;
use mge_trainer::{PriorSource, warnings};

/// Variables of a script and their values, which replace `${NAME}`.
pub type Variables = [(String, String)];

/// Why a script cannot be run: it cannot be read, a line is not a valid command, or the command of a line failed.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ScriptError(String);

/// A parsed script: every line is a valid command.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    origin: String,
    commands: Vec<(usize, Command)>,
}

impl Script {
    /// Reads the script in a file.
    ///
    /// # Errors
    /// As [`Script::parse`], and when the file cannot be read.
    pub fn load(path: &Path, variables: &Variables) -> Result<Self, ScriptError> {
        let text = bounded::read_text(path).map_err(|error| ScriptError(format!("{}: {error}", path.display())))?;
        Self::parse(&text, &path.display().to_string(), variables)
    }

    /// Parses a script; `origin` names it in errors.
    ///
    /// # Errors
    /// With the number of the first line that is not a valid command or uses an unknown variable.
    pub fn parse(text: &str, origin: &str, variables: &Variables) -> Result<Self, ScriptError> {
        let mut commands = Vec::new();
        for (index, line) in text.lines().enumerate() {
            // A comment is not a use of a variable.
            let text = if line.trim_start().starts_with('#') { Ok(line.into()) } else { substitute(line, variables) };
            let command = text
                .and_then(|line| Command::parse(&line).map_err(|error| error.to_string()))
                .map_err(|problem| ScriptError(format!("{origin}:{}: {problem}", index + 1)))?;
            commands.extend(command.map(|command| (index + 1, command)));
        }
        Ok(Self { origin: origin.to_owned(), commands })
    }

    /// Executes the commands in order; `on_output` receives each command with its report, and the
    /// notices while the script waits. Ends at `quit`.
    ///
    /// # Errors
    /// As [`Script::dry_run`], before anything is executed; then with the line of the first command
    /// that fails.
    pub fn run(&self, session: &mut Session, mut on_output: impl FnMut(Output<'_>)) -> Result<(), ScriptError> {
        for (line, warning) in self.dry_run(session)? {
            on_output(Output::Warning { place: format!("{}:{line}", self.origin), warning: &warning });
        }
        for (line, command) in &self.commands {
            let report = play(session, command, &mut on_output).map_err(|error| self.failed(*line, error))?;
            on_output(Output::Report(command, &report));
            if session.quit {
                break;
            }
        }
        Ok(())
    }

    /// Checks the commands as far as possible without doing their work, up to one whose results decide about the task, so
    /// that a mistake on the last line is found before the first training starts. Returns the warnings about the settings
    /// of runs, with the lines that would start these.
    ///
    /// # Errors
    /// With the line of the first command that would fail whatever the results of the work before it.
    pub fn dry_run(&self, session: &Session) -> Result<Vec<(usize, String)>, ScriptError> {
        let mut setup = session.setup.clone();
        let (mut written, mut found, mut deletes) = (Vec::new(), Vec::new(), false);
        for (line, command) in &self.commands {
            match command {
                // The task is then one that the script itself changes by proposals or writes.
                Command::Propose(_) => break,
                Command::Task(Task(name)) if written.contains(&expanded(name)) => break,
                Command::Model(Model(PriorSource::ModelFile(file))) if written.contains(&file.path) => continue,
                _ => {}
            }
            // A run that the script deletes makes room for another.
            deletes |= matches!(command, Command::Delete(_));
            let checked = command.check_output(session.file()).map_err(SessionError::from);
            let checked = checked.and_then(|()| match setup.try_command(command) {
                Err(SessionError::Run(RunError::AlreadyARun(_))) if deletes => Ok(()),
                checked => checked,
            });
            checked.map_err(|error| self.failed(*line, error))?;
            written.extend(command.with_output(|to, _| to.path.clone()));
            if let Command::Train(_) = command {
                found.extend(warnings([(&setup.config, &setup.set)]).into_iter().map(|warning| (*line, warning)));
            }
        }
        Ok(found)
    }

    fn failed(&self, line: usize, error: SessionError) -> ScriptError {
        ScriptError(format!("{}:{line}: {error}", self.origin))
    }
}

/// Executes a command and waits for the results that the following lines need.
fn play(session: &mut Session, command: &Command, output: &mut impl FnMut(Output<'_>)) -> Result<String, SessionError> {
    let command = &session.with_folders(command.clone())?;
    let report = session.apply(command.clone())?;
    match command.as_execute().script_role().awaits {
        WaitFor::Nothing | WaitFor::Work => Ok(report),
        WaitFor::Result => Ok(session.wait_for(command)?.unwrap_or(report)),
        WaitFor::Everything => session.wait(|notice| output(Output::Notice(notice))),
    }
}

/// Output of a running script.
#[derive(Debug)]
pub enum Output<'a> {
    /// The dry run found the settings of the run that a line would start doubtful.
    Warning { place: String, warning: &'a str },
    /// A command was executed, with this report.
    Report(&'a Command, &'a str),
    /// Something happened in the background.
    Notice(&'a Notice),
}

/// Replaces `${NAME}` by the value of the variable.
fn substitute(line: &str, variables: &Variables) -> Result<String, String> {
    let mut result = String::new();
    let mut rest = line;
    while let Some(start) = rest.find("${") {
        let Some(length) = rest[start..].find('}') else { break };
        let name = &rest[start + 2..start + length];
        let value = variables
            .iter()
            .find(|(known, _)| known == name)
            .ok_or_else(|| format!("`${{{name}}}` has no value: give it with `--define {name}=VALUE`"))?;
        result.push_str(&rest[..start]);
        result.push_str(&value.1);
        rest = &rest[start + length + 1..];
    }
    Ok(result + rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::Seed;
    use mge_task as task;

    fn session(folder: &Path) -> Session {
        Session::new(task::load("task1").unwrap(), folder.to_owned())
    }

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
            ("figure learning a.jpeg", "`.png` or `.svg`"),
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
                    model a.safetensors\ntrain\nwait\ntask mine.json\nsubgoal move 9 0 0\nfigure scene a.png";
        assert_eq!(dry_run(text), Ok(()));
        assert_eq!(dry_run("propose 1\nwait\nproposal accept 1\nundo"), Ok(()));
        assert!(!std::path::Path::new("mine.json").exists());
    }

    #[test]
    fn a_comment_may_name_a_variable_without_a_value() {
        let script = Script::parse("  # needs ${SEED}\nseed 1", "s", &[]).unwrap();
        assert_eq!(script.commands.len(), 1);
        assert!(Script::parse("seed ${SEED}", "s", &[]).is_err());
    }

    #[test]
    fn a_mistake_is_found_before_anything_runs() {
        let error = Script::parse("task task1\n\n# fine\ntrian\n", "tour.mge", &[]).unwrap_err().to_string();
        assert_eq!(error, "tour.mge:4: unknown command `trian`: did you mean `train`?");
    }

    #[test]
    fn variables_are_replaced() {
        let variables = [("seed".to_owned(), "7".to_owned())];
        let script = Script::parse("seed ${seed}", "s", &variables).unwrap();
        assert_eq!(script.commands, [(1, Seed(7).into())]);
        let error = Script::parse("seed ${sed}", "s", &variables).unwrap_err().to_string();
        assert!(error.starts_with("s:1: `${sed}` has no value"), "{error}");
    }

    #[test]
    fn an_expectation_that_fails_names_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let script = Script::parse("expect subgoals = 1\nsubgoal add 0 0\nexpect subgoals = 1", "s", &[]).unwrap();
        let error = script.run(&mut session(folder.path()), |_| {}).unwrap_err().to_string();
        assert_eq!(error, "s:3: expected subgoals = 1, but it is 2");
    }

    #[test]
    fn a_run_pauses_at_the_given_episode() {
        let folder = tempfile::tempdir().unwrap();
        let text =
            "method ddpg\nepisodes 6\ntrain until 3\nwait\nexpect episodes = 3\nresume\nwait\nexpect episodes = 6";
        let mut session = session(folder.path());
        Script::parse(text, "s", &[]).unwrap().run(&mut session, |_| {}).unwrap();
        assert_eq!(session.run().unwrap().state(), mge_run::RunState::Finished);
    }

    #[test]
    fn a_recorded_session_gives_the_same_run_and_figures() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let text = "method ddpg\nepisodes 8\nset ddpg.warmup_steps 20\nset ddpg.hidden 8\n\
                    train ${run} until 3\nwait\nepsilon 0.3\nresume\nwait\nfigure learning ${figure}";
        let play = |text: &str, run: &str| {
            let variables = [("run".to_owned(), path(run)), ("figure".to_owned(), path(&format!("{run}.png")))];
            let mut session = session(folder.path());
            Script::parse(text, "s", &variables).unwrap().run(&mut session, |_| {}).unwrap();
            let metrics = std::fs::read(session.run().unwrap().directory().metrics_path()).unwrap();
            (session.to_script(), metrics, std::fs::read(path(&format!("{run}.csv"))).unwrap())
        };
        let (recorded, metrics, figure) = play(text, "first");
        assert!(recorded.contains("until 3\nwait\nepsilon 0.3\nresume\nwait"), "{recorded}");
        let again = play(&recorded.replace("first", "second"), "second");
        assert_eq!((metrics, figure), (again.1, again.2));
    }
}
