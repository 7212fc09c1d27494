//! Results name every effective value, pool nothing that differs, and are written by one process at a time.
//!
//! Which settings results show is decided in `crates/results/src/settings.rs` (`distinguish`): where runs differ
//! in a setting, each has its effective value. What belongs together is written by one process at a time
//! (`sync::hold_folder`), and a setting is given once (`src/cli/runs.rs`, `definitions`).

use std::path::Path;

use serde_json::{Value, json};

use crate::program::{command, fail, mge, succeed, text};

/// Settings of agents that train in an instant.
const QUICK: &str = r#""task": "task1", "episodes": 4, "ddpg.hidden": 8, "ddpg.warmup_steps": 30"#;

/// Trains a sweep of plain DDPG with further settings; returns its folder's name.
fn sweep<'a>(here: &Path, name: &'a str, settings: &str) -> &'a str {
    std::fs::write(here.join("sweep.json"), format!("{{{QUICK}, {settings}}}")).unwrap();
    succeed(mge(here, ["sweep", "sweep.json", "--quiet", "--out", name]));
    name
}

fn read(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.as_ref().display()))
}

fn json_of(path: impl AsRef<Path>) -> Value {
    serde_json::from_str(&read(path)).unwrap()
}

/// The values in a column of a sweep's results, as JSON and as CSV.
fn column(sweep: &Path, name: &str) -> (Vec<Value>, Vec<String>) {
    let rows = json_of(sweep.join("results.json"))["rows"].as_array().unwrap().clone();
    let mut csv = csv::Reader::from_path(sweep.join("results.csv")).unwrap();
    let place = csv.headers().unwrap().iter().position(|column| column == name).expect(name);
    let cells = csv.records().map(|record| record.unwrap()[place].to_owned()).collect();
    (rows.iter().map(|row| row[name].clone()).collect(), cells)
}

/// The labels in a report's table of methods.
fn labels(report: &Path) -> Vec<String> {
    let rows = json_of(report.join("report.json"))["aggregates"].as_array().unwrap().clone();
    let of_auc = rows.iter().filter(|row| row["measure"] == "auc");
    of_auc.map(|row| row["method"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn swept_values_that_equal_a_default_are_in_results_and_reports_with_their_types() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // 0.95, no held policy and no start noise (that of the task) are the defaults.
    let axes = [
        (r#""ddpg.gamma": [0.95, 0.9]"#, "ddpg.gamma", json!([0.9, 0.95])),
        (
            r#""hold_tolerance": [null, 0.5], "epsilon": "need:0.5:0.1:4", "method": "ddpg-uniform""#,
            "hold_tolerance",
            json!([0.5, "none"]),
        ),
        (r#""start_noise": [null, 0.25]"#, "start_noise", json!([0.25, 0.0])),
        (r#""epsilon": [0.5, "linear:0.5:0:4"], "method": "ddpg-uniform""#, "epsilon", json!([0.5, "linear:0.5:0:4"])),
        (r#""episodes": [4, 12]"#, "episodes", json!([4, 12])),
    ];
    for (number, (axis, name, expected)) in axes.into_iter().enumerate() {
        let method = if axis.contains("method") { "" } else { r#""method": "ddpg","# };
        let quick = QUICK.replace(r#""episodes": 4, "#, if name == "episodes" { "" } else { r#""episodes": 4, "# });
        let out = format!("sweep{number}");
        std::fs::write(here.join("s.json"), format!("{{{quick}, {method} {axis}}}")).unwrap();
        succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", &out]));
        let (typed, cells) = column(&here.join(&out), name);
        assert_eq!(json!(typed), expected, "{name}");
        assert!(cells.iter().all(|cell| !cell.is_empty()), "{name}: {cells:?}");
    }
    assert_eq!(column(&here.join("sweep0"), "epsilon").1, ["", ""], "plain DDPG has no epsilon");
    succeed(mge(here, ["report", "sweep0", "--resamples", "10"]));
    assert_eq!(labels(&here.join("report")), ["DDPG, ddpg.gamma 0.9", "DDPG"]);
    let report = json_of(here.join("report/report.json"));
    assert_eq!(report["learning"][1]["implied"]["ddpg.gamma"], json!(0.95));
    // Of several of plain DDPG, the reference is that with the usual settings.
    assert_eq!(report["reference"], "DDPG");
    let figures =
        ["figures", "sweep0/runs/task1-ddpg-ddpg.gamma_0.95-seed0", "sweep0/runs/task1-ddpg-ddpg.gamma_0.9-seed0"];
    succeed(mge(here, figures.into_iter().chain(["--out", "drawn"])));
    assert!(read(here.join("drawn/learning.csv")).contains("DDPG, ddpg.gamma 0.9\""));
    // A run has its label among all in its folder, also if that is the current one.
    succeed(mge(here.join("sweep0/runs"), ["figures", "task1-ddpg-ddpg.gamma_0.9-seed0", "--out", "../alone"]));
    assert!(read(here.join("sweep0/alone/learning.csv")).contains("DDPG, ddpg.gamma 0.9\""));
}

#[test]
fn models_of_a_sweep_have_every_effective_value() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let quick = r#""kind": "dynamics", "layers": 2, "epochs": 1, "width": 8, "observations": 10, "validation": 3,
        "evaluation.launches": 5, "evaluation.episodes": 1, "evaluation.hit_rollouts": 10"#;
    std::fs::write(here.join("m.json"), format!(r#"{{{quick}, "tools": "box", "mirror": [true, false]}}"#)).unwrap();
    succeed(mge(here, ["sweep", "m.json", "--quiet", "--out", "models"]));
    assert_eq!(json!(column(&here.join("models"), "mirror").0), json!([false, true]));
    // A result that another process left empty does not count as one.
    let run = here.join("models/runs/bucket-box-mirror_true-seed0");
    let run = if run.exists() { run } else { here.join("models/runs/box-mirror_true-seed0") };
    std::fs::write(run.join("result.json"), "").unwrap();
    fail(
        mge(
            here,
            [
                "sweep",
                "--one",
                &format!(r#"{{{quick}, "tools": "box", "mirror": [true]}}"#),
                "--quiet",
                "--out",
                "models",
            ],
        ),
        "result.json",
    );
}

#[test]
fn runs_with_other_fixed_settings_are_not_pooled() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // In each sweep the setting is fixed, and no task has both values.
    sweep(here, "calm", r#""method": "ddpg""#);
    let noisy = format!("{{{}, {}}}", QUICK.replace("task1", "task3"), r#""method": "ddpg", "start_noise": 0.02"#);
    std::fs::write(here.join("noisy.json"), noisy).unwrap();
    succeed(mge(here, ["sweep", "noisy.json", "--quiet", "--out", "noisy"]));
    succeed(mge(here, ["report", "calm", "noisy", "--resamples", "10"]));
    let report = read(here.join("report/report.md"));
    for label in ["| DDPG |", "DDPG, start_noise 0.02 |"] {
        assert!(report.contains(label), "{label}: {report}");
    }
    assert!(report.contains("No task has runs of every method"), "{report}");
}

#[test]
fn runs_beside_the_folder_of_runs_are_reported_too_and_numbers_are_sorted_as_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    sweep(here, "all", r#""method": "ddpg", "seed": [2, 10]"#);
    let alone =
        ["train", "task1", "--method", "ddpg", "--episodes", "4", "--seed", "7", "--quiet", "--out", "all/alone"];
    succeed(mge(here, alone.into_iter().chain(["--set", "ddpg.hidden=8", "--set", "ddpg.warmup_steps=30"])));
    succeed(mge(here, ["report", "all", "--resamples", "10"]));
    assert!(read(here.join("report/report.md")).contains("from 3 finished runs with the seeds 2, 7, 10"));
    assert_eq!(json!(column(&here.join("all"), "seed").0), json!([2, 10]));
}

#[test]
fn the_reference_of_a_report_can_be_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    sweep(here, "all", r#""method": ["ddpg", "ddpg-uniform"], "epsilon": 0.5"#);
    let report = ["report", "all", "--resamples", "10", "--reference"];
    let label = "DDPG, uniform exploration, epsilon 0.5";
    succeed(mge(here, report.into_iter().chain([label])));
    assert!(read(here.join("report/report.md")).contains(&format!("P(better than {label})")));
    fail(mge(here, report.into_iter().chain(["DDGP"])), "no runs are called `DDGP`: did you mean `DDPG`?");
    fail(mge(here, report.into_iter().chain(["other"])), &format!("use one of DDPG; {label}"));
}

#[test]
fn a_setting_given_twice_is_an_error_that_names_both() {
    let folder = tempfile::tempdir().unwrap();
    let twins = [
        ("--seed", "1", "seed=2"),
        ("--episodes", "5", "episodes=6"),
        ("--method", "ddpg", "method=planning"),
        ("--epsilon", "0.1", "epsilon=0.2"),
        ("--model", "true", "prior=rapier"),
        ("--set", "ddpg.gamma=0.9", "ddpg.gamma=0.8"),
        ("--set", r#"guidance.clusters={"fixed":3}"#, "guidance.clusters.fixed=4"),
    ];
    for (option, value, setting) in twins {
        let message = fail(mge(&folder, ["train", "task1", option, value, "--set", setting]), "set the same");
        assert!(message.contains(option) && message.contains(setting), "{message}");
    }
    let define = ["script", "s.mge", "--define", "A=1", "--define", "A=2"];
    fail(mge(&folder, define), "--define A=1 and --define A=2 set the same");
    let fork = ["fork", "run", "--at", "1", "--set", "epsilon=0", "--set", "epsilon=1"];
    std::fs::create_dir(folder.path().join("run")).unwrap();
    assert!(!mge(&folder, fork).status.success());
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "nothing was trained");
}

/// Starts two commands at the same time, and waits for both.
fn both(here: &Path, first: &[&str], second: &[&str]) -> [std::process::Output; 2] {
    use std::process::Stdio;
    let start = |arguments: &[&str]| {
        command(here, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts")
    };
    [start(first), start(second)].map(|process| process.wait_with_output().unwrap())
}

#[test]
fn two_sweeps_with_runs_of_the_same_names_are_not_mixed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // One of them has its runs, the other says that it has not.
    for (name, gamma) in [("one", 0.5), ("two", 0.6)] {
        let settings = format!(r#"{{{QUICK}, "method": "ddpg", "seed": [0, 1], "ddpg.gamma": {gamma}}}"#);
        std::fs::write(here.join(name).with_extension("json"), settings).unwrap();
    }
    let train = |file| ["sweep", file, "--quiet", "--threads", "1", "--out", "shared"];
    let ended = both(here, &train("one.json"), &train("two.json"));
    let failed = ended.iter().find(|output| !output.status.success()).expect("one cannot have its runs");
    assert!(text(&failed.stderr).contains("other settings than the sweep asks for"), "{}", text(&failed.stderr));
}

#[test]
fn a_damaged_configuration_fails_alone_and_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    sweep(here, "all", r#""method": "ddpg", "seed": [0, 1, 2]"#);
    let run = |seed: u32| here.join(format!("all/runs/task1-ddpg-seed{seed}"));
    for text in ["", "{", "{}", r#"{"format": 1, "seed": "x"}"#] {
        std::fs::write(run(1).join("config.json"), text).unwrap();
        std::fs::remove_dir_all(run(2)).unwrap();
        let again = ["sweep", "sweep.json", "--quiet", "--out", "all"];
        let message = fail(mge(here, again), "config.json");
        assert!(message.contains("task1-ddpg-seed1") && message.contains("1 of 3 not finished"), "{text}: {message}");
        assert!(run(2).join("metrics.csv").exists(), "{text}: the others are trained");
        assert_eq!(column(&here.join("all"), "seed").0, [json!(0), json!(2)], "{text}: the others are in the results");
    }
    std::fs::remove_dir_all(run(1)).unwrap();
    succeed(mge(here, ["sweep", "sweep.json", "--quiet", "--out", "all"]));
}

#[test]
fn an_option_of_a_figure_given_twice_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    sweep(here, "all", r#""method": "ddpg", "seed": [0]"#);
    let figures = ["figures", "all/runs/task1-ddpg-seed0", "--set", "width=single", "--set"];
    fail(mge(here, figures.into_iter().chain(["width=double"])), "--set width=double: `width` is given twice");
    let names = ["curve=DDPG", "--set", "name=A", "--set", "name=B"];
    fail(mge(here, figures.into_iter().chain(names)), "--set name=B: the curve `DDPG` has a name already");
}

#[test]
fn settings_of_a_file_give_way_to_options_and_to_those_of_a_sweep() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let file = r#"{"method": "ddpg", "ddpg": {"hidden": 8, "gamma": 0.5}, "episodes": 3, "seed": 4}"#;
    std::fs::write(here.join("c.json"), file).unwrap();
    let options = ["--episodes", "2", "--set", "ddpg.gamma=0.6", "--out", "run", "--quiet"];
    succeed(mge(here, ["train", "task1", "--config", "c.json"].into_iter().chain(options)));
    let of = |config: &Value| {
        let value = |pointer: &str| config["config"].pointer(pointer).unwrap().clone();
        ["/method", "/ddpg/hidden", "/ddpg/gamma", "/episodes", "/seed"].map(value)
    };
    let expected = [json!("ddpg"), json!(8), json!(0.6), json!(2), json!(4)];
    assert_eq!(of(&json_of(here.join("run/config.json"))), expected);
    let swept = r#"{"task": "task1", "config": "c.json", "ddpg.gamma": [0.6], "episodes": 2}"#;
    std::fs::write(here.join("s.json"), swept).unwrap();
    succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", "s"]));
    assert_eq!(of(&json_of(here.join("s/runs/task1-ddpg-ddpg.gamma_0.6-seed4/config.json"))), expected);
    let printed: Value = serde_json::from_str(&succeed(mge(here, ["config", "c.json"]))).unwrap();
    assert_eq!(printed["ddpg.gamma"], json!({"value": 0.5, "source": "file"}));
    let printed: Value = serde_json::from_str(&succeed(mge(here, ["config", "ddpg-mge-adaptive"]))).unwrap();
    assert_eq!(printed["ddpg.hidden"], json!({"value": 128, "source": "method"}));
    assert_eq!(printed["guidance.horizon"]["source"], "default");
    fail(mge(here, ["train", "task1", "--config", "papr"]), "did you mean `paper`?");
}

#[test]
fn a_mistake_in_a_file_of_settings_is_named_with_the_file_and_the_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let write = |text: &str| std::fs::write(here.join("c.json"), text).unwrap();
    write("{\n\"method\": \"ddpg\",\n\"ddpg\": {\"gama\": 0.9}}");
    let sweep = r#"{"task": "task1", "config": "c.json"}"#;
    for command in
        [&["train", "task1", "--config", "c.json"][..], &["config", "c.json"], &["sweep", "--one", sweep, "--out", "s"]]
    {
        let message = fail(mge(here, command), "c.json:3: there is no setting `ddpg.gama`");
        assert!(message.contains("did you mean `ddpg.gamma`?"), "{message}");
    }
    write("{\"episodes\": \"many\"}");
    fail(mge(here, ["train", "task1", "--config", "c.json"]), "c.json:1: `episodes` cannot be `many`");
    write("{\"ddpg.gamma\": 7}");
    fail(mge(here, ["train", "task1", "--config", "c.json"]), "c.json: ddpg.gamma");
}

#[test]
fn a_missing_model_is_named_with_its_entry_in_the_sweep_file() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = "{\"task\": \"task1\",\n\"model\": [\"learned\",\n\"models/gone.safetensors\"]}";
    std::fs::write(folder.path().join("s.json"), sweep).unwrap();
    let message = fail(mge(&folder, ["sweep", "s.json"]), "s.json:3: at model[1]");
    assert!(message.contains("models/gone.safetensors"), "{message}");
}

#[test]
fn a_sweep_needs_a_folder_that_can_be_listed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("hits.json"), r#"{"kind": "hits", "task": "task1", "policy": "uniform"}"#).unwrap();
    std::fs::write(here.join("taken"), "").unwrap();
    assert!(!mge(here, ["sweep", "hits.json", "--quiet", "--out", "taken"]).status.success());
}

#[test]
fn a_damaged_result_is_left_out_of_a_report_which_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let counts = r#"{"kind": "hits", "task": "task1", "policy": "uniform", "episodes": 5, "seed": [0, 1]}"#;
    std::fs::write(here.join("hits.json"), counts).unwrap();
    succeed(mge(here, ["sweep", "hits.json", "--quiet", "--out", "hits"]));
    std::fs::write(here.join("hits/runs/task1-uniform-seed1/result.json"), "{").unwrap();
    sweep(here, "trained", r#""method": "ddpg""#);
    let output = mge(here, ["report", "hits", "trained", "--resamples", "10"]);
    let told = text(&output.stderr);
    assert!(told.contains("2 left out: not finished, damaged, or not of the kind of the first"), "{told}");
    succeed(output);
    let report = read(here.join("report/report.md"));
    assert!(report.contains("Left out, as it is damaged: hits/runs/task1-uniform-seed1/result.json"), "{report}");
    assert!(!report.contains("ddpg.hidden"), "no settings of trainings: {report}");
}

#[test]
fn a_figure_is_drawn_again_with_another_axis() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    sweep(here, "all", r#""method": "ddpg", "seed": [0]"#);
    let figures = ["figures", "all/runs/task1-ddpg-seed0", "--out", "drawn"];
    succeed(mge(here, figures));
    // Reports of earlier versions call the charged actions `steps`.
    for (against, column) in [("steps", "charged_actions"), ("charged", "charged_actions"), ("actions", "actions")] {
        succeed(mge(here, figures.into_iter().chain(["--set", &format!("against={against}")])));
        let csv = read(here.join("drawn/learning.csv"));
        assert!(csv.starts_with(&format!("task,method,{column},")), "{against}: {csv}");
    }
}
