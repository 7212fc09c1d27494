//! Runs that other processes train, steered from the shell, and trainings that outlive their terminal.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::{Outcome, output};
use crate::guidance::EpsilonSchedule;
use crate::run::{Event, Request, RunDirectory, RunState};

/// Time between two looks at the log.
const LOOK: Duration = Duration::from_millis(50);

pub fn pause(run: &Path) -> Outcome {
    if state(run)? == RunState::Paused {
        return Ok(output::line("paused already")?);
    }
    ask(run, &Request::Pause, |event| matches!(event, Event::Paused { .. }))
}

pub fn stop(run: &Path) -> Outcome {
    ask(run, &Request::Stop, |event| matches!(event, Event::Stopped { .. }))
}

pub fn epsilon(run: &Path, schedule: &EpsilonSchedule) -> Outcome {
    let request = Request::Epsilon { schedule: schedule.to_string() };
    ask(run, &request, |event| matches!(event, Event::ScheduleChanged { .. }))
}

/// Lets a run go on that another process has paused; false if none has.
pub fn resume(run: &Path) -> Result<bool, Box<dyn std::error::Error>> {
    if state(run)? != RunState::Paused {
        return Ok(false);
    }
    ask(run, &Request::Resume, |event| matches!(event, Event::Resumed { .. })).map(|()| true)
}

fn state(run: &Path) -> Result<RunState, Box<dyn std::error::Error>> {
    Ok(RunDirectory::open(run)?.status()?.state)
}

/// Asks something of the process that trains a run and waits until its log says that it took effect.
fn ask(run: &Path, request: &Request, is_effect: fn(&Event) -> bool) -> Outcome {
    let directory = RunDirectory::open(run)?;
    let mut log = directory.events();
    // What happened before is no effect.
    while log.poll()?.more {}
    directory.request(request)?;
    loop {
        // Asked first, so that what happened before is read afterwards.
        let is_over = !directory.is_locked()?;
        let news = log.poll()?;
        for logged in news.events {
            if is_effect(&logged.event) {
                return Ok(output::line(logged.event)?);
            }
        }
        if is_over && !news.more {
            return Err(format!("{} ended before it could do what was asked", run.display()).into());
        }
        std::thread::sleep(LOOK);
    }
}

/// Makes the process outlive the terminal it was started from.
///
/// # Errors
/// When the system refuses.
pub fn detach() -> io::Result<()> {
    #[cfg(unix)]
    {
        // A process that leads its group already, as one started by a shell or the workbench, keeps its session.
        let _ = rustix::process::setsid();
        // The signal of a terminal that is closed is taken note of, and nothing else.
        signal_hook::flag::register(signal_hook::consts::SIGHUP, std::sync::Arc::default())?;
    }
    Ok(())
}

/// Begins a process that goes on with runs when this one has ended.
///
/// # Errors
/// When a folder is gone, or the system refuses another process.
pub fn continue_in_background(runs: &[PathBuf]) -> io::Result<()> {
    let runs: Vec<PathBuf> = runs.iter().map(std::fs::canonicalize).collect::<Result<_, _>>()?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["resume", "--detached", "--quiet"]).args(&runs);
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;

        // A terminal that is closed just now hangs up its foreground group, before the process can leave it.
        command.process_group(0);
    }
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    for run in &runs {
        output::message(format_args!("{} goes on in the background", run.display()));
    }
    output::message("`mge` finds them again; `mge pause`, `mge stop` and `mge epsilon` steer them");
    Ok(())
}
