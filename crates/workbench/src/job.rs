//! Background jobs: computations with progress, cancellation and a result, and those of a session. Commands never wait for
//! a job: they start it, and the next poll after its end applies its result to the session.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use std::{fmt, io};

use super::command::Command;
use super::session::Notice;
use super::{Session, SessionError};
use mge_base::stop::Stop;
use mge_base::sync::lock;
use mge_trainer::panic_message;

/// The error of a computation that ended because it was cancelled.
pub(super) const CANCELLED: &str = "the computation was cancelled: the same command starts it again";

/// A computation on its own thread.
pub struct Job<T> {
    reporter: Arc<Reporter>,
    /// An error if the thread could not be spawned.
    thread: io::Result<JoinHandle<Result<T, String>>>,
}

/// How much of a computation is done; unknown while `total` is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Number of parts done.
    pub done: usize,
    /// Number of parts in total.
    pub total: usize,
}

impl Progress {
    /// The fraction done, from 0 to 1; None if unknown.
    pub fn share(self) -> Option<f32> {
        (self.total > 0).then(|| self.done as f32 / self.total as f32)
    }
}

/// The computation's side of a job.
#[derive(Debug, Default)]
pub struct Reporter {
    progress: Mutex<Progress>,
    /// The stop request, for code that polls it itself.
    pub stop: Stop,
}

impl Reporter {
    /// Reports how much is done; false if the computation should end.
    pub fn progress(&self, done: usize, total: usize) -> bool {
        *lock(&self.progress) = Progress { done, total };
        !self.stop.is_requested()
    }
}

/// Runs a computation and turns a panic into an error.
pub(super) fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(format!("the computation panicked: {}", panic_message(&*panic))))
}

impl<T> fmt::Debug for Job<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Job").field("reporter", &self.reporter).finish_non_exhaustive()
    }
}

impl<T: Send + 'static> Job<T> {
    /// Starts a job. If no thread can be spawned, that error is its result.
    pub fn spawn(work: impl FnOnce(&Reporter) -> Result<T, String> + Send + 'static) -> Self {
        let reporter: Arc<Reporter> = Arc::default();
        let own = reporter.clone();
        let body = move || caught(|| work(&own));
        Self { reporter, thread: std::thread::Builder::new().name("mge-job".to_owned()).spawn(body) }
    }

    /// How much is done.
    pub fn progress(&self) -> Progress {
        *lock(&self.reporter.progress)
    }

    /// Whether the result is available.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().map_or(true, JoinHandle::is_finished)
    }

    /// The result; blocks until it is available.
    ///
    /// # Errors
    /// The error or panic that ended the computation, or the failure to spawn its thread.
    pub fn result(self) -> Result<T, String> {
        match self.thread {
            // The computation's own panics are caught in `spawn`.
            Ok(thread) => thread.join().unwrap_or_else(|_| Err("the computation failed".to_owned())),
            Err(error) => Err(format!("cannot start a thread: {error}")),
        }
    }

    /// Requests cancellation: the computation ends when it next polls the request or reports progress.
    pub fn cancel(&self) {
        self.reporter.stop.request();
    }
}

/// Polling interval while a script waits.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Applies a result to the session, and returns the report or the reason of the failure.
type Completion = Box<dyn FnOnce(&mut Session) -> Result<String, SessionError> + Send>;

/// A job started by a command.
#[derive(Debug)]
pub(super) struct CommandJob {
    pub command: Command,
    /// Its entries in the journal, removed when it fails.
    pub entries: Vec<u64>,
    shown: Progress,
    pub job: Job<Completion>,
}

impl Session {
    /// Starts a job for a command; `complete` applies its result to the session.
    pub(super) fn start_job<T: Send + 'static>(
        &mut self,
        command: impl Into<Command>,
        work: impl FnOnce(&Reporter) -> Result<T, SessionError> + Send + 'static,
        complete: impl FnOnce(&mut Self, Result<T, String>) -> Result<String, SessionError> + Send + 'static,
    ) {
        #[cfg(test)]
        let work = {
            let gate = self.gate.clone();
            move |reporter: &Reporter| {
                drop(gate.lock());
                work(reporter)
            }
        };
        let work = move |reporter: &Reporter| {
            let result = match reporter.stop.is_requested() {
                true => Err(CANCELLED.to_owned()),
                false => caught(|| work(reporter).map_err(|error| error.to_string())),
            };
            Ok(Box::new(move |session: &mut Self| complete(session, result)) as Completion)
        };
        let (command, job) = (command.into(), Job::spawn(work));
        self.jobs.push(CommandJob { command, entries: Vec::new(), shown: Progress::default(), job });
    }

    /// The command of the latest unfinished job whose command satisfies `which`, and the progress of the job.
    pub fn job(&self, which: impl Fn(&Command) -> bool) -> Option<(&Command, Progress)> {
        let pending = self.jobs.iter().rev().find(|pending| which(&pending.command))?;
        Some((&pending.command, pending.job.progress()))
    }

    /// Cancels the job of a command; its end is reported as usual.
    pub fn cancel(&mut self, command: &Command) {
        if let Some(pending) = self.jobs.iter_mut().rev().find(|pending| pending.command == *command) {
            pending.job.cancel();
        }
    }

    /// Cancels and drops the jobs of the commands that satisfy `which`.
    pub(super) fn cancel_jobs(&mut self, which: impl Fn(&Command) -> bool) {
        for pending in self.jobs.extract_if(.., |pending| which(&pending.command)) {
            pending.job.cancel();
            self.journal.forget(&pending.entries);
        }
    }

    /// Applies the available results.
    pub(super) fn advance_jobs(&mut self) {
        for pending in &mut self.jobs {
            let progress = pending.job.progress();
            if std::mem::replace(&mut pending.shown, progress) != progress {
                self.notices.push(Notice::Progress { command: pending.command.clone(), progress });
            }
        }
        while let Some(index) = self.jobs.iter().position(|pending| pending.job.is_finished()) {
            let CommandJob { command, entries, job, .. } = self.jobs.remove(index);
            let outcome = job.result().and_then(|complete| complete(self).map_err(|error| error.to_string()));
            if outcome.is_err() {
                self.journal.forget(&entries);
            }
            self.notices.push(Notice::Finished { command, outcome });
        }
    }

    /// Waits for the job of a command and returns its report; None if it started no job.
    ///
    /// # Errors
    /// When the job failed.
    pub fn wait_for(&mut self, command: &Command) -> Result<Option<String>, SessionError> {
        while self.job(|pending| pending == command).is_some() {
            self.interrupt.check().map_err(|_| SessionError::Interrupted)?;
            self.advance(true);
            std::thread::sleep(POLL_INTERVAL);
        }
        let finished = |notice: &Notice| matches!(notice, Notice::Finished { command: of, .. } if of == command);
        match self.notices.iter().rposition(finished).map(|index| self.notices.remove(index)) {
            Some(Notice::Finished { outcome, .. }) => outcome.map(Some).map_err(SessionError::Failed),
            _ => Ok(None),
        }
    }

    /// Waits until all jobs have ended and all runs have ended or paused; `on_notice` receives the
    /// notices meanwhile. For scripts and the command line: the terminal polls.
    ///
    /// # Errors
    /// When a job or a run failed.
    pub fn wait(&mut self, mut on_notice: impl FnMut(&Notice)) -> Result<String, SessionError> {
        loop {
            self.interrupt.check().map_err(|_| SessionError::Interrupted)?;
            let idle = self.is_idle();
            for notice in self.poll() {
                on_notice(&notice);
                if let Some(reason) = self.failure_in(&notice) {
                    return Err(reason.into());
                }
            }
            if idle {
                break;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        match self.run().filter(|run| run.trained_here).and_then(|run| run.failure()) {
            Some(reason) => Err(reason.to_owned().into()),
            None => Ok(self.activity()),
        }
    }

    /// The reason of a failure of the session's own work, if the notice reports one.
    fn failure_in(&self, notice: &Notice) -> Option<String> {
        match notice {
            Notice::Finished { outcome, .. } => outcome.as_ref().err().cloned(),
            Notice::Run { run, event: mge_run::Event::Failed { reason, .. } } => {
                self.run_numbered(*run).filter(|run| run.trained_here).map(|_| reason.clone())
            }
            _ => None,
        }
    }

    /// Describes what is running or queued.
    pub(super) fn activity(&self) -> String {
        let runs = self.runs().iter().filter(|run| run.is_working() || run.is_queued()).count();
        match (runs, self.jobs.len()) {
            (0, 0) => "nothing is running".to_owned(),
            (runs, jobs) => format!("runs running or queued: {runs}; computations: {jobs}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::path::Path;

    use super::*;
    use crate::command::{Open, Seed};
    use mge_run::{Event, LoggedEvent};

    #[test]
    fn a_job_is_cancelled_without_effect_on_others() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
        let gate = session.gate.clone();
        let held = gate.lock().unwrap();
        let command = |seed| Command::from(Seed(seed));
        for seed in 0..2 {
            let wait = |reporter: &Reporter| {
                if reporter.stop.is_requested() { Err("cancelled".to_owned().into()) } else { Ok(()) }
            };
            session.start_job(command(seed), wait, |_, result| Ok(result.map(|()| "computed".to_owned())?));
        }
        session.cancel(&command(1));
        drop(held);
        assert_eq!(session.wait_for(&command(0)).unwrap().as_deref(), Some("computed"));
        assert!(session.wait_for(&command(1)).is_err());
    }

    #[test]
    fn a_wait_fails_with_any_run_of_the_session_but_not_with_a_run_of_another() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
        for line in ["method ddpg", "episodes 1", "set ddpg.hidden 4", "train"] {
            session.apply(Command::parse(line).unwrap().unwrap()).unwrap();
        }
        session.wait(|_| ()).unwrap();
        let trained = session.run().unwrap().directory().path().to_owned();
        let opened = folder.path().join("opened");
        std::fs::create_dir(&opened).unwrap();
        for file in ["config.json", "events.jsonl"] {
            std::fs::copy(trained.join(file), opened.join(file)).unwrap();
        }
        session.apply(Open(opened.clone())).unwrap();
        session.wait(|_| ()).unwrap();
        let fail = |run: &Path| {
            let event = Event::Failed { episode: 1, reason: "the disk is full".to_owned() };
            let line = serde_json::to_string(&LoggedEvent { time: 0.0, event }).unwrap() + "\n";
            let mut log = std::fs::File::options().append(true).open(run.join("events.jsonl")).unwrap();
            log.write_all(line.as_bytes()).unwrap();
        };
        fail(&opened);
        let mut failures = 0;
        let is_failure = |notice: &Notice| matches!(notice, Notice::Run { run: 1, event: Event::Failed { .. } });
        session.wait(|notice| failures += usize::from(is_failure(notice))).unwrap();
        assert_eq!(failures, 1, "it is reported");
        fail(&trained);
        assert_eq!(session.wait(|_| ()).unwrap_err().to_string(), "the disk is full");
    }

    #[test]
    fn a_result_an_error_and_a_panic_are_all_outcomes() {
        assert_eq!(Job::spawn(|_| Ok(7)).result(), Ok(7));
        assert_eq!(Job::<()>::spawn(|_| Err("no".to_owned())).result(), Err("no".to_owned()));
        let panicked = Job::<()>::spawn(|_| panic!("on purpose")).result();
        assert_eq!(panicked, Err("the computation panicked: on purpose".to_owned()));
    }

    #[test]
    fn a_cancelled_job_ends_at_its_next_report() {
        let job = Job::<()>::spawn(|reporter| {
            let mut done = 0;
            while reporter.progress(done, 9) {
                done = 1;
                std::thread::yield_now();
            }
            Err("cancelled".to_owned())
        });
        while job.progress().done != 1 {
            std::thread::yield_now();
        }
        assert!(!job.is_finished() && job.progress().share() == Some(1.0 / 9.0));
        job.cancel();
        assert_eq!(job.result(), Err("cancelled".to_owned()));
    }
}
