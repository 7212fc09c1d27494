//! Whether a run is finished, damaged or the best is judged by all of its files.
//!
//! Decided in `crates/run/src/check.rs` (logs and checkpoints), `trainer::checked_history` (also the configuration)
//! and, for `best`, in `run::checkpoint_actions` and `Training::score`.

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
fn a_run_whose_table_was_cut_is_not_finished_and_is_completed() {
    let (folder, run) = finished();
    let table = run.join("metrics.csv");
    let whole = read(&table);
    edit(&table, |text| without(&text, 10..99));
    assert!(matches!(state(&run), RunState::Incomplete(reason) if reason.contains("ends at episode 9 of 16")));
    fail(
        mge(&folder, ["evaluate", "run"]),
        "metrics.csv: it ends at episode 9 of 16: `mge resume` without --episodes writes it anew",
    );
    fail(mge(&folder, ["report", "run", "--out", "report"]), "metrics.csv: it ends at episode 9 of 16");
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
    assert_eq!(read(&table), whole);
    assert_eq!(state(&run), RunState::Finished);
    assert!(read(&run.join("log.txt")).contains("metrics.csv: it ends at episode 9 of 16"));
}

#[test]
fn a_copy_made_during_training_continues_where_its_files_allow() {
    let (folder, run) = finished();
    let whole = read(&run.join("metrics.csv"));
    // As if `last` had been copied before the run ended, and its log afterwards.
    let last = run.join("checkpoint/last");
    std::fs::rename(&last, run.join("checkpoint/later")).unwrap();
    std::fs::rename(run.join("checkpoint/episode-8"), &last).unwrap();
    std::fs::remove_dir_all(run.join("checkpoint/later")).unwrap();
    assert!(matches!(state(&run), RunState::Incomplete(reason) if reason.contains("of episode 8 of 16")));
    fail(mge(&folder, ["evaluate", "run"]), "`mge resume` continues it");
    succeed(mge(&folder, ["evaluate", "run", "--checkpoint", "8"]));
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
    assert_eq!(read(&run.join("metrics.csv")), whole);
    assert_eq!(state(&run), RunState::Finished);
    // As if the log had been copied before `last` was saved: an earlier checkpoint has to do.
    let (folder, run) = finished();
    edit(&run.join("events.jsonl"), |text| text[..text.find("\"episode\":12,").unwrap()].to_owned());
    let output = mge(&folder, ["resume", "run"]);
    assert!(text(&output.stderr).contains("ends at episode 11, before the checkpoint of episode 16"));
    succeed(output);
    assert_eq!(read(&run.join("metrics.csv")), whole);
    assert_eq!(state(&run), RunState::Finished);
}

#[test]
fn damage_before_the_checkpoint_is_found_by_every_reader() {
    type Edit = fn(String) -> String;
    let edits: [(&str, &str, Edit); 9] = [
        ("events.jsonl", "an event was removed", |text| {
            let line = text.lines().position(|line| line.contains("\"type\":\"evaluated\"")).unwrap();
            without(&text, line..line + 1)
        }),
        ("events.jsonl", "a number was changed", |text| text.replacen("\"mean_return\":", "\"mean_return\":1", 1)),
        ("events.jsonl", "the middle was removed", |text| without(&text, 6..12)),
        ("events.jsonl", "garbage was inserted", |text| text.replacen('\n', "\ngarbage\n", 5)),
        ("metrics.csv", "a row was removed", |text| without(&text, 5..6)),
        ("metrics.csv", "a number was changed", |text| text.replacen(",false,", ",true,", 1)),
        ("episodes.jsonl", "a line was removed", |text| without(&text, 5..6)),
        ("episodes.jsonl", "a number was changed", |text| text.replacen("\"action\":[", "\"action\":[0", 1)),
        ("config.json", "a setting was changed", |text| text.replacen("\"least_hits\": ", "\"least_hits\": 1", 1)),
    ];
    let (folder, run) = finished();
    for (name, what, change) in edits {
        let file = run.join(name);
        let before = read(&file);
        edit(&file, change);
        assert_ne!(read(&file), before, "{what}");
        for command in [
            &["evaluate", "run"][..],
            &["export", "run", "--out", "actor.safetensors"],
            &["report", "run", "--out", "report"],
            &["resume", "run", "--episodes", "20", "--quiet"],
        ] {
            let message = fail(mge(&folder, command), name);
            assert!(message.contains('`') || message.contains("line "), "{what}: {message}");
        }
        std::fs::write(&file, before).unwrap();
    }
    assert_eq!(state(&run), RunState::Finished);
    succeed(mge(&folder, ["report", "run", "--out", "report"]));
}

#[test]
fn resuming_mends_what_follows_from_the_log_and_refuses_the_rest() {
    let (folder, run) = finished();
    let [events, table, episodes] = ["events.jsonl", "metrics.csv", "episodes.jsonl"].map(|name| run.join(name));
    let whole = read(&table);
    edit(&table, |text| without(&text, 5..6));
    edit(&episodes, |text| text.replacen("\"action\":[", "\"action\":[0", 1));
    succeed(mge(&folder, ["resume", "run", "--quiet"]));
    assert_eq!(read(&table), whole);
    let log = read(&run.join("log.txt"));
    assert!(log.contains("no episode left of 16; found on resuming: ") && log.contains("metrics.csv, line 6"), "{log}");
    assert!(log.contains("episodes.jsonl, line 1: not an episode"), "{log}");
    succeed(mge(&folder, ["report", "run", "--out", "report"]));
    // Replays may be removed.
    std::fs::remove_file(&episodes).unwrap();
    assert_eq!(state(&run), RunState::Finished);
    succeed(mge(&folder, ["evaluate", "run"]));
    let before = read(&events);
    edit(&events, |text| text.replacen("\"mean_return\":", "\"mean_return\":1", 1));
    let changed = read(&events);
    let message = fail(mge(&folder, ["report", "run", "--out", "report"]), "events.jsonl: it was changed after");
    assert!(!message.contains("writes it anew"), "resuming refuses it: {message}");
    fail(mge(&folder, ["resume", "run", "--quiet"]), "events.jsonl: it was changed after it was written");
    assert_eq!(read(&events), changed, "nothing else was changed");
    std::fs::write(&events, before).unwrap();
    edit(&run.join("config.json"), |text| text.replacen("\"method\": \"ddpg\"", "\"method\": \"ddpg-uniform\"", 1));
    fail(mge(&folder, ["resume", "run", "--quiet"]), "began with another `method`");
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
