//! `mge runs`, `mge show` and `mge compare`: what is known of runs, as text or JSON.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::arguments::{Compare, Runs, Show};
use super::output::{self, Outcome};
use mge_base::json;
use mge_base::text::counted;
use mge_results::{differences, find_runs, read_runs};
use mge_run::{RunDirectory, RunState};
use mge_trainer::non_default_settings;
use mge_workbench::listing::{RunSummary, read_run, span};
use mge_workbench::run_label;

/// Lists runs. Damaged ones are named on stderr.
pub fn runs(arguments: &Runs) -> Outcome {
    let (mut runs, mut damaged) = (Vec::new(), 0);
    for path in find_runs(&arguments.folders)? {
        match read_run(&path) {
            Ok(run) => runs.extend(run),
            Err(error) => {
                damaged += 1;
                output::message(error);
            }
        }
    }
    if arguments.format.json {
        print_json(&runs.iter().map(entry).collect::<Vec<_>>().into())?;
    } else {
        let header = ["run", "state", "episodes", "success", "changed", "label", "task"].map(str::to_owned);
        output::table(&[vec![header], runs.iter().map(line).collect()].concat())?;
    }
    match damaged {
        0 => Ok(()),
        damaged => Err(format!("{} cannot be read", counted(damaged, "run")).into()),
    }
}

/// Seconds since something was last written into the log of a run, if there is one.
fn age(run: &Path) -> Option<f64> {
    let changed = std::fs::metadata(run.join("events.jsonl")).and_then(|log| log.modified()).ok()?;
    Some(changed.elapsed().unwrap_or_default().as_secs_f64())
}

fn line(run: &RunSummary) -> [String; 7] {
    let changed = age(&run.path).map_or_else(|| "-".to_owned(), |age| format!("{} ago", span(age)));
    let episodes = format!("{}/{}", run.done, run.episodes());
    let is_renamed = run.path.file_name().is_some_and(|folder| *folder != *run.name);
    let label = if is_renamed { format!("{}: {}", run.name, run.label) } else { run.label.clone() };
    let task = run.config.task.name.clone();
    [run.path.display().to_string(), run.state.name().to_owned(), episodes, run.success_text(), changed, label, task]
}

fn entry(run: &RunSummary) -> Value {
    json!({
        "run": run.path.display().to_string(),
        "name": run.name,
        "state": run.state.name(),
        "task": run.config.task.name,
        "method": run.config.method.name(),
        "seed": run.config.seed,
        "label": run.label,
        "episodes_done": run.done,
        "episodes": run.episodes(),
        "rolling_success": run.success,
        "seconds_since_change": age(&run.path).map(f64::round),
        "tags": run.tags,
        "note": run.note,
    })
}

/// Shows a run.
pub fn show(arguments: &Show) -> Outcome {
    let run = read_runs(std::slice::from_ref(&arguments.run))?.remove(0);
    let directory = RunDirectory::open(&run.path)?;
    let notes = directory.notes()?;
    let settings: Map<String, Value> =
        non_default_settings(&run.config).into_iter().map(|(path, value)| (path, value.into())).collect();
    let reason = match &run.state {
        RunState::Incomplete(reason) | RunState::Stopped(reason) | RunState::Failed(reason) => Some(reason),
        _ => None,
    };
    let shown = json!({
        "run": run.path.display().to_string(),
        "name": directory.name(),
        "state": run.state.name(),
        "reason": reason,
        "task": run.config.task.name,
        "label": run_label(&run.config),
        "settings": settings,
        "results": results(&run.trained.row),
        "forked": run.config.fork.as_ref().map(ToString::to_string),
        "tags": notes.tags,
        "note": notes.note,
    });
    if arguments.format.json {
        return print_json(&shown);
    }
    let lines = json::leaf_values(&shown).into_iter().filter(|(_, value)| !value.is_null());
    output::table(&lines.map(|(path, value)| [path, json::text(value)]).collect::<Vec<_>>())
}

/// The results of a run, without its settings.
fn results(row: &impl serde::Serialize) -> Value {
    let mut results = json::to_value(row);
    for setting in ["task", "method", "seed", "epsilon", "settings", "implied"] {
        results.as_object_mut().and_then(|results| results.remove(setting));
    }
    results
}

/// Compares two runs.
pub fn compare(arguments: &Compare) -> Outcome {
    let [first, second] = [&arguments.first, &arguments.second].map(|run| read_runs(std::slice::from_ref(run)));
    let [first, second] = [first?.remove(0), second?.remove(0)];
    let settings = differences(&first.config, &second.config);
    let rows = [&first, &second].map(|run| results(&run.trained.row));
    if arguments.format.json {
        let settings: Map<String, Value> = settings.into_iter().map(|(path, values)| (path, json!(values))).collect();
        let runs = [&first, &second].map(|run| run.path.display().to_string());
        return print_json(&json!({ "runs": runs, "settings": settings, "results": rows }));
    }
    let [ours, theirs] = rows.each_ref().map(|row| json::leaf_values(row));
    let text = |value: &Value| if value.is_null() { "-".to_owned() } else { json::text(value) };
    let results = ours.into_iter().zip(theirs).map(|((name, a), (_, b))| (name, [a, b].map(text)));
    let names = ("run".to_owned(), [&first, &second].map(|run| run.path.display().to_string()));
    let lines = std::iter::once(names).chain(settings).chain(results).map(|(name, [a, b])| [name, a, b]);
    output::table(&lines.collect::<Vec<_>>())
}

fn print_json(value: &Value) -> Outcome {
    Ok(output::line(format_args!("{value:#}"))?)
}
