//! The figures in `assets/figures` match the numbers beside them. With `MGE_REDRAW_FIGURES` set they are rewritten:
//! `MGE_REDRAW_FIGURES=1 cargo test -p mge-figures shipped`.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::actions::StageActions;
use crate::data::labels;
use crate::*;
use mge_base::atomic::Target;
use mge_guidance::Cluster;
use mge_stats::Estimate;

type Row = HashMap<String, String>;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/figures")
}

fn number(row: &Row, column: &str) -> f64 {
    if row[column].is_empty() { f64::NAN } else { row[column].parse().unwrap() }
}

fn column(rows: &[&Row], column: &str) -> Vec<f64> {
    rows.iter().map(|row| number(row, column)).collect()
}

fn estimate(row: &Row, value: &str) -> Estimate {
    Estimate { value: number(row, value), lower: number(row, "low"), upper: number(row, "high") }
}

/// The distinct values of a column, in order of appearance, and the rows of each.
fn groups<'r>(rows: &[&'r Row], column: &str) -> Vec<(String, Vec<&'r Row>)> {
    let names = labels(rows.iter().map(|row| row[column].as_str()));
    let of = |name: &str| rows.iter().copied().filter(|row| row[column] == name).collect();
    names.into_iter().map(|name| (name.to_owned(), of(name))).collect()
}

fn statistics(centre: &str, interval: &str, seeds: usize) -> Statistics {
    Statistics { centre: centre.to_owned(), interval: interval.to_owned(), seeds, fewest_seeds: None }
}

const INTERVAL: &str = "95 % bootstrap interval over seeds";

fn actions(rows: &[&Row]) -> ActionSamples {
    let place = |row: &Row, x: &str, y: &str| [x, y].map(|column| row[column].parse::<f32>().unwrap());
    let stage = |rows: Vec<&Row>| {
        let of = |kind: &'static str| rows.iter().filter(move |row| row["kind"] == kind);
        let cluster = |row: &&Row| Cluster {
            mean: place(row, "x", "y"),
            std: place(row, "std_x", "std_y"),
            weight: row["weight"].parse().unwrap(),
            count: 0,
        };
        StageActions {
            samples: of("sample").map(|row| place(row, "x", "y")).collect(),
            clusters: of("cluster").map(cluster).collect(),
        }
    };
    let task = |(name, rows): (String, Vec<&Row>)| {
        let mut stages = groups(&rows, "stage");
        let task = mge_task::load(&name).unwrap();
        // A stage without clusters has no rows.
        let stages = (1..=task.stage_count()).map(|order| {
            let found = stages.iter_mut().find(|(name, _)| *name == order.to_string());
            found.map(|(_, rows)| stage(std::mem::take(rows))).unwrap_or_default()
        });
        TaskActions { stages: stages.collect(), task }
    };
    ActionSamples { tasks: groups(rows, "task").into_iter().map(task).collect() }
}

fn hits(rows: &[&Row], seeds: usize) -> HitBars {
    let policy = |(policy, rows): (String, Vec<&Row>)| {
        let (goal, subgoals): (Vec<&Row>, Vec<&Row>) = rows.into_iter().partition(|row| row["stage"] == "goal");
        let subgoals = subgoals.iter().map(|row| estimate(row, "hits")).collect();
        PolicyHits { policy, goal: estimate(goal[0], "hits"), subgoals }
    };
    let task = |(task, rows): (String, Vec<&Row>)| TaskHits {
        task,
        policies: groups(&rows, "policy").into_iter().map(policy).collect(),
    };
    HitBars {
        episodes: number(rows[0], "episodes") as usize,
        statistics: statistics("Mean", INTERVAL, seeds),
        tasks: groups(rows, "task").into_iter().map(task).collect(),
    }
}

fn curves(rows: &[&Row], seeds: usize, greedy: bool) -> LearningCurves {
    let window = if greedy { 10 } else { 100 };
    let curve = |(label, rows): (String, Vec<&Row>)| {
        let x = column(&rows, "episode");
        let [y, low, high] = ["success", "low", "high"].map(|name| column(&rows, name));
        Curve { label, x, y, low, high }
    };
    let panel = |(task, rows): (String, Vec<&Row>)| CurvePanel {
        task,
        curves: groups(&rows, "method").into_iter().map(curve).collect(),
    };
    LearningCurves {
        measure: if greedy { Success::Greedy } else { Success::Training },
        window,
        statistics: statistics("Interquartile mean", INTERVAL, seeds),
        panels: groups(rows, "task").into_iter().map(panel).collect(),
        ..LearningCurves::default()
    }
}

fn figure(name: &str, rows: &[&Row], seeds: usize) -> Box<dyn Figure> {
    match name {
        "figure4" => Box::new(actions(rows)),
        "figure5" => Box::new(hits(rows, seeds)),
        "figure6" => Box::new(curves(rows, seeds, false)),
        "figure6-greedy" => Box::new(curves(rows, seeds, true)),
        other => panic!("{other}: no figure is known by this name"),
    }
}

#[test]
fn shipped_figures_show_the_numbers_beside_them() {
    let redraw = std::env::var_os("MGE_REDRAW_FIGURES").is_some();
    for name in ["figure4", "figure5", "figure6", "figure6-greedy"] {
        let path = folder().join(name).with_extension("png");
        let provenance = super::read(&path);
        let beside = std::fs::read_to_string(path.with_extension("csv")).unwrap();
        let rows: Vec<Row> =
            csv::Reader::from_reader(beside.as_bytes()).deserialize().collect::<Result<_, _>>().unwrap();
        let figure = figure(name, &rows.iter().collect::<Vec<_>>(), provenance.seeds.len());
        assert_eq!(String::from_utf8(figure.table().to_csv()).unwrap(), beside, "{name}");
        if redraw {
            figure.write(&Target::from(&path), &provenance, DEFAULT_DPI).unwrap();
        }
    }
}
