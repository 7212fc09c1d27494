//! Texts and paths as people write them: byte order marks, `~`, long names, letters of any language.
//!
//! Decided in `crates/base/src/text.rs` (`without_mark`, used by `bounded::read_text` and `json::parse`),
//! `paths.rs` (`~`, lengths of names) and `table.rs` (CSV) beside it, and `crates/task/src/validate.rs`
//! (names of tasks).

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};

use crate::program::{command, fail, mge, succeed};

const TINY: &str = r#""method": "ddpg", "episodes": 2, "ddpg.hidden": 4"#;

/// Runs the program with a home folder and an input.
fn at_home(folder: &Path, arguments: &[&str], input: &[u8]) -> Output {
    let mut command = command(folder, arguments);
    command.env("HOME", folder.join("home")).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut program = command.spawn().unwrap();
    // The program may end before it has read everything.
    let _ = program.stdin.take().unwrap().write_all(input);
    program.wait_with_output().unwrap()
}

fn script(folder: &Path, lines: &str) -> Output {
    fs::write(folder.join("script.mge"), lines).unwrap();
    at_home(folder, &["script", "script.mge", "--quiet"], b"")
}

/// Every text that the user names or pipes in: the arguments, and the name and the text of the file; `-` is standard
/// input.
fn texts() -> Vec<(Vec<&'static str>, &'static str, String)> {
    let level = r#"{"version": 1}"#;
    vec![
        (vec!["sweep", "--plan", "a.json"], "a.json", format!(r#"{{"task": "task1", {TINY}}}"#)),
        (vec!["play", "task1", "--actions", "b.json"], "b.json", "[[0.5, 0.9]]".to_owned()),
        (vec!["env", "serve", "task1"], "-", r#"{"reset": {}}"#.to_owned() + "\n"),
        (vec!["tasks", "check", "c.json"], "c.json", fs::read_to_string("tasks/task1.json").unwrap()),
        (vec!["script", "d.mge"], "d.mge", "episodes 3\n".to_owned()),
        (vec!["play", "--levels", "e.json"], "e.json", level.to_owned()),
    ]
}

#[test]
fn a_byte_order_mark_is_skipped_and_utf_16_and_32_are_named_in_every_text() {
    for (arguments, name, text) in texts() {
        let folder = tempfile::tempdir().unwrap();
        let given = |bytes: &[u8]| {
            if name == "-" {
                return at_home(folder.path(), &arguments, bytes);
            }
            fs::write(folder.path().join(name), bytes).unwrap();
            at_home(folder.path(), &arguments, b"")
        };
        let plain = given(text.as_bytes());
        let marked = given(format!("\u{feff}{text}").as_bytes());
        assert_eq!(marked, plain, "{arguments:?}");
    }
}

#[test]
fn a_tilde_is_the_home_folder_where_no_shell_has_seen_it() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, home) = (folder.path(), folder.path().join("home"));
    fs::create_dir(&home).unwrap();
    let lines = "subgoal add 0.5 0.5\nsave ~/t.json\ntask ~/t.json\nmethod ddpg\nepisodes 1\nset ddpg.hidden 4\n\
                 out ~/a\ntrain\nwait\nfigure scene ~/f.PNG\nfigure learning ~/g.png runs=~/a\nrecord ~/s.mge\nwait\n";
    succeed(script(folder, lines));
    for file in ["t.json", "f.PNG", "g.png", "s.mge", "a/t-ddpg-seed0/config.json"] {
        assert!(home.join(file).is_file(), "{file}");
    }
    // Options, the environment and JSON.
    succeed(at_home(folder, &["export", "~/a/t-ddpg-seed0", "--out=~/actor.safetensors"], b""));
    assert!(home.join("actor.safetensors").is_file());
    let mut train = command(folder, ["train", "~/t.json", "--method=ddpg", "--episodes=1", "--set=ddpg.hidden=4"]);
    succeed(train.env("HOME", &home).env("MGE_RUNS", "~/b").output().unwrap());
    assert!(home.join("b/t-ddpg-seed0").is_dir());
    fs::write(folder.join("sweep.json"), format!(r#"{{"task": "~/t.json", {TINY}}}"#)).unwrap();
    let plan = succeed(at_home(folder, &["sweep", "sweep.json", "--plan", "--out=~/c"], b""));
    assert!(!plan.contains('~') && plan.contains(&home.join("t.json").display().to_string()), "{plan}");
    assert!(!folder.join("~").exists());
    // A name that a spreadsheet would compute.
    let options = ["--set", "curve=DDPG", "--set", "name==HYPERLINK(1)"];
    let arguments = [&["figures", "home/a/t-ddpg-seed0", "--svg", "--out", "."][..], &options[..]].concat();
    succeed(at_home(folder, &arguments, b""));
    let table = fs::read_to_string(folder.join("learning.csv")).unwrap();
    assert!(table.contains("'=HYPERLINK(1)") && !table.contains("\n=") && !table.contains(",="), "{table}");
}

#[test]
fn names_of_runs_fit_into_a_file_system() {
    let folder = tempfile::tempdir().unwrap();
    let lists = "ddpg.gamma 0.9,ddpg.tau 0.01,ddpg.batch_size 4,ddpg.replay_capacity 100,ddpg.warmup_steps 4,\
                 ddpg.actor_learning_rate 0.01,ddpg.critic_learning_rate 0.01,ddpg.updates_per_step 1,ddpg.layers 2,\
                 ddpg.hidden 4,ddpg.ou.theta 0.1,ddpg.ou.mu 0.1,ddpg.ou.sigma 0.1,evaluation.every 1,\
                 evaluation.episodes 1,checkpoints.last_every 1,noise_decay.share 0.4,noise_decay.final_scale 0.1,\
                 checkpoints.periodic_every 1,start_noise 0.01";
    let lists: Vec<String> = lists
        .split(',')
        .map(|list| list.split_once(' ').unwrap())
        .map(|(key, value)| format!("\"{key}\": [{value}]"))
        .collect();
    assert_eq!(lists.len(), 20);
    let sweep =
        format!(r#"{{"task": "task1", "method": "ddpg", "episodes": 2, "seed": [3, 4], {}}}"#, lists.join(", "));
    let path = folder.path().join("sweep.json");
    fs::write(&path, sweep).unwrap();
    let plan = succeed(mge(folder.path(), ["sweep", "sweep.json", "--slurm"]));
    assert!(plan.contains("--array=0-1"), "{plan}");
    succeed(mge(folder.path(), ["sweep", "sweep.json", "--quiet", "--out", "out"]));
    let runs = fs::read_dir(folder.path().join("out/runs")).unwrap();
    let mut names: Vec<String> = runs.map(|run| run.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert!(names.len() == 2 && names.iter().all(|name| name.len() == 255), "{names:?}");
    assert!(names[0].ends_with("-seed3") && names[1].ends_with("-seed4"), "{names:?}");
    // What cannot be run is not planned.
    fs::write(folder.path().join("file"), "").unwrap();
    for how in ["--plan", "--slurm", "--quiet"] {
        fail(mge(folder.path(), ["sweep", "sweep.json", how, "--out", "file"]), "file");
    }
}

#[test]
fn names_of_tasks_have_letters_of_any_language() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["übung", "u\u{308}bung-2", "テスト", "задача_1", "😀"] {
        let lines = format!("subgoal add 0.5 0.5\nsave {name}.json\ntask {name}.json\nfigure scene {name}.png\nwait\n");
        succeed(script(folder.path(), &lines));
        assert!(folder.path().join(format!("{name}.png")).is_file(), "{name}");
    }
    for name in ["a\u{202e}b", "a\u{a0}b", "\u{feff}", "a\u{2028}b"] {
        fail(script(folder.path(), &format!("subgoal add 0.5 0.5\nsave '{name}.json'\n")), "name: must be letters");
    }
}
