//! Past episodes of the watched run and the agents that played them, read in the background.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::playback::{Episode, Origin};
use mge_task::Task;
use mge_trainer::Trace;
use mge_workbench::{Job, RunView, SavedAgent};

/// A recorded trace as an episode of the run in a folder.
pub fn episode_of(run: &Path, task: &Arc<Task>, trace: Arc<Trace>) -> Episode {
    let name = run.file_name().unwrap_or_default().to_string_lossy();
    let title = match trace.episode {
        0 => format!("the greedy policy of {name}"),
        episode => format!("episode {episode} of {name}"),
    };
    Episode { title, task: task.clone(), trace, origin: Origin::Run(run.to_owned()) }
}

/// The last episode of a run that this program does not train, read in the background.
#[derive(Default)]
pub struct LastEpisode {
    known: Option<Arc<Episode>>,
    reading: Option<Job<Episode>>,
}

impl LastEpisode {
    /// The latest known episode of a run. If it is not the last one, that is read in the background.
    pub fn of(&mut self, run: &RunView) -> Option<Arc<Episode>> {
        let last = Some(run.episodes()).filter(|episodes| *episodes > 0)?;
        let origin = Origin::Run(run.directory().path().to_owned());
        let known = self.known.clone().filter(|known| known.origin == origin);
        let is_last = known.as_ref().is_some_and(|known| known.trace.episode == last);
        if !run.is_active() && !is_last && self.reading.is_none() {
            let saved = run.saved();
            let (path, task) = (run.directory().path().to_owned(), run.config().task_of(last).clone());
            // If no thread can be started or the episode was not recorded, there is none to show.
            let read = move || saved.past_episode(last).map_err(|error| error.to_string());
            self.reading = Job::spawn(move |_| Ok(episode_of(&path, &task, Arc::new(read()?)))).ok();
        }
        known
    }

    /// Takes over the result of a finished read. True if it is new.
    pub fn collect(&mut self) -> bool {
        let read = self.reading.take_if(|job| job.is_finished()).and_then(|job| job.result().ok());
        let news = read.is_some();
        self.known = read.map(Arc::new).or(self.known.take());
        news
    }
}

/// The agent of the checkpoint nearest to a past episode, or why there is none.
pub type PastAgent = Result<Arc<SavedAgent>, String>;

/// The agent of the episode shown. The previous agent is kept while the next is read.
#[derive(Default)]
pub struct AgentReader {
    known: Option<(AgentRequest, PastAgent)>,
    reading: Option<(AgentRequest, Job<Arc<SavedAgent>>)>,
}

/// Number of further episodes of a running training after which checkpoints are looked up again.
const RECHECK_EPISODES: u64 = 50;

/// The folder of a run, an episode of it, and the run's progress in units of `RECHECK_EPISODES` episodes.
type AgentRequest = (PathBuf, u64, u64);

impl AgentReader {
    /// Starts reading the agent that played an episode of a run, unless it is known or a read is in progress.
    pub fn want(&mut self, run: &RunView, episode: u64) {
        let wanted = (run.directory().path().to_owned(), episode, run.episodes() / RECHECK_EPISODES);
        if self.reading.is_some() || self.known.as_ref().is_some_and(|(known, _)| *known == wanted) {
            return;
        }
        let saved = run.saved();
        let known = self.known.as_ref().filter(|(known, _)| known.0 == wanted.0);
        let known = known.and_then(|(_, agent)| agent.clone().ok());
        let read = move |_: &_| saved.agent_near(episode, known).map_err(|error| error.to_string());
        match Job::spawn(read) {
            Ok(job) => self.reading = Some((wanted, job)),
            Err(error) => self.known = Some((wanted, Err(error.to_string()))),
        }
    }

    /// The agent last read, if it belongs to the run in a folder.
    pub fn of(&self, run: &Path) -> Option<PastAgent> {
        self.known.as_ref().filter(|(known, _)| known.0 == run).map(|(_, agent)| agent.clone())
    }

    /// Takes over the result of a finished read. True if it is new.
    pub fn collect(&mut self) -> bool {
        let Some((wanted, job)) = self.reading.take_if(|(_, job)| job.is_finished()) else { return false };
        let agent = job.result();
        let is_same = match (&self.known, &agent) {
            (Some((known, Ok(before))), Ok(agent)) => known.0 == wanted.0 && Arc::ptr_eq(before, agent),
            _ => false,
        };
        self.known = Some((wanted, agent));
        !is_same
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_workbench::{Command, Session};

    #[test]
    fn the_last_episode_and_the_nearest_agent_are_read_once() {
        fn finish(agents: &mut AgentReader) -> bool {
            while agents.reading.as_ref().is_some_and(|(_, job)| !job.is_finished()) {
                std::thread::yield_now();
            }
            agents.collect()
        }
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::on_task("task1", folder.path().to_owned()).unwrap();
        for line in ["method ddpg", "episodes 3", "set ddpg.hidden 8", "train"] {
            session.apply(Command::parse(line).unwrap().unwrap()).unwrap();
        }
        session.wait(|_| {}).unwrap();
        let run = session.run().unwrap();
        assert!(!run.is_active());
        let mut last = LastEpisode::default();
        assert!(last.of(run).is_none());
        while last.reading.as_ref().is_some_and(|job| !job.is_finished()) {
            std::thread::yield_now();
        }
        assert!(last.collect());
        assert_eq!(last.of(run).map(|episode| episode.trace.episode), Some(3));
        assert!(last.reading.is_none());
        let mut agents = AgentReader::default();
        agents.want(run, u64::MAX);
        assert!(finish(&mut agents) && agents.of(run.directory().path()).unwrap().is_ok());
        agents.want(run, u64::MAX);
        assert!(agents.reading.is_none());
        agents.want(run, u64::MAX - 1);
        assert!(agents.reading.is_some() && !finish(&mut agents), "the same agent is not news");
    }
}
