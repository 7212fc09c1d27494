//! Settings without effect, contradictions and defaults are never silent.
//!
//! Decided in `crates/trainer/src/`: in `effect.rs` what is without effect or doubtful about settings, in `defaults.rs` the default
//! method.

use std::path::Path;
use std::process::Output;

use crate::program::{mge, succeed, text};

/// A training of the default method in a second.
const QUICK: [(&str, &str); 5] = [
    ("prior", "true"),
    ("ddpg.hidden", "8"),
    ("guidance.model_rollouts", "40"),
    ("guidance.most_model_rollouts", "40"),
    ("practice.rollouts", "4"),
];

fn train(folder: &Path, more: &[&str]) -> Output {
    let quick = QUICK.iter().flat_map(|(key, value)| ["--set".to_owned(), format!("{key}={value}")]);
    let words = ["train", "task1", "--quiet"].into_iter().chain(more.iter().copied()).map(str::to_owned);
    mge(folder, words.chain(quick))
}

/// A script that trains a run in the folder `scripted` after these lines.
fn script(folder: &Path, lines: &str) {
    let quick: String = QUICK.iter().map(|(key, value)| format!("set {key} {value}\n")).collect();
    std::fs::write(folder.join("s.mge"), format!("{lines}\n{quick}train ./scripted\n")).unwrap();
}

/// A sweep file of a run with these settings too.
fn sweep(folder: &Path, more: &[(&str, &str)]) {
    let all = QUICK.iter().chain(more).map(|(key, value)| format!("{key:?}: {value:?}"));
    let text = format!("{{\"task\": \"task1\", {}}}", all.collect::<Vec<_>>().join(", "));
    std::fs::write(folder.join("s.json"), text).unwrap();
}

fn warned(output: &Output) -> Vec<String> {
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stderr).lines().filter_map(|line| line.strip_prefix("warning: ")).map(str::to_owned).collect()
}

#[test]
fn without_a_method_every_way_to_train_trains_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    script(here, "episodes 2");
    sweep(here, &[("episodes", "2")]);
    assert_eq!(warned(&train(here, &["--episodes", "20", "--out", "trained"])), [""; 0]);
    succeed(train(here, &["--episodes", "2", "--out", "short"]));
    succeed(mge(here, ["script", "s.mge", "--quiet"]));
    succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", "swept"]));
    let config = |run: &str| std::fs::read_to_string(here.join(run).join("config.json")).unwrap();
    let expected = config("short");
    assert!(expected.contains("\"ddpg-mge-adaptive\""), "{expected}");
    assert_eq!(config("scripted"), expected);
    assert_eq!(config("swept/runs/task1-ddpg-mge-adaptive-seed0"), expected);
}

#[test]
fn an_epsilon_that_cripples_the_method_is_told_by_every_way_to_train() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let told = |output: Output, place: &str| {
        let found = warned(&output);
        assert!(found.len() == 1 && found[0].starts_with(place) && found[0].contains("cripples"), "{found:?}");
    };
    script(here, "episodes 2\nepsilon 0.1");
    sweep(here, &[("episodes", "2"), ("epsilon", "0.1")]);
    told(train(here, &["--episodes", "2", "--epsilon", "0.1", "--out", "a"]), "epsilon 0.1");
    told(mge(here, ["script", "s.mge"]), "s.mge:8: epsilon 0.1");
    for kind in [&["--plan"][..], &["--slurm"], &["--quiet", "--out", "swept"]] {
        told(mge(here, [&["sweep", "s.json"], kind].concat()), "epsilon 0.1");
    }
    let plain = train(here, &["--episodes", "25", "--out", "plain"]);
    assert_eq!(warned(&plain), [""; 0]);
    told(mge(here, ["fork", "plain", "--at", "24", "--set", "epsilon=0.1", "--quiet", "--out", "fork"]), "epsilon 0.1");
}

#[test]
fn a_setting_without_effect_and_a_schedule_longer_than_the_run_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let plain =
        ["--method", "ddpg", "--episodes", "1", "--epsilon", "0.1", "--set", "hold_tolerance=0.2", "--out", "a"];
    let output = mge(here, [&["train", "task1", "--quiet", "--set", "ddpg.hidden=8"], &plain[..]].concat());
    let told = warned(&output);
    assert!(told.len() == 2 && told[0].starts_with("`epsilon` has no effect") && told[1].contains("need"), "{told:?}");
    // In a sweep, a setting may be for some of its methods.
    let both =
        r#"{"task": "task1", "method": ["ddpg", "ddpg-mge"], "epsilon": [0.1, "linear:0.5:0:1000"], "episodes": 500}"#;
    std::fs::write(here.join("s.json"), both).unwrap();
    let told = warned(&mge(here, ["sweep", "s.json", "--plan"]));
    assert!(told.len() == 1 && told[0].contains("after 500 episodes it is 0.25"), "{told:?}");
}
