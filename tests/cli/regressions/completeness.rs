//! Whether a run is finished, damaged or the best is judged by all of its files.
//!
//! Decided in `run::RunDirectory::newest_checkpoint`, `run::RunHistory::read` and, for `best`, in
//! `run::CheckpointStore::due` and `Training::score`.

use std::path::{Path, PathBuf};

use mge::run::{CheckpointName, RunDirectory, RunState};

use crate::program::{fail, mge, succeed, text};

const TRAIN: [&str; 15] = [
    "train",
    "task1",
    "--method",
    "ddpg",
    "--episodes",
    "16",
    "--set",
    "ddpg.hidden=8",
    "--set",
    "evaluation.every=4",
    "--set",
    "checkpoints.periodic_every=8",
    "--quiet",
    "--out",
    "run",
];

/// A folder with a finished run.
fn finished() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    succeed(mge(&folder, TRAIN));
    let run = folder.path().join("run");
    assert_eq!(state(&run), RunState::Finished);
    (folder, run)
}

fn state(run: &Path) -> RunState {
    RunDirectory::open(run).unwrap().status().unwrap().state
}

fn read(file: &Path) -> String {
    std::fs::read_to_string(file).unwrap()
}

/// Changes a file of a run.
fn edit(file: &Path, change: impl FnOnce(String) -> String) {
    std::fs::write(file, change(read(file))).unwrap();
}

/// A text without the lines with these numbers, from 0.
fn without(text: &str, lines: std::ops::Range<usize>) -> String {
    let kept = text.lines().enumerate().filter(|(number, _)| !lines.contains(number));
    kept.map(|(_, line)| line.to_owned() + "\n").collect()
}

#[test]
fn a_table_that_was_changed_is_written_anew() {
    let (folder, run) = finished();
    let table = run.join("metrics.csv");
    let whole = read(&table);
    edit(&table, |text| without(&text, 10..99));
    succeed(mge(&folder, ["report", "run", "--out", "report"]));
    succeed(mge(&folder, ["resume", "run", "--episodes", "20", "--quiet"]));
    assert!(read(&table).starts_with(&whole));
}

#[test]
fn a_log_that_ends_before_the_checkpoint_is_found_and_an_earlier_checkpoint_continues() {
    let (folder, run) = finished();
    let whole = read(&run.join("metrics.csv"));
    edit(&run.join("events.jsonl"), |text| text[..text.find("\"episode\":12,").unwrap()].to_owned());
    fail(mge(&folder, ["report", "run", "--out", "report"]), "events.jsonl ends at episode 11, before the checkpoint");
    let output = mge(&folder, ["resume", "run"]);
    assert!(text(&output.stderr).contains("ends at episode 11, before the checkpoint of episode 16"));
    succeed(output);
    assert_eq!(read(&run.join("metrics.csv")), whole);
    assert_eq!(state(&run), RunState::Finished);
}

#[test]
fn damage_is_found_by_its_readers() {
    let (folder, run) = finished();
    let [events, config] = ["events.jsonl", "config.json"].map(|name| run.join(name));
    type Edit = fn(String) -> String;
    let edits: [(&str, Edit); 2] = [
        ("events.jsonl, line 8: episode 9 follows episode 4", |text| without(&text, 6..12)),
        ("events.jsonl, line 6: not an event", |text| {
            let mut lines: Vec<&str> = text.lines().collect();
            lines.insert(5, "garbage");
            lines.join("\n") + "\n"
        }),
    ];
    let whole = read(&events);
    for (message, change) in edits {
        edit(&events, change);
        for command in [&["report", "run", "--out", "report"][..], &["resume", "run", "--episodes", "20", "--quiet"]] {
            fail(mge(&folder, command), message);
        }
        std::fs::write(&events, &whole).unwrap();
    }
    // Replays may be removed.
    std::fs::remove_file(run.join("episodes.jsonl")).unwrap();
    assert_eq!(state(&run), RunState::Finished);
    succeed(mge(&folder, ["evaluate", "run"]));
    edit(&config, |text| text.replacen("\"method\": \"ddpg\"", "\"method\": \"ddpg-uniform\"", 1));
    fail(mge(&folder, ["resume", "run", "--episodes", "20", "--quiet"]), "began with another `method`");
}

#[test]
fn a_refused_resume_gives_its_reason_once() {
    let (folder, run) = finished();
    let is_end = |line: &&str| line.contains("\"type\":\"finished\"");
    edit(&run.join("events.jsonl"), |text| {
        text.lines().filter(|line| !is_end(line)).map(|l| l.to_owned() + "\n").collect()
    });
    edit(&run.join("config.json"), |text| text.replacen("\"method\": \"ddpg\"", "\"method\": \"ddpg-uniform\"", 1));
    fail(mge(&folder, ["resume", "run"]), "began with another `method`");
}

#[test]
fn a_damaged_checkpoint_with_several_names_is_named_once() {
    let (folder, run) = finished();
    // The files of a checkpoint are shared by its names.
    edit(&run.join("checkpoint/last/progress.json"), |text| text + " ");
    let output = mge(&folder, ["resume", "run", "--episodes", "20"]);
    let told = text(&output.stderr);
    assert!(output.status.success() && told.contains("episodes 9 to 20"), "{told}");
    assert_eq!(told.matches("a checkpoint cannot be used").count(), 1, "{told}");
}

#[test]
fn a_run_with_a_damaged_log_is_not_called_finished() {
    let (folder, run) = finished();
    edit(&run.join("events.jsonl"), |text| text.replacen("\"episode\":12,", "", 1));
    let told = fail(mge(&folder, ["resume", "run"]), "not an event");
    assert!(!told.contains("is finished"), "{told}");
}

#[test]
fn what_only_shows_the_log_is_written_anew() {
    let (folder, run) = finished();
    let lines = |text: &str| Vec::from_iter(text.lines().filter(|line| line.contains("] episode ")).map(str::to_owned));
    let (table, log) = (read(&run.join("metrics.csv")), lines(&read(&run.join("log.txt"))));
    let size = || {
        let files = std::fs::read_dir(run.join("tensorboard")).unwrap().map(|file| file.unwrap().path());
        files.map(|file| std::fs::metadata(file).unwrap().len()).collect::<Vec<_>>()
    };
    let before = size();
    std::fs::remove_dir_all(run.join("tensorboard")).unwrap();
    std::fs::write(run.join("log.txt"), "damaged").unwrap();
    succeed(mge(&folder, ["resume", "run", "--episodes", "20", "--quiet"]));
    assert!(matches!((&before[..], &size()[..]), ([before], [after]) if before < after), "one file with all episodes");
    let again = read(&run.join("log.txt"));
    assert!(lines(&again).starts_with(&log) && again.ends_with("finished after 20 episodes\n"), "{again}");
    assert!(read(&run.join("metrics.csv")).starts_with(&table));
}

#[test]
fn every_command_with_an_agent_takes_a_checkpoint() {
    let (folder, run) = finished();
    let checkpoints = RunDirectory::open(&run).unwrap().checkpoints();
    let best = checkpoints.load(CheckpointName::Best).unwrap().episode;
    for (name, episode) in [("last", 16), ("best", best), ("8", 8), ("episode-8", 8), ("16", 16)] {
        let lines = succeed(mge(&folder, ["evaluate", "run", "--checkpoint", name]));
        assert!(lines.contains(&format!("\"checkpoint\":{episode},")), "{name}: {lines}");
    }
    let actor = |name: &str| {
        succeed(mge(&folder, ["export", "run", "--out", "actor.safetensors", "--checkpoint", name]));
        std::fs::read(folder.path().join("actor.safetensors")).unwrap()
    };
    assert_eq!(actor("16"), actor("last"));
    fail(mge(&folder, ["evaluate", "run", "--checkpoint", "7"]), "there is no checkpoint episode-7");
}

#[test]
fn best_is_judged_by_many_episodes_where_starts_differ() {
    let folder = tempfile::tempdir().unwrap();
    let noise = ["--set", "start_noise=0.1", "--set", "evaluation.every=2"];
    let settings = ["--set", "ddpg.hidden=8", "--quiet", "--out", "run"];
    succeed(mge(
        &folder,
        [&["train", "task1", "--method", "ddpg", "--episodes", "12"][..], &noise, &settings].concat(),
    ));
    let run = folder.path().join("run");
    let best = RunDirectory::open(&run).unwrap().checkpoints().load(CheckpointName::Best).unwrap();
    let wanted = format!("\"type\":\"evaluated\",\"episode\":{},", best.episode);
    let events = read(&run.join("events.jsonl"));
    let single = events.lines().find(|line| line.contains(&wanted)).unwrap();
    let mean = single.split("\"mean_return\":").nth(1).unwrap().trim_end_matches('}').parse::<f64>().unwrap();
    assert_ne!(best.score, Some(mean), "its score is not that of the single episode of the evaluation");
}
