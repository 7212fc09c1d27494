//! What a result depends on is identified by its content, not by its path.
//!
//! Decided in `crates/base/src/identity.rs` (hashes, version, origin of results) and `crates/trainer/src/model_file.rs`
//! (models of runs); the checksum of tensor files is in `crates/nn/src/tensor_file.rs`.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::program::{fail, mge, succeed};

const PLANNING: &str = "train task1 --method planning --quiet --set planner.rollouts=20 --set planner.iterations=1";
const GUIDED: &str = "train task1 --method ddpg-mge --epsilon 0.5 --quiet --episodes 3 --set ddpg.hidden=8 \
                      --set guidance.model_rollouts=50 --set guidance.environment_rollouts=4";

fn words(line: &str) -> std::str::SplitWhitespace<'_> {
    line.split_whitespace()
}

#[track_caller]
fn run(folder: impl AsRef<Path>, line: &str) -> String {
    succeed(mge(folder, words(line)))
}

/// Trains two small models of task 1: `a/mine.safetensors` and, on other launches, `other.safetensors`.
fn models() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("a")).unwrap();
    for (seed, file) in [(0, "a/mine.safetensors"), (1, "other.safetensors")] {
        let options = "--layers 1 --observations 4 --epochs 1 --set batch=4 --quiet";
        run(&folder, &format!("dynamics train --tools box,bucket --seed {seed} {options} --out {file}"));
    }
    folder
}

fn copy(folder: &TempDir, from: &str, to: &str) {
    let to = folder.path().join(to);
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    fs::copy(folder.path().join(from), to).unwrap();
}

fn read(path: PathBuf) -> Vec<u8> {
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn json_of(text: &[u8]) -> Value {
    serde_json::from_slice(text).unwrap()
}

/// The labels of all runs below a folder, in a report.
fn labels(folder: &TempDir, runs: &str) -> Vec<String> {
    run(folder, &format!("report {runs} --out {runs}/report"));
    let report = json_of(&read(folder.path().join(runs).join("report/report.json")));
    assert!(!report.to_string().contains(&*folder.path().to_string_lossy()), "a private path");
    let mut labels: Vec<String> =
        report["aggregates"].as_array().unwrap().iter().map(|row| row["method"].as_str().unwrap().to_owned()).collect();
    labels.sort();
    labels.dedup();
    labels
}

#[test]
fn copies_of_a_model_are_one_method_and_other_content_is_another() {
    let folder = models();
    copy(&folder, "a/mine.safetensors", "b/mine.safetensors");
    copy(&folder, "a/mine.safetensors", "yours.safetensors");
    copy(&folder, "other.safetensors", "c/mine.safetensors");
    for (seed, model) in ["a/mine", "b/mine", "yours"].iter().enumerate() {
        run(&folder, &format!("{GUIDED} --model {model}.safetensors --seed {seed} --out same/{seed}"));
    }
    let same = labels(&folder, "same");
    assert_eq!(same.len(), 1, "{same:?}");
    let config = json_of(&read(folder.path().join("same/0/config.json")));
    let model = config["config"]["prior"].as_str().unwrap();
    assert!(model.starts_with("mine@sha256:") && model.len() == 76, "{model}");
    let [copied, file] = ["same/0/model.safetensors", "a/mine.safetensors"].map(|file| read(folder.path().join(file)));
    assert_eq!(copied, file);

    fs::rename(folder.path().join("same/0"), folder.path().join("same/first")).unwrap();
    run(&folder, &format!("{GUIDED} --model c/mine.safetensors --out same/other"));
    let differing = labels(&folder, "same");
    assert_eq!(differing.len(), 2, "{differing:?}");
    assert!(differing.iter().all(|label| label.contains("model mine (")), "{differing:?}");

    // The shipped model is the same under its name, in a file and by default.
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/bucket-box.safetensors");
    fs::copy(shipped, folder.path().join("copied.safetensors")).unwrap();
    for (seed, model) in ["learned", "bucket-box", "copied.safetensors"].iter().enumerate() {
        run(&folder, &format!("{GUIDED} --model {model} --seed {seed} --out shipped/{seed}"));
    }
    assert_eq!(labels(&folder, "shipped").len(), 1);
}

#[test]
fn a_run_goes_on_with_its_own_model_after_its_file_was_replaced_or_moved() {
    let folder = models();
    // The noise depends on the number of episodes, so this run is extended too.
    run(&folder, &format!("{PLANNING} --model other.safetensors --episodes 3 --out whole"));
    run(&folder, "resume whole --episodes 6 --quiet");
    copy(&folder, "other.safetensors", "model.safetensors");
    run(&folder, &format!("{PLANNING} --model model.safetensors --episodes 3 --out run"));
    copy(&folder, "a/mine.safetensors", "model.safetensors");
    run(&folder, "resume run --episodes 6 --quiet");
    let [whole, resumed] = ["whole", "run"].map(|run| read(folder.path().join(run).join("metrics.csv")));
    assert_eq!(whole, resumed);

    // A fork from another folder finds it too, and has a copy of its own.
    let elsewhere = tempfile::tempdir().unwrap();
    let source = folder.path().join("run").display().to_string();
    run(&elsewhere, &format!("fork {source} --at 4 --out fork --quiet"));
    assert_eq!(read(elsewhere.path().join("fork/metrics.csv")), whole);
    let [copied, file] =
        [elsewhere.path().join("fork/model.safetensors"), folder.path().join("other.safetensors")].map(read);
    assert_eq!(copied, file);

    // What is not the run's model is not used in its place.
    copy(&folder, "a/mine.safetensors", "run/model.safetensors");
    fail(mge(&folder, words("resume run --episodes 7 --quiet")), "is not the model `model`");
    assert_eq!(read(folder.path().join("run/metrics.csv")), whole);
}

#[test]
fn a_guided_run_is_not_continued_without_its_model_though_its_clusters_are_saved() {
    let folder = models();
    run(&folder, &format!("{GUIDED} --model other.safetensors --out run"));
    let [metrics, own] = ["metrics.csv", "model.safetensors"].map(|file| folder.path().join("run").join(file));
    let before = read(metrics.clone());
    let model = read(own.clone());
    copy(&folder, "a/mine.safetensors", "run/model.safetensors");
    fail(mge(&folder, words("resume run --episodes 5 --quiet")), "is not the model `other`");
    fs::remove_file(&own).unwrap();
    fail(mge(&folder, words("resume run --episodes 5 --quiet")), "model.safetensors");
    assert_eq!(read(metrics.clone()), before);
    fs::write(&own, model).unwrap();
    run(&folder, "resume run --episodes 5 --quiet");
    assert_ne!(read(metrics), before);
}

#[test]
fn a_run_of_an_earlier_version_finds_its_model_by_its_path() {
    let folder = models();
    // The noise depends on the number of episodes, so this run is extended too.
    run(&folder, &format!("{PLANNING} --model other.safetensors --episodes 3 --out whole"));
    run(&folder, "resume whole --episodes 6 --quiet");
    run(&folder, &format!("{PLANNING} --model other.safetensors --episodes 3 --out run"));
    let path = folder.path().join("run/config.json");
    let mut config = json_of(&read(path.clone()));
    config["config"]["prior"] = json!("other.safetensors");
    fs::write(&path, config.to_string()).unwrap();
    fs::remove_file(folder.path().join("run/model.safetensors")).unwrap();
    // Nor did checkpoints hold the configuration.
    let checkpoint = folder.path().join("run/checkpoint/last");
    let mut manifest = json_of(&read(checkpoint.join("manifest.json")));
    manifest["sections"].as_array_mut().unwrap().retain(|section| section["name"] != "config.json");
    fs::write(checkpoint.join("manifest.json"), manifest.to_string()).unwrap();
    fs::remove_file(checkpoint.join("config.json")).unwrap();
    run(&folder, "resume run --episodes 6 --quiet");
    let [whole, resumed] = ["whole", "run"].map(|run| read(folder.path().join(run).join("metrics.csv")));
    assert_eq!(whole, resumed);
}

#[test]
fn a_moved_sweep_trains_nothing_again_and_a_replaced_model_is_noticed() {
    let folder = models();
    let sweep = |model: &Value| {
        json!({"task": "task1", "method": "ddpg-mge", "epsilon": 0.5, "model": model, "episodes": 2, "ddpg.hidden": 8,
               "guidance.model_rollouts": 50, "guidance.environment_rollouts": 4})
        .to_string()
    };
    copy(&folder, "a/mine.safetensors", "project/m/mine.safetensors");
    let project = folder.path().join("project");
    fs::write(project.join("listed.json"), sweep(&json!(["m/mine.safetensors"]))).unwrap();
    fs::write(project.join("single.json"), sweep(&json!("m/mine.safetensors"))).unwrap();
    let runs = |project: &Path| {
        let runs = project.join("sweeps/listed/runs");
        let mut found: Vec<(String, Vec<u8>)> = fs::read_dir(runs)
            .unwrap()
            .map(|run| run.unwrap())
            .map(|run| (run.file_name().into_string().unwrap(), read(run.path().join("events.jsonl"))))
            .collect();
        found.sort();
        found
    };
    for name in ["listed", "single"] {
        run(&project, &format!("sweep {name}.json --quiet"));
    }
    let before = runs(&project);
    assert!(before.len() == 1 && before[0].0.contains("model_mine-"), "{:?}", before[0].0);

    let moved = folder.path().join("moved");
    fs::rename(&project, &moved).unwrap();
    for name in ["listed", "single"] {
        run(&moved, &format!("sweep {name}.json --quiet"));
    }
    assert_eq!(runs(&moved), before);

    copy(&folder, "other.safetensors", "moved/m/mine.safetensors");
    run(&moved, "sweep listed.json --quiet");
    let after = runs(&moved);
    assert!(after.len() == 2 && after.contains(&before[0]), "{:?}", after.iter().map(|run| &run.0).collect::<Vec<_>>());
    fail(mge(&moved, words("sweep single.json --quiet")), "or with another model");
}

#[test]
fn results_name_their_model_and_the_program() {
    let folder = models();
    let prior = json_of(run(&folder, "clusters task1 --model a/mine.safetensors").as_bytes());
    assert_eq!(prior["model"], "mine");
    assert_eq!(prior["model_sha256"].as_str().map(str::len), Some(64));
    let evaluation = "--launches 10 --rollouts 10 --quiet";
    let evaluation = json_of(run(&folder, &format!("dynamics evaluate a/mine.safetensors {evaluation}")).as_bytes());
    assert_eq!((&evaluation["model"], &evaluation["model_sha256"]), (&json!("mine"), &prior["model_sha256"]));

    let version = run(&folder, "--version").trim().replacen("mge ", "", 1);
    assert!(version.starts_with(env!("CARGO_PKG_VERSION")), "{version}");
    let is_checkout = Path::new(env!("CARGO_MANIFEST_DIR")).join(".git").exists();
    assert_eq!(version.contains('('), is_checkout, "{version}");
    run(&folder, &format!("{GUIDED} --out run"));
    let started = started(&folder, "run");
    assert_eq!(started["mge_version"], version);
    assert!(started["models"][0].as_str().unwrap().starts_with("bucket-box@sha256:"), "{started}");
    assert!(!started["processor"].as_str().unwrap().is_empty());
}

/// The first event of a run.
fn started(folder: &TempDir, run: &str) -> Value {
    let events = read(folder.path().join(run).join("events.jsonl"));
    json_of(events.split(|byte| *byte == b'\n').next().unwrap())
}

/// Changes the log of a run as if it had been trained on a processor of another kind.
fn on_another_processor(folder: &TempDir, run: &str) {
    let path = folder.path().join(run).join("events.jsonl");
    let processor = started(folder, run)["processor"].to_string();
    let events = fs::read_to_string(&path).unwrap();
    assert!(events.contains(&processor));
    fs::write(&path, events.replace(&processor, r#""m68k portable""#)).unwrap();
}

#[test]
fn a_resume_on_another_kind_of_processor_says_so() {
    let folder = tempfile::tempdir().unwrap();
    run(&folder, &format!("{GUIDED} --out run"));
    on_another_processor(&folder, "run");
    let resumed = mge(&folder, words("resume run --episodes 5"));
    let shown = String::from_utf8_lossy(&resumed.stderr).into_owned();
    succeed(resumed);
    let log = fs::read_to_string(folder.path().join("run/log.txt")).unwrap();
    for text in [&shown, &log] {
        assert!(text.contains("results may differ") && text.contains("not m68k portable"), "{text}");
    }
}

#[test]
fn a_changed_byte_anywhere_in_a_model_file_is_noticed() {
    let folder = models();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/square-floor.safetensors");
    fs::copy(shipped, folder.path().join("shipped.safetensors")).unwrap();
    for file in ["a/mine.safetensors", "shipped.safetensors"] {
        let path = folder.path().join(file);
        let bytes = read(path.clone());
        let cutoff = bytes.windows(6).position(|window| window == b"cutoff").unwrap();
        let header = 8 + u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        let digit = cutoff + bytes[cutoff..].iter().position(u8::is_ascii_digit).unwrap();
        // The cutoff, bytes all over the metadata, and a value.
        let places = (8..header).step_by(header / 15).chain([digit, bytes.len() - 3]);
        for place in places {
            let mut changed = bytes.clone();
            changed[place] = if place == digit && changed[place] == b'8' { b'9' } else { changed[place] ^ 1 };
            fs::write(&path, changed).unwrap();
            let output = mge(&folder, words(&format!("dynamics evaluate {file} --launches 1 --rollouts 1 --quiet")));
            assert!(!output.status.success(), "{file}, byte {place}");
        }
    }
}
