//! Tests of whole screens, on a workspace without a session and view models of typical states.

mod background;
mod compared;
mod composer;
mod details;
mod frame;
mod golden;
mod lists;
mod pictures;
#[path = "../../../../tests/cli/terminal.rs"]
#[allow(dead_code, reason = "shared: each test file uses a part of it")]
mod pseudo_terminal;
mod real_sessions;
mod remembered;
mod sequences;
mod ways_out;

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;

use super::App;
use crate::tui::view::playback::{Episode, Origin};
use crate::tui::view::{
    Curves, Grouping, Level, LogLine, ModelSummary, RunSummary, TaskModel, ViewModel, Watched, Workspace,
};
use crate::tui::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_agent::DdpgConfig;
use mge_figures::TaskGrid;
use mge_guidance::{ActionPrior, Cluster, GuidanceConfig, StagePrior};
use mge_results::Composition;
use mge_run::{Metric, RunState};
use mge_task::{Region, Task};
use mge_trainer::{Fork, PriorSource, RunConfig, Trace};
use mge_workbench::listing::named_tasks;
use mge_workbench::{Command, FigureJob, FigureKind, HandPlay, PriorState};

/// A workspace that records what it is asked to do.
pub struct RecordingWorkspace {
    view: ViewModel,
    asked: Rc<RefCell<Vec<String>>>,
}

thread_local! {
    /// Background requests to the workspace of this test, the latest last.
    static WANTED: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
    /// Past episodes take for ever to read.
    static SLOW: Cell<bool> = const { Cell::new(false) };
    /// The view that the next poll brings.
    static NEWS: RefCell<Option<ViewModel>> = const { RefCell::new(None) };
}

/// Background requests to the workspace since the last call.
fn wanted() -> Vec<String> {
    WANTED.take()
}

fn want(what: String) {
    WANTED.with_borrow_mut(|wanted| wanted.push(what));
}

/// The folder names of runs.
fn names(runs: &[PathBuf]) -> String {
    let names: Vec<_> = runs.iter().filter_map(|run| run.file_name()?.to_str()).collect();
    names.join(" ")
}

/// Brings the session into another state and ticks the app.
fn bring(app: &mut App, view: ViewModel) {
    NEWS.set(Some(view));
    app.tick(std::time::Duration::ZERO);
}

impl RecordingWorkspace {
    fn episode(&self, run: &Path, episode: u64) -> Result<Arc<Episode>, String> {
        let shown = Episode::untouched(&self.view.task);
        let trace = Trace { episode, ..Trace::clone(&shown.trace) };
        let run = self.view.run(run).ok_or("no such run")?;
        if episode > run.done {
            return Err(format!("{} has no episode {episode}", run.name));
        }
        Ok(Arc::new(Episode { trace: Arc::new(trace), origin: Origin::Run(run.path.clone()), ..shown }))
    }
}

impl Workspace for RecordingWorkspace {
    fn view(&self) -> &ViewModel {
        &self.view
    }

    fn poll(&mut self) -> bool {
        let Some(news) = NEWS.take() else { return false };
        self.view = news;
        true
    }

    fn apply(&mut self, command: Command) -> Result<String, String> {
        self.asked.borrow_mut().push(command.to_string());
        Ok(String::new())
    }

    fn check(&self, _: &[Command]) -> Result<(), String> {
        Ok(())
    }

    fn request_live(&self) {
        want("an episode".to_owned());
    }

    fn model_for(&mut self, task: &Arc<Task>) -> Option<Result<TaskModel, String>> {
        Some(TaskModel::new(&RunConfig { prior: PriorSource::TruePhysics, ..RunConfig::new(task.clone()) }))
    }

    fn past_episode(&mut self, run: &Path, episode: u64) -> Option<Result<Arc<Episode>, String>> {
        (!SLOW.get()).then(|| self.episode(run, episode))
    }

    fn request_curves(&mut self, runs: Vec<PathBuf>) {
        want(format!("curves of {}", names(&runs)));
    }

    fn request_agent(&mut self, episode: u64) {
        want(format!("agent of {episode}"));
    }

    fn figure(&self, kind: FigureKind, _: &Composition) -> Result<FigureJob, String> {
        match kind {
            FigureKind::Scene => {
                let figure = Box::new(TaskGrid { tasks: vec![Task::clone(&self.view.task)] });
                Ok(Box::new(|_| {
                    Ok(mge_results::Composed {
                        figure,
                        seeds: vec![],
                        config_hash: String::new(),
                        remark: String::new(),
                    })
                }))
            }
            _ => Err(format!("there is nothing for the {} figure in tests", kind.name())),
        }
    }

    fn log(&mut self, level: Level, text: String) {
        self.view.log.push(at_noon(level, &text));
    }
}

/// The first start, before anything has happened.
pub fn empty() -> ViewModel {
    let task = Arc::new(mge_task::load("task1").unwrap());
    let model = |name: &str, about: &str| ModelSummary {
        name: name.into(),
        about: about.into(),
        fits: true,
        ..ModelSummary::default()
    };
    ViewModel {
        hand: HandPlay::new(task.clone(), 0),
        file: None,
        dirty: false,
        proposed: Vec::new(),
        proposing: None,
        settings: RunConfig {
            episodes: 2000,
            epsilon: "linear:0.8:0.05:1500".parse().unwrap(),
            ddpg: DdpgConfig { gamma: 0.9, ..DdpgConfig::default() },
            ..RunConfig::new(task.clone())
        },
        extends_to: None,
        folder: PathBuf::from("runs"),
        prior: None,
        prior_state: PriorState::Absent,
        prior_failure: None,
        tasks: named_tasks(),
        models: vec![model("trained", "model of the task"), model("true", "the environment's own physics")],
        runs: Vec::new(),
        groups: Arc::default(),
        runs_unread: 0,
        damaged: Vec::new(),
        watched: None,
        task,
        model_work: None,
        forking: None,
        figures: Vec::new(),
        log: Vec::new(),
        log_total: 0,
    }
}

/// In the middle of a training, with another run finished.
pub fn typical() -> ViewModel {
    let mut view = empty();
    view.prior = Some(Arc::new(prior()));
    view.prior_state = PriorState::Fresh;
    view.dirty = true;
    view.proposed = vec![Region { position: [-0.2, 0.5], radius: 4.0 }];
    let running = run("task1-ddpg-mge-seed0", RunState::Running, 700);
    view.runs = vec![Arc::new(run("old", RunState::Finished, 2000)), Arc::new(running)];
    watch(&mut view, 1);
    view.figures = vec![PathBuf::from("figures/task1-scene.png")];
    view.log = vec![
        at_noon(Level::Info, "training in runs/task1-ddpg-mge-seed0"),
        at_noon(Level::Good, "the action clusters are there"),
    ];
    view
}

/// Two groups of three seeds.
pub fn grouped() -> ViewModel {
    let mut view = empty();
    for (name, method, state, done) in [
        ("guided", "ddpg-mge", RunState::Finished, 2000),
        ("plain", "ddpg", RunState::Stopped("on request".into()), 500),
    ] {
        for seed in 0..3 {
            let known = run(&format!("{name}-{seed}"), state.clone(), done - 100 * seed);
            let config = RunConfig::clone(&view.settings).with_setting("method", method).unwrap();
            let config = config.with_setting("seed", &seed.to_string()).unwrap();
            let RunSummary { config, label, .. } = RunSummary::new(&known.path, Arc::new(config), state.clone());
            view.runs.push(Arc::new(RunSummary { config, label, ..known }));
        }
    }
    view.groups = Arc::new(Grouping::new(&view.runs, &Grouping::default()));
    watch(&mut view, 0);
    view
}

/// A run, a fork of it, and a fork of that fork.
pub fn forked() -> ViewModel {
    let mut view = empty();
    let first = run("first", RunState::Finished, 2000);
    let fork = |name: &str, of: &str, episode: u32, changes: &[&str]| {
        let mut config = RunConfig::clone(&view.settings);
        let changes = changes.iter().map(|change| (*change).to_owned()).collect();
        config.ddpg.gamma = 0.5;
        config.fork = Some(Fork { run: of.to_owned(), episode, changes, tasks: Vec::new() });
        let known = run(name, RunState::Finished, 1200);
        let RunSummary { config, label, .. } = RunSummary::new(&known.path, Arc::new(config), known.state.clone());
        Arc::new(RunSummary { config, label, ..known })
    };
    let grandchild = fork("first-at500-at700", "first-at500", 700, &["epsilon=0.1"]);
    let child = fork("first-at500", "first", 500, &["ddpg.gamma=0.5"]);
    view.runs = vec![grandchild, Arc::new(first), Arc::new(run("other", RunState::Finished, 300)), child];
    watch(&mut view, 3);
    view
}

/// A run and the clusters have failed.
pub fn failed() -> ViewModel {
    let mut view = empty();
    let reason = "the critic's loss is not finite after 1203 updates: try a smaller learning rate";
    view.prior_failure = Some("no shipped dynamics model knows the tools box, bucket".into());
    view.runs = vec![Arc::new(run("task1-ddpg-mge-seed0", RunState::Failed(reason.into()), 120))];
    watch(&mut view, 0);
    view.log = vec![at_noon(Level::Error, &format!("task1-ddpg-mge-seed0: {reason}"))];
    view
}

/// Watches a run of the list, on the current task.
pub fn watch(view: &mut ViewModel, index: usize) {
    let run = view.runs[index].clone();
    view.watched = Some(Watched { run, prior: None, live: None, agent: None, greedy: None });
}

/// Changes a run of the list; if it is watched, the watched run, too.
pub fn change_run(view: &mut ViewModel, index: usize, change: impl FnOnce(&mut RunSummary)) {
    let watched = view.watched.as_ref().is_some_and(|watched| watched.run.path == view.runs[index].path);
    change(Arc::make_mut(&mut view.runs[index]));
    if watched {
        watch(view, index);
    }
}

/// A finished run with a name and no episodes.
pub fn run_summary(name: &str) -> RunSummary {
    run(name, RunState::Finished, 0)
}

/// A run on a task that differs from the others' in its name.
pub fn run_on(task: &str, name: &str) -> RunSummary {
    let mut run = run_summary(name);
    Arc::make_mut(&mut Arc::make_mut(&mut run.config).task).name = task.to_owned();
    run
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
        model_sha256: None,
        seed: 0,
        config: GuidanceConfig::default(),
        stages: vec![stage(vec![cluster(0.4, 0.5), cluster(0.4, 0.1)]), stage(vec![cluster(-0.3, -0.3)])],
    }
}

/// A run with curves that rise, fall, and have a gap.
fn run(name: &str, state: RunState, done: u64) -> RunSummary {
    let mut curves = Curves::default();
    for episode in 0..done {
        // The numbers of episodes begin at 1.
        let share = episode as f32 / 2000.0;
        let wave = (episode as f32 / 40.0).sin();
        curves.push(
            episode + 1,
            episode as f32 / 12.5,
            Metric::KEPT.map(|metric| match metric {
                Metric::Success => share,
                Metric::CriticLoss if (200..300).contains(&episode) => f32::NAN,
                Metric::CriticLoss => 10f32.powf(-2.0 * share),
                Metric::Epsilon => 0.8 - 0.75 * share,
                Metric::Actions => 10.0,
                _ => share + 0.3 * wave,
            }),
        );
    }
    RunSummary {
        opened: true,
        active: state == RunState::Running,
        expected: (state == RunState::Running).then_some(0.08),
        done,
        success: Some(done as f64 / 2000.0),
        curves: Arc::new(curves),
        evaluations: vec![(100, 0.0), (600, 1.0)],
        ..RunSummary::new(&PathBuf::from("runs").join(name), Arc::new(empty().settings), state)
    }
}

impl App {
    /// The latest message.
    pub(super) fn message(&self) -> String {
        self.message.as_ref().map_or_else(String::new, |(_, text, _)| text.clone())
    }
}

/// The workbench with a view and playback stopped, and the commands that it gives its workspace.
pub fn app(view: ViewModel) -> (App, Rc<RefCell<Vec<String>>>) {
    let asked = Rc::default();
    let workspace = RecordingWorkspace { view, asked: Rc::clone(&asked) };
    let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
    let mut app = App::new(Box::new(workspace), theme);
    app.screens.scene.player.playing = false;
    app.tick(std::time::Duration::ZERO);
    (app, asked)
}

/// Presses keys, written as in the help and separated by spaces.
pub fn press(app: &mut App, keys: &str) {
    for key in keys.split_whitespace() {
        app.press_keys(key).unwrap();
        app.tick(std::time::Duration::ZERO);
    }
}

/// The screen at a size.
pub fn shot(app: &mut App, width: u16, height: u16) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| app.draw(frame)).unwrap();
    terminal.backend().buffer().clone()
}

/// The characters of a screen, line by line.
pub fn text(buffer: &Buffer) -> String {
    let rows = buffer.content.chunks(usize::from(buffer.area.width));
    rows.map(|row| row.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned() + "\n").collect()
}
