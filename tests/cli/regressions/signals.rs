//! Signals and waiting: a signal ends every command promptly and saves its work, at any moment; a stop request is never
//! lost; the run that a stop is meant for is the only one that it ends.
//!
//! Decided in `crates/base/src/stop.rs` (the request, which signals make one, long pieces of work),
//! `src/cli/interrupt.rs` (commands), `src/tui/terminal/` (the workbench) and `crates/trainer/src/batch/` (many runs).

use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use mge::run::{RunDirectory, RunState};
use mge::trainer::Control;
use portable_pty::{CommandBuilder, PtySize, native_pty_system};
use rustix::process::{Pid, Signal, kill_process};

use crate::program::{MGE, command, fail, mge, succeed, text};
use crate::terminal::Terminal;

/// A small training of a million episodes into `run`.
const ENDLESS: &str = "train task1 --method ddpg --episodes 1000000 --quiet --set ddpg.hidden=4 --out run";
/// Longest wait; a signal that has no effect lasts longer.
const PATIENCE: Duration = Duration::from_secs(60);

fn start(folder: &Path, line: &str) -> Child {
    let mut command = command(folder, shell_words::split(line).unwrap());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn send(child: &Child, signal: Signal) {
    kill_process(Pid::from_child(child), signal).unwrap();
}

fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < PATIENCE, "waited for {what}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn ended(mut child: Child) -> Output {
    wait_until("the end", || child.try_wait().unwrap().is_some());
    child.wait_with_output().unwrap()
}

/// Waits until a process handles SIGTERM, or has ended.
fn wait_until_listening(child: &mut Child) {
    let file = format!("/proc/{}/status", child.id());
    wait_until("the handlers", || {
        let status = std::fs::read_to_string(&file).unwrap_or_default();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0");
        let catches = u64::from_str_radix(caught.trim(), 16).unwrap() & 1 << (Signal::TERM.as_raw() - 1) != 0;
        catches || child.try_wait().unwrap().is_some()
    });
}

fn has_episodes(run: &Path) -> bool {
    std::fs::read_to_string(run.join("metrics.csv")).is_ok_and(|text| text.lines().count() > 2)
}

/// Long commands. Each is run in a folder that has what `prepare` makes.
const COMMANDS: [&str; 18] = [
    "train task1 --method ddpg-mge --quiet --out OUT --set ddpg.hidden=8",
    "train task2 --quiet --out OUT --set guidance.model_rollouts=100000 \
     --set guidance.most_model_rollouts=100000 --set guidance.horizon=100",
    "train task1 --quiet --out OUT --method ddpg --set evaluation.every=5 --set evaluation.episodes=1000",
    "train task1 --quiet --out OUT --method ddpg --set ddpg.hidden=1024 --set ddpg.layers=4 \
     --set ddpg.batch_size=65536 --set ddpg.warmup_steps=200",
    "resume run --episodes 1000000 --quiet",
    "fork run --at 20 --quiet --out OUT",
    "evaluate run --episodes 1000000",
    "script long.mge --quiet",
    "sweep sweep.json --quiet --out OUT",
    "sweep models.json --quiet --out OUT",
    "dynamics train --tools box,bucket --observations 1000000 --quiet --out OUT",
    "dynamics train --tools box --observations 3000 --set batch=65536 --layers 64 --quiet --out OUT",
    "dynamics evaluate bucket-box --launches 1000000 --quiet",
    "selection train create/Push-random --episodes 5000 --quiet --out OUT",
    "selection evaluate create/Push-random --episodes 1000000 --quiet",
    "clusters task5",
    "puzzles generate --count 4 --quiet --out OUT",
    "reproduce --quick --quiet --out OUT",
];

/// Whether a command has nothing to save.
fn saves_nothing(line: &str) -> bool {
    ["evaluate ", "dynamics evaluate ", "selection "].iter().any(|start| line.starts_with(start))
}

/// What the long commands need.
fn prepare(folder: &Path) {
    let training = "train task1 --method ddpg --quiet --set ddpg.hidden=4 --out run --episodes 20";
    succeed(mge(folder, training.split(' ')));
    std::fs::write(folder.join("long.mge"), "method ddpg\nepisodes 1000000\ntrain ./scripted\nwait\n").unwrap();
    let sweep = r#"{"task": "task1", "method": "ddpg", "seed": [0, 1], "episodes": 100000, "ddpg.hidden": 4}"#;
    std::fs::write(folder.join("sweep.json"), sweep).unwrap();
    let models = r#"{"kind": "dynamics", "tools": "box", "epochs": 1, "observations": 2, "layers": 1,
        "evaluation.launches": 1000000, "evaluation.hit_rollouts": 1000000}"#;
    std::fs::write(folder.join("models.json"), models).unwrap();
}

/// Starts a command, sends it a signal some time after it listens, and checks how it ends. Returns how long that took.
fn interrupt(folder: &Path, line: &str, signal: Signal, after: Duration) -> Duration {
    // A shell ignores SIGINT for what it starts in the background; commands without work to save leave that so.
    let signal = if saves_nothing(line) && signal == Signal::INT { Signal::TERM } else { signal };
    let mut child = start(folder, line);
    if !saves_nothing(line) {
        wait_until_listening(&mut child);
    }
    std::thread::sleep(after);
    let is_over = child.try_wait().unwrap().is_some();
    let sent = Instant::now();
    if !is_over {
        send(&child, signal);
    }
    let output = ended(child);
    let (took, message) = (sent.elapsed(), text(&output.stderr));
    if !is_over {
        // Commands without work to save end as the system ends them.
        let status = output.status.code().or(output.status.signal().map(|number| 128 + number));
        let lines = output.status.code().map_or(0, |_| 1);
        assert_eq!(status, Some(128 + signal.as_raw()), "{line}, after {after:?}: {message}");
        assert_eq!(message.lines().count(), lines, "{line}, after {after:?}: {message}");
        assert_eq!(lines == 0, saves_nothing(line), "{line}");
    }
    took
}

/// Interrupts every command at these of ten moments, each a fixed pseudo-random time of up to 1.5 s after its start.
#[allow(clippy::print_stderr, reason = "the measured times")]
fn at_moments(chosen: impl Fn(usize, usize) -> bool) {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let mut moment = 12_345u64;
    let mut work = Vec::new();
    for (number, line) in COMMANDS.iter().enumerate() {
        for round in 0..10 {
            moment = moment.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let signal = [Signal::TERM, Signal::INT, Signal::USR1, Signal::USR2, Signal::XCPU][(number + round) % 5];
            if chosen(number, round) {
                let line = line.replace("OUT", &format!("out-{number}-{round}"));
                work.push((line, signal, Duration::from_millis((moment >> 33) % 1500)));
            }
        }
    }
    // Commands on the same run wait for each other.
    let (queue, shared) = (Mutex::new(work.into_iter()), Mutex::new(()));
    let worst = Mutex::new(std::collections::BTreeMap::new());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                loop {
                    let Some((line, signal, after)) = queue.lock().unwrap().next() else { return };
                    let alone = line.starts_with("resume") || line.starts_with("script");
                    let _turn = alone.then(|| shared.lock().unwrap());
                    let took = interrupt(folder.path(), &line, signal, after);
                    worst.lock().unwrap().entry(line.replace(char::is_numeric, "")).or_insert_with(Vec::new).push(took);
                    // The next one trains again.
                    if line.starts_with("script") {
                        std::fs::remove_dir_all(folder.path().join("scripted")).unwrap_or_default();
                    }
                }
            });
        }
    });
    for (line, mut times) in worst.into_inner().unwrap() {
        times.sort();
        eprintln!(
            "{:.2} s, at most {:.2} s: {line}",
            times[times.len() / 2].as_secs_f32(),
            times[times.len() - 1].as_secs_f32()
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn every_long_command_ends_at_any_moment() {
    // One moment of each command.
    at_moments(|command, round| round == command % 10);
}

/// All moments, as `every_long_command_ends_at_any_moment` tests a sample of them; prints the times.
#[cfg(target_os = "linux")]
#[test]
#[ignore = "takes minutes"]
fn every_long_command_ends_at_ten_moments() {
    at_moments(|_, _| true);
}

#[test]
fn a_warning_before_a_time_limit_saves_the_work() {
    for signal in [Signal::USR1, Signal::USR2, Signal::XCPU] {
        let folder = tempfile::tempdir().unwrap();
        let child = start(folder.path(), ENDLESS);
        let run = folder.path().join("run");
        wait_until("episodes", || has_episodes(&run));
        send(&child, signal);
        let output = ended(child);
        assert_eq!(output.status.code(), Some(128 + signal.as_raw()));
        assert!(text(&output.stderr).contains("continue with `mge resume run`"));
        let directory = RunDirectory::open(&run).unwrap();
        assert!(matches!(directory.status().unwrap().state, RunState::Stopped(_)));
        let records = mge::run::RunHistory::read(&directory).unwrap().records;
        assert_eq!(directory.newest_checkpoint().unwrap().0.unwrap().episode, records.len() as u64);
    }
}

/// A closing terminal ends a training with a checkpoint, unless the signal was ignored when it was started.
#[cfg(target_os = "linux")]
#[test]
fn a_closed_terminal_ends_a_training_with_a_checkpoint() {
    for (option, status) in [("--default-signal=HUP", 129), ("--ignore-signal=HUP", 143)] {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new("env");
        command.args([option, MGE]).args(shell_words::split(ENDLESS).unwrap()).current_dir(folder.path());
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let run = folder.path().join("run");
        wait_until("episodes", || has_episodes(&run));
        send(&child, Signal::HUP);
        if status == 143 {
            std::thread::sleep(Duration::from_millis(600));
            send(&child, Signal::TERM);
        }
        let output = ended(child);
        assert_eq!(output.status.code(), Some(status), "{option}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains("continue with `mge resume run`"));
        let directory = RunDirectory::open(&run).unwrap();
        assert!(matches!(directory.status().unwrap().state, RunState::Stopped(_)));
        assert!(directory.newest_checkpoint().unwrap().0.is_some());
    }
}

/// A terminal, a shell and a batch system may each send a signal for the same event.
#[test]
fn signals_in_quick_succession_are_one() {
    let folder = tempfile::tempdir().unwrap();
    let child = start(folder.path(), ENDLESS);
    let run = folder.path().join("run");
    wait_until("episodes", || has_episodes(&run));
    for signal in [Signal::TERM, Signal::TERM, Signal::INT] {
        send(&child, signal);
        std::thread::sleep(Duration::from_millis(1));
    }
    let output = ended(child);
    // Which of signals that arrive together is noticed first is up to the system.
    assert!(matches!(output.status.code(), Some(143 | 130)), "{:?}", output.status);
    assert!(text(&output.stderr).contains("continue with"));
    assert!(matches!(RunDirectory::open(&run).unwrap().status().unwrap().state, RunState::Stopped(_)));
}

#[test]
fn a_stop_of_one_run_ends_only_this_run_of_a_sweep() {
    let folder = tempfile::tempdir().unwrap();
    let at = |path: &str| folder.path().join(path);
    let sweep = r#"{"task": "task1", "method": "ddpg", "seed": [0, 1, 2], "episodes": 300, "ddpg.hidden": 4}"#;
    std::fs::write(at("s.json"), sweep).unwrap();
    let child = start(folder.path(), "sweep s.json --threads 1 --quiet --out sweep");
    let stopped = "task1-ddpg-seed0";
    let run = at("sweep/runs").join(stopped);
    wait_until("episodes", || has_episodes(&run));
    RunDirectory::open(&run).unwrap().request(&Control::Stop { reason: String::new() }).unwrap();
    let message = fail(ended(child), "1 of 3 not finished");
    assert!(message.contains(stopped) && message.contains("the same command continues it"), "{message}");
    let state = |seed: u32| {
        let run = at("sweep/runs").join(format!("task1-ddpg-seed{seed}"));
        RunDirectory::open(run).unwrap().status().unwrap().state
    };
    assert!(matches!(state(0), RunState::Stopped(_)));
    assert_eq!((state(1), state(2)), (RunState::Finished, RunState::Finished));
    let table = std::fs::read_to_string(at("sweep/results.csv")).unwrap();
    assert_eq!((table.matches(",finished,").count(), table.matches(",stopped").count()), (2, 1), "{table}");
    succeed(mge(folder.path(), ["sweep", "s.json", "--quiet", "--out", "sweep"]));
    assert_eq!(state(0), RunState::Finished);
}

/// The job script with a Slurm that only notes its requests: a warned task is saved and requeued, and continues.
#[test]
fn a_warned_slurm_task_is_saved_requeued_and_continued() {
    let folder = tempfile::tempdir().unwrap();
    let at = |path: &str| folder.path().join(path);
    let sweep = r#"{"task": "task1", "method": "ddpg", "seed": [0], "episodes": 100000, "ddpg.hidden": 4}"#;
    std::fs::write(at("s.json"), sweep).unwrap();
    let script = succeed(mge(folder.path(), ["sweep", "s.json", "--slurm", "--out", "it's here"]));
    for line in ["#SBATCH --signal=B:USR1@", "#SBATCH --requeue\n", "#SBATCH --open-mode=append\n"] {
        assert!(script.contains(line), "{script}");
    }
    std::fs::write(at("job.sh"), script).unwrap();
    std::fs::create_dir(at("bin")).unwrap();
    std::fs::write(at("bin/scontrol"), "#!/bin/sh\necho \"$@\" >> \"$NOTES\"\n").unwrap();
    succeed(Command::new("chmod").arg("+x").arg(at("bin/scontrol")).output().unwrap());
    let path = format!("{}:{}", at("bin").display(), std::env::var("PATH").unwrap());
    let run = at("it's here/runs/task1-ddpg-seed0");
    let mut done = 0;
    // SIGTERM reaches the shell and, a moment later, the program as well.
    for (signal, status) in [(Signal::USR1, 138), (Signal::TERM, 143)] {
        let mut job = Command::new("bash");
        job.arg("job.sh").current_dir(folder.path()).stdin(Stdio::null());
        job.env("PATH", &path).env("NOTES", at("notes")).env("SLURM_ARRAY_TASK_ID", "0").env("SLURM_JOB_ID", "71");
        let child = job.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let rows = || std::fs::read_to_string(run.join("metrics.csv")).map_or(0, |text| text.lines().count());
        wait_until("episodes", || rows() > done + 2);
        send(&child, signal);
        let output = ended(child);
        assert_eq!(output.status.code(), Some(status), "{}", text(&output.stderr));
        assert_eq!(text(&output.stderr).matches("interrupted after 0 of 1").count(), 1, "{}", text(&output.stderr));
        assert!(matches!(RunDirectory::open(&run).unwrap().status().unwrap().state, RunState::Stopped(_)));
        assert!(rows() > done, "it did not continue");
        done = rows();
    }
    assert_eq!(std::fs::read_to_string(at("notes")).unwrap(), "requeue 71\n");
}

/// The workbench in a terminal of this size, with its line modes before it started.
struct Opened {
    pair: portable_pty::PtyPair,
    child: Box<dyn portable_pty::Child + Send + Sync>,
    before: String,
}

impl Opened {
    fn new(folder: &Path, cols: u16, rows: u16) -> Self {
        let pair = native_pty_system().openpty(PtySize { rows, cols, pixel_width: 0, pixel_height: 0 }).unwrap();
        let before = format!("{:?}", pair.master.get_termios());
        let mut command = CommandBuilder::new(MGE);
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        let child = pair.slave.spawn_command(command).unwrap();
        Self { pair, child, before }
    }

    fn is_raw(&self) -> bool {
        format!("{:?}", self.pair.master.get_termios()) != self.before
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_raw(self.child.process_id().unwrap() as i32).unwrap(), signal).unwrap();
    }

    /// Reads what the workbench writes, until it has ended.
    fn read(&self) -> std::thread::JoinHandle<()> {
        let mut reader = self.pair.master.try_clone_reader().unwrap();
        std::thread::spawn(move || {
            let mut bytes = [0; 1 << 16];
            while reader.read(&mut bytes).is_ok_and(|count| count > 0) {}
        })
    }
}

#[test]
fn a_signal_while_the_terminal_is_taken_over_restores_it() {
    for wait in [0, 0, 0, 0, 0, 0, 0, 0, 300, 1000] {
        let folder = tempfile::tempdir().unwrap();
        let mut opened = Opened::new(folder.path(), 100, 30);
        let _reader = opened.read();
        let begun = Instant::now();
        while !opened.is_raw() {
            assert!(begun.elapsed() < PATIENCE);
        }
        std::thread::sleep(Duration::from_micros(wait));
        opened.signal(Signal::TERM);
        assert_eq!(opened.child.wait().unwrap().exit_code(), 143);
        assert!(!opened.is_raw(), "after {wait} us");
    }
}

#[test]
fn a_workbench_without_a_shell_to_continue_it_is_not_stopped() {
    let folder = tempfile::tempdir().unwrap();
    let mut program = CommandBuilder::new(MGE);
    program.cwd(folder.path());
    // The program leads a session of its own, so that its process group is orphaned.
    let mut terminal = Terminal::start(program, "\x1b[?62;22c");
    terminal.wait_for("welcome");
    // Ctrl-Z
    terminal.type_text("\x1a");
    terminal.wait_until_written("\x1b[?1049l");
    terminal.wait_until_taken();
    terminal.signal("TSTP");
    terminal.type_text("8");
    terminal.wait_for("Nothing has happened yet");
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
}
