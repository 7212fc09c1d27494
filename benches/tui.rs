//! Time per frame of the workbench at 200 x 60 cells: `cargo bench --bench tui`.
//!
//! The session watches a finished run of 5000 episodes and has action clusters. A frame lets a 60th of a second pass,
//! draws the whole screen, and finds the cells that differ. The heaviest screens show 10 groups of 10 runs of 10,000
//! episodes. `cargo bench --bench tui -- training` reports the processor time that the screen takes during training.
//! A frame should take at most 4 ms, and the response to a key that moves the scene at most 100 ms.

#![allow(clippy::print_stdout, reason = "the report of a benchmark")]

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use divan::Bencher;
use mge::App;
use mge::run::{EpisodeRecord, Event, PlayedAction, PlayedEpisode, RunDirectory, RunState, RunWriter, Source};
use mge::task;
use mge::trainer::RunConfig;
use mge::workbench::{Command, Session};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

/// Episodes of the watched run.
const EPISODES: u64 = 5000;
/// Time between two frames.
const FRAME: Duration = Duration::from_micros(16_667);
/// Polling interval of the session while nothing else happens.
const LOOK: Duration = Duration::from_millis(60);

fn main() {
    divan::main();
    if std::env::args().any(|argument| argument == "training") {
        cost_of_the_screen();
    }
}

/// Processor time of a process or thread in seconds, from a file in `/proc`.
fn processor_seconds(path: &str) -> f64 {
    let text = std::fs::read_to_string(path).expect("a system with /proc");
    let fields: Vec<&str> = text.rsplit(')').next().expect("fields").split_whitespace().collect();
    let ticks = |field: &str| field.parse::<f64>().expect("a number");
    // User and system time, in ticks of 1/100 s.
    (ticks(fields[11]) + ticks(fields[12])) / 100.0
}

/// Trains with the screen open, polled as often as in a terminal of 200 x 60 cells while no key is pressed, and
/// reports the screen's processor time relative to that of the training.
fn cost_of_the_screen() {
    for keys in ["1", "4", "5"] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut session = Session::new(task::load("task1").expect("a shipped task"), folder.path().to_owned());
        let run = folder.path().join("run");
        for line in ["method ddpg-uniform".to_owned(), "episodes 1500".to_owned(), format!("train {}", run.display())] {
            session.apply(Command::parse(&line).expect("a command").expect("no comment")).expect("a run");
        }
        let mut workbench = App::offscreen(session);
        workbench.press_keys(keys).expect("keys");
        let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
        let now = || ["/proc/thread-self/stat", "/proc/self/stat"].map(processor_seconds);
        let (begun, since) = (now(), Instant::now());
        let directory = RunDirectory::open(&run).expect("a run");
        let mut frames = 0;
        loop {
            workbench.tick(LOOK);
            if workbench.is_changed() {
                terminal.draw(|frame| workbench.draw(frame)).expect("a backend that cannot fail");
                frames += 1;
            } else if directory.status().is_ok_and(|status| status.state == RunState::Finished) {
                break;
            }
            std::thread::sleep(LOOK);
        }
        let end = now();
        let [screen, all] = [end[0] - begun[0], end[1] - begun[1]];
        let core = 100.0 * screen / since.elapsed().as_secs_f64();
        let share = 100.0 * screen / (all - screen);
        println!(
            "screen {keys}: {frames} frames, {screen:.2} s of {all:.2} s: {core:.1} % of a core, {share:.1} % of the training"
        );
    }
}

/// A finished run in `folder`.
fn run(folder: &Path, config: &RunConfig, episodes: u64) {
    let directory = RunDirectory::create(folder, config).expect("a new folder");
    let mut writer = RunWriter::open(&directory, 0).expect("a new run");
    for episode in 1..=episodes {
        let wave = (episode as f32 / 40.0).sin();
        let record = EpisodeRecord {
            episode,
            steps: 10,
            return_: 5.0 + wave,
            rolling_success: episode as f64 / episodes as f64,
            critic_loss: Some(0.1 + 0.09 * wave),
            ..EpisodeRecord::default()
        };
        let action = PlayedAction { action: [0.4, wave / 2.0], source: Source::Policy };
        let played = PlayedEpisode { episode, actions: vec![action; 10], ..PlayedEpisode::default() };
        writer.record(&Event::EpisodeFinished(record)).expect("room on the disk");
        writer.record_actions(&played).expect("room on the disk");
    }
    writer.record(&Event::Finished { episode: episodes }).expect("room on the disk");
}

/// A session with clusters that watches a long run in `folder`.
fn session(folder: &Path) -> Session {
    let task = task::load("task1").expect("a shipped task");
    run(&folder.join("run"), &RunConfig::new(Arc::new(task.clone())), EPISODES);
    let mut session = Session::new(task, folder.to_owned());
    for line in ["model true".to_owned(), "clusters".to_owned(), format!("open {}/run", folder.display())] {
        let command = Command::parse(&line).expect("a command").expect("no comment");
        session.apply(command).expect("a command that works");
        session.wait(|_| {}).expect("a result");
    }
    session
}

#[divan::bench(args = ["1 z", "2", "3", "4", "4 enter", "5", "6", "8", "?"])]
fn frame_200x60(bencher: Bencher, keys: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut workbench = App::offscreen(session(folder.path()));
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    workbench.press_keys(keys).expect("keys");
    bencher.bench_local(|| {
        workbench.tick(FRAME);
        terminal.draw(|frame| workbench.draw(frame)).map(drop)
    });
}

/// A key press on the list of 10,000 runs, and the frame after it.
#[divan::bench]
fn key_among_10000_runs(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let session = session(folder.path());
    for number in 0..10_000 {
        let run = folder.path().join(format!("run-{number:05}"));
        std::fs::create_dir(&run).expect("room on the disk");
        for file in ["config.json", "events.jsonl"] {
            std::fs::hard_link(folder.path().join("run").join(file), run.join(file)).expect("a file of the run");
        }
    }
    let mut workbench = App::offscreen(session);
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    workbench.press_keys("5").expect("keys");
    while workbench.is_reading_runs() {
        std::thread::sleep(FRAME);
        workbench.tick(FRAME);
    }
    bencher.bench_local(|| {
        workbench.press_keys("down").expect("keys");
        workbench.tick(FRAME);
        terminal.draw(|frame| workbench.draw(frame)).map(drop)
    });
}

/// Lets time pass until the screen has not changed for a while, so that nothing more is being read.
fn wait_until_drawn(workbench: &mut App, terminal: &mut Terminal<TestBackend>) {
    const QUIET: Duration = Duration::from_secs(3);
    let mut changed = Instant::now();
    let mut before = terminal.backend().buffer().clone();
    while changed.elapsed() < QUIET {
        std::thread::sleep(FRAME);
        workbench.tick(FRAME);
        terminal.draw(|frame| workbench.draw(frame)).expect("a backend that cannot fail");
        if *terminal.backend().buffer() != before {
            changed = Instant::now();
            before = terminal.backend().buffer().clone();
        }
    }
}

/// 10 groups of 10 runs of 10,000 episodes: their list, their bands, their hundred single curves,
/// and one metric alone.
#[divan::bench(args = ["5", "4 v", "4 v tab", "4 v enter"])]
fn frame_of_10_groups_of_10_runs(bencher: Bencher, keys: &str) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let task = Arc::new(task::load("task1").expect("a shipped task"));
    let config = RunConfig { episodes: 10_000, ..RunConfig::new(task) };
    let first = folder.path().join("run-0-0");
    for group in 0..10u64 {
        for seed in 0..10 {
            let mut config = RunConfig { seed, ..config.clone() };
            config.ddpg.gamma = 0.90 + 0.005 * group as f32;
            let path = folder.path().join(format!("run-{group}-{seed}"));
            if path == first {
                run(&path, &config, 10_000);
                continue;
            }
            RunDirectory::create(&path, &config).expect("a new folder");
            std::fs::hard_link(first.join("events.jsonl"), path.join("events.jsonl")).expect("a log");
        }
    }
    let mut session = Session::new((*config.task).clone(), folder.path().to_owned());
    let open = Command::parse(&format!("open {}", first.display())).expect("a command").expect("no comment");
    session.apply(open).expect("a run");
    session.wait(|_| {}).expect("a result");
    let mut workbench = App::offscreen(session);
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    workbench.press_keys("5").expect("keys");
    wait_until_drawn(&mut workbench, &mut terminal);
    workbench.press_keys(keys).expect("keys");
    wait_until_drawn(&mut workbench, &mut terminal);
    bencher.bench_local(|| {
        // As after the end of an episode, everything is redrawn.
        workbench.redraw();
        workbench.tick(FRAME);
        terminal.draw(|frame| workbench.draw(frame)).map(drop)
    });
}

/// A key that moves the crosshair, and with it the scene, to an earlier episode.
#[divan::bench]
fn key_that_scrubs(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut workbench = App::offscreen(session(folder.path()));
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    workbench.press_keys("4 z z left space").expect("keys");
    wait_until_drawn(&mut workbench, &mut terminal);
    let mut keys = ["left", "right"].into_iter().cycle();
    bencher.bench_local(|| {
        workbench.press_keys(keys.next().expect("it does not end")).expect("keys");
        workbench.tick(FRAME);
        terminal.draw(|frame| workbench.draw(frame)).map(drop)
    });
}
