//! The shipped scripts, played by the program itself as a user would.

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
fn a_wrong_script_fails_before_it_does_anything() {
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
