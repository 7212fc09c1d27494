//! Links, pipes, filesystems without locks, and several writers of one file.
//!
//! Decided in `crates/run/src/`: `append.rs` and `lock.rs` (files with several names), `file.rs` (what is
//! opened at all; also `crates/base/src/bounded.rs`), and `exclusive` in `lock.rs` (locks, and their absence).

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use mge::run::{Notes, RunDirectory, RunState};

use crate::program::{command, fail, mge, succeed, text};

fn train(folder: &Path, run: &str) -> PathBuf {
    let settings = ["--set", "ddpg.hidden=8", "--quiet", "--out", run];
    succeed(mge(folder, [&["train", "task1", "--method", "ddpg", "--episodes", "6"][..], &settings].concat()));
    folder.join(run)
}

fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// All files in a folder, with their content.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(contents(&path));
        } else {
            files.push((path.clone(), std::fs::read(&path).unwrap()));
        }
    }
    files.sort();
    files
}

#[test]
fn a_copy_by_hard_links_does_not_change_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let run = train(folder.path(), "run");
    std::fs::write(run.join("control.jsonl"), "").unwrap();
    assert!(Command::new("cp").current_dir(&folder).args(["-al", "run", "copy"]).status().unwrap().success());
    let before = contents(&run);
    succeed(mge(&folder, ["resume", "copy", "--episodes", "9", "--quiet"]));
    let copy = RunDirectory::open(folder.path().join("copy")).unwrap();
    copy.change_notes(|notes| notes.note = "a copy".to_owned()).unwrap();
    assert!(contents(&run) == before);
    // Each has its own lock. Until then, the writer of one holds that of the other for a moment.
    std::thread::scope(|scope| {
        let held = copy.lock().unwrap();
        scope.spawn(move || {
            std::thread::sleep(std::time::Duration::from_millis(50));
            drop(held);
        });
        copy.check_free().unwrap();
    });
    let _held = copy.lock().unwrap();
    drop(RunDirectory::open(&run).unwrap().lock().unwrap());
}

#[test]
fn no_reader_of_a_named_file_waits_for_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    make_pipe(&folder.path().join("pipe"));
    make_pipe(&folder.path().join("pipe.json"));
    symlink("pipe.json", folder.path().join("link.json")).unwrap();
    let commands = [
        &["--task", "pipe.json"][..],
        &["train", "pipe.json"],
        &["train", "link.json"],
        &["script", "pipe"],
        &["sweep", "pipe.json", "--out", "out"],
        &["play", "task1", "--actions", "pipe.json"],
        &["clusters", "task1", "--model", "pipe"],
        &["play", "--levels", "pipe"],
    ];
    let start = |arguments| {
        let mut command = command(&folder, arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let children = commands.map(start);
    for (arguments, child) in commands.iter().zip(children) {
        let output = child.wait_with_output().unwrap();
        let message = text(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(message.contains("pipe"), "{arguments:?}: {message}");
    }
}

#[test]
fn notes_and_names_of_several_processes_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    RunDirectory::create(folder.path().join("run"), &1).unwrap();
    let script = |name: &str, line: &str| std::fs::write(folder.path().join(name), line.repeat(5)).unwrap();
    for trial in 0..3 {
        script("a", &format!("note run trial-{trial}\n"));
        script("b", &format!("rename run trial-{trial}\n"));
        let children = ["a", "b"].map(|script| command(&folder, ["script", script, "--quiet"]).spawn().unwrap());
        children.into_iter().for_each(|mut child| assert!(child.wait().unwrap().success()));
        let Notes { name, note, .. } = RunDirectory::open(folder.path().join("run")).unwrap().notes().unwrap();
        assert_eq!((name, note), (format!("trial-{trial}"), format!("trial-{trial}")));
    }
    let run = RunDirectory::open(folder.path().join("run")).unwrap();
    run.change_notes(|notes| notes.note.clear()).unwrap();
    std::thread::scope(|scope| {
        for writer in 0..8 {
            let run = &run;
            scope.spawn(move || {
                run.change_notes(|notes| notes.note += &format!("writer-{writer} ")).unwrap();
            });
        }
    });
    assert_eq!(run.notes().unwrap().note.split_whitespace().count(), 8);
}

#[test]
fn without_locks_runs_are_read_and_training_says_what_to_do() {
    const SHIM: &str = "#include <errno.h>\n#include <stdlib.h>\n\
        int flock(int file, int operation) { errno = atoi(getenv(\"FLOCK_ERROR\")); return -1; }\n";
    let folder = tempfile::tempdir().unwrap();
    let run = train(folder.path(), "run");
    let [source, library] = ["flock.c", "flock.so"].map(|name| folder.path().join(name));
    std::fs::write(&source, SHIM).unwrap();
    let compiled = Command::new("cc").args(["-shared", "-fPIC", "-o"]).args([&library, &source]).status();
    if !compiled.is_ok_and(|status| status.success()) {
        #[allow(clippy::print_stderr, reason = "whoever runs the tests should know")]
        {
            eprintln!("skipped: there is no C compiler");
        }
        return;
    }
    for error in [libc::ENOSYS, libc::EOPNOTSUPP, libc::ENOLCK, libc::EINVAL] {
        let without_locks = |arguments: &[&str]| {
            let mut command = command(&folder, arguments);
            command.env("LD_PRELOAD", &library).env("FLOCK_ERROR", error.to_string()).output().unwrap()
        };
        succeed(without_locks(&["evaluate", "run"]));
        succeed(without_locks(&["report", "run", "--out", "report"]));
        std::fs::write(folder.path().join("s"), format!("note run {error}\nopen run")).unwrap();
        succeed(without_locks(&["script", "s", "--quiet"]));
        assert_eq!(RunDirectory::open(&run).unwrap().notes().unwrap().note, error.to_string());
        fail(without_locks(&["resume", "run", "--episodes", "9"]), "its file system has no locks; mount it with them");
        fail(without_locks(&["train", "task1", "--out", "new"]), "or train on a local disk");
        assert!(!folder.path().join("new/config.json").exists());
        std::fs::remove_dir_all(folder.path().join("new")).unwrap();
    }
    assert_eq!(RunDirectory::open(&run).unwrap().status().unwrap().state, RunState::Finished);
}
