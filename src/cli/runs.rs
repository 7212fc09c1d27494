//! Commands on runs: `train`, `resume`, `fork`, `evaluate`, `export`, `figures`, `script`, and the
//! workbench itself.

use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode, Stdio};
use std::sync::Arc;

use clap::CommandFactory as _;
use serde_json::json;

use super::arguments::{Arguments, Delete, Evaluate, Export, Figures, Fork, Rename, Resume, Script, Train, Workbench};
use super::interrupt::Interrupt;
use super::output::{self, Outcome};
use super::session::{RUNS, Viewer, follow, perform, use_folder};
use crate::tui;
use mge_agent::Ddpg;
use mge_base::paths::expanded;
use mge_base::spelling::did_you_mean;
use mge_base::text::counted;
use mge_figures::DEFAULT_DPI;
use mge_results::{Composition, is_listed_run};
use mge_run::{RunDirectory, RunError, RunHistory};
use mge_task as task;
use mge_trainer::set_the_same;
use mge_workbench::{self as workbench, FigureKind, Output, RunView, Session, SessionError, command};

/// Opens the workbench. If a signal ends it, the exit status is that of the signal.
pub fn workbench(arguments: &Workbench) -> Result<ExitCode, Box<dyn std::error::Error>> {
    let run = arguments.run.as_ref().or(Some(&arguments.runs).filter(|folder| is_listed_run(folder)));
    let session = match run {
        Some(run) if !run.exists() => return Err(no_such(run).into()),
        Some(run) => Session::on_run(run)?,
        None => {
            let mut session =
                Session::on_task(arguments.task.as_deref().unwrap_or(workbench::FIRST_TASK), RUNS.into())?;
            use_folder(&mut session, &arguments.runs)?;
            session
        }
    };
    let first_start = !arguments.runs.exists();
    let options = tui::Options {
        greet: first_start,
        fresh: arguments.fresh,
        keeps_task: run.is_some() || arguments.task.is_some(),
        no_mouse: arguments.no_mouse,
        notify: arguments.notify,
    };
    Ok(match tui::run(session, &options)? {
        tui::ExitReason::Quit => ExitCode::SUCCESS,
        tui::ExitReason::Background(runs) => {
            continue_in_background(&runs)?;
            ExitCode::SUCCESS
        }
        tui::ExitReason::Signal(number) => ExitCode::from(128u8.saturating_add(number.clamp(0, 127) as u8)),
    })
}

/// Starts a process that continues runs after this one and its terminal have ended.
fn continue_in_background(runs: &[PathBuf]) -> Outcome {
    let runs: Vec<PathBuf> = runs.iter().map(std::fs::canonicalize).collect::<Result<_, _>>()?;
    let mut command = process::Command::new("nohup");
    command.arg(std::env::current_exe()?).args(["resume", "--quiet"]).args(&runs);
    // In its own group, so that keys in the terminal do not send it signals.
    command.process_group(0);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    for run in &runs {
        output::message(format_args!("{} continues in the background", run.display()));
    }
    output::message("`mge` finds them again, and can pause and stop them");
    Ok(())
}

/// Success rate of a solved task.
const SOLVED: &str = "0.8";

/// Whether a word is neither an option, a command, nor the folder of a run.
pub fn is_unknown(word: &Path) -> bool {
    let text = word.to_string_lossy();
    !text.starts_with('-') && !word.exists() && Arguments::command().find_subcommand(&*text).is_none()
}

/// Says that a word is neither a command nor a run.
pub fn no_such(path: &Path) -> String {
    let word = path.display().to_string();
    let program = Arguments::command();
    let commands = program.get_subcommands().map(clap::Command::get_name);
    let hint = RunDirectory::named_so(path, &usual_folder()).unwrap_or_else(|| did_you_mean(commands, &word));
    format!("`{word}` is neither a command nor the folder of a run{hint}")
}

/// The folder of runs where none is given.
pub fn usual_folder() -> PathBuf {
    expanded(std::env::var_os("MGE_RUNS").filter(|runs| !runs.is_empty()).unwrap_or_else(|| RUNS.into()))
}

pub fn train(arguments: &Train) -> Outcome {
    let interrupt = Interrupt::listen()?;
    // A path, also if it is a name alone.
    let runs = if arguments.out.is_some() { PathBuf::new() } else { usual_folder() };
    let mut session = Session::on_task(&arguments.task, runs)?;
    let Train { method, seed, episodes, epsilon, model, .. } = arguments;
    let options = [
        ("method", "--method", method.map(|value| value.to_string())),
        ("seed", "--seed", seed.map(|value| value.to_string())),
        ("episodes", "--episodes", episodes.map(|value| value.to_string())),
        ("epsilon", "--epsilon", epsilon.as_ref().map(ToString::to_string)),
        ("prior", "--model", model.clone().map(String::from)),
        ("stop.success", "--until-solved", arguments.until_solved.then(|| SOLVED.to_owned())),
    ];
    let own = definitions(&arguments.settings, "--set", options)?.into_iter();
    session.set_all(arguments.config.as_deref(), own.map(|(key, value)| (key, value.into())).collect())?;
    session.apply(command::Train { folder: arguments.out.clone(), ..Default::default() })?;
    follow(&mut session, 0, arguments.quiet, interrupt)
}

pub fn resume(arguments: &Resume) -> Outcome {
    let interrupt = Interrupt::listen()?;
    // clap requires at least one.
    let mut session = Session::on_run(&arguments.runs[0])?;
    if let Some(episodes) = arguments.episodes {
        session.apply(command::Episodes(episodes))?;
    }
    for run in &arguments.runs {
        if let Some(episodes) = arguments.episodes
            && let before = RunView::open(run)?.config().episodes
            && episodes < before
        {
            let run = run.display();
            return Err(format!("--episodes {episodes}: {run} has {before} episodes, which cannot become fewer").into());
        }
        match session.apply(command::Continue { folder: Some(run.clone()), until: None }) {
            // It is left as it is, and its result is printed.
            Err(SessionError::Finished { run: name, episodes, by }) => {
                // That its log is damaged is told at the end.
                if !arguments.quiet && RunHistory::read(&RunDirectory::at(run)).is_ok() {
                    let done = format!("{name} is finished after {episodes} episodes{by}");
                    output::message(format_args!("{done}: --episodes sets more"));
                }
                session.apply(command::Open(run.clone()))?;
            }
            outcome => _ = outcome?,
        }
    }
    follow(&mut session, 0, arguments.quiet, interrupt)
}

pub fn fork(arguments: &Fork) -> Outcome {
    let interrupt = Interrupt::listen()?;
    let mut session = Session::on_run(&arguments.run)?;
    if let Some(task) = &arguments.task {
        session.apply(command::Task(task.clone()))?;
    }
    let task = arguments.task.as_ref().map(|_| "edited".to_owned());
    let changes = definitions(&arguments.settings, "--set", [("task", "--task", task)])?;
    let folder = arguments.out.clone();
    // A name alone is that of a folder here, not beside the run.
    if let Some(parent) = folder.as_deref().and_then(Path::parent) {
        session.apply(command::Out(parent.to_owned()))?;
    }
    let fork = command::Fork { episode: arguments.at, changes, folder, until: None };
    perform(&mut session, fork, "repeating episodes", arguments.quiet)?;
    // Run 0 of the session is the source of the fork.
    follow(&mut session, 1, arguments.quiet, interrupt)
}

pub fn evaluate(arguments: &Evaluate) -> Outcome {
    let run = RunView::open(&arguments.run)?;
    let task = arguments.task.as_deref().map(task::load).transpose()?.map(Arc::new);
    let player = run.saved.clone().at(arguments.checkpoint).player(task)?;
    let (mut goals, mut returns) = (0, 0.0);
    for episode in 0..arguments.episodes {
        let trace = player.episode(arguments.seed + u64::from(episode));
        let actions: Vec<_> = trace.steps.iter().map(|step| step.action).collect();
        goals += u32::from(trace.reached_goal());
        returns += f64::from(trace.total_reward());
        let mut line = json!({
            "episode": episode + 1,
            "checkpoint": player.trained,
            "goal": trace.reached_goal(),
            "subgoals": trace.steps.iter().map(|step| step.subgoals.len()).sum::<usize>(),
            "return": trace.total_reward(),
            "steps": trace.steps.len(),
            "actions": actions,
        });
        if arguments.observations {
            line["observations"] = json!(player.observations(&trace));
        }
        output::line(line)?;
    }
    let mean = returns / f64::from(arguments.episodes);
    output::message(format_args!(
        "{goals} of {} reached the goal, mean return {mean:.2}",
        counted(arguments.episodes as usize, "episode")
    ));
    Ok(())
}

pub fn export_actor(arguments: &Export) -> Outcome {
    let to = arguments.force.target(&arguments.out);
    output::check_target(&to, &Ddpg::ACTOR_FORMAT)?;
    let (_, agent) = RunView::open(&arguments.run)?.saved.at(arguments.checkpoint).agent()?;
    to.write(&agent.export_actor(), &Ddpg::ACTOR_FORMAT).map_err(RunError::io("write", &to.path))?;
    Ok(output::line(arguments.out.display())?)
}

pub fn figures(arguments: &Figures) -> Outcome {
    // clap requires at least one.
    let mut session = Session::on_run(&arguments.runs[0])?;
    let extension = if arguments.svg { "svg" } else { "png" };
    let dpi = Some(arguments.print.dpi).filter(|dpi| extension == "png" && *dpi != DEFAULT_DPI);
    let folder = arguments.out.clone().unwrap_or_else(|| arguments.runs[0].join("figures"));
    let options = arguments.options.iter().map(|option| split_definition(option, "--set"));
    let options = options.collect::<Result<Vec<_>, String>>()?;
    let composition = Composition { runs: arguments.runs.clone(), ..Composition::default() };
    let composition = composition.with_options(options).map_err(|reason| format!("--set {reason}"))?;
    let path = folder.join(format!("learning.{extension}"));
    let figure = command::Figure::with_defaults(FigureKind::Learning, arguments.force.target(&path));
    perform(&mut session, command::Figure { dpi, composition, ..figure }, "drawing", true)?;
    Ok(output::line(path.display())?)
}

pub fn delete(arguments: &Delete) -> Outcome {
    let mut session = Session::on_task(workbench::FIRST_TASK, RUNS.into())?;
    for run in &arguments.runs {
        if arguments.restore {
            output::line(session.apply(command::Restore(Some(run.clone())))?)?;
            continue;
        }
        session.apply(command::Delete(vec![run.clone()]))?;
        let run = run.display();
        output::line(format_args!("moved {run} to the trash: `mge delete --restore {run}` brings it back"))?;
    }
    Ok(())
}

pub fn rename(arguments: &Rename) -> Outcome {
    let mut session = Session::on_task(workbench::FIRST_TASK, RUNS.into())?;
    let rename = command::Rename { folder: arguments.run.clone(), name: arguments.name.clone() };
    Ok(output::line(session.apply(rename)?)?)
}

pub fn script(arguments: &Script) -> Outcome {
    let interrupt = Interrupt::listen()?;
    let variables = definitions(&arguments.variables, "--define", [])?;
    let script = workbench::Script::load(&arguments.file, &variables)?;
    let mut session = Session::new(task::load(workbench::FIRST_TASK)?, RUNS.into());
    use_folder(&mut session, &arguments.runs)?;
    session.interrupt = interrupt.stop.clone();
    let mut viewer = Viewer::new(0, arguments.quiet);
    let outcome = script.run(&mut session, |output| match output {
        Output::Warning { place, warning } => viewer.warn(Some(&place), warning),
        Output::Report(command, report) => viewer.progress.say(&format!("> {command}\n  {report}")),
        Output::Notice(notice) => viewer.show(notice),
    });
    let mut outcome = outcome.map_err(|error| SessionError::Failed(error.to_string()));
    if outcome.is_ok() && !session.quit {
        // What a script has started is finished, as by a last line `wait`.
        outcome = session.wait(|notice| viewer.show(notice)).map(drop);
    }
    drop(viewer);
    // On an error, dropping the session ends its trainings with a checkpoint.
    drop(session);
    interrupt.result(outcome, |_| true)
}

/// What options and the definitions `NAME=VALUE` of a repeatable option define. A name may be defined once: `options` are
/// names with the options that define them too, and their values. The name of a group, such as `guidance.clusters`,
/// defines all in it.
///
/// # Errors
/// What is not a definition, or the two options that contradict each other.
pub fn definitions<const N: usize>(
    texts: &[String],
    flag: &str,
    options: [(&str, &str, Option<String>); N],
) -> Result<Vec<(String, String)>, String> {
    let given = options.into_iter().filter_map(|(name, option, value)| Some((name, option, value?)));
    // With what the user wrote.
    let mut known: Vec<(String, String, String)> =
        given.map(|(name, option, value)| (name.to_owned(), value, option.to_owned())).collect();
    for text in texts {
        let (name, value) = split_definition(text, flag)?;
        let wrote = format!("{flag} {text}");
        if let Some((.., other)) = known.iter().find(|(other, ..)| set_the_same(name, other)) {
            return Err(format!("{other} and {wrote} set the same: give only one of them"));
        }
        known.push((name.to_owned(), value.to_owned(), wrote));
    }
    Ok(known.into_iter().map(|(name, value, _)| (name, value)).collect())
}

fn split_definition<'a>(text: &'a str, flag: &str) -> Result<(&'a str, &'a str), String> {
    text.split_once('=').ok_or_else(|| format!("{flag} {text}: write NAME=VALUE"))
}
