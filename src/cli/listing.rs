//! `mge runs`, `mge show` and `mge compare`: what is known of runs, as text or JSON.

use std::path::Path;
use std::slice;
use std::sync::Arc;

use rayon::prelude::*;
use serde_json::{Map, Value, json};

use super::arguments::{Compare, Runs, Show};
use super::output::{self, Outcome};
use super::session::RUNS;
use mge_base::json;
use mge_base::text::{counted, number, span};
use mge_results::{FoundRun, differences, find_runs, interventions, read_runs, result_label};
use mge_run::{RunDirectory, RunError, RunHistory};
use mge_task::is_edited;
use mge_trainer::non_default_settings;
use mge_workbench::listing::{Grouping, RunSummary, read_run};
use mge_workbench::run_label;

/// Lists runs. Damaged ones are named on stderr.
pub fn runs(arguments: &Runs) -> Outcome {
    let (mut runs, mut damaged) = (Vec::new(), 0);
    let is_usual = arguments.folders == [Path::new(RUNS)];
    let found = match find_runs(&arguments.folders) {
        Err(RunError::NotARun(_) | RunError::NoRuns(_)) if is_usual => {
            output::message(format_args!("no runs in {RUNS}/"));
            Vec::new()
        }
        found => found?,
    };
    let read = |path| read_run(path).map(|run| run.map(RunSummary::with_whole_log));
    for read in found.par_iter().map(|path| read(path)).collect::<Vec<_>>() {
        match read {
            Ok(run) => runs.extend(run.map(Arc::new)),
            Err(error) => {
                damaged += 1;
                output::message(error);
            }
        }
    }
    // Named as in the workbench and in figures of the same runs.
    let groups = Grouping::new(&runs, &Grouping::default());
    for run in runs.iter_mut().map(Arc::make_mut) {
        if let Some(group) = groups.of(&run.path) {
            run.label = format!("{}, seed {}", group.label, run.config.seed);
        }
    }
    if arguments.format.json {
        output::json(&runs.iter().map(|run| entry(run)).collect::<Vec<_>>())?;
    } else {
        let header = ["run", "state", "episodes", "success", "changed", "label", "task"].map(str::to_owned);
        output::table(&[vec![header], runs.iter().map(|run| line(run)).collect()].concat())?;
    }
    match damaged {
        0 => Ok(()),
        damaged => Err(format!("{} cannot be read", counted(damaged, "run")).into()),
    }
}

/// Seconds since something was last written into the log of a run, if there is one.
fn age(run: &Path) -> Option<f64> {
    let changed = std::fs::metadata(RunDirectory::at(run).events_path()).and_then(|log| log.modified()).ok()?;
    Some(changed.elapsed().unwrap_or_default().as_secs_f64())
}

fn line(run: &RunSummary) -> [String; 7] {
    let changed = age(&run.path).map_or_else(|| "-".to_owned(), |age| format!("{} ago", span(age)));
    let episodes = format!("{}/{}", run.done, run.episodes());
    let label = run.given_name().map_or_else(|| run.label.clone(), |name| format!("{name}: {}", run.label));
    let edited = if is_edited(&run.config.task) { " (edited)" } else { "" };
    let task = format!("{}{edited}", run.config.task.name);
    let success = run.success.map_or_else(|| "-".to_owned(), |success| format!("{:.0} %", 100.0 * success));
    [run.path.display().to_string(), run.state.name().to_owned(), episodes, success, changed, label, task]
}

fn entry(run: &RunSummary) -> Value {
    json!({
        "run": run.path.display().to_string(),
        "name": run.name,
        "state": run.state.name(),
        "task": run.config.task.name,
        "task_edited": is_edited(&run.config.task),
        "method": run.config.method.name(),
        "seed": run.config.seed,
        "label": run.label,
        "episodes_done": run.done,
        "episodes": run.episodes(),
        "rolling_success": run.success,
        "seconds_since_change": age(&run.path).map(f64::round),
        "note": run.note,
    })
}

/// What was done to a run from outside, such as another epsilon schedule, and its history, which is empty before it has
/// begun.
fn done_to(run: &FoundRun) -> (Vec<String>, RunHistory) {
    let history = RunHistory::read(&RunDirectory::at(&run.path)).unwrap_or_default();
    let all = interventions(&run.config, &history.interventions).into_iter();
    (all.map(|(episode, text)| format!("episode {episode}: {text}")).collect(), history)
}

/// Shows a run.
pub fn show(arguments: &Show) -> Outcome {
    let mut run = read_runs(slice::from_ref(&arguments.run))?.remove(0);
    // It is defined among runs that are compared.
    run.trained.row.charged_area = None;
    let (interventions, history) = done_to(&run);
    // The method is shown above them, and what a fork was given among its interventions.
    let settings = non_default_settings(&run.config).into_iter();
    let settings = settings.filter(|(path, _)| !["method", "fork.tasks"].contains(&&**path));
    let settings: Map<String, Value> = settings.map(|(path, value)| (path, value.into())).collect();
    let shown = json!({
        "run": run.path.display().to_string(),
        "name": run.name(),
        "state": run.state.name(),
        "reason": run.state.reason(),
        "task": run.config.task.name,
        "task_edited": Some(true).filter(|_| is_edited(&run.config.task)),
        "method": run.config.method.name(),
        "label": run_label(&run.config),
        "settings": settings,
        "seconds": history.times.last().map(|last| last.seconds.round()),
        "results": results(&run.trained.row),
        "interventions": Some(interventions).filter(|all| !all.is_empty()),
        "note": RunDirectory::at(&run.path).notes()?.note,
    });
    if arguments.format.json {
        return output::json(&shown);
    }
    let text = |value: &Value| match value.as_array() {
        Some(all) => all.iter().map(json::text).collect::<Vec<_>>().join("; "),
        None => json::text(value),
    };
    let lines = json::leaf_values(&shown).into_iter().filter(|(_, value)| !value.is_null() && !text(value).is_empty());
    let line = |(path, value): (String, &Value)| match path.strip_prefix("results.") {
        Some(key) => [result_label(key).to_owned(), result_text(value)],
        None => [path, text(value)],
    };
    output::table(&lines.map(line).collect::<Vec<_>>())
}

/// A result for a person: numbers with at most three decimals, unless these do not tell it.
fn result_text(value: &Value) -> String {
    match value.as_f64() {
        Some(value) if value != 0.0 && value.abs() < 9.5e-4 => number(value as f32),
        Some(value) if value.fract() != 0.0 => format!("{value:.3}"),
        _ if value.is_null() => "-".to_owned(),
        _ => json::text(value),
    }
}

/// The results of a run, without its settings and name.
fn results(row: &impl serde::Serialize) -> Value {
    let mut results = json::to_value(row);
    let others = ["name", "task", "method", "seed", "epsilon", "settings", "implied"];
    if let Some(results) = results.as_object_mut() {
        results.retain(|key, _| !others.contains(&&**key));
    }
    results
}

/// Compares two runs.
pub fn compare(arguments: &Compare) -> Outcome {
    let runs = read_runs(&[arguments.first.clone(), arguments.second.clone()])?;
    let both = [&runs[0], &runs[1]];
    let done = both.map(|run| done_to(run).0);
    let settings = differences(&both[0].config, &both[1].config);
    let rows = both.map(|run| results(&run.trained.row));
    let paths = both.map(|run| run.path.display().to_string());
    if arguments.format.json {
        let settings: Map<String, Value> = settings.into_iter().map(|(path, values)| (path, json!(values))).collect();
        let names = both.map(FoundRun::name);
        return output::json(
            &json!({ "runs": paths, "names": names, "settings": settings, "interventions": done, "results": rows }),
        );
    }
    let [ours, theirs] = rows.each_ref().map(|row| json::leaf_values(row));
    let results =
        ours.into_iter().zip(theirs).map(|((key, a), (_, b))| (result_label(&key).to_owned(), [a, b].map(result_text)));
    let names = both.map(|run| run.trained.row.name.clone());
    let first = [("run", paths), ("name", names), ("interventions", done.map(|all| all.join("; ")))];
    let first = first.map(|(name, texts)| (name.to_owned(), texts)).into_iter();
    let lines = first.chain(settings).chain(results).filter(|(_, texts)| texts.iter().any(|text| !text.is_empty()));
    let lines = lines.map(|(name, [a, b])| [name, a, b]);
    output::table(&lines.collect::<Vec<_>>())
}
