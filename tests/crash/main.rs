//! A crash at every operation on files: a command is killed, or an operation fails, at operation k; then the work is
//! continued without a fault, and every file must equal that of an undisturbed command.
//!
//! `cargo test --test crash` tests a sample of the operations of each command;
//! `cargo test --test crash -- --ignored --nocapture` tests all of them and prints how many.
//! `MGE_CRASH_PROGRAM` names a binary other than the one built with the test.
//! Needs Linux and a C compiler named `cc`; without a compiler the tests are skipped with a note.

#![cfg(target_os = "linux")]
// Notes what was skipped and how much was tested.
#![allow(clippy::print_stderr)]

#[path = "../cli/program.rs"]
#[allow(dead_code, reason = "shared: each test file needs a part of it")]
mod program;

mod power;
mod tensorboard;

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use power::{Disk, Kept};
use program::{MGE, succeed, text};

/// The program under test.
fn tested_program() -> String {
    std::env::var("MGE_CRASH_PROGRAM").unwrap_or_else(|_| MGE.to_owned())
}

const SIGKILL: i32 = 9;

/// Kinds of faults, as `faults.c` names them.
const KINDS: [&str; 5] = ["kill", "torn", "eio", "full", "short"];

/// Settings of a training of a tenth of a second that writes every kind of file.
const TRAINING: &str = "--method ddpg-mge-true --epsilon 0.5 --episodes 8 --quiet --set ddpg.hidden=4 \
    --set ddpg.replay_capacity=40 --set ddpg.batch_size=4 --set ddpg.warmup_steps=10 --set checkpoints.last_every=3 \
    --set checkpoints.periodic_every=3 --set checkpoints.periodic_kept=1 --set evaluation.every=3 \
    --set guidance.model_rollouts=20 --set guidance.environment_rollouts=10 --set refinement.every=4 \
    --set refinement.least=1";

/// The library that injects faults, compiled once; `None` without a compiler.
fn library() -> Option<&'static Path> {
    static LIBRARY: OnceLock<Option<PathBuf>> = OnceLock::new();
    let compile = || {
        let library = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faults.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/crash/faults.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&library).arg(source);
        match compiler.status() {
            Ok(status) => assert!(status.success(), "faults.c does not compile"),
            Err(error) => {
                eprintln!("skipped: no C compiler `cc`: {error}");
                return None;
            }
        }
        Some(library)
    };
    LIBRARY.get_or_init(compile).as_deref()
}

/// A fault at operation `at`, counted from 1, on the files in `folder`; with 0 no operation fails.
struct Fault<'a> {
    folder: &'a Path,
    kind: &'a str,
    at: usize,
    log: Option<&'a Path>,
    trace: Option<&'a Path>,
}

/// Runs a line of arguments, in which `@` is the folder.
fn mge(line: &str, folder: &Path, fault: Option<&Fault<'_>>) -> Output {
    let mut command = Command::new(tested_program());
    command.args(line.split_whitespace().map(|word| word.replace('@', &folder.display().to_string())));
    command.envs(library().map(|library| ("LD_PRELOAD", library)));
    if let Some(fault) = fault {
        command.env("FAULT_ROOT", fault.folder);
        command.env("FAULT_KIND", fault.kind).env("FAULT_AT", fault.at.to_string());
        command.envs(fault.log.map(|log| ("FAULT_LOG", log)));
        command.envs(fault.trace.map(|trace| ("FAULT_TRACE", trace)));
    }
    command.output().expect("the program starts")
}

/// Work that one command does and others continue after a fault.
struct Work {
    name: &'static str,
    /// Prepares an empty folder.
    prepare: fn(&Path),
    /// The command that suffers the fault.
    command: String,
    /// Commands that a user gives afterwards: each in turn until one succeeds.
    repair: Vec<String>,
}

fn works() -> Vec<Work> {
    let train = format!("train task1 {TRAINING} --out @/run");
    let resume = "resume @/run --quiet".to_owned();
    let sweep = "sweep @/s.json --out @/sweep --threads 1 --quiet".to_owned();
    let model =
        "dynamics train --tools box --epochs 3 --seed 2 --observations 20 --quiet --out @/m.safetensors".to_owned();
    let script = "script @/s.mge --quiet".to_owned();
    let figures = "figures @/run --out @/figures --svg".to_owned();
    let session = ["all", "rest", "end"].map(|name| format!("script @/{name}.mge --quiet"));
    let nothing: fn(&Path) = |_| {};
    vec![
        Work { name: "train", prepare: nothing, repair: vec![resume.clone(), train.clone()], command: train },
        Work { name: "resume", prepare: interrupted_run, repair: vec![resume.clone()], command: resume },
        Work { name: "sweep", prepare: sweep_file, repair: vec![sweep.clone()], command: sweep },
        Work { name: "model", prepare: nothing, repair: vec![model.clone()], command: model },
        Work { name: "task", prepare: script_file, repair: vec![script.clone()], command: script },
        Work { name: "session", prepare: session_files, command: session[0].clone(), repair: session.to_vec() },
        Work { name: "figures", prepare: finished_run, repair: vec![figures.clone()], command: figures },
    ]
}

/// A run that was killed in the middle of its second checkpoint.
fn interrupted_run(folder: &Path) {
    let line = format!("train task1 {TRAINING} --out @/run");
    let output = mge(&line, folder, Some(&Fault { folder, kind: "kill", at: 100, log: None, trace: None }));
    assert_eq!(output.status.signal(), Some(SIGKILL));
}

fn finished_run(folder: &Path) {
    succeed(mge(&format!("train task1 {TRAINING} --out @/run"), folder, None));
}

fn sweep_file(folder: &Path) {
    let file = r#"{"task": "task1", "method": "ddpg", "seed": [0, 1], "episodes": 4, "ddpg.hidden": 4,
        "ddpg.replay_capacity": 20, "checkpoints.last_every": 2, "evaluation.every": 2}"#;
    std::fs::write(folder.join("s.json"), file).unwrap();
}

fn script_file(folder: &Path) {
    let own = folder.join("own.json");
    std::fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("tasks/task2.json"), &own).unwrap();
    std::fs::write(
        folder.join("s.mge"),
        format!("task task1\nsubgoal move 1 0.05 0.2\nsave {} force\n", own.display()),
    )
    .unwrap();
}

/// Scripts of a session that edits, saves, trains, computes and exports (`all`), and of its continuation if the training
/// was begun (`rest`) or is over (`end`).
fn session_files(folder: &Path) {
    let at = folder.display();
    let edited = format!("task task1\nsubgoal move 1 0.05 0.2\nsave {at}/own.json\n");
    let settings = "method ddpg\nmodel uniform\nepisodes 8\nset ddpg.hidden 4\nset ddpg.replay_capacity 20\n\
        set checkpoints.last_every 3\n";
    let rest = format!(
        "wait\nclusters {at}/clusters.json\nwait\nfigure scene {at}/scene.svg\nfigure learning {at}/learning.svg\nwait\n"
    );
    for (name, run) in [("all", "train"), ("rest", "continue"), ("end", "open")] {
        let script = format!("{edited}{settings}{run} {at}/run\n{rest}");
        std::fs::write(folder.join(name).with_extension("mge"), script).unwrap();
    }
}

/// Every file that the work leaves, without what may differ: times, processes and further starts.
fn result(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    collect(folder, folder, &mut files);
    files
}

fn collect(folder: &Path, root: &Path, files: &mut BTreeMap<String, Vec<u8>>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.strip_prefix(root).unwrap().display().to_string();
        let bytes = match path.file_name().unwrap().to_str().unwrap() {
            // They describe the processes that worked on the run.
            "lock" | "log.txt" => continue,
            "events.jsonl" => events(&path),
            "tensorboard" => format!("{:?}", tensorboard::numbers(&path)).into_bytes(),
            _ if path.is_dir() => {
                files.insert(format!("{name}/"), Vec::new());
                collect(&path, root, files);
                continue;
            }
            _ => std::fs::read(&path).unwrap(),
        };
        files.insert(name, with_placeholder(bytes, root));
    }
}

/// The content of a file with `@` for the folder it is in.
fn with_placeholder(mut bytes: Vec<u8>, root: &Path) -> Vec<u8> {
    let root = root.as_os_str().as_encoded_bytes();
    while let Some(at) = bytes.windows(root.len()).position(|piece| piece == root) {
        bytes.splice(at..at + root.len(), *b"@");
    }
    bytes
}

/// The events of a run without their times and without starts after the first.
fn events(path: &Path) -> Vec<u8> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = Vec::new();
    for line in text.lines() {
        let mut event: serde_json::Value = serde_json::from_str(line).expect("whole lines");
        event.as_object_mut().unwrap().remove("time");
        if lines.is_empty() || event["type"] != "started" {
            lines.push(event.to_string());
        }
    }
    lines.join("\n").into_bytes()
}

/// The number of operations of an undisturbed command and the files it leaves.
fn undisturbed(work: &Work) -> (usize, BTreeMap<String, Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let logs = tempfile::tempdir().unwrap();
    (work.prepare)(folder.path());
    let log = logs.path().join("log");
    let fault = Fault { folder: folder.path(), kind: "none", at: 0, log: Some(&log), trace: None };
    succeed(mge(&work.command, folder.path(), Some(&fault)));
    let operations = std::fs::read_to_string(&log).unwrap().lines().count();
    (operations, result(folder.path()))
}

/// The problem after a fault and the repair, if any.
fn problem(work: &Work, kind: &str, at: usize, expected: &BTreeMap<String, Vec<u8>>) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    (work.prepare)(folder.path());
    let output =
        mge(&work.command, folder.path(), Some(&Fault { folder: folder.path(), kind, at, log: None, trace: None }));
    let message = text(&output.stderr);
    match (kind, output.status.signal(), output.status.code()) {
        ("kill" | "torn", Some(SIGKILL), _) | ("short", None, Some(0)) => {}
        ("eio" | "full", None, Some(0 | 1)) if !message.contains("panicked") => {}
        _ => return Some(format!("{}: {message}", output.status)),
    }
    if output.status.code() == Some(0) { None } else { repair(work, folder.path()) }
        .or_else(|| difference(folder.path(), expected))
}

/// Repairs the work after a fault. Returns the problem if no command succeeds.
fn repair(work: &Work, folder: &Path) -> Option<String> {
    let mut failures = Vec::new();
    let repaired = work.repair.iter().any(|line| {
        let output = mge(line, folder, None);
        failures.push(text(&output.stderr));
        output.status.success()
    });
    (!repaired).then(|| format!("it cannot be continued: {failures:?}"))
}

/// The first file that differs from that of an undisturbed command.
fn difference(folder: &Path, expected: &BTreeMap<String, Vec<u8>>) -> Option<String> {
    let found = result(folder);
    let names: Vec<&String> = expected.keys().chain(found.keys()).collect();
    let differing = names.into_iter().find(|name| expected.get(*name) != found.get(*name))?;
    let show = |files: &BTreeMap<String, Vec<u8>>| {
        files.get(differing).map_or("absent".to_owned(), |bytes| text(bytes).chars().take(3000).collect())
    };
    Some(format!("{differing} differs:\n{}\ninstead of\n{}", show(&found), show(expected)))
}

/// Tests one of `every` operations for each kind of fault.
fn check(name: &str, every: usize) {
    if library().is_none() {
        return;
    }
    let work = works().into_iter().find(|work| work.name == name).unwrap();
    let (operations, expected) = undisturbed(&work);
    let mut tried = 0;
    let mut problems = Vec::new();
    for (index, kind) in KINDS.iter().enumerate() {
        // Each kind of fault is at other operations.
        for at in (1..=operations).skip(index * 7 % every).step_by(every) {
            tried += 1;
            problems.extend(problem(&work, kind, at, &expected).map(|problem| format!("{kind} at {at}: {problem}")));
        }
    }
    let faults = tried;
    for (at, kept, problem) in losses(&work, every, &expected, &mut tried) {
        problems.push(format!("power lost after {at}, {kept:?} kept: {problem}"));
    }
    let losses = tried - faults;
    eprintln!(
        "{name}: {operations} operations, {faults} faults, {losses} losses of power, {} problems",
        problems.len()
    );
    assert!(problems.is_empty(), "{} of {tried}:\n{}", problems.len(), problems.join("\n"));
}

/// Problems after losses of power, after one of `every` operations.
fn losses(
    work: &Work,
    every: usize,
    expected: &BTreeMap<String, Vec<u8>>,
    tried: &mut usize,
) -> Vec<(usize, Kept, String)> {
    let folder = tempfile::tempdir().unwrap();
    (work.prepare)(folder.path());
    let mut disk = Disk::of(folder.path());
    let traces = tempfile::tempdir().unwrap();
    let trace = traces.path().join("trace");
    let fault = Fault { folder: folder.path(), kind: "none", at: 0, log: None, trace: Some(&trace) };
    succeed(mge(&work.command, folder.path(), Some(&fault)));
    let trace = std::fs::read(trace).unwrap();
    let mut problems = Vec::new();
    for (at, operation) in power::operations(&trace).iter().enumerate() {
        disk.apply(operation);
        if at % every != every / 2 {
            continue;
        }
        for kept in [Kept::Synced, Kept::Names] {
            // In the same folder, because files may name it.
            std::fs::remove_dir_all(folder.path()).unwrap();
            disk.restore(kept, folder.path());
            *tried += 1;
            let problem = repair(work, folder.path()).or_else(|| difference(folder.path(), expected));
            problems.extend(problem.map(|problem| (at + 1, kept, problem)));
        }
    }
    problems
}

/// A training that is ended by signals and continued leaves the files of an undisturbed one.
#[test]
fn signals() {
    let line = format!("train task1 {} --out @/run", TRAINING.replace("--episodes 8", "--episodes 120"));
    let whole = tempfile::tempdir().unwrap();
    succeed(mge(&line, whole.path(), None));
    let expected = result(whole.path());
    let disturbed = tempfile::tempdir().unwrap();
    let run = disturbed.path().join("run");
    let rows = || std::fs::read_to_string(run.join("metrics.csv")).map_or(0, |text| text.lines().count());
    let resume = "resume @/run --quiet";
    for (signal, after) in [("TERM", 2), ("INT", 25), ("TERM", 26), ("INT", 60), ("TERM", 61), ("INT", 90)] {
        let line = if run.exists() { resume } else { &line };
        let mut command = Command::new(tested_program());
        command.args(line.split_whitespace().map(|word| word.replace('@', &disturbed.path().display().to_string())));
        let mut child =
            command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
        while rows() <= after && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        // Before the program handles signals, the signal kills it.
        assert!(!sent.success() || matches!(status.code(), None | Some(0 | 130 | 143)), "{status}");
    }
    succeed(mge(resume, disturbed.path(), None));
    let difference = difference(disturbed.path(), &expected);
    assert!(difference.is_none(), "{}", difference.unwrap());
}

/// Tests of a sample of the operations, and ignored tests of all of them.
macro_rules! crash_tests {
    ($($name:ident: $every:literal,)+) => {
        $(#[test]
        fn $name() {
            check(stringify!($name), $every);
        })+

        mod all {
            $(#[test]
            #[ignore = "takes minutes"]
            fn $name() {
                super::check(stringify!($name), 1);
            })+
        }
    };
}

crash_tests! {
    train: 29,
    resume: 23,
    sweep: 41,
    model: 5,
    task: 3,
    session: 31,
    figures: 5,
}
