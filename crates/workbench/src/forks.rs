//! Forks: new runs that branch off another run at an episode, with other settings.

use std::io::ErrorKind;

use super::SessionError;
use super::command::{Fork, Watch};
use super::job::Reporter;
use super::run::RunView;
use super::session::Session;
use mge_base::validation::ValidationError;
use mge_trainer::{self as trainer, RunConfig, SettingError};

/// The value of `task` that selects the edited task.
const EDITED: &str = "edited";

impl Session {
    /// Starts forking the current run; the fork is trained once it exists.
    pub(super) fn fork(&mut self, command: &Fork) -> Result<String, SessionError> {
        let run = self.run().ok_or(SessionError::NoRun)?;
        let (source, name, number) = (run.directory().clone(), run.name.clone(), run.number);
        let config = self.forked(run, &name, command)?;
        let free = || self.setup.free_folder(&format!("{name}-at{}", command.episode));
        let path = command.folder.as_ref().map_or_else(free, |folder| self.setup.place(folder));
        std::fs::create_dir_all(path.parent().unwrap_or(&path)).map_err(mge_run::RunError::io("create", &path))?;
        // Reserves the folder, so that a concurrent fork gets another.
        let taken = "exists, or is being made: choose another name";
        std::fs::create_dir(&path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => SessionError::Failed(format!("{} {taken}", path.display())),
            _ => mge_run::RunError::io("create", &path)(error).into(),
        })?;
        self.warn(&config, &command.changes.iter().map(|(key, _)| key.clone()).collect());
        let mut report = format!("forking {name} at episode {} into {}", command.episode, path.display());
        if path.parent() != Some(self.folder()) {
            report += &format!(", not in {}", self.folder().display());
        }
        let work = move |reporter: &Reporter| {
            let progress = |done: u64, all: u64| _ = reporter.progress(done as usize, all as usize);
            let fork = trainer::fork(&source, &path, config, progress, &reporter.stop);
            // Removes the reserved folder only if it is still empty.
            let fork = fork.inspect_err(|_| _ = std::fs::remove_dir(&path));
            Ok(RunView::new(fork?)?.with_whole_log(&reporter.stop)?)
        };
        let asked = command.clone();
        self.start_job(command.clone(), work, move |session, made| {
            let added = session.runs.add(made?, false);
            session.journal.note(Watch(number).into(), Some(number));
            session.journal.note(asked.clone().into(), Some(added));
            let current = session.runs.current;
            let report = session.start_run(added, asked.until, "training in");
            // A run that was chosen while the fork was made stays the current one.
            session.runs.current = current.filter(|current| *current != number).or(session.runs.current);
            report
        });
        Ok(report)
    }

    /// The settings of a fork.
    fn forked(&self, run: &RunView, name: &str, command: &Fork) -> Result<RunConfig, SessionError> {
        let before = run.config();
        let mut config = RunConfig { fork: None, ..RunConfig::clone(before) };
        for (key, value) in &command.changes {
            match key.as_str() {
                "task" if value == EDITED => config.task = self.setup.config.task.clone(),
                "task" => return Err(ValidationError::new("task", "is `edited`: the task as it is edited").into()),
                "method" | "seed" => return Err(ValidationError::new(key, "cannot change in a fork").into()),
                _ => config = config.with_unchecked_setting(key, value)?,
            }
        }
        config.validate().map_err(SettingError::Range)?;
        let done = run.history().records.len();
        // While its log is being read, that is found when the fork is made.
        if !run.unread && done < command.episode as usize {
            return Err(format!("{name} has {done} episodes, not {}", command.episode).into());
        }
        if config.episodes <= command.episode {
            let few = format!("is {}, but a fork at episode {} needs more", config.episodes, command.episode);
            return Err(ValidationError::new("episodes", few).into());
        }
        let change = |(key, value): &(String, String)| match key.as_str() {
            "prior" => format!("{key}={}", config.prior.name()),
            _ => format!("{key}={value}"),
        };
        let changes = command.changes.iter().map(change).collect();
        Ok(config.forked(before, name, command.episode, changes))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::{Command, Script};
    use super::*;

    fn play(session: &mut Session, text: &str) {
        Script::parse(text, "s", &[]).unwrap().run(session, |_| {}).unwrap_or_else(|error| panic!("{text}: {error}"));
    }

    fn session(folder: &Path) -> Session {
        Session::new(mge_task::load("task1").unwrap(), folder.to_owned())
    }

    const TRAIN: &str = "method ddpg-uniform\nset ddpg.hidden 4\nset ddpg.warmup_steps 8\nepisodes 18\n\
                         set checkpoints.last_every 5\ntrain\nwait\n";

    fn rows(folder: &Path, run: &str) -> Vec<String> {
        let text = std::fs::read_to_string(folder.join(run).join("metrics.csv")).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    }

    fn refused(session: &mut Session, line: &str) -> String {
        let command = Command::parse(line).unwrap().unwrap();
        let begun = session.apply(command.clone()).map_err(|error| error.to_string());
        let outcome = begun.and_then(|_| session.wait_for(&command).map_err(|error| error.to_string()));
        outcome.expect_err(line)
    }

    #[test]
    fn a_fork_with_its_own_schedule_has_it_in_its_label() {
        use crate::listing::RunSummary;
        use mge_run::{Event, RunHistory, RunState};
        let config = RunConfig::new(std::sync::Arc::new(mge_task::load("task1").unwrap()));
        let config = config.with_setting("epsilon", "0.1").unwrap();
        let fork = |change: &str| config.clone().forked(&config, "first", 100, vec![change.to_owned()]);
        let label = |change: &str| {
            let mut log = RunHistory::default();
            log.add(0.0, &Event::ScheduleChanged { episode: 50, schedule: "0.9".to_owned() });
            let run = RunSummary::new(Path::new("fork"), std::sync::Arc::new(fork(change)), RunState::Finished);
            run.with_log(&log, Default::default()).label
        };
        assert!(label("epsilon=0.1").contains("epsilon 0.1"), "the run that it comes from had been set to 0.9");
        assert!(label("ddpg.gamma=0.9").contains("epsilon 0.9"));
    }

    #[test]
    fn a_fork_with_other_guidance_has_new_clusters() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        let train = TRAIN.replace("method ddpg-uniform", "method ddpg-mge\nset prior true\nepsilon 0.5");
        play(&mut session, &format!("{train}fork 12 guidance.clusters.fixed=2 guidance.std_floor=0.3\nwait\n"));
        let name = session.runs()[1].name.clone();
        let prior = std::fs::read_to_string(folder.path().join(name).join("prior.json")).unwrap();
        let prior: serde_json::Value = serde_json::from_str(&prior).unwrap();
        let clusters = prior["stages"][0]["clusters"].as_array().unwrap();
        assert!(clusters.len() <= 2 && clusters[0]["std"][0].as_f64().unwrap() >= 0.3, "{prior}");
    }

    #[test]
    fn a_fork_without_changes_repeats_the_run_and_one_with_changes_diverges() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = session(folder.path());
        play(&mut first, &format!("{TRAIN}fork 12\nwait\nwatch 1\nfork 12 epsilon=1 ddpg.gamma=0.5\nwait\n"));
        let [source, same, other] =
            ["", "-at12", "-at12-run2"].map(|end| rows(folder.path(), &format!("task1-ddpg-uniform-seed0{end}")));
        assert_eq!(source.len(), 18);
        assert_eq!(same, source, "the same settings make the same run");
        assert_eq!(other[..12], source[..12]);
        assert_ne!(other[12..], source[12..]);
        let fork = first.runs()[2].config().fork.clone().unwrap();
        assert_eq!(
            fork.to_string(),
            "forked from task1-ddpg-uniform-seed0 at episode 12 with epsilon=1, ddpg.gamma=0.5"
        );
        // A fork can be forked, but not at an episode before its start.
        play(&mut first, "fork 15 episodes=17\nwait\nexpect episodes = 17\n");
        assert!(refused(&mut first, "fork 3").contains("fork the run that it comes from"));
        // The recorded session reproduces all forks.
        let elsewhere = tempfile::tempdir().unwrap();
        let mut second = session(elsewhere.path());
        play(&mut second, &first.to_script());
        let names = |session: &Session| session.runs().iter().map(|run| run.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&second), names(&first), "{}", first.to_script());
        for name in names(&first) {
            assert_eq!(rows(elsewhere.path(), &name), rows(folder.path(), &name), "{name}");
        }
    }

    #[test]
    fn a_fork_repeats_earlier_schedule_changes_and_its_pauses_are_recorded() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = session(folder.path());
        let text = TRAIN.replace("train\nwait", "train until 5\nwait\nepsilon 0.9\nresume\nwait");
        play(&mut first, &format!("{text}fork 10 until 15\nwait\nexpect episodes = 15\nepsilon 0\nresume\nwait\n"));
        let [source, fork] = ["", "-at10"].map(|end| rows(folder.path(), &format!("task1-ddpg-uniform-seed0{end}")));
        assert_eq!((&fork[..15], fork.len()), (&source[..15], 18));
        assert_ne!(fork[15..], source[15..]);
        let script = first.to_script();
        assert!(script.contains("fork 10 until 15\nwait\n") && script.contains("epsilon 0\nresume\nwait"), "{script}");
    }

    #[test]
    fn a_name_alone_is_that_of_a_folder_in_the_folder_for_runs() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        play(&mut session, &format!("{TRAIN}fork 12 in other until 13\nwait\n"));
        assert!(folder.path().join("other/config.json").is_file());
        assert!(refused(&mut session, "fork 12 in other").contains("already holds a run"));
        let recorded = session.to_script();
        assert!(recorded.contains("in other until 13"), "{recorded}");
        // Played there again, it fails before anything is trained, and elsewhere it does the same.
        let error = Script::parse(&recorded, "s", &[]).unwrap().run(&mut session, |_| {}).unwrap_err().to_string();
        assert!(error.starts_with("s:") && error.contains("other already holds a run"), "{error}");
        let elsewhere = tempfile::tempdir().unwrap();
        let mut second = self::session(elsewhere.path());
        play(&mut second, &recorded);
        assert_eq!(rows(elsewhere.path(), "other"), rows(folder.path(), "other"));
    }

    #[test]
    fn the_folder_of_a_fork_that_is_being_made_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        play(&mut session, TRAIN);
        let fork = |line: &str| Command::parse(line).unwrap().unwrap();
        session.apply(fork("fork 12 in other until 13")).unwrap();
        let (command, _) = session.job(Command::is_fork).unwrap();
        assert_eq!(command.to_string(), "fork 12 in other until 13");
        let error = session.apply(fork("fork 6 in other")).unwrap_err().to_string();
        assert!(error.contains("other exists, or is being made: choose another name"), "{error}");
        play(&mut session, "wait\nexpect episodes = 13\n");
        assert!(session.job(Command::is_fork).is_none());
        // Also a run whose log has not been read yet is forked.
        let mut later = self::session(folder.path());
        later.apply(fork("open task1-ddpg-uniform-seed0")).unwrap();
        later.apply(fork("fork 12 in third until 13")).unwrap();
        play(&mut later, "wait\nexpect episodes = 13\n");
    }

    #[test]
    fn an_invalid_fork_is_refused_and_leaves_no_files() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        assert!(refused(&mut session, "fork 1").contains("there is no run"));
        play(&mut session, TRAIN);
        let before = std::fs::read_dir(folder.path()).unwrap().count();
        for (line, reason) in [
            ("fork 19 episodes=40", "task1-ddpg-uniform-seed0 has 18 episodes, not 19"),
            ("fork 18", "needs more"),
            ("fork 5 seed=3", "cannot change in a fork"),
            ("fork 5 ddpg.hidden=8", "ddpg.hidden"),
            ("fork 5 ddpg.gama=0.5", "did you mean `ddpg.gamma`?"),
            ("fork 5 task=task2", "the task as it is edited"),
        ] {
            let error = refused(&mut session, line);
            assert!(error.contains(reason), "{line}: {error}");
        }
        play(&mut session, "subgoal add 0 0 4\n");
        assert!(refused(&mut session, "fork 5 task=edited").contains("number of subgoals"));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before);
        play(&mut session, "undo\nsubgoal move 1 0.3 0.3\nfork 5 task=edited episodes=8\nwait\nexpect episodes = 8\n");
        let task = session.run().unwrap().config().task.clone();
        assert_eq!(task.subgoals[0].position, [0.3, 0.3]);
        // The shared episodes are replayed on the task they were played on.
        play(&mut session, "fork 7 episodes=9\nwait\n");
        let config = session.run().unwrap().config().clone();
        assert_eq!((config.task_of(5), config.task_of(6)), (&session.runs()[0].config().task, &task));
        let [first, last] = [&session.runs()[0], session.run().unwrap()];
        assert_eq!(last.saved.past_episode(4).unwrap(), first.saved.past_episode(4).unwrap());
    }

    #[test]
    fn a_fork_without_its_checkpoint_is_not_trained_from_the_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        play(&mut session, &format!("{TRAIN}fork 5 until 6\nwait\nstop\nwait\n"));
        let path = session.run().unwrap().directory().path().to_owned();
        std::fs::remove_dir_all(path.join("checkpoint")).unwrap();
        let (_sender, controls) = crossbeam_channel::unbounded();
        let directory = mge_run::RunDirectory::open(&path).unwrap();
        let error = trainer::train(&directory, &controls, &trainer::Watch::default()).unwrap_err().to_string();
        assert!(error.contains("the checkpoint from which it continues is missing"), "{error}");
        assert_eq!(mge_run::RunHistory::read(&directory).unwrap().records.len(), 6, "existing rows are kept");
    }
}
