//! Runs that differ only in the seed, started by one command.

use std::path::{Path, PathBuf};

use super::command::{Seed, Train, Watch};
use super::{Session, SessionError};

/// The folder of the run with a seed, when several are trained in `folder`: one beside it, so that lists of the folder
/// for runs have it.
pub(super) fn folder_of_seed(folder: &Path, seed: u64) -> PathBuf {
    let mut name = folder.components().as_path().as_os_str().to_owned();
    name.push(format!("-seed{seed}"));
    name.into()
}

impl Session {
    /// Starts or queues a run for each of `seeds` consecutive seeds, beginning with the one set. Each run is
    /// recorded as if it had been started on its own.
    pub(super) fn train_seeds(
        &mut self,
        seeds: u32,
        folder: Option<&Path>,
        until: Option<u32>,
    ) -> Result<String, SessionError> {
        let first = self.config().seed;
        let last = first.saturating_add(u64::from(seeds).saturating_sub(1));
        let before = self.runs().len();
        let mut report = String::new();
        let outcome = (first..=last).try_for_each(|seed| {
            self.apply(Seed(seed))?;
            let folder = folder.map(|folder| folder_of_seed(folder, seed));
            report = self.apply(Train { folder, seeds: None, until })?;
            Ok::<_, SessionError>(())
        });
        self.apply(Seed(first))?;
        outcome?;
        // The first is trained first: those that wait for a core show nothing yet.
        if let Some(run) = self.runs().get(before).filter(|_| first < last).map(|run| run.number) {
            self.apply(Watch(run))?;
        }
        let seeds = || format!("training with seeds {first} to {last}{}", self.with_settings());
        Ok(if first == last { report } else { seeds() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Script;
    use super::*;

    #[test]
    fn a_run_for_each_seed_is_started_and_recorded() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
        let play = |session: &mut Session, text: &str| {
            Script::parse(text, "s", &[]).unwrap().run(session, |_| {}).unwrap();
        };
        play(&mut session, "method ddpg\nset ddpg.hidden 4\nepisodes 2\nseed 7\ntrain seeds 3\nwait\n");
        let seeds: Vec<u64> = session.runs().iter().map(|run| run.config().seed).collect();
        assert_eq!((seeds, session.config().seed), (vec![7, 8, 9], 7));
        assert!(session.runs().iter().all(|run| run.history().records.len() == 2));
        let elsewhere = tempfile::tempdir().unwrap();
        let mut second = Session::new(mge_task::load("task1").unwrap(), elsewhere.path().to_owned());
        play(&mut second, &session.to_script());
        let names = |session: &Session| session.runs().iter().map(|run| run.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&second), names(&session), "{}", session.to_script());
        let metrics = |folder: &Path| std::fs::read(folder.join("task1-ddpg-seed9/metrics.csv")).unwrap();
        assert_eq!(metrics(elsewhere.path()), metrics(folder.path()));
        // A name alone is that of a run in the folder for runs, as in the dialog and for forks.
        play(&mut session, "train alone\ntrain together seeds 2\nwait\n");
        for name in ["alone", "together-seed7", "together-seed8"] {
            assert!(folder.path().join(name).join("metrics.csv").exists(), "{name}");
        }
        // Runs in a folder of their own name are beside it, where the folder's runs are listed.
        play(&mut session, &format!("train {}/ seeds 2\nwait\n", folder.path().join("named").display()));
        assert!(
            ["named-seed7", "named-seed8"].iter().all(|name| folder.path().join(name).join("metrics.csv").exists())
        );
    }
}
