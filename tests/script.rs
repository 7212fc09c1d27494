//! The shipped scripts and other commands, run as a user would.

use std::path::Path;
use std::process::{Command, Output};

fn mge(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mge")).args(arguments).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_tour_runs_and_its_recording_gives_the_same_figures() {
    let folder = tempfile::tempdir().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scripts/tour.mge");
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    for out in [&first, &second] {
        std::fs::create_dir(out).unwrap();
    }
    let define = format!("out={}", first.display());
    let output = mge(&["script", script, "--define", &define, "--quiet"]);
    assert!(output.status.success(), "{}", text(&output.stderr));

    let recorded = std::fs::read_to_string(first.join("session.mge")).unwrap();
    let again = folder.path().join("again.mge");
    let moved = recorded.replace(&first.display().to_string(), &second.display().to_string());
    std::fs::write(&again, moved).unwrap();
    let output = mge(&["script", &again.display().to_string(), "--quiet"]);
    assert!(output.status.success(), "{}\n{recorded}", text(&output.stderr));
    for file in ["clusters.json", "clusters.csv", "scene.csv", "learning.csv", "dashboard.csv", "run/metrics.csv"] {
        let read = |out: &Path| std::fs::read(out.join(file)).unwrap();
        assert_eq!(read(&first), read(&second), "{file}");
    }
}

#[test]
fn an_invalid_script_fails_before_any_command_runs() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.mge");
    std::fs::write(&file, "out nowhere\nepisodes 3\ntrian\n").unwrap();
    let output = mge(&["script", &file.display().to_string()]);
    assert_eq!(output.status.code(), Some(1));
    let message = text(&output.stderr);
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(message.contains("wrong.mge:3: unknown command `trian`: did you mean `train`?"), "{message}");
}

#[test]
fn wrong_usage_is_status_2() {
    assert_eq!(mge(&["train"]).status.code(), Some(2));
    assert_eq!(mge(&["train", "task1", "--epsilon", "2"]).status.code(), Some(2));
}

#[test]
fn a_run_is_forked_from_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let rows = |name: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.path().join(name).join("metrics.csv")).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    };
    let small = ["--set", "ddpg.hidden=4", "--set", "ddpg.warmup_steps=8", "--set", "checkpoints.last_every=5"];
    let train = ["train", "task1", "--method", "ddpg-uniform", "--episodes", "12", "--out", &path("run"), "--quiet"];
    let output = mge(&[&train[..], &small].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let changed = ["fork", &path("run"), "--at", "7", "--set", "epsilon=0.9", "--set", "episodes=14", "--quiet"];
    for out in [vec![], vec!["--out".to_owned(), path("other")]] {
        let out: Vec<&str> = out.iter().map(String::as_str).collect();
        let output = mge(&[&changed[..], &out].concat());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert_eq!(text(&output.stdout).lines().count(), 1, "only the result of the new run");
    }
    let [source, fork] = ["run", "run-at7"].map(rows);
    assert_eq!((&fork[..7], fork.len()), (&source[..7], 14));
    assert_ne!(fork[7..12], source[7..]);
    assert_eq!(rows("other"), fork, "the same settings make the same run");
    for (arguments, reason) in [
        (&["--at", "13", "--set", "episodes=20"][..], "the run has 12 episodes, not 13"),
        (&["--at", "5", "--set", "ddpg.gama=0.5"], "did you mean `ddpg.gamma`?"),
        (&["--at", "5", "--out", &path("other")], "other"),
    ] {
        let output = mge(&[&["fork", &path("run")], arguments].concat());
        let message = text(&output.stderr);
        assert_eq!((output.status.code(), message.lines().count()), (Some(1), 1), "{message}");
        assert!(message.contains(reason), "{message}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3, "a failed fork left files");
}
