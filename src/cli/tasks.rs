//! `mge tasks`: list, check and propose subgoals; `mge clusters`: the action prior of a task.

use serde_json::json;

use super::arguments::{Clusters, Tasks, TasksCommand};
use super::output::{self, Outcome};
use super::session::{guided, perform};
use mge_base::atomic::Target;
use mge_base::text::counted;
use mge_task::{self as task, Task, TaskError};
use mge_trainer::PriorSource;
use mge_workbench::{SessionError, command};

pub fn run(arguments: Tasks) -> Outcome {
    match arguments.command {
        None => list(arguments.format.json),
        Some(TasksCommand::Check { files }) => check(&files),
        Some(TasksCommand::Propose { task, subgoals, model, seed, out, force }) => {
            propose(&task, subgoals, &model, seed, out.map(|path| force.target(&path)).as_ref())
        }
    }
}

/// The shipped tasks, then CREATE's levels, each with the path of its file; those of levels have their random shifts.
fn listed() -> Result<Vec<(Task, String)>, TaskError> {
    let shipped = task::shipped().into_iter().map(|task| {
        let path = format!("tasks/{}.json", task.name);
        Ok((task, path))
    });
    let levels = task::level_names().map(|level| {
        let name = format!("create/{level}");
        let task = task::load(&name)?;
        Ok((Task { name, ..task }, format!("tasks/create/{}-random.json", level.to_lowercase())))
    });
    shipped.chain(levels).collect()
}

fn list(as_json: bool) -> Outcome {
    let tasks = listed()?;
    if as_json {
        let rows: Vec<_> = tasks
            .iter()
            .map(|(task, path)| {
                json!({
                    "name": task.name,
                    "path": path,
                    "tools": task.tool_set(),
                    "placeable": task.placeable.kind,
                    "subgoals": task.subgoals.len(),
                    "description": task.description,
                })
            })
            .collect();
        return output::json(&rows);
    }
    for (task, _) in &tasks {
        let tools = task.tool_set().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let (placeable, subgoals) = (task.placeable.kind, counted(task.subgoals.len(), "subgoal"));
        let about = format!("{tools}; places a {placeable}; {subgoals}");
        output::lines(format_args!("{}  {about}\n       {}\n", task.name, task.description))?;
    }
    Ok(output::line("by name also tune1 to tune6, for choosing settings, and create/LEVEL-random, with random shifts")?)
}

fn check(files: &[String]) -> Outcome {
    let mut wrong = 0;
    for file in files {
        match task::load(file) {
            Ok(task) => {
                let (subgoals, tools) = (counted(task.subgoals.len(), "subgoal"), counted(task.tools.len(), "tool"));
                output::line(format_args!("{file}: ok ({subgoals}, {tools})"))?;
            }
            Err(error) => {
                wrong += 1;
                output::message(error);
            }
        }
    }
    if wrong > 0 { Err(format!("{wrong} of {} tasks cannot be used", files.len()).into()) } else { Ok(()) }
}

fn propose(name: &str, subgoals: usize, model: &PriorSource, seed: u64, to: Option<&Target>) -> Outcome {
    to.into_iter().try_for_each(|to| output::check_target(to, &task::FORMAT))?;
    let mut session = guided(name, Some(model.clone()), seed)?;
    let report = perform(&mut session, command::Propose(Some(subgoals)), "candidates", false)?;
    output::message(report);
    let task = session.with_proposals();
    match to {
        Some(to) => task::save_as(&task, to)?,
        None => output::lines(task::to_json(&task))?,
    }
    Ok(())
}

/// The action prior of a task.
pub fn clusters(arguments: &Clusters) -> Outcome {
    let to = arguments.out.as_deref().map(|path| arguments.force.target(path));
    let mut session = guided(&arguments.task, arguments.model.clone(), arguments.seed)?;
    let is_saved = to.is_some();
    perform(&mut session, command::Clusters(to), "clusters", false)?;
    let prior = session.prior().ok_or(SessionError::NoClusters)?;
    if is_saved { Ok(()) } else { Ok(output::lines(prior.to_json())?) }
}
