//! Time of a frame of the workbench at 200 x 60 cells: `cargo bench --bench tui`.
//!
//! The session watches a finished run of 5000 episodes and has action clusters. A frame is
//! what a 60th of a second brings: time passes, the whole screen is drawn, and the cells
//! that differ are found.

use std::time::Duration;

use divan::Bencher;
use mge::Still;
use mge::run::{EpisodeRecord, Event, RunDirectory, RunWriter};
use mge::task;
use mge::trainer::RunConfig;
use mge::workbench::{Command, Session};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

/// Episodes of the run that is watched.
const EPISODES: u64 = 5000;
/// Time between two frames.
const FRAME: Duration = Duration::from_micros(16_667);

fn main() {
    divan::main();
}

/// A session with clusters that watches a long run in `folder`.
fn session(folder: &std::path::Path) -> Session {
    let task = task::load("task1").expect("a shipped task");
    let config = RunConfig::new(std::sync::Arc::new(task.clone()));
    let directory = RunDirectory::create(folder.join("run"), &config).expect("a new folder");
    let mut writer = RunWriter::open(&directory, 0).expect("a new run");
    for episode in 1..=EPISODES {
        let wave = (episode as f32 / 40.0).sin();
        let record = EpisodeRecord {
            episode,
            steps: 10,
            return_: 5.0 + wave,
            rolling_success: episode as f64 / EPISODES as f64,
            critic_loss: Some(0.1 + 0.09 * wave),
            ..EpisodeRecord::default()
        };
        writer.record(&Event::EpisodeFinished(record)).expect("room on the disk");
    }
    writer.record(&Event::Finished { episode: EPISODES }).expect("room on the disk");
    drop(writer);
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
    let mut still = Still::new(session(folder.path()));
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    still.press(keys).expect("keys");
    bencher.bench_local(|| {
        still.pass(FRAME);
        still.draw(&mut terminal)
    });
}

/// A key on the list of 10,000 runs, and the frame after it.
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
    let mut still = Still::new(session);
    let mut terminal = Terminal::new(TestBackend::new(200, 60)).expect("a backend that cannot fail");
    still.press("5").expect("keys");
    while still.is_reading_runs() {
        std::thread::sleep(FRAME);
        still.pass(FRAME);
    }
    bencher.bench_local(|| {
        still.press("down").expect("keys");
        still.pass(FRAME);
        still.draw(&mut terminal)
    });
}
