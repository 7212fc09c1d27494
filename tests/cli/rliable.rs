//! Compares our statistics with those of Google's rliable: on the runs of a real study, whose numbers
//! `tests/python/rliable_numbers.py` wrote to `tests/data/rliable/`, and on a new report, if a Python with rliable is
//! available (`MGE_PYTHON`).

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::program::{mge, succeed};
use mge::stats::aggregate::{iqm, mean, median, optimality_gap};
use mge::stats::comparison::improvement_interval;
use mge::stats::{Bootstrap, Estimate, TaskScores};
use serde_json::Value;

/// Largest allowed difference of point estimates.
const POINT: f64 = 1e-6;
/// Largest allowed differences of interval ends with 10 000 and with 1000 resamples, because each library draws its own
/// resamples.
const END: f64 = 0.02;
const END_OF_FEW: f64 = 0.06;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|number| number.as_f64().expect("a number")).collect()
}

fn task_scores(method: &Value) -> TaskScores {
    let tasks = method["scores"].as_array().expect("tasks");
    TaskScores::new(tasks.iter().map(numbers).collect()).unwrap()
}

#[track_caller]
fn check(what: &str, ours: Estimate, theirs: &[f64], end: f64) {
    let near = |ours: f64, theirs: f64, most: f64| (ours - theirs).abs() <= most;
    let agrees =
        near(ours.value, theirs[0], POINT) && near(ours.lower, theirs[1], end) && near(ours.upper, theirs[2], end);
    assert!(agrees, "{what}: {ours:?}, but rliable has {theirs:?}");
}

#[test]
fn the_numbers_of_a_real_study_are_those_of_rliable() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/rliable/study.json");
    let study: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let bootstrap = Bootstrap { resamples: 10_000, ..Bootstrap::default() };
    let mut checked = 0;
    for (measure, methods) in study["measures"].as_object().unwrap() {
        for (label, method) in methods.as_object().unwrap() {
            let scores = task_scores(method);
            let of = |statistic: fn(&TaskScores) -> f64| bootstrap.stratified(&scores, statistic).unwrap();
            for (name, ours) in [
                ("iqm", of(iqm)),
                ("mean", of(mean)),
                ("median", of(median)),
                ("optimality_gap", of(|scores| optimality_gap(scores, 1.0))),
            ] {
                check(&format!("{name} of {measure} of {label}"), ours, &numbers(&method[name]), END);
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 2 * 3 * 4, "two measures of three methods");
    let area = &study["measures"]["auc"];
    for improvement in study["improvements"].as_array().unwrap() {
        let [x, y] = [0, 1].map(|n| improvement[n].as_str().unwrap());
        let ours = improvement_interval(&task_scores(&area[x]), &task_scores(&area[y]), &bootstrap).unwrap();
        check(
            &format!("{x} over {y}"),
            ours,
            &numbers(&Value::from(improvement.as_array().unwrap()[2..].to_vec())),
            END,
        );
    }
}

fn python_with_rliable() -> Option<PathBuf> {
    let python = std::env::var_os("MGE_PYTHON").map(PathBuf::from)?;
    let imported = Command::new(&python).args(["-c", "import rliable"]).output().expect("Python starts");
    imported.status.success().then_some(python)
}

#[test]
fn the_numbers_of_a_report_are_those_of_rliable() {
    let Some(python) = python_with_rliable() else {
        eprintln!("skipped: set MGE_PYTHON to a Python with rliable");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let sweep = r#"{"task": ["task1", "task3"], "method": ["ddpg", "ddpg-uniform"], "seed": [0, 1, 2, 3], "episodes": 60,
        "epsilon": 0.5, "ddpg.hidden": 8, "evaluation.every": 0}"#;
    std::fs::write(folder.path().join("s.json"), sweep).unwrap();
    succeed(mge(&folder, ["sweep", "s.json", "--quiet", "--out", "sweep"]));
    succeed(mge(&folder, ["report", "sweep", "--resamples", "1000", "--out", "report"]));
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/rliable_numbers.py");
    let path = folder.path().join("report/report.json");
    let output = Command::new(&python).arg(script).arg(&path).arg("1000").output().expect("Python starts");
    let theirs: Value = serde_json::from_str(&succeed(output)).unwrap();
    let ours: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();

    let estimate = |value: &Value| -> Estimate { serde_json::from_value(value.clone()).unwrap() };
    let aggregates = ours["aggregates"].as_array().unwrap();
    assert_eq!(aggregates.len(), 8, "four measures of two methods");
    for row in aggregates {
        let [measure, method] = ["measure", "method"].map(|key| row[key].as_str().unwrap());
        for name in ["iqm", "mean", "median", "optimality_gap"] {
            let theirs = numbers(&theirs["measures"][measure][method][name]);
            check(&format!("{name} of {measure} of {method}"), estimate(&row[name]), &theirs, END_OF_FEW);
        }
    }
    let improvements = ours["improvements"].as_array().unwrap();
    assert_eq!(improvements.len(), 2);
    for (row, theirs) in improvements.iter().zip(theirs["improvements"].as_array().unwrap()) {
        assert_eq!((&row["method"], &row["over"]), (&theirs[0], &theirs[1]));
        let theirs = [2, 3, 4].map(|n| theirs[n].as_f64().unwrap());
        check("probability of improvement", estimate(&row["probability"]), &theirs, END_OF_FEW);
    }
}
