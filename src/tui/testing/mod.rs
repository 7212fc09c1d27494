//! A desk without a session, sessions' states as facts, and the tests of whole screens.

mod golden;
#[cfg(unix)]
#[path = "../../../tests/terminal/mod.rs"]
#[allow(dead_code, reason = "shared: each test file needs a part of it")]
mod pseudo_terminal;
mod sequences;
#[cfg(unix)]
mod ways_out;

use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;

use super::app::App;
use super::desk::{Desk, Mind};
use super::facts::{Facts, Level, LogLine, ModelFacts, RunFacts, Settings};
use super::key::Key;
use super::keymap::Keymap;
use super::metric::{Curves, Metric};
use super::playback::Episode;
use super::preview::Drawing;
use super::scene::{Ghost, Heat};
use super::screens;
use super::theme::{Depth, Marker, Palette, Theme};
use crate::env::{Action, Placement};
use crate::figures::TaskGrid;
use crate::guidance::{ActionPrior, Cluster, GuidanceConfig, StagePrior};
use crate::run::RunState;
use crate::task::{Region, Task};
use crate::trainer::Trace;
use crate::workbench::{Command, FigureKind, PriorState};

/// A desk that writes down what it is asked.
pub struct FakeDesk {
    facts: Facts,
    asked: Rc<RefCell<Vec<String>>>,
}

impl Desk for FakeDesk {
    fn facts(&self) -> &Facts {
        &self.facts
    }

    fn poll(&mut self) -> bool {
        false
    }

    /// Every line must be one of the command language, or it is refused.
    fn apply(&mut self, line: &str) -> Result<String, String> {
        match Command::parse(line) {
            Ok(Some(command)) => {
                self.asked.borrow_mut().push(command.to_string());
                Ok(String::new())
            }
            Ok(None) => Ok(String::new()),
            Err(error) => Err(error.to_string()),
        }
    }

    fn request_live(&self) {}

    fn ghost(&mut self, action: Action) -> Ghost {
        Ghost { action, placement: Placement::Placed, predicted: vec![[0.2, 0.6], [0.1, 0.4], [-0.1, 0.3]] }
    }

    fn mind(&self, _: &Episode, _: usize) -> Option<Mind> {
        Some(Mind { heat: Heat { side: 2, values: vec![0.0, 1.0, 2.0, 3.0] }, choice: [0.0; 2] })
    }

    fn foresee(&mut self, _: &Episode, _: usize) -> Vec<[f32; 2]> {
        vec![[0.2, 0.6], [0.1, 0.4]]
    }

    fn past_episode(&self, episode: u64) -> Result<Arc<Episode>, String> {
        let shown = Episode::untouched(&self.facts.task);
        let trace = Trace { episode, ..Trace::clone(&shown.trace) };
        Ok(Arc::new(Episode { title: format!("episode {episode} of a run"), trace: Arc::new(trace), ..shown }))
    }

    fn figure(&self, kind: FigureKind) -> Result<Drawing, String> {
        match kind {
            FigureKind::Scene => Ok(Box::new(TaskGrid { tasks: vec![Task::clone(&self.facts.task)] })),
            _ => Err(format!("there is nothing for the {} figure in tests", kind.name())),
        }
    }

    fn unusual_settings(&self) -> Vec<(String, String)> {
        vec![("episodes".into(), "2000".into()), ("ddpg.gamma".into(), "0.9".into())]
    }

    fn look_for_runs(&mut self) {}

    fn log(&mut self, level: Level, text: String) {
        self.facts.log.push(at_noon(level, &text));
    }
}

/// The first start: nothing has happened.
pub fn empty() -> Facts {
    let task = Arc::new(crate::task::load("task1").unwrap());
    let model = |name: &str, about: &str| ModelFacts { name: name.into(), about: about.into() };
    Facts {
        task,
        file: None,
        dirty: false,
        proposed: Vec::new(),
        proposing: None,
        settings: Settings {
            method: "ddpg-mge".into(),
            seed: 0,
            episodes: 2000,
            epsilon: "linear:0.8:0.05:1500".parse().unwrap(),
            model: "learned".into(),
            folder: PathBuf::from("runs"),
        },
        prior: None,
        prior_state: PriorState::Absent,
        prior_failure: None,
        models: vec![model("learned", "the shipped model"), model("true", "the environment's own physics")],
        runs: Vec::new(),
        current: None,
        live: None,
        played: Arc::new(Trace::default()),
        played_end: None,
        model_work: None,
        model_outcome: None,
        figures: Vec::new(),
        log: Vec::new(),
        log_total: 0,
    }
}

/// In the middle of a training, with another run finished.
pub fn typical() -> Facts {
    let mut facts = empty();
    facts.prior = Some(Arc::new(prior()));
    facts.prior_state = PriorState::Fresh;
    facts.dirty = true;
    facts.proposed = vec![Region { position: [-0.2, 0.5], radius: 4.0 }];
    facts.runs = vec![run("old", RunState::Finished, 2000), run("task1-ddpg-mge-seed0", RunState::Running, 700)];
    facts.current = Some(1);
    facts.figures = vec![PathBuf::from("figures/task1-scene.png")];
    facts.log = vec![
        at_noon(Level::Info, "training in runs/task1-ddpg-mge-seed0"),
        at_noon(Level::Good, "the action clusters are there"),
    ];
    facts
}

/// A run, the clusters, and the training of a model have failed.
pub fn failed() -> Facts {
    let mut facts = empty();
    let reason = "the critic's loss is not finite after 1203 updates: try a smaller learning rate";
    facts.prior_failure = Some("no shipped dynamics model knows the tools box, bucket".into());
    facts.runs = vec![run("task1-ddpg-mge-seed0", RunState::Failed(reason.into()), 120)];
    facts.current = Some(0);
    facts.log = vec![at_noon(Level::Error, &format!("task1-ddpg-mge-seed0: {reason}"))];
    facts.model_outcome = Some(Err("models/box.safetensors: epoch 12: the loss is not finite".into()));
    facts
}

/// A line of the log.
fn at_noon(level: Level, text: &str) -> LogLine {
    LogLine { time: jiff::civil::time(12, 0, 0, 0), level, text: text.to_owned() }
}

/// Clusters of both stages of the task.
fn prior() -> ActionPrior {
    let cluster = |x: f32, y: f32| Cluster { mean: [x, y], std: [0.05, 0.1], weight: 0.5, count: 20 };
    let stage = |clusters: Vec<Cluster>| StagePrior {
        actions: clusters.iter().map(|cluster| cluster.mean).collect(),
        clusters,
        ..StagePrior::default()
    };
    ActionPrior {
        version: 1,
        task: "task1".into(),
        model: "true physics".into(),
        seed: 0,
        config: GuidanceConfig::default(),
        stages: vec![stage(vec![cluster(0.4, 0.5), cluster(0.4, 0.1)]), stage(vec![cluster(-0.3, -0.3)])],
    }
}

/// A run with curves that rise, fall, and have a gap.
fn run(name: &str, state: RunState, done: u64) -> RunFacts {
    let mut curves = Curves::default();
    for episode in 0..done {
        let share = episode as f32 / 2000.0;
        let wave = (episode as f32 / 40.0).sin();
        curves.push(Metric::CURVES.map(|metric| match metric {
            Metric::Success => share,
            Metric::CriticLoss if (200..300).contains(&episode) => f32::NAN,
            Metric::CriticLoss => 10f32.powf(-2.0 * share),
            Metric::Epsilon => 0.8 - 0.75 * share,
            Metric::Actions => 10.0,
            _ => share + 0.3 * wave,
        }));
    }
    RunFacts {
        name: name.into(),
        path: PathBuf::from("runs").join(name),
        opened: true,
        active: state == RunState::Running,
        queued: false,
        task: "task1".into(),
        method: "ddpg-mge".into(),
        seed: 0,
        subgoals: 1,
        episodes: 2000,
        rate: Some(12.5).filter(|_| state == RunState::Running),
        state,
        preparing: None,
        done,
        success: Some(done as f32 / 2000.0),
        curves,
        evaluations: vec![(100, 0.0), (600, 1.0)],
    }
}

/// The workbench with these facts, not moving, and what it asks its desk.
pub fn app(facts: Facts) -> (App, Rc<RefCell<Vec<String>>>) {
    let asked = Rc::default();
    let desk = FakeDesk { facts, asked: Rc::clone(&asked) };
    let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
    let mut app = App::new(Box::new(desk), theme, Keymap::default());
    app.scene.player.playing = false;
    app.tick(std::time::Duration::ZERO);
    (app, asked)
}

/// Presses keys as people write them, separated by spaces.
pub fn press(app: &mut App, keys: &str) {
    for key in keys.split_whitespace() {
        let key: Key = key.parse().unwrap();
        app.event(crossterm::event::Event::Key(key.event()));
        app.tick(std::time::Duration::ZERO);
    }
}

/// The screen at a size.
pub fn shot(app: &mut App, width: u16, height: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| screens::draw(app, frame)).unwrap();
    terminal.backend().buffer().clone()
}

/// The characters of a screen, line by line.
pub fn text(buffer: &Buffer) -> String {
    let rows = buffer.content.chunks(usize::from(buffer.area.width));
    rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned() + "\n").collect()
}
