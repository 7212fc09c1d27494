//! Control of runs that other processes train, and trainings that outlive their terminal.

use std::collections::BTreeSet;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::interrupt;
use super::output::{self, Outcome};
use mge_guidance::EpsilonSchedule;
use mge_run::{Event, Request, RunDirectory, RunState};
use mge_trainer::{RunConfig, warnings};

/// Polling interval of the log.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Time after which is said what is being waited for.
const PATIENCE: Duration = Duration::from_secs(2);

pub fn pause(run: &Path) -> Outcome {
    if state(run)? == RunState::Paused {
        return Ok(output::line("already paused")?);
    }
    ask(run, &Request::Pause, |event| matches!(event, Event::Paused { .. }))
}

pub fn stop(run: &Path) -> Outcome {
    ask(run, &Request::Stop, |event| matches!(event, Event::Stopped { .. }))
}

pub fn epsilon(run: &Path, schedule: &EpsilonSchedule) -> Outcome {
    let directory = RunDirectory::open(run)?;
    directory.refuse_model()?;
    let config = RunConfig::of(&directory)?;
    let method = config.method;
    let has_clusters = method.learns() && directory.prior_path().exists();
    if !method.is_adaptive() && !has_clusters {
        let remedy = match method.uses("epsilon") {
            true => "fork it with another epsilon".to_owned(),
            false => format!("its method is `{method}`"),
        };
        return Err(format!("{} has no action clusters, so epsilon has no effect: {remedy}", run.display()).into());
    }
    output::warnings(warnings([(&RunConfig { epsilon: schedule.clone(), ..config }, &BTreeSet::new())]));
    let request = Request::Epsilon { schedule: schedule.to_string() };
    ask(run, &request, |event| matches!(event, Event::ScheduleChanged { .. }))
}

/// Resumes a run that another process has paused; false if it is not paused.
pub fn resume(run: &Path) -> Result<bool, Box<dyn std::error::Error>> {
    if !is_paused(run)? {
        return Ok(false);
    }
    ask(run, &Request::Resume, |event| matches!(event, Event::Resumed { .. })).map(|()| true)
}

/// Whether another process has paused a run.
pub fn is_paused(run: &Path) -> Result<bool, Box<dyn std::error::Error>> {
    Ok(state(run)? == RunState::Paused)
}

fn state(run: &Path) -> Result<RunState, Box<dyn std::error::Error>> {
    Ok(RunDirectory::open(run)?.status()?.state)
}

/// Sends a request to the process that trains a run and waits until its effect is in the log.
fn ask(run: &Path, request: &Request, is_effect: fn(&Event) -> bool) -> Outcome {
    let directory = RunDirectory::open(run)?;
    directory.refuse_model()?;
    let mut log = directory.events();
    // Skips earlier events.
    while log.poll()?.more {}
    directory.request(request)?;
    let mut since = Some(Instant::now());
    loop {
        // Checked before reading, so that events written before the end are not missed.
        let is_over = !directory.is_locked()?;
        let news = log.poll()?;
        for logged in news.events {
            if is_effect(&logged.event) {
                return Ok(output::line(logged.event)?);
            }
        }
        if is_over && !news.more {
            return Err(format!("{} ended before the request took effect", run.display()).into());
        }
        if since.take_if(|since| since.elapsed() > PATIENCE).is_some() {
            output::message(format_args!(
                "waiting for {}: for the end of its episode, or before the first for its clusters and practice",
                run.display()
            ));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Makes the process outlive the terminal it was started from.
///
/// # Errors
/// When the system refuses.
pub fn detach() -> io::Result<()> {
    // Fails if the process leads its group, as when started by a shell or the workbench; it then keeps its session.
    let _ = rustix::process::setsid();
    interrupt::ignore_hang_up();
    // Replaces the default action of SIGHUP, which a closing terminal sends, by a flag that nothing reads.
    signal_hook::flag::register(signal_hook::consts::SIGHUP, std::sync::Arc::default())?;
    Ok(())
}

/// Starts a process that continues runs after this one has ended.
///
/// # Errors
/// When a folder does not exist, or the process cannot be started.
pub fn continue_in_background(runs: &[PathBuf]) -> io::Result<()> {
    let runs: Vec<PathBuf> = runs.iter().map(std::fs::canonicalize).collect::<Result<_, _>>()?;
    let mut command = Command::new(std::env::current_exe()?);
    command.args(["resume", "--detached", "--quiet"]).args(&runs);
    // In its own group, so that a terminal closing before `setsid` does not send it SIGHUP.
    command.process_group(0);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    for run in &runs {
        output::message(format_args!("{} continues in the background", run.display()));
    }
    output::message("`mge` finds them again; `mge pause`, `mge stop` and `mge epsilon` steer them");
    Ok(())
}
