//! The session's figures: what it holds, as the data of a figure, into a file.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::command::{self, Command, FigureKind};
use super::dry_run::check_figure;
use super::job::Reporter;
use super::run::{RunView, SavedRun};
use super::{Session, SessionError, create_parent};
use crate::env::Placement;
use crate::figures::{
    ActionSamples, Animation, Curve, CurvePanel, DEFAULT_DPI, Dashboard, Figure, LearningCurves, Moment, Provenance,
    Statistics, TaskActions, TaskGrid,
};
use crate::physics::PHYSICS_DT;
use crate::run::{EpisodeRecord, Metric, config_hash};
use crate::stats::rolling::WINDOW;
use crate::task::Task;
use crate::trainer::{RunConfig, Trace};

/// Physics steps between two frames of an animation.
const STEPS_PER_FRAME: usize = 3;
/// Resolution of an animation unless another is asked for: 480 pixels wide.
const ANIMATION_DPI: u32 = 137;

impl Session {
    /// Begins to write a figure of what the session holds, with its numbers as CSV beside it.
    pub(super) fn export(&mut self, command: &command::Figure) -> Result<String, SessionError> {
        let command::Figure { kind, ref path, dpi } = *command;
        check_figure(kind, path)?;
        let provenance = self.provenance(kind, Command::from(command.clone()).to_string())?;
        let figure = match self.figure(kind)? {
            Some(figure) => Ok(figure),
            None => Err(self.episode_to_show()?),
        };
        let report = format!("drawing {}", path.display());
        let path = path.clone();
        let work = move |_: &Reporter| -> Result<PathBuf, String> {
            create_parent(&path).map_err(|error| error.to_string())?;
            let written = match figure {
                Ok(figure) => figure.write(&path, &provenance, dpi.unwrap_or(DEFAULT_DPI)),
                Err(episode) => {
                    let (task, trace) = episode.played().map_err(|error| error.to_string())?;
                    animation(&task, &trace).write_gif(&path, &provenance, dpi.unwrap_or(ANIMATION_DPI))
                }
            };
            written.map(|()| path).map_err(|error| error.to_string())
        };
        self.begin_job(command.clone(), work, |_, path| Ok(format!("wrote {}", path?.display())))?;
        Ok(report)
    }

    /// The settings behind a figure: those of the runs it shows, or of the session.
    fn provenance(&self, kind: FigureKind, command: String) -> Result<Provenance, SessionError> {
        let by_hand = kind == FigureKind::Episode && !self.hand_play().trace().steps.is_empty();
        let settings = match kind {
            FigureKind::Learning => {
                let configs: Vec<&RunConfig> = self.runs().iter().map(RunView::config).collect();
                let seeds: BTreeSet<u64> = configs.iter().map(|config| config.seed).collect();
                return Ok(Provenance::new(command, &Vec::from_iter(seeds), config_hash(&configs)?));
            }
            FigureKind::Dashboard | FigureKind::Episode if !by_hand => {
                self.run().map_or(self.config(), RunView::config)
            }
            _ => self.config(),
        };
        Ok(Provenance::new(command, &[settings.seed], config_hash(settings)?))
    }

    /// A figure of what the session holds; None for the animation, which is no figure.
    ///
    /// # Errors
    /// When there is nothing to show of that kind yet.
    pub fn figure(&self, kind: FigureKind) -> Result<Option<Box<dyn Figure + Send>>, SessionError> {
        Ok(Some(match kind {
            FigureKind::Scene => Box::new(TaskGrid { tasks: vec![self.task().clone()] }),
            FigureKind::Clusters => {
                let prior = self.prior().ok_or(SessionError::NoClusters)?;
                Box::new(ActionSamples { tasks: vec![TaskActions::sample(self.task(), prior, self.config().seed)] })
            }
            FigureKind::Learning if self.runs().iter().all(|run| run.records().is_empty()) => {
                return Err(SessionError::NoRun);
            }
            FigureKind::Learning => Box::new(learning_curves(self.runs())),
            FigureKind::Dashboard => Box::new(dashboard(self.run().ok_or(SessionError::NoRun)?)),
            FigureKind::Episode => return Ok(None),
        }))
    }

    /// The greedy episode of the current run, or the one played by hand.
    fn episode_to_show(&self) -> Result<EpisodeToShow, SessionError> {
        let hand_play = self.hand_play();
        if !hand_play.trace().steps.is_empty() {
            return Ok(EpisodeToShow::Played(hand_play.task().clone(), hand_play.trace().clone()));
        }
        let run = self.run().ok_or(SessionError::NoRun)?;
        Ok(EpisodeToShow::Greedy(run.config().task.clone(), Box::new(run.saved()), run.config().seed))
    }
}

/// The episode of an animation.
enum EpisodeToShow {
    /// One that was played.
    Played(Arc<Task>, Trace),
    /// One of a saved policy, that is yet to be played, with its seed.
    Greedy(Arc<Task>, Box<SavedRun>, u64),
}

impl EpisodeToShow {
    fn played(self) -> Result<(Arc<Task>, Trace), SessionError> {
        match self {
            Self::Played(task, trace) => Ok((task, trace)),
            Self::Greedy(task, run, seed) => Ok((task, run.greedy_episode(seed)?)),
        }
    }
}

/// Rolling success of each run, one panel a task.
fn learning_curves(runs: &[RunView]) -> LearningCurves {
    let mut panels: Vec<CurvePanel> = Vec::new();
    for run in runs {
        let config = run.config();
        let curve = Curve {
            label: run_label(config),
            x: run.records().iter().map(|record| record.episode as f64).collect(),
            y: run.records().iter().map(|record| record.rolling_success).collect(),
            partial: run.records().len().min(WINDOW.get() - 1),
            ..Curve::default()
        };
        match panels.iter_mut().find(|panel| panel.task == config.task.name) {
            Some(panel) => panel.curves.push(curve),
            None => panels.push(CurvePanel { task: config.task.name.clone(), curves: vec![curve] }),
        }
    }
    let seeds: BTreeSet<u64> = runs.iter().map(|run| run.config().seed).collect();
    let statistics = Statistics { centre: "Single runs".to_owned(), seeds: seeds.len(), ..Statistics::default() };
    LearningCurves { window: WINDOW.get(), statistics, panels, ..LearningCurves::default() }
}

/// A run among others, in words: method, threshold and seed.
pub fn run_label(config: &RunConfig) -> String {
    let method = config.method.label();
    match config.method.has_clusters() {
        true => format!("{method}, epsilon {}, seed {}", config.epsilon.describe(), config.seed),
        false => format!("{method}, seed {}", config.seed),
    }
}

fn dashboard(run: &RunView) -> Dashboard {
    let config = run.config();
    let column = |of: &dyn Fn(&EpisodeRecord) -> f64| run.records().iter().map(of).collect::<Vec<f64>>();
    let metric = |metric: Metric| column(&|record| metric.of(record));
    let greedy = |record: &EpisodeRecord| {
        let evaluation = run.evaluations().iter().find(|evaluation| evaluation.episode == record.episode);
        evaluation.map_or(f64::NAN, |evaluation| evaluation.success)
    };
    Dashboard {
        title: format!("{} on {}", run_label(config), config.task.name),
        window: WINDOW.get(),
        episode: column(&|record| record.episode as f64),
        success: metric(Metric::Success),
        greedy_success: column(&greedy),
        episode_return: metric(Metric::Return),
        critic_loss: metric(Metric::CriticLoss),
        actor_loss: metric(Metric::ActorLoss),
        q_mean: metric(Metric::MeanQ),
        saturation: metric(Metric::Saturation),
        epsilon: metric(Metric::Epsilon),
    }
}

fn animation(task: &Task, trace: &Trace) -> Animation {
    let mut moments = Vec::new();
    let mut placed = Vec::new();
    let (mut reached, mut steps) = (0, 0);
    for (n, step) in trace.steps.iter().enumerate() {
        if step.placement == Placement::Placed {
            placed.push(step.action);
        }
        for (i, ball) in step.path.iter().enumerate() {
            let ends = i + 1 == step.path.len();
            if ends {
                reached += step.subgoals.len() + usize::from(step.goal);
            }
            let last = ends && n + 1 == trace.steps.len();
            if last || (steps + i).is_multiple_of(STEPS_PER_FRAME) {
                let time = (steps + i) as f32 * PHYSICS_DT;
                moments.push(Moment { time, ball: *ball, placed: placed.clone(), reached });
            }
        }
        steps += step.path.len();
    }
    let frame_ms = (STEPS_PER_FRAME as f32 * PHYSICS_DT * 1000.0) as u32;
    Animation { task: task.clone(), moments, frame_ms, trail: 30 }
}
