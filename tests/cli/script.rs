//! The shipped scripts and other commands, run as a user would.

use std::path::Path;

use crate::program::{fail, mge, succeed};

#[test]
fn the_tour_runs_and_its_recording_gives_the_same_figures() {
    let folder = tempfile::tempdir().unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/scripts/tour.mge");
    let (first, second) = (folder.path().join("first"), folder.path().join("second"));
    for out in [&first, &second] {
        std::fs::create_dir(out).unwrap();
    }
    let define = format!("out={}", first.display());
    succeed(mge(&folder, ["script", script, "--define", &define, "--quiet"]));

    let recorded = std::fs::read_to_string(first.join("session.mge")).unwrap();
    let moved = recorded.replace(&first.display().to_string(), &second.display().to_string());
    std::fs::write(folder.path().join("again.mge"), moved).unwrap();
    succeed(mge(&folder, ["script", "again.mge", "--quiet"]));
    for file in ["clusters.json", "clusters.csv", "scene.csv", "learning.csv", "run/metrics.csv"] {
        let read = |out: &Path| std::fs::read(out.join(file)).unwrap();
        assert_eq!(read(&first), read(&second), "{file}");
    }
}

#[test]
fn an_invalid_script_fails_before_any_command_runs() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("wrong.mge"), "out nowhere\nepisodes 3\ntrian\n").unwrap();
    let output = mge(&folder, ["script", "wrong.mge"]);
    fail(output, "wrong.mge:3: unknown command `trian`: did you mean `train`?");
}

#[test]
fn wrong_usage_is_status_2() {
    assert_eq!(mge(".", ["train"]).status.code(), Some(2));
    assert_eq!(mge(".", ["train", "task1", "--epsilon", "2"]).status.code(), Some(2));
}

#[test]
fn a_run_is_forked_from_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let rows = |name: &str| -> Vec<String> {
        let text = std::fs::read_to_string(folder.path().join(name).join("metrics.csv")).unwrap();
        text.lines().skip(1).map(str::to_owned).collect()
    };
    let train = "train task1 --method ddpg-uniform --episodes 12 --out run --quiet --set ddpg.hidden=4 \
        --epsilon 0.1 --set ddpg.warmup_steps=8 --set checkpoints.last_every=5";
    succeed(mge(&folder, train.split_whitespace()));
    let changed = ["fork", "run", "--at", "7", "--set", "epsilon=0.9", "--set", "episodes=14", "--quiet"];
    for out in [&[] as &[&str], &["--out", "other"]] {
        let result = succeed(mge(&folder, [&changed[..], out].concat()));
        assert_eq!(result.lines().count(), 1, "only the result of the new run");
    }
    let [source, fork] = ["run", "run-at7"].map(rows);
    assert_eq!((&fork[..7], fork.len()), (&source[..7], 14));
    assert_ne!(fork[7..12], source[7..]);
    assert_eq!(rows("other"), fork, "the same settings make the same run");
    for (arguments, reason) in [
        (&["--at", "13", "--set", "episodes=20"][..], "run has 12 episodes, not 13"),
        (&["--at", "5", "--set", "ddpg.gama=0.5"], "did you mean `ddpg.gamma`?"),
        (&["--at", "5", "--out", "other"], "other"),
    ] {
        fail(mge(&folder, [&["fork", "run"][..], arguments].concat()), reason);
    }
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 3, "a failed fork left files");
}
