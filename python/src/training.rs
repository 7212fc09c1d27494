//! Trainings: a session trains a run on its own thread, while the caller's thread waits and tells Python the news.

use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arguments;
use super::error::exception;
use super::pool::abandonable;
use super::task::Task;
use mge_workbench::{Notice, RunView, Session, SessionError, command};

/// Time between two looks at the run and at Python's signals.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Trains an agent in the folder `out`, or in a new one in `runs`, and returns the folder. `tell` is called with the kind
/// and the text of each piece of news: `event` (JSON), `warning` or `phase`.
#[pyfunction]
pub fn train(
    py: Python<'_>,
    task: Task,
    out: Option<PathBuf>,
    config: Option<PathBuf>,
    settings: &Bound<'_, PyDict>,
    tell: &Bound<'_, PyAny>,
) -> PyResult<PathBuf> {
    let mut settings = arguments::settings(settings)?;
    // As on the command line; the settings of a model that is trained are `model.epochs` and so on.
    settings.iter_mut().filter(|(path, _)| path == "model").for_each(|(path, _)| "prior".clone_into(path));
    let mut session = Session::new(mge_task::Task::clone(&task.0), "runs".into());
    session.set_all(config.as_deref(), settings).map_err(exception)?;
    session.apply(command::Train { folder: out, ..Default::default() }).map_err(exception)?;
    follow(py, session, tell)
}

/// Continues the run in a folder, up to this number of episodes if it has fewer. A finished one is left as it is.
#[pyfunction]
pub fn resume(py: Python<'_>, run: PathBuf, episodes: Option<u32>, tell: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let folder = run.clone();
    let mut session = abandonable(py, move || Session::on_run(&folder))?.map_err(exception)?;
    if let Some(episodes) = episodes {
        let before = session.run().map_or(0, |run| run.config().episodes);
        if episodes < before {
            let message = format!("`episodes` is {episodes}: the run has {before}, which cannot become fewer");
            return Err(PyValueError::new_err(message));
        }
        session.apply(command::Episodes(episodes)).map_err(exception)?;
    }
    match session.apply(command::Continue { folder: Some(run.clone()), until: None }) {
        Err(SessionError::Finished { .. }) => Ok(run),
        outcome => outcome.map_err(exception).and_then(|_| follow(py, session, tell)),
    }
}

/// Waits for the training of a session, and returns its folder. A signal, or an exception of `tell`, ends the training
/// with a checkpoint.
fn follow(py: Python<'_>, mut session: Session, tell: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let mut phase = None;
    let told = loop {
        // Checked before polling, so that the final events are not missed. A paused run is waited for, too.
        let is_over = session.is_idle() && !session.runs().iter().any(RunView::is_active);
        let told = py.check_signals().and_then(|()| tell_news(&mut session, &mut phase, tell));
        if told.is_err() || is_over {
            break told;
        }
        py.detach(|| sleep(POLL_INTERVAL));
    };
    let of_run = |run: &RunView| (run.directory().path().to_owned(), run.failure().map(str::to_owned));
    let (folder, failure) = session.run().map(of_run).unwrap_or_default();
    py.detach(|| drop(session));
    match (told, failure) {
        (Err(raised), _) => Err(raised),
        (Ok(()), Some(reason)) => Err(PyRuntimeError::new_err(format!("{}: {reason}", folder.display()))),
        (Ok(()), None) => Ok(folder),
    }
}

fn tell_news(session: &mut Session, phase: &mut Option<String>, tell: &Bound<'_, PyAny>) -> PyResult<()> {
    for notice in session.poll() {
        match notice {
            Notice::Run { event, .. } => tell.call1(("event", serde_json::json!(event).to_string()))?,
            Notice::Warning(warning) => tell.call1(("warning", warning))?,
            Notice::Finished { outcome: Err(reason), .. } => return Err(PyRuntimeError::new_err(reason)),
            _ => continue,
        };
    }
    let now = session.run().and_then(RunView::phase).and_then(|phase| phase.preparation());
    if now != *phase {
        phase.clone_from(&now);
        now.map(|now| tell.call1(("phase", now))).transpose()?;
    }
    Ok(())
}
