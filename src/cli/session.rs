//! The session behind the commands of the command line: applies commands, shows their progress and the notices on stderr.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use serde_json::json;

use super::interrupt::Interrupt;
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_run::{Event, RunState};
use mge_trainer::{Method, PriorSource};
use mge_workbench::{Command, Notice, RunView, Session, SessionError, command};

/// The usual folder for runs.
pub const RUNS: &str = "runs";
/// Time between two polls of a session.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Makes a folder for runs that is not the usual one that of a session, also in its recording.
pub fn use_folder(session: &mut Session, runs: &Path) -> Result<(), SessionError> {
    if runs != Path::new(RUNS) {
        session.apply(command::Out(runs.to_owned()))?;
    }
    Ok(())
}

/// A session on a task with the clusters of DDPG-MGE.
///
/// # Errors
/// When the task cannot be loaded.
pub fn guided(task: &str, model: Option<PriorSource>, seed: u64) -> Result<Session, SessionError> {
    let mut session = Session::on_task(task, RUNS.into())?;
    session.apply(command::Method(Method::DdpgMge))?;
    session.apply(command::Seed(seed))?;
    model.map(|model| session.apply(command::Model(model))).transpose()?;
    Ok(session)
}

/// Applies a command, waits for its job, of which it shows the progress as `what`, and returns the report.
///
/// # Errors
/// When the command is refused or its job fails, also because a signal has cancelled it.
pub fn perform(session: &mut Session, command: impl Into<Command>, what: &str, quiet: bool) -> Outcome<String> {
    let (command, interrupt) = (command.into(), Interrupt::listen()?);
    let report = session.apply(command.clone())?;
    let mut progress = Progress::new(1, quiet);
    loop {
        let is_idle = session.is_idle();
        for notice in session.poll() {
            match notice {
                Notice::Progress { command: of, progress: now } if of == command => {
                    progress.set(now.done as u64, now.total as u64, what);
                }
                Notice::Warning(text) => progress.warn(&text),
                Notice::Finished { command: of, outcome } if of == command => {
                    return interrupt.result(outcome.map_err(SessionError::Failed), |_| true);
                }
                _ => {}
            }
        }
        if is_idle {
            return Ok(report);
        }
        if interrupt.stop.is_requested() {
            session.cancel(&command);
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Shows the progress of the session's runs from number `first` on, on stderr, and their results on stdout.
pub fn follow(session: &mut Session, first: usize, quiet: bool, interrupt: &Interrupt) -> Outcome {
    let followed = |run: &&RunView| run.number >= first;
    let episodes = session.runs().iter().filter(followed).map(|run| u64::from(run.config().episodes)).sum();
    let mut viewer = Viewer::new(episodes, quiet);
    let mut stopping = false;
    loop {
        // Checked before polling, so that the final events are not missed. A run that another process has
        // paused is waited for, too.
        let idle = session.is_idle() && !session.runs().iter().any(RunView::is_active);
        // A failure, and the stop by a signal, are the outcome of their run.
        let is_shown = |notice: &&Notice| match notice {
            Notice::Run { event, .. } => match event {
                Event::Failed { .. } => false,
                Event::Stopped { .. } => !stopping,
                _ => true,
            },
            _ => true,
        };
        session.poll().iter().filter(is_shown).for_each(|notice| viewer.show(notice));
        if idle {
            break;
        }
        session.runs().iter().filter(followed).filter_map(RunView::phase).for_each(|now| viewer.progress.show(&now));
        if interrupt.stop.is_requested() && !stopping {
            stopping = true;
            let runs: Vec<usize> = session.runs().iter().filter(followed).map(|run| run.number).collect();
            for run in runs {
                // Fails if the run has just ended.
                let _ = session.apply(command::Watch(run)).and_then(|_| session.apply(command::Stop));
            }
        }
        std::thread::sleep(POLL_INTERVAL);
    }
    drop(viewer);
    let mut outcome = Ok(());
    for run in session.runs().iter().filter(followed) {
        // All problems are shown, the last one as the error of the program.
        if let Err(problem) = result(run, stopping, interrupt)
            && let Err(earlier) = std::mem::replace(&mut outcome, Err(problem))
        {
            output::message(earlier);
        }
    }
    outcome
}

/// Prints the result of a run on stdout.
fn result(run: &RunView, stopping: bool, interrupt: &Interrupt) -> Outcome {
    let episodes = run.config().episodes;
    if let Some(failure) = run.failure() {
        return Err(format!("{}: {failure}", run.directory().path().display()).into());
    }
    if stopping && run.state() != RunState::Finished {
        let folder = run.directory().path().display().to_string();
        let resume = shell_words::join(["mge", "resume", &folder]);
        let done = run.episodes();
        let message = format!("stopped after {done} of {episodes} episodes: continue with `{resume}`");
        return Err(interrupt.ended(message).into());
    }
    let last = run.history().records.last();
    let result = json!({
        "run": run.directory().path().display().to_string(),
        "episodes": run.episodes(),
        "charged_actions": last.map(|record| record.charged_actions),
        "rolling_success": last.map(|record| record.rolling_success),
        "latest_evaluation": run.history().evaluations.last().map(|evaluation| evaluation.success),
    });
    Ok(output::line(result)?)
}

/// Shows the notices of a session on stderr.
pub struct Viewer {
    pub progress: Progress,
    /// Number of episodes of each run.
    episodes: BTreeMap<usize, u64>,
    /// The warnings shown.
    warned: BTreeSet<String>,
}

impl Viewer {
    pub fn new(length: u64, quiet: bool) -> Self {
        Self { progress: Progress::new(length, quiet), episodes: BTreeMap::new(), warned: BTreeSet::new() }
    }

    /// Shows a warning once, with the line of a script that it is about.
    pub fn warn(&mut self, place: Option<&str>, text: &str) {
        if self.warned.insert(text.to_owned()) {
            self.progress.warn(&place.map_or_else(|| text.to_owned(), |place| format!("{place}: {text}")));
        }
    }

    pub fn show(&mut self, notice: &Notice) {
        match notice {
            Notice::Progress { command: Command::Clusters(_), progress: stages } => {
                self.progress.set(stages.done as u64, stages.total as u64, "clusters");
            }
            Notice::Run { run, event: Event::EpisodeFinished(record) } => {
                let message = format!("success {:.0} %, return {:.2}", 100.0 * record.rolling_success, record.return_);
                let episodes = self.episodes.get(run).copied().unwrap_or(record.episode);
                self.progress.set(record.episode, episodes, &message);
            }
            Notice::Run {
                event: Event::Evaluated { .. } | Event::Checkpointed { .. } | Event::NeedsChanged { .. },
                ..
            } => {}
            Notice::Progress { .. } | Notice::Changed => {}
            Notice::Warning(text) => self.warn(None, text),
            Notice::Run { run, event } => {
                if let Event::Started { episodes, .. } = event {
                    self.episodes.insert(*run, *episodes);
                }
                self.progress.say(&event.to_string());
            }
            Notice::Finished { outcome: Ok(text) | Err(text), .. } => self.progress.say(text),
        }
    }
}
