//! Export of the session's state as figures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::command::{self, Command, FigureKind};
use super::job::Reporter;
use super::run::RunView;
use super::{Session, SessionError};
use mge_base::atomic;
use mge_env::Placement;
use mge_figures::{ActionSamples, Animation, Dashboard, Figure, Moment, Provenance, TaskActions, TaskGrid};
use mge_physics::PHYSICS_DT;
use mge_results::{Composed, Composition, LearningRow, find_runs};
use mge_run::{EpisodeRecord, RunError, config_hash};
use mge_stats::rolling::WINDOW;
use mge_task::Task;
use mge_trainer::{RunConfig, Trace};

/// Physics steps between two frames of an animation.
const STEPS_PER_FRAME: usize = 3;

/// Deferred work that produces a figure and its provenance.
pub type FigureJob = Box<dyn FnOnce(&mut dyn FnMut(usize, usize)) -> Result<DrawnFigure, String> + Send>;

/// A figure and its provenance.
pub struct DrawnFigure {
    /// The figure.
    pub figure: Box<dyn Figure + Send>,
    seeds: Vec<u64>,
    config_hash: String,
}

impl Session {
    /// Starts writing a figure, with its data as CSV beside it.
    pub(super) fn export(&mut self, command: &command::Figure) -> Result<String, SessionError> {
        command.check_kind()?;
        let mut made_by = command.clone();
        made_by.to.force = false;
        if command.kind == FigureKind::Learning {
            made_by.composition.runs = self.source_runs(&command.composition);
        }
        let made_by = Command::from(made_by).to_string();
        let drawing = self.figure(command.kind, &command.composition)?;
        let report = format!("drawing {}", command.to.path.display());
        let (to, dpi) = (command.to.clone(), command.dpi);
        let work = move |reporter: &Reporter| -> Result<PathBuf, String> {
            atomic::create_parent(&to.path).map_err(|error| RunError::io("write", &to.path)(error).to_string())?;
            let drawn = drawing(&mut |done, all| _ = reporter.progress(done, all))?;
            let DrawnFigure { figure, seeds, config_hash } = drawn;
            let (provenance, dpi) = (Provenance::new(made_by, &seeds, config_hash), dpi.unwrap_or(figure.resolution()));
            figure.write(&to, &provenance, dpi).map(|()| to.path).map_err(|error| error.to_string())
        };
        self.start_job(command.clone(), work, |_, path| Ok(format!("wrote {}", path?.display())));
        Ok(report)
    }

    /// The settings behind a figure of one run or task.
    fn settings_of(&self, kind: FigureKind) -> &RunConfig {
        let by_hand = kind == FigureKind::Episode && !self.hand_play().trace().steps.is_empty();
        match kind {
            FigureKind::Dashboard | FigureKind::Episode if !by_hand => {
                self.run().map_or(self.config(), |run| run.config())
            }
            _ => self.config(),
        }
    }

    /// The folders of the runs that a composition shows: those it lists, otherwise the session's folder and the
    /// runs opened from elsewhere.
    fn source_runs(&self, composition: &Composition) -> Vec<PathBuf> {
        if !composition.runs.is_empty() {
            return composition.runs.clone();
        }
        let elsewhere =
            self.runs().iter().map(|run| run.directory().path()).filter(|path| !path.starts_with(self.folder()));
        let elsewhere: Vec<PathBuf> = elsewhere.map(Path::to_owned).collect();
        // A session folder without runs is left out if other runs are open.
        let holds_runs = elsewhere.is_empty() || find_runs(&[self.folder().to_owned()]).is_ok();
        Some(self.folder().to_owned()).filter(|_| holds_runs).into_iter().chain(elsewhere).collect()
    }

    /// A figure of the session, to be drawn later.
    ///
    /// # Errors
    /// When there is nothing of that kind to show yet.
    pub fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<FigureJob, SessionError> {
        let settings = self.settings_of(kind);
        let (seeds, config_hash) = (vec![settings.seed], config_hash(settings)?);
        let figure: Box<dyn Figure + Send> = match kind {
            FigureKind::Scene => Box::new(TaskGrid { tasks: vec![self.task().clone()] }),
            FigureKind::Clusters => {
                let prior = self.prior().ok_or(SessionError::NoClusters)?;
                Box::new(ActionSamples { tasks: vec![TaskActions::sample(self.task(), prior, self.config().seed)] })
            }
            FigureKind::Learning => {
                if composition.runs.is_empty() && self.runs().is_empty() && !self.folder().is_dir() {
                    return Err(SessionError::NoRun);
                }
                let composition = Composition { runs: self.source_runs(composition), ..composition.clone() };
                let (reader, estimates) = (Arc::clone(&self.reader), Arc::clone(&self.estimates));
                return Ok(Box::new(move |on_progress| {
                    let composed = composition.figure(&reader, &*estimates, on_progress);
                    let Composed { figure, seeds, config_hash } = composed.map_err(|error| error.to_string())?;
                    Ok(DrawnFigure { figure: Box::new(figure), seeds, config_hash })
                }));
            }
            FigureKind::Dashboard => {
                let run = self.run().ok_or(SessionError::NoRun)?;
                // The log of a run that was just opened is still being read: an empty figure would be drawn.
                if run.is_unread() {
                    let folder = run.directory().path().to_owned();
                    return Ok(Box::new(move |_| {
                        let run = RunView::read(&folder).map_err(|error| error.to_string())?;
                        match run.failure() {
                            Some(reason) if run.records().is_empty() => Err(reason.to_owned()),
                            _ => Ok(DrawnFigure { figure: Box::new(dashboard(&run)), seeds, config_hash }),
                        }
                    }));
                }
                Box::new(dashboard(run))
            }
            FigureKind::Episode => {
                let play = self.episode_to_show()?;
                return Ok(Box::new(move |_| {
                    let (task, trace) = play().map_err(|error| error.to_string())?;
                    Ok(DrawnFigure { figure: Box::new(animation(&task, &trace)), seeds, config_hash })
                }));
            }
        };
        Ok(Box::new(move |_| Ok(DrawnFigure { figure, seeds, config_hash })))
    }

    /// The episode played by hand, or else a greedy episode of the current run.
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

/// Produces the episode of an animation, playing it if needed.
type Play = Box<dyn FnOnce() -> Result<(Arc<Task>, Trace), SessionError> + Send>;

/// The label of a run: method, threshold and seed.
pub fn run_label(config: &RunConfig) -> String {
    format!("{}, seed {}", LearningRow::so_far(config, 0, None).label(), config.seed)
}

fn dashboard(run: &RunView) -> Dashboard {
    let (config, name) = (run.config(), run.name());
    let is_named = run.directory().path().file_name().is_some_and(|folder| *folder != *name);
    let named = if is_named { format!("{name}: ") } else { String::new() };
    let column = |of: &dyn Fn(&EpisodeRecord) -> f64| run.records().iter().map(of).collect::<Vec<f64>>();
    // An evaluation whose episode was not kept is shown at the next kept one.
    let mut greedy = vec![f64::NAN; run.records().len()];
    for evaluation in run.evaluations() {
        let place = run.records().partition_point(|record| record.episode < evaluation.episode);
        if let Some(success) = greedy.get_mut(place) {
            *success = evaluation.success;
        }
    }
    Dashboard {
        title: format!("{named}{} on {}", run_label(config), config.task.name),
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
            placed.push(trace.tool(task, step));
        }
        for (i, ball) in step.path.iter().enumerate() {
            let ends = i + 1 == step.path.len();
            if ends {
                reached += step.subgoals.len() + usize::from(step.goal);
            }
            let last = ends && n + 1 == trace.steps.len();
            if last || (steps + i).is_multiple_of(STEPS_PER_FRAME) {
                let time = (steps + i) as f32 * PHYSICS_DT;
                moments.push(Moment { time, ball: *ball, movers: Vec::new(), placed: placed.clone(), reached });
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
    use crate::Script;
    use mge_trainer::TracedStep;

    fn run(session: &mut Session, lines: &str) {
        Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).unwrap();
    }

    fn session(folder: &std::path::Path) -> Session {
        let mut session = Session::new(mge_task::load("task1").unwrap(), folder.to_owned());
        run(&mut session, "method ddpg\nepisodes 3\nset ddpg.hidden 8\nset evaluation.every 2");
        session
    }

    fn drawn(session: &Session, composition: &Composition) -> Result<DrawnFigure, String> {
        let drawing = session.figure(FigureKind::Learning, composition).map_err(|error| error.to_string())?;
        drawing(&mut |_, _| ())
    }

    fn options(words: &[&str]) -> Composition {
        Composition::default().with_options(words.iter().map(|word| word.split_once('=').unwrap())).unwrap()
    }

    #[test]
    fn learning_curves_show_the_folder_and_the_dashboard_the_run() {
        let folder = tempfile::tempdir().unwrap();
        let mut first = session(folder.path());
        run(&mut first, "train\nwait\nseed 4\nmethod ddpg-uniform\nepsilon 0.1\ntrain seeds 2\nwait");
        // Another session, in which no run is opened.
        let mut session = session(folder.path());
        let path = folder.path().join("a.svg");
        let text = |session: &mut Session, words: &str| {
            run(session, &format!("figure learning {} {words}", path.display()));
            std::fs::read_to_string(&path).unwrap()
        };
        let all = text(&mut session, "");
        let picture = folder.path().join("a.png");
        run(&mut session, &format!("figure learning {} 72", picture.display()));
        let [seeds, command] = ["Seed", "Command"].map(|keyword| crate::tests::text_of_png(&picture, keyword));
        assert_eq!(seeds, "0 4 5");
        assert!(command.contains(&format!("runs={}", folder.path().display())), "{command}");
        assert!(all.contains("1 DDPG\n") && all.contains("2 DDPG, uniform exploration, epsilon 0.1"), "{all}");
        // The command stored in the figure reproduces it.
        let before = std::fs::read(&picture).unwrap();
        std::fs::remove_file(&picture).unwrap();
        run(&mut session, &command);
        assert!(std::fs::read(&picture).unwrap() == before);
        let label = "DDPG, uniform exploration, epsilon 0.1";
        let own = text(
            &mut session,
            &format!("width=single font=9 axis=log curve='{label}' name=ours curve=DDPG reference=DDPG"),
        );
        assert!(own.contains("1 ours") && own.contains("2 DDPG\n") && own.contains("width=\"252pt\""), "{own}");
        let known = session.estimates.count();
        text(&mut session, &format!("font=8 width=single axis=log curve=DDPG name=plain curve='{label}'"));
        assert_eq!((known, session.estimates.count()), (2, 2), "the style does not change the statistics");
        let shaped = text(&mut session, "x=0:2 y=0:50 bands=off height=200 smooth=2");
        assert!(shaped.contains("in the CSV only") && !shaped.contains("100</text>"), "{shaped}");
        // The colour of a run does not depend on which others are shown.
        let plain = options(&[&format!("runs={}", first.runs()[0].directory().path().display())]);
        let Composed { figure, .. } = plain.figure(&session.reader, &*session.estimates, &mut |_, _| ()).unwrap();
        assert_eq!((figure.panels[0].curves.len(), &*figure.known), (1, &["DDPG".to_owned(), label.to_owned()][..]));
        let alone = text(&mut session, "curve=DDPG");
        assert!(!alone.contains("uniform"), "{alone}");
        let named = drawn(&session, &options(&["runs=nowhere"])).err().unwrap();
        assert!(named.contains("nowhere"), "{named}");
        let error = drawn(&session, &options(&["curve=DPDG"])).err().unwrap();
        assert!(error.contains("did you mean `DDPG`?") && error.contains(label), "{error}");

        run(
            &mut session,
            "open NAME".replace("NAME", &format!("{}/task1-ddpg-seed0", folder.path().display())).as_str(),
        );
        let run = session.run().unwrap();
        let shown = dashboard(run);
        assert_eq!((shown.title.as_str(), shown.window), ("DDPG, seed 0 on task1", WINDOW.get()));
        let successes: Vec<f64> = run.records().iter().map(|record| record.rolling_success).collect();
        assert_eq!((&shown.episode[..], &shown.metrics[&mge_run::Metric::Success]), (&[1.0, 2.0, 3.0][..], &successes));
        let [none, greedy, last] = shown.greedy_success[..] else { panic!("three episodes") };
        assert!(none.is_nan() && last.is_nan() && greedy == run.evaluations()[0].success);
        assert!(session.figure(FigureKind::Episode, &Composition::default()).is_ok());
    }

    #[test]
    fn the_dashboard_of_a_run_that_is_being_read_is_complete() {
        let folder = tempfile::tempdir().unwrap();
        let mut trained = session(folder.path());
        run(&mut trained, "train\nwait");
        let path = trained.run().unwrap().directory().path().to_owned();
        let mut opened = Session::new(mge_task::load("task1").unwrap(), folder.path().to_owned());
        let gate = opened.gate.clone();
        let held = gate.lock().unwrap();
        opened.apply(crate::command::Open(path)).unwrap();
        assert!(opened.run().unwrap().is_unread());
        let draw = opened.figure(FigureKind::Dashboard, &Composition::default()).unwrap();
        let drawn = draw(&mut |_, _| ()).map(|drawn| drawn.figure.table().to_csv()).unwrap();
        assert_eq!(drawn, dashboard(trained.run().unwrap()).table().to_csv());
        drop(held);
    }

    #[test]
    fn unfinished_runs_are_shown_only_if_none_of_their_group_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        assert!(drawn(&session, &Composition::default()).is_err());
        run(&mut session, "train until 2\nwait");
        assert_eq!(drawn(&session, &Composition::default()).unwrap().seeds, [0]);
        run(&mut session, "seed 1\ntrain\nwait");
        assert_eq!(drawn(&session, &Composition::default()).unwrap().seeds, [1]);
        run(&mut session, "watch 1\nresume\nwait");
        assert_eq!(drawn(&session, &Composition::default()).unwrap().seeds, [0, 1]);
    }

    #[test]
    fn options_of_a_composition_survive_a_round_trip() {
        let words =
            ["runs=a b", "runs=c", "curve=x=1", "name=y", "curve=z", "reference=z", "against=charged", "font=9.5"];
        let shape = ["x=0:500", "y=10:60.5", "bands=off", "height=200", "smooth=5"];
        let words = [&words[..], &shape].concat();
        let composition = options(&words);
        let written: Vec<String> =
            composition.options().into_iter().map(|(key, value)| format!("{key}={value}")).collect();
        assert_eq!(written, words);
        let earlier = Composition::default().with_options([("against", "steps")]).unwrap();
        assert_eq!(earlier.options(), [("against", "charged".to_owned())]);
        for (key, value, reason) in [
            ("font", "99", "4 to 16"),
            ("font", "NaN", "4 to 16"),
            ("widht", "single", "did you mean `width`?"),
            ("axis", "square", "`linear` or `log`"),
            ("success", "greedy", "against episodes"),
            ("curve", "z", "named twice"),
            ("x", "5", "not like 0:500"),
            ("y", "60:0", "the smaller first"),
            ("bands", "none", "`on` or `off`"),
            ("height", "3", "80 to 600"),
            ("smooth", "0", "1 to 1000"),
        ] {
            let error = composition.clone().with_options([(key, value)]).unwrap_err();
            assert!(error.contains(reason), "{key}={value}: {error}");
        }
        assert!(Composition::default().with_options([("name", "x")]).unwrap_err().contains("must follow the curve="));
    }

    #[test]
    fn hand_play_is_shown_in_preference_to_the_greedy_policy() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        run(&mut session, "seed 4\ntrain\nwait\nseed 5");
        let seed = |session: &Session, kind| session.settings_of(kind).seed;
        assert_eq!(seed(&session, FigureKind::Episode), 4);
        run(&mut session, "place -0.9 0.9");
        assert_eq!((seed(&session, FigureKind::Episode), seed(&session, FigureKind::Dashboard)), (5, 4));
        let (_, trace) = session.episode_to_show().unwrap()().unwrap();
        assert_eq!(trace.steps.len(), 1);
    }

    #[test]
    fn an_animation_has_every_third_step_and_the_last() {
        let step = |placement, points: usize, subgoals: &[usize], goal| TracedStep {
            action: [points as f32, 0.0],
            tool: None,
            source: mge_trainer::Source::Hand,
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
        let task = mge_task::load("task1").unwrap();
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
