//! What the session computes in the background. No command waits for a computation: it
//! begins one, and its result is taken in when the session is next polled.

use std::fmt;
use std::time::Duration;

use super::command::Command;
use super::job::{Job, Progress, Reporter, caught};
use super::session::Notice;
use super::{Session, SessionError};

/// Time between two looks at what a script waits for.
const LOOK: Duration = Duration::from_millis(10);

/// Computations of a session at the same time: more wait without a thread, so that however many are asked
/// for, they take up no more memory than these.
const AT_A_TIME: usize = 4;

/// Takes a result into the session; what to report, or why there is none.
type Completion = Box<dyn FnOnce(&mut Session) -> Result<String, String> + Send>;

/// A computation that a command began.
pub(super) struct Pending {
    pub command: Command,
    /// The command's entry in the journal, if it has one.
    pub entry: Option<u64>,
    shown: Progress,
    pub job: Job<Completion>,
}

impl fmt::Debug for Pending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pending").field("command", &self.command).finish_non_exhaustive()
    }
}

impl Session {
    /// Begins a computation for a command, at once or when it is its turn; `complete` takes its result into the session.
    pub(super) fn begin_job<T: Send + 'static>(
        &mut self,
        command: impl Into<Command>,
        work: impl FnOnce(&Reporter) -> Result<T, String> + Send + 'static,
        complete: impl FnOnce(&mut Self, Result<T, String>) -> Result<String, String> + Send + 'static,
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
            let result = match reporter.is_cancelled() {
                true => Err("the computation was cancelled".to_owned()),
                false => caught(|| work(reporter)),
            };
            Ok(Box::new(move |session: &mut Self| complete(session, result)) as Completion)
        };
        let (command, job) = (command.into(), Job::new(work));
        self.jobs.push(Pending { command, entry: None, shown: Progress::default(), job });
        self.begin_waiting_jobs();
    }

    /// Begins the computations that wait, the first first, as far as there are places.
    fn begin_waiting_jobs(&mut self) {
        let begun = self.jobs.iter().filter(|pending| pending.job.is_begun()).count();
        let waiting = self.jobs.iter_mut().filter(|pending| !pending.job.is_begun());
        waiting.take(AT_A_TIME.saturating_sub(begun)).for_each(|pending| pending.job.begin());
    }

    /// The latest computation begun by such a command that has not ended.
    pub(super) fn job(&self, which: impl Fn(&Command) -> bool) -> Option<&Pending> {
        self.jobs.iter().rev().find(|job| which(&job.command))
    }

    /// Asks the computation that a command began to end; its end is reported as ever.
    pub fn cancel(&mut self, command: &Command) {
        if let Some(pending) = self.jobs.iter_mut().rev().find(|pending| pending.command == *command) {
            pending.job.cancel();
            // One that waits for its turn ends at once.
            pending.job.begin();
        }
    }

    /// Cancels the computations begun by such commands.
    pub(super) fn cancel_jobs(&mut self, which: impl Fn(&Command) -> bool) {
        let cancelled: Vec<Pending> = self.jobs.extract_if(.., |pending| which(&pending.command)).collect();
        for pending in &cancelled {
            pending.job.cancel();
            self.forget(pending.entry);
        }
    }

    /// What came to nothing need not be repeated by the recorded script.
    fn forget(&mut self, entry: Option<u64>) {
        if let Some(entry) = entry {
            self.journal.forget(entry);
        }
    }

    /// Takes in the results that are there.
    pub(super) fn advance_jobs(&mut self) {
        for pending in &mut self.jobs {
            let progress = pending.job.progress();
            if std::mem::replace(&mut pending.shown, progress) != progress {
                self.notices.push(Notice::Progress { command: pending.command.clone(), progress });
            }
        }
        while let Some(index) = self.jobs.iter().position(|pending| pending.job.is_finished()) {
            let Pending { command, entry, job, .. } = self.jobs.remove(index);
            let outcome = job.result().and_then(|complete| complete(self));
            if outcome.is_err() {
                self.forget(entry);
            }
            self.notices.push(Notice::Finished { command, outcome });
        }
        self.begin_waiting_jobs();
    }

    /// Waits for the result of a command, which is what to report of it; None if it began
    /// no computation.
    ///
    /// # Errors
    /// When the computation failed.
    pub fn wait_for(&mut self, command: &Command) -> Result<Option<String>, SessionError> {
        while self.job(|pending| pending == command).is_some() {
            self.check_interrupt()?;
            self.advance();
            std::thread::sleep(LOOK);
        }
        let finished = |notice: &Notice| matches!(notice, Notice::Finished { command: of, .. } if of == command);
        match self.notices.iter().rposition(finished).map(|index| self.notices.remove(index)) {
            Some(Notice::Finished { outcome, .. }) => outcome.map(Some).map_err(SessionError::Failed),
            _ => Ok(None),
        }
    }

    /// Waits until nothing is under way but what is paused; `on_notice` sees what happens
    /// meanwhile. For scripts and the command line: the terminal polls.
    ///
    /// # Errors
    /// When a computation or a run failed.
    pub fn wait(&mut self, mut on_notice: impl FnMut(&Notice)) -> Result<String, SessionError> {
        loop {
            self.check_interrupt()?;
            let idle = self.is_idle();
            for notice in self.poll() {
                on_notice(&notice);
                if let Some(reason) = self.failure_in(&notice) {
                    return Err(SessionError::Failed(reason));
                }
            }
            if idle {
                break;
            }
            std::thread::sleep(LOOK);
        }
        match self.run().and_then(|run| run.failure()) {
            Some(reason) => Err(SessionError::Failed(reason.to_owned())),
            None => Ok(self.under_way()),
        }
    }

    /// Why something that the session does has failed.
    fn failure_in(&self, notice: &Notice) -> Option<String> {
        match notice {
            Notice::Finished { outcome, .. } => outcome.as_ref().err().cloned(),
            Notice::Run { run, event: crate::run::Event::Failed { reason, .. } } => {
                self.run_numbered(*run).filter(|run| run.was_trained_here()).map(|_| reason.clone())
            }
            _ => None,
        }
    }

    /// What is under way, in words.
    pub(super) fn under_way(&self) -> String {
        let runs = self.runs.iter().filter(|run| run.is_working() || run.is_queued()).count();
        match (runs, self.jobs.len()) {
            (0, 0) => "nothing is under way".to_owned(),
            (runs, jobs) => format!("runs under way: {runs}; computations: {jobs}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::command::Seed;

    #[test]
    fn so_many_computations_are_begun_and_the_others_follow_or_are_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::new(crate::task::load("task1").unwrap(), folder.path().to_owned());
        let gate = session.gate.clone();
        let held = gate.lock().unwrap();
        let command = |seed| Command::from(Seed(seed));
        for seed in 0..AT_A_TIME as u64 + 3 {
            session.begin_job(command(seed), |_| Ok(()), |_, result| result.map(|()| "computed".to_owned()));
        }
        let begun = |session: &Session| session.jobs.iter().filter(|pending| pending.job.is_begun()).count();
        assert_eq!((begun(&session), session.jobs.len()), (AT_A_TIME, AT_A_TIME + 3));
        let last = command(AT_A_TIME as u64 + 2);
        session.cancel(&last);
        assert_eq!(begun(&session), AT_A_TIME + 1, "it ends before its turn");
        drop(held);
        assert_eq!(session.wait_for(&last).unwrap_err().to_string(), "the computation was cancelled");
        assert_eq!(session.wait_for(&command(AT_A_TIME as u64 + 1)).unwrap().as_deref(), Some("computed"));
    }
}
