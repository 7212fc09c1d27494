//! Random puzzles opened as the session's task.

use super::command::{Command, Puzzle};
use super::job::Reporter;
use super::setup::Setup;
use super::{Session, SessionError};
use mge_experiments::puzzles::random_puzzle;
use mge_task::Task;

fn is_puzzle(command: &Command) -> bool {
    matches!(command, Command::Puzzle(_))
}

impl Session {
    /// Starts searching for a puzzle.
    pub(super) fn search_puzzle(&mut self, command: &Puzzle) -> Result<String, SessionError> {
        self.cancel_jobs(is_puzzle);
        let (command, seed) = (command.clone(), command.0);
        let before = self.setup.config.task.clone();
        let work = move |reporter: &Reporter| {
            let tell = |layouts| _ = reporter.progress(layouts as usize, 0);
            random_puzzle(seed, reporter.stop(), tell).map_err(|error| error.to_string())
        };
        self.start_job(command.clone(), work, move |session, result| {
            let puzzle = result?;
            match session.setup.config.task == before {
                true => session.open_puzzle(command, puzzle),
                false => Err(format!(
                    "the task was changed while a puzzle was searched for: `{}` again",
                    Command::from(command)
                )),
            }
        });
        Ok(format!("searching for puzzle {seed}"))
    }

    /// Number of layouts tried by the search for a puzzle, while it runs.
    pub fn searching(&self) -> Option<usize> {
        self.job(is_puzzle).map(|pending| pending.job.progress().done)
    }

    fn open_puzzle(&mut self, command: Puzzle, puzzle: Task) -> Result<String, String> {
        let take = |setup: &mut Setup| {
            setup.take_task(puzzle, None);
            Ok(())
        };
        self.change(take).map_err(|error| error.to_string())?;
        self.forget_results_of_task();
        let report = format!("puzzle {}, {}: `propose` looks for subgoals", command.0, self.task().name);
        // Recorded when it is opened: only later commands can refer to it.
        self.journal.note(command.into(), self.runs.current);
        Ok(report)
    }

    /// Discards clusters and proposals, and searches for a puzzle: those of one task are meaningless for another.
    pub(super) fn forget_results_of_task(&mut self) {
        self.forget_clusters();
        self.forget_proposals();
        self.cancel_jobs(is_puzzle);
    }
}

#[cfg(test)]
mod tests {
    use crate::{Script, Session};
    use mge_task as task;

    fn run(session: &mut Session, lines: &str) -> Result<(), String> {
        Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).map_err(|error| error.to_string())
    }

    #[test]
    fn a_random_puzzle_is_opened_and_a_recorded_session_opens_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = Session::new(task::load("task2").unwrap(), "runs".into());
        run(&mut first, "puzzle 13").unwrap();
        assert_eq!((&*first.task().name, &*first.hand_play().task().name), ("train-13-0000", "train-13-0000"));
        run(&mut first, "goal size 3").unwrap();
        assert!(first.task().subgoals.is_empty());
        let error = run(&mut first, "save").unwrap_err();
        assert!(error.contains("train-13-0000 has no file"), "{error}");
        let file = folder.path().join("puzzle.json");
        let script = first.to_script();
        let mut second = Session::new(task::load("task2").unwrap(), "runs".into());
        run(&mut second, &format!("{script}save {}", file.display())).unwrap();
        assert_eq!(task::load(&file.display().to_string()).unwrap().tools, first.task().tools, "{script}");
        assert_eq!(second.task().goal, first.task().goal);
    }

    #[test]
    fn a_puzzle_does_not_replace_a_task_that_was_changed_meanwhile() {
        let mut session = Session::new(task::load("task2").unwrap(), "runs".into());
        let gate = session.gate.clone();
        let held = gate.lock().unwrap();
        for line in ["puzzle 13", "goal size 5"] {
            session.apply(crate::Command::parse(line).unwrap().unwrap()).unwrap();
        }
        drop(held);
        let error = session.wait(|_| ()).unwrap_err().to_string();
        assert!(error.contains("was changed while") && error.contains("`puzzle 13`"), "{error}");
        assert_eq!(session.task().name, "task2");
        session.apply(crate::Command::parse("puzzle 13").unwrap().unwrap()).unwrap();
        session.apply(crate::command::Task("task1".to_owned())).unwrap();
        assert!(session.is_idle(), "another task ends the search");
    }
}
