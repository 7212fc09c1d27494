//! A crash at every operation on files: a command is killed, or an operation fails, at operation k;
//! then the same work is continued without a fault, and every file must be as after an undisturbed
//! one.
//!
//! `cargo test --test crash` tries a share of the operations of each command;
//! `cargo test --test crash -- --ignored --nocapture` tries all of them and prints how many.
//! `MGE_CRASH_PROGRAM` names another binary than the one that was built with the test.
//! Needs Linux and a C compiler named `cc`; without them nothing is tried, which is said.

#![cfg(target_os = "linux")]
// It prints what was skipped and how much was tried.
#![allow(clippy::print_stderr)]

mod power;
mod tensorboard;

use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

use power::{Disk, Kept};

/// The program that is tried.
fn program() -> String {
    std::env::var("MGE_CRASH_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_mge").to_owned())
}

const SIGKILL: i32 = 9;

/// Kinds of faults, as `faults.c` names them, with what they leave of the command.
const KINDS: [&str; 5] = ["kill", "torn", "eio", "full", "short"];

/// Settings of a training of a tenth of a second that writes every kind of file.
const TRAINING: &str = "--method ddpg-mge-true --epsilon 0.5 --episodes 8 --quiet --set ddpg.hidden=4 \
    --set ddpg.replay_capacity=40 --set ddpg.batch_size=4 --set ddpg.warmup_steps=10 --set checkpoints.last_every=3 \
    --set checkpoints.periodic_every=3 --set checkpoints.periodic_kept=1 --set evaluation.every=3 \
    --set guidance.model_rollouts=20 --set guidance.environment_rollouts=10 --set refinement.every=4 \
    --set refinement.least=1";

/// The library that makes operations fail, compiled once; none without a compiler.
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

/// A command with a fault at operation `at` of those on files in `folder`; with 0 none fails.
struct Fault<'a> {
    folder: &'a Path,
    kind: &'a str,
    at: usize,
    log: Option<&'a Path>,
    trace: Option<&'a Path>,
}

/// Runs a line of arguments, in which `@` is the folder.
fn mge(line: &str, folder: &Path, fault: Option<&Fault<'_>>) -> Output {
    let mut command = Command::new(program());
    command.args(line.split_whitespace().map(|word| word.replace('@', &folder.display().to_string())));
    if let (Some(fault), Some(library)) = (fault, library()) {
        command.env("LD_PRELOAD", library).env("FAULT_ROOT", fault.folder);
        command.env("FAULT_KIND", fault.kind).env("FAULT_AT", fault.at.to_string());
        command.envs(fault.log.map(|log| ("FAULT_LOG", log)));
        command.envs(fault.trace.map(|trace| ("FAULT_TRACE", trace)));
    }
    command.output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A piece of work that is done by one command and continued by others.
struct Work {
    name: &'static str,
    /// Prepares an empty folder.
    prepare: fn(&Path),
    /// The command that is disturbed.
    command: String,
    /// What a person does afterwards: each is tried in turn until one succeeds.
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
    let output = mge(&format!("train task1 {TRAINING} --out @/run"), folder, None);
    assert!(output.status.success(), "{}", text(&output.stderr));
}

fn sweep_file(folder: &Path) {
    let file = r#"{"task": "task1", "method": "ddpg", "seed": [0, 1], "episodes": 4, "ddpg.hidden": 4,
        "ddpg.replay_capacity": 20, "checkpoints.last_every": 2, "evaluation.every": 2}"#;
    std::fs::write(folder.join("s.json"), file).unwrap();
}

fn script_file(folder: &Path) {
    let own = folder.join("own.json");
    std::fs::write(&own, "{}").unwrap();
    std::fs::write(folder.join("s.mge"), format!("task task1\nsubgoal move 1 0.05 0.2\nsave {}\n", own.display()))
        .unwrap();
}

/// A session of the workbench that edits, saves, trains, computes and exports, as a script; and what a
/// person does of it whose run was begun, or is done.
fn session_files(folder: &Path) {
    let at = folder.display();
    let edited = format!("task task1\nsubgoal move 1 0.05 0.2\nsave {at}/own.json\n");
    let settings = "method ddpg\nmodel uniform\nepisodes 8\nset ddpg.hidden 4\nset ddpg.replay_capacity 20\n\
        set checkpoints.last_every 3\n";
    let rest = format!(
        "wait\nclusters {at}/clusters.json\nwait\nfigure scene {at}/scene.svg\nfigure learning {at}/learning.svg\n\
        figure dashboard {at}/dashboard.svg\nwait\n"
    );
    for (name, run) in [("all", "train"), ("rest", "continue"), ("end", "open")] {
        let script = format!("{edited}{settings}{run} {at}/run\n{rest}");
        std::fs::write(folder.join(name).with_extension("mge"), script).unwrap();
    }
}

/// Every file that the work leaves, without what must differ: times, and how often it was begun.
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
            // The process, and the story of all processes that worked on the run.
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
        files.insert(name, without(bytes, root));
    }
}

/// A file may name the folder it is in.
fn without(mut bytes: Vec<u8>, root: &Path) -> Vec<u8> {
    let root = root.as_os_str().as_encoded_bytes();
    while let Some(at) = bytes.windows(root.len()).position(|piece| piece == root) {
        bytes.splice(at..at + root.len(), *b"@");
    }
    bytes
}

/// The events of a run without their times and without the beginnings after the first.
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

/// The operations of an undisturbed command and what it leaves.
fn undisturbed(work: &Work) -> (usize, BTreeMap<String, Vec<u8>>) {
    let folder = tempfile::tempdir().unwrap();
    let logs = tempfile::tempdir().unwrap();
    (work.prepare)(folder.path());
    let log = logs.path().join("log");
    let fault = Fault { folder: folder.path(), kind: "none", at: 0, log: Some(&log), trace: None };
    let output = mge(&work.command, folder.path(), Some(&fault));
    assert!(output.status.success(), "{}: {}", work.name, text(&output.stderr));
    let operations = std::fs::read_to_string(&log).unwrap().lines().count();
    (operations, result(folder.path()))
}

/// What is wrong after a fault and the repair, if anything.
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
    if output.status.code() == Some(0) { None } else { continued(work, folder.path()) }
        .or_else(|| difference(folder.path(), expected))
}

/// Does what a person does after a fault; what is wrong if nothing helps.
fn continued(work: &Work, folder: &Path) -> Option<String> {
    let mut failures = Vec::new();
    let repaired = work.repair.iter().any(|line| {
        let output = mge(line, folder, None);
        failures.push(text(&output.stderr));
        output.status.success()
    });
    (!repaired).then(|| format!("it cannot be continued: {failures:?}"))
}

/// The first file that is not as after an undisturbed command.
fn difference(folder: &Path, expected: &BTreeMap<String, Vec<u8>>) -> Option<String> {
    let found = result(folder);
    let names: Vec<&String> = expected.keys().chain(found.keys()).collect();
    let differing = names.into_iter().find(|name| expected.get(*name) != found.get(*name))?;
    let show = |files: &BTreeMap<String, Vec<u8>>| {
        files.get(differing).map_or("absent".to_owned(), |bytes| text(bytes).chars().take(3000).collect())
    };
    Some(format!("{differing} differs:\n{}\ninstead of\n{}", show(&found), show(expected)))
}

/// Tries every operation, or one of `every` for each kind of fault.
fn check(name: &str, every: usize) {
    if library().is_none() {
        return;
    }
    let work = works().into_iter().find(|work| work.name == name).unwrap();
    let (operations, expected) = undisturbed(&work);
    let mut tried = 0;
    let mut problems = Vec::new();
    for (index, kind) in KINDS.iter().enumerate() {
        // Each kind meets other operations.
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

/// What is wrong after losses of power: one after each operation, or one of `every`.
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
    assert!(mge(&work.command, folder.path(), Some(&fault)).status.success());
    let trace = std::fs::read(trace).unwrap();
    let mut problems = Vec::new();
    for (at, operation) in power::operations(&trace).iter().enumerate() {
        disk.apply(operation);
        if at % every != every / 2 {
            continue;
        }
        for kept in [Kept::Synced, Kept::Names] {
            // In the same place: files may name the folder they are in.
            std::fs::remove_dir_all(folder.path()).unwrap();
            disk.restore(kept, folder.path());
            *tried += 1;
            let problem = continued(work, folder.path()).or_else(|| difference(folder.path(), expected));
            problems.extend(problem.map(|problem| (at + 1, kept, problem)));
        }
    }
    problems
}

/// A training that is ended by signals and continued leaves what an undisturbed one does.
#[test]
fn signals() {
    let line = format!("train task1 {} --out @/run", TRAINING.replace("--episodes 8", "--episodes 120"));
    let whole = tempfile::tempdir().unwrap();
    assert!(mge(&line, whole.path(), None).status.success());
    let expected = result(whole.path());
    let disturbed = tempfile::tempdir().unwrap();
    let run = disturbed.path().join("run");
    let rows = || std::fs::read_to_string(run.join("metrics.csv")).map_or(0, |text| text.lines().count());
    let resume = "resume @/run --quiet";
    for (signal, after) in [("TERM", 2), ("INT", 25), ("TERM", 26), ("INT", 60), ("TERM", 61), ("INT", 90)] {
        let line = if run.exists() { resume } else { &line };
        let mut command = Command::new(program());
        command.args(line.split_whitespace().map(|word| word.replace('@', &disturbed.path().display().to_string())));
        let mut child =
            command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
        while rows() <= after && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let sent = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        // Before the program itself has begun, the signal ends it as any other.
        assert!(!sent.success() || matches!(status.code(), None | Some(0 | 130 | 143)), "{status}");
    }
    assert!(mge(resume, disturbed.path(), None).status.success());
    let difference = difference(disturbed.path(), &expected);
    assert!(difference.is_none(), "{}", difference.unwrap());
}

/// A share of the faults in the normal suite, all of them on demand.
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
