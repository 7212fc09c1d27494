//! Runs the workbench under a random script for a long time, with trainings: its memory, open files and threads must
//! not grow.
//!
//! `MGE_SOAK_MINUTES=60 cargo test --release --test cli soak -- --ignored --nocapture` prints one line per
//! minute; the default is an hour. `MGE_SOAK_PROGRAM` names a binary other than the one built with the test,
//! `MGE_SOAK_SEED` the seed of the random script.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use portable_pty::CommandBuilder;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::terminal::Terminal;

/// The program under test.
fn mge() -> String {
    std::env::var("MGE_SOAK_PROGRAM").unwrap_or_else(|_| env!("CARGO_BIN_EXE_mge").to_owned())
}

/// Minutes until all permanent data has been allocated.
const WARM: usize = 10;

/// The workbench thins longer runs to this number of episodes.
const KEPT: usize = 16_384;

/// The script rests at the end of every minute so that computations finish: their temporary memory does not count as
/// growth.
const REST: Duration = Duration::from_secs(15);

/// Resources that a process holds. Over a minute: the least memory at rest, the maximum of the others.
#[derive(Debug, Clone, Copy)]
struct Held {
    /// Resident memory in KB, if it was measured at rest.
    memory: Option<u64>,
    files: u64,
    threads: u64,
    /// Processor time in seconds.
    time: f64,
}

impl Held {
    fn by(process: u32, is_at_rest: bool) -> Self {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).expect("it runs");
        let number = |name: &str| {
            let line = status.lines().find(|line| line.starts_with(name)).expect("Linux has it");
            line.split_whitespace().nth(1).unwrap().parse().unwrap()
        };
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("it runs");
        let after_name: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        let ticks: f64 = after_name[11].parse::<f64>().unwrap() + after_name[12].parse::<f64>().unwrap();
        Self {
            memory: is_at_rest.then(|| number("VmRSS:")),
            threads: number("Threads:"),
            files: std::fs::read_dir(format!("/proc/{process}/fd")).expect("it runs").count() as u64,
            time: ticks / 100.0,
        }
    }

    /// Combines this sample with an earlier one.
    fn and(self, before: Option<Self>) -> Self {
        let Some(before) = before else { return self };
        Self {
            memory: self.memory.into_iter().chain(before.memory).min(),
            files: self.files.max(before.files),
            threads: self.threads.max(before.threads),
            time: self.time,
        }
    }
}

/// Keys that neither quit the workbench nor stop a training, not even as an answer to a prompt; Escape closes whatever
/// they open.
const KEYS: &[&str] = &[
    "1", "2", "3", "4", "5", "6", "7", "8", "[", "]", "\t", "\x1b[Z", "\x1b[A", "\x1b[B", "\x1b[C", "\x1b[D", "h", "j",
    "k", "l", "H", "J", "K", "L", "\x1b[5~", "\x1b[6~", "\x1b[H", "\x1b[F", "a", "z", "Z", "v", "i", "g", "s", "r",
    ".", ",", "<", ">", " ", "A", "T", ")", "(", "{", "}", "u", "U", "P", "+", "-", "c", "G", "e", "m", "n", "?", "0",
    "9", "\x1b[12~", "\x1b[13~", "\x1bOQ", "\x1bOR",
];

/// Commands that a user gives during trainings.
const COMMANDS: &[&str] = &[
    "task task2",
    "task task1",
    "task task5",
    "model true",
    "model uniform",
    "clusters",
    "epsilon 0.3",
    "epsilon linear:0.5:0.1:500",
    "subgoal move 1 0.1 0.2",
    "undo",
    "redo",
    "reset",
    "place 0.2 0.3",
    "watch 1",
    "watch 2",
    "evaluate",
    "figure scene scene.svg",
    "figure learning learning.png",
    "pause",
    "resume",
    "no such command",
    "set ddpg.gamma 2",
    "train runs/first",
];

/// Closes whatever is open: a click may have opened the prompt for quitting, which the next key would answer.
fn leave(terminal: &Terminal) {
    terminal.type_text("\x1b\x1b\x1b");
    // Input right after an Escape would be parsed as part of the same sequence.
    std::thread::sleep(Duration::from_millis(100));
}

/// Whether a process has neither ended nor been killed.
fn is_running(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.rsplit(')').next().is_some_and(|state| !state.trim_start().starts_with('Z') && !state.is_empty())
}

/// One random action of a user, a cat or a broken terminal.
fn act(terminal: &Terminal, rng: &mut ChaCha8Rng) {
    // Without `q`, which quits the workbench if a layer consumes the colon before it.
    let text = |rng: &mut ChaCha8Rng, length| -> String {
        let characters = (0..rng.gen_range(1..length)).map(|_| char::from(rng.gen_range(b' '..=b'~')));
        characters.filter(|character| *character != 'q').collect()
    };
    // Above the footer of the smallest terminal: a click on a key hint there could start a training.
    let (column, row) = (rng.gen_range(1..=120), rng.gen_range(1..8));
    match rng.gen_range(0..20) {
        0 => {
            let (columns, rows) = (rng.gen_range(20..220), rng.gen_range(8..70));
            terminal.resize(columns, rows);
        }
        1..=3 => {
            // Otherwise earlier input could start another training, which holds memory permanently.
            leave(terminal);
            terminal.type_text(&format!(":{}\r", COMMANDS.choose(rng).unwrap()));
        }
        4 => terminal.type_text(&format!(":{}", text(rng, 30))),
        5 => terminal.type_text(&format!("\x1b[200~{}\x1b[201~", text(rng, 4000))),
        6 => terminal.type_text(&format!("\x1b[<35;{column};{row}M").repeat(rng.gen_range(1..200))),
        // A click on an open palette could start a training, too.
        7 => {
            leave(terminal);
            terminal.type_text(&format!("\x1b[<0;{column};{row}M\x1b[<0;{column};{row}m"));
            leave(terminal);
        }
        8 => {
            leave(terminal);
            let to = (rng.gen_range(1..=120), rng.gen_range(1..=40));
            let drag = format!("\x1b[<0;{column};{row}M\x1b[<32;{};{}M\x1b[<0;{};{}m", to.0, to.1, to.0, to.1);
            terminal.type_text(&drag);
            leave(terminal);
        }
        9 => terminal.type_text(&format!("\x1b[<{};{column};{row}M", rng.gen_range(64..=65))),
        _ => (0..rng.gen_range(1..12)).for_each(|_| terminal.type_text(KEYS.choose(rng).unwrap())),
    }
}

/// A training in another process, in the folder that the workbench shows.
fn another(folder: &Path) -> Child {
    let arguments = "train task1 --method ddpg --seed 7 --episodes 10000000 --quiet --out runs/another";
    let settings = "--set ddpg.hidden=16 --set ddpg.replay_capacity=2000";
    Command::new(mge())
        .args(arguments.split(' ').chain(settings.split(' ')))
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts")
}

/// Waits until a run has so many episodes that the workbench thins them.
fn wait_until_kept(folder: &Path, run: &str) {
    let start = Instant::now();
    let path = folder.join("runs").join(run).join("metrics.csv");
    while std::fs::read_to_string(&path).unwrap_or_default().lines().count() <= KEPT {
        assert!(start.elapsed() < Duration::from_secs(600), "{run} has too few episodes");
        std::thread::sleep(Duration::from_secs(1));
    }
}

#[test]
#[ignore = "takes an hour"]
fn resources_do_not_grow_over_an_hour() {
    let minutes = std::env::var("MGE_SOAK_MINUTES").ok().and_then(|text| text.parse().ok()).unwrap_or(60);
    let folder = tempfile::tempdir().unwrap();
    let mut command = CommandBuilder::new(mge());
    command.cwd(folder.path());
    let mut terminal = Terminal::start(command, "\x1b[?62;4;22c");
    terminal.wait_for("welcome");
    terminal.type_text("\x1b");
    // Input right after an Escape would be parsed as part of the same sequence.
    std::thread::sleep(Duration::from_millis(500));
    // Small networks for many episodes, and a replay buffer that fills soon. A training waits for a
    // free core: on two cores the third waits.
    for line in [
        "set ddpg.hidden 16",
        "set ddpg.replay_capacity 2000",
        "set guidance.model_rollouts 100",
        "episodes 10000000",
        "model true",
        "method ddpg",
        "train runs/first",
        "seed 1",
        "method ddpg-mge-true",
        "train runs/second",
        "seed 2",
        "train runs/third",
    ] {
        terminal.type_text(&format!(":{line}\r"));
    }
    terminal.wait_for("run      third");
    // Every run holds all its permanent data before the script begins, in whichever order that pauses them.
    for run in ["first", "second"] {
        wait_until_kept(folder.path(), run);
    }
    terminal.type_text(":watch 1\r:pause\r");
    wait_until_kept(folder.path(), "third");
    terminal.type_text(":resume\r");
    let mut other = another(folder.path());
    wait_until_kept(folder.path(), "another");
    terminal.type_text(":open runs/another\r");
    let seed = std::env::var("MGE_SOAK_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(0);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let process = terminal.process();
    let start = Instant::now();
    let mut acts = 0;
    let mut samples = Vec::new();
    let mut minute = None;
    eprintln!(
        "| minute | actions | least memory at rest, MB | files | threads | processor, s |\n|---|---|---|---|---|---|"
    );
    while samples.len() <= minutes {
        // A workbench that was quit reads no input.
        assert!(is_running(process), "the workbench ended after {acts} actions");
        let end = Duration::from_secs(60 * samples.len() as u64);
        let rests = start.elapsed() + REST >= end;
        if rests {
            leave(&terminal);
        } else {
            act(&terminal, &mut rng);
            acts += 1;
            std::thread::sleep(Duration::from_millis(rng.gen_range(0..200)));
            if acts % 3 == 0 {
                leave(&terminal);
            }
        }
        let held = Held::by(process, rests).and(minute);
        minute = Some(held);
        if start.elapsed() >= end {
            let Held { memory, files, threads, time } = held;
            let (number, memory) = (samples.len(), memory.expect("every minute ends at rest") as f64 / 1024.0);
            eprintln!("| {number} | {acts} | {memory:.1} | {files} | {threads} | {time:.0} |");
            samples.push(held);
            minute = None;
        }
    }
    // The memory of an ended training would make room for growth.
    for run in ["first", "second", "third", "another"] {
        let log = std::fs::read_to_string(folder.path().join("runs").join(run).join("log.txt")).unwrap();
        let has_ended = ["finished after", "stopped after", "failed after"].iter().any(|end| log.contains(end));
        assert!(!has_ended, "{run} has ended: {}", log.lines().last().unwrap_or_default());
    }
    other.kill().unwrap();
    other.wait().unwrap();
    terminal.signal("TERM");
    assert_eq!(terminal.wait_for_exit(), 143);
    if samples.len() < 3 * WARM {
        return;
    }
    let (early, late) = (&samples[WARM..2 * WARM], &samples[samples.len() - WARM..]);
    // The median, because in single minutes computations do not end before the rest.
    let median = |part: &[Held]| {
        let mut memory: Vec<u64> = part.iter().filter_map(|held| held.memory).collect();
        memory.sort_unstable();
        memory[memory.len() / 2]
    };
    let (before, after) = (median(early), median(late));
    assert!(after <= before + before / 20, "{after} KB after {before} KB");
    let most = |part: &[Held], of: fn(&Held) -> u64| part.iter().map(of).max().unwrap();
    for (name, of) in [("files", (|held| held.files) as fn(&Held) -> u64), ("threads", |held| held.threads)] {
        assert!(most(late, of) <= most(early, of) + 4, "{name}: {samples:?}");
    }
}
