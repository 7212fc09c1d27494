//! The session's figures: what it holds, as the data of a figure, into a file.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use super::command::{self, Command, FigureKind};
use super::dry_run::check_figure;
use super::job::Reporter;
use super::run::RunView;
use super::{Session, SessionError, create_parent};
use crate::env::Placement;
use crate::figures::{
    ActionSamples, Animation, Curve, CurvePanel, DEFAULT_DPI, Dashboard, Figure, LearningCurves, Moment, Provenance,
    Statistics, TaskActions, TaskGrid,
};
use crate::physics::PHYSICS_DT;
use crate::run::{EpisodeRecord, config_hash};
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
                Err(play) => {
                    let (task, trace) = play().map_err(|error| error.to_string())?;
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
    fn episode_to_show(&self) -> Result<Play, SessionError> {
        let hand_play = self.hand_play();
        if !hand_play.trace().steps.is_empty() {
            let played = (hand_play.task().clone(), hand_play.trace().clone());
            return Ok(Box::new(|| Ok(played)));
        }
        let run = self.run().ok_or(SessionError::NoRun)?;
        let (task, saved, seed) = (run.config().task.clone(), run.saved(), run.config().seed);
        Ok(Box::new(move || Ok((task, saved.greedy_episode(seed)?))))
    }
}

/// Plays the episode of an animation, if it is yet to be played.
type Play = Box<dyn FnOnce() -> Result<(Arc<Task>, Trace), SessionError> + Send>;

/// Rolling success of each run, one panel a task.
fn learning_curves(runs: &[RunView]) -> LearningCurves {
    let mut panels: Vec<CurvePanel> = Vec::new();
    for run in runs {
        let config = run.config();
        let curve = Curve {
            label: run_label(config),
            x: run.records().iter().map(|record| record.episode as f64).collect(),
            y: run.records().iter().map(|record| record.rolling_success).collect(),
            partial: run.records().iter().take_while(|record| record.episode < WINDOW.get() as u64).count(),
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
    // An evaluation whose episode is not among those kept goes to the next one.
    let mut greedy = vec![f64::NAN; run.records().len()];
    for evaluation in run.evaluations() {
        let place = run.records().partition_point(|record| record.episode < evaluation.episode);
        if let Some(success) = greedy.get_mut(place) {
            *success = evaluation.success;
        }
    }
    Dashboard {
        title: format!("{} on {}", run_label(config), config.task.name),
        window: WINDOW.get(),
        episode: column(&|record| record.episode as f64),
        greedy_success: greedy,
        metrics: Dashboard::metrics().map(|metric| (metric, column(&|record| metric.of(record)))).collect(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trainer::TracedStep;
    use crate::workbench::Script;

    fn run(session: &mut Session, lines: &str) {
        Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).unwrap();
    }

    fn session(folder: &std::path::Path) -> Session {
        let mut session = Session::new(crate::task::load("task1").unwrap(), folder.to_owned());
        run(&mut session, "method ddpg\nepisodes 3\nset ddpg.hidden 8\nset evaluation.every 2");
        session
    }

    #[test]
    fn curves_and_dashboard_are_those_of_the_runs() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        run(&mut session, "train\nwait\nseed 4\nmethod ddpg-uniform\nepsilon 0.1\ntrain\nwait");
        run(&mut session, "task task2\nepisodes 1\ntrain\nwait\nwatch 1");
        let curves = learning_curves(session.runs());
        assert_eq!((curves.window, curves.statistics.seeds), (WINDOW.get(), 2));
        assert_eq!(curves.statistics.centre, "Single runs");
        let tasks: Vec<(&str, usize)> =
            curves.panels.iter().map(|panel| (panel.task.as_str(), panel.curves.len())).collect();
        assert_eq!(tasks, [("task1", 2), ("task2", 1)]);
        let [first, second] = &curves.panels[0].curves[..] else { panic!("two curves") };
        assert_eq!(
            (first.label.as_str(), second.label.as_str()),
            ("DDPG, seed 0", "DDPG, uniform exploration, epsilon 0.1, seed 4")
        );
        let run = session.run().unwrap();
        let successes: Vec<f64> = run.records().iter().map(|record| record.rolling_success).collect();
        assert_eq!((&first.x[..], &first.y, first.partial), (&[1.0, 2.0, 3.0][..], &successes, 3));

        let shown = dashboard(run);
        assert_eq!((shown.title.as_str(), shown.window), ("DDPG, seed 0 on task1", WINDOW.get()));
        assert_eq!((&shown.episode, &shown.metrics[&crate::run::Metric::Success]), (&first.x, &first.y));
        let [none, greedy, last] = shown.greedy_success[..] else { panic!("three episodes") };
        assert!(none.is_nan() && last.is_nan() && greedy == run.evaluations()[0].success);
        assert!(session.figure(FigureKind::Episode).unwrap().is_none());
    }

    #[test]
    fn runs_without_episodes_have_no_curves() {
        let folder = tempfile::tempdir().unwrap();
        assert!(matches!(session(folder.path()).figure(FigureKind::Learning), Err(SessionError::NoRun)));
    }

    #[test]
    fn what_was_played_by_hand_is_shown_before_the_greedy_policy() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        run(&mut session, "seed 4\ntrain\nwait\nseed 5");
        let seed = |session: &Session, kind| session.provenance(kind, String::new()).unwrap().seeds;
        assert_eq!(seed(&session, FigureKind::Episode), [4]);
        run(&mut session, "place -0.9 0.9");
        assert_eq!((seed(&session, FigureKind::Episode), seed(&session, FigureKind::Dashboard)), (vec![5], vec![4]));
        let (_, trace) = session.episode_to_show().unwrap()().unwrap();
        assert_eq!(trace.steps.len(), 1);
    }

    #[test]
    fn an_animation_has_every_third_moment_and_the_last() {
        let step = |placement, points: usize, subgoals: &[usize], goal| TracedStep {
            action: [points as f32, 0.0],
            source: crate::trainer::Source::Hand,
            placement,
            reward: 0.0,
            subgoals: subgoals.to_vec(),
            goal,
            path: (0..points).map(|i| [points as f32, i as f32]).collect(),
        };
        let steps = vec![
            step(Placement::Placed, 4, &[], false),
            step(Placement::Overlap, 5, &[0, 1], false),
            step(Placement::Placed, 2, &[], true),
        ];
        let task = crate::task::load("task1").unwrap();
        let shown = animation(&task, &Trace { steps, ..Trace::default() });
        let found: Vec<_> = shown.moments.iter().map(|m| (m.ball, m.placed.len(), m.reached)).collect();
        let expected =
            [([4.0, 0.0], 1, 0), ([4.0, 3.0], 1, 0), ([5.0, 2.0], 1, 0), ([2.0, 0.0], 2, 2), ([2.0, 1.0], 2, 3)];
        assert_eq!(found, expected);
        let times: Vec<f32> = shown.moments.iter().map(|moment| (moment.time / PHYSICS_DT).round()).collect();
        assert_eq!(times, [0.0, 3.0, 6.0, 9.0, 10.0]);
        assert_eq!(shown.frame_ms, (3000.0 * PHYSICS_DT) as u32);
    }
}
