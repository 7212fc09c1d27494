//! `mge simulate`, `mge play` and `mge env`: physics without tasks, replay of actions, and tasks as
//! environments for other programs.

use std::fs::File;
use std::io::{self, BufReader};
use std::path::Path;
use std::sync::Arc;

use super::arguments::Play;
use super::output::{self, Outcome};
use mge_base::text::counted;
use mge_base::{bounded, json};
use mge_env::protocol;
use mge_env::protocol::Catalogue;
use mge_env::{Action, Environment};
use mge_physics::ToolSplit;
use mge_task as task;

pub fn simulate() -> Outcome {
    Ok(protocol::simulate(io::stdin().lock(), output::stream())?)
}

pub fn play(arguments: &Play) -> Outcome {
    match (&arguments.levels, &arguments.task, &arguments.actions) {
        (Some(levels), _, _) => play_episodes(levels, arguments.tools.as_deref()),
        (None, Some(task), Some(actions)) => play_actions(task, actions),
        _ => Err("give a TASK with --actions FILE, or --levels FILE".into()),
    }
}

pub fn serve(task: &str, tools: Option<ToolSplit>, seed: u64) -> Outcome {
    let env = Environment::new(Arc::new(task::load(task)?)).with_tools(tools);
    Ok(protocol::serve(env, seed, io::stdin().lock(), output::stream())?)
}

fn play_episodes(levels: &Path, tools: Option<&Path>) -> Outcome {
    let (levels, name) = open(levels)?;
    let catalogue = match tools.map(open).transpose()? {
        Some((tools, name)) => Catalogue::read(tools, &name)?,
        None => Catalogue::of_create(),
    };
    Ok(protocol::play_episodes(levels, &name, &catalogue, io::stdin().lock(), output::stream())?)
}

/// Opens a file, and returns it with its name for errors.
fn open(path: &Path) -> Result<(BufReader<File>, String), String> {
    let name = path.display().to_string();
    let file = bounded::open(path).map_err(|error| format!("{name}: {error}"))?;
    Ok((BufReader::new(file), name))
}

fn play_actions(task: &str, actions: &Path) -> Outcome {
    let task = Arc::new(task::load(task)?);
    let name = actions.display().to_string();
    let text = bounded::read(actions, bounded::TEXT).map_err(|error| format!("{name}: {error}"))?;
    let actions: Vec<Action> = json::parse(&text, &name)?;
    let played = protocol::play_actions(task, &actions, output::stream())?;
    if played < actions.len() {
        let left = counted(actions.len() - played, "action");
        output::message(format_args!("the episode ended after {}: {left} not played", counted(played, "action")));
    }
    Ok(())
}
