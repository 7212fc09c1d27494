//! `mge tasks`: list, check, propose subgoals and audit.

use std::sync::Arc;

use serde_json::json;

use super::arguments::{Tasks, TasksCommand};
use super::output::{self, Outcome};
use super::progress::Progress;
use mge_base::atomic::Target;
use mge_base::markdown;
use mge_base::stop::Stop;
use mge_base::text::counted;
use mge_experiments::{AuditRow, audit};
use mge_guidance::{GuidanceConfig, NO_SUBGOALS, TRIALS, choose_subgoals};
use mge_task::{self as task, Task, TaskError};
use mge_trainer::batch::{Batch, default_threads};
use mge_trainer::{PriorSource, required_model};

pub fn run(arguments: Tasks) -> Outcome {
    match arguments.command {
        None => list(arguments.json),
        Some(TasksCommand::Check { files }) => check(&files),
        Some(TasksCommand::Propose { task, subgoals, model, seed, out, force }) => {
            propose(&task, subgoals, &model, seed, out.map(|path| force.target(&path)).as_ref())
        }
        Some(TasksCommand::Audit { tasks, episodes, seeds, json }) => run_audit(&tasks, episodes, seeds, json),
    }
}

/// The shipped tasks, then CREATE's levels, each with the path of its file.
fn listed() -> Result<Vec<(Task, String)>, TaskError> {
    let shipped = task::shipped().into_iter().map(|task| {
        let path = format!("tasks/{}.json", task.name);
        Ok((task, path))
    });
    let levels = task::level_names().map(|name| {
        // CREATE's files have the names of their levels, except this one.
        let file = if name == "GoalTest" { "test".to_owned() } else { name.to_lowercase() };
        let name = format!("create/{name}");
        let task = task::load(&name)?;
        Ok((Task { name, ..task }, format!("tasks/create/level_{file}.json")))
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
        return Ok(output::line(serde_json::to_string_pretty(&rows)?)?);
    }
    for (task, _) in &tasks {
        let tools = task.tool_set().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let (placeable, subgoals) = (task.placeable.kind, counted(task.subgoals.len(), "subgoal"));
        let about = format!("{tools}; places a {placeable}; {subgoals}");
        output::lines(format_args!("{}  {about}\n       {}\n", task.name, task.description))?;
    }
    Ok(())
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
    let mut task = task::load(name)?;
    let model = required_model(model, &task)?;
    let mut progress = Progress::new(TRIALS as u64, false);
    let config = GuidanceConfig::default();
    let chosen = choose_subgoals(&task, &*model, subgoals, &config, seed, &Stop::default(), |tried| {
        progress.set(tried as u64, TRIALS as u64, "candidates");
    })?;
    drop(progress);
    if chosen.is_failure() {
        return Err(NO_SUBGOALS.into());
    }
    output::message(format_args!(
        "subgoals: {}, the best of {} candidates: each stage was reached by {:.0} % of the guided rollouts or more",
        chosen.subgoals.len(),
        chosen.candidates,
        100.0 * chosen.least_reached,
    ));
    task.subgoals = chosen.subgoals;
    match to {
        Some(to) => task::save(&task, to)?,
        None => output::lines(task::to_json(&task))?,
    }
    Ok(())
}

fn run_audit(names: &[String], episodes: u32, seeds: u64, as_json: bool) -> Outcome {
    let tasks = match names {
        [] => task::shipped(),
        names => names.iter().map(|name| task::load(name)).collect::<Result<Vec<Task>, _>>()?,
    };
    let tasks: Vec<Arc<Task>> = tasks.into_iter().map(Arc::new).collect();
    let mut progress = Progress::new(1, false);
    let batch = Batch { threads: default_threads(), interrupt: &Stop::default() };
    let rows = audit(&tasks, episodes, seeds, &batch, &mut |now| progress.set(now.done, now.total, now.message))?;
    drop(progress);
    match as_json {
        true => output::line(serde_json::to_string_pretty(&rows)?)?,
        false => output::lines(table(&rows, episodes))?,
    }
    Ok(())
}

/// A Markdown table: one row per task and kind of exploration, one number per seed.
fn table(rows: &[AuditRow], episodes: u32) -> String {
    let mut table = format!("Episodes of {episodes} that reached each subgoal and the goal, one entry per seed.\n\n");
    table += &markdown::header(["task", "exploration", "subgoals", "goal"]);
    for row in rows {
        let subgoals: Vec<String> = row
            .hits
            .iter()
            .map(|hits| hits.subgoals.iter().map(u32::to_string).collect::<Vec<_>>().join("/"))
            .collect();
        let goals: Vec<String> = row.hits.iter().map(|hits| hits.goal.to_string()).collect();
        table += &markdown::row([&row.task, &row.exploration, &subgoals.join(", "), &goals.join(", ")]);
    }
    table
}
