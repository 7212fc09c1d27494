//! Export of the session's state as figures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::command::{self, Command, FigureKind};
use super::job::Reporter;
use super::{Notice, Session, SessionError};
use mge_base::atomic;
use mge_base::text::counted;
use mge_figures::{ActionSamples, DEFAULT_DPI, Figure, Provenance, TaskActions, TaskGrid};
use mge_results::{Composed, Composition, LearningRow, find_runs};
use mge_run::{RunError, RunHistory, config_hash};
use mge_trainer::RunConfig;

/// Deferred work that produces a figure and its provenance.
pub type FigureJob = Box<dyn FnOnce(&mut dyn FnMut(usize, usize)) -> Result<Composed, String> + Send>;

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
        let work = move |reporter: &Reporter| {
            atomic::create_parent(&to.path).map_err(RunError::io("write", &to.path))?;
            let drawn = drawing(&mut |done, all| _ = reporter.progress(done, all))?;
            let Composed { figure, seeds, config_hash, remark } = drawn;
            let provenance = Provenance::new(made_by, &seeds, config_hash);
            figure.write(&to, &provenance, dpi.unwrap_or(DEFAULT_DPI)).map_err(|error| error.to_string())?;
            Ok((to.path, remark))
        };
        self.start_job(command.clone(), work, |session, written| {
            let (path, remark) = written?;
            session.notices.extend((!remark.is_empty()).then(|| Notice::Warning(remark.trim_start().to_owned())));
            Ok(format!("wrote {}", path.display()))
        });
        Ok(report)
    }

    /// The folders of the runs that a composition shows: those it lists, otherwise the session's folder and the
    /// runs opened from elsewhere.
    fn source_runs(&self, composition: &Composition) -> Vec<PathBuf> {
        if !composition.runs.is_empty() {
            return composition.runs.clone();
        }
        let others = self.runs().iter().map(|run| run.directory().path()).filter(|it| !it.starts_with(self.folder()));
        let others: Vec<PathBuf> = others.map(Path::to_owned).collect();
        // A session folder without runs is left out if other runs are open.
        let holds_runs = others.is_empty() || find_runs(&[self.folder().to_owned()]).is_ok();
        Some(self.folder().to_owned()).filter(|_| holds_runs).into_iter().chain(others).collect()
    }

    /// A figure of the session, to be drawn later.
    ///
    /// # Errors
    /// When there is nothing of that kind to show yet.
    pub fn figure(&self, kind: FigureKind, composition: &Composition) -> Result<FigureJob, SessionError> {
        let (seeds, config_hash) = (vec![self.config().seed], config_hash(self.config()));
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
                let sources = self.source_runs(composition);
                let others = sources.iter().filter(|run| composition.runs.is_empty() && *run != self.folder()).count();
                let told = || format!(" With {} from outside {}.", counted(others, "run"), self.folder().display());
                let others = if (1..sources.len()).contains(&others) { told() } else { String::new() };
                let composition = Composition { runs: sources, ..composition.clone() };
                let reader = Arc::clone(&self.reader);
                return Ok(Box::new(move |on_progress| {
                    let mut composed = composition.figure(&reader, on_progress).map_err(|error| error.to_string())?;
                    composed.remark += &others;
                    Ok(composed)
                }));
            }
        };
        Ok(Box::new(move |_| Ok(Composed { figure, seeds, config_hash, remark: String::new() })))
    }
}

/// The label of a run: method, threshold and seed.
pub fn run_label(config: &RunConfig) -> String {
    format!("{}, seed {}", LearningRow::new(config, &RunHistory::default()).label(), config.seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Script;

    fn run(session: &mut Session, lines: &str) {
        Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).unwrap();
    }

    fn session(folder: &std::path::Path) -> Session {
        let mut session = Session::new(mge_task::load("task1").unwrap(), folder.to_owned());
        run(&mut session, "method ddpg\nepisodes 3\nset ddpg.hidden 8\nset evaluation.every 2");
        session
    }

    fn drawn(session: &Session, composition: &Composition) -> Result<Composed, String> {
        let drawing = session.figure(FigureKind::Learning, composition).map_err(|error| error.to_string())?;
        drawing(&mut |_, _| ())
    }

    fn options(words: &[&str]) -> Composition {
        Composition::default().with_options(words.iter().map(|word| word.split_once('=').unwrap())).unwrap()
    }

    #[test]
    fn learning_curves_show_the_runs_of_the_folder() {
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
        assert!(all.contains("\nDDPG\n") && all.contains("\nDDPG, uniform exploration, epsilon 0.1"), "{all}");
        // The command stored in the figure reproduces it.
        let before = std::fs::read(&picture).unwrap();
        std::fs::remove_file(&picture).unwrap();
        run(&mut session, &command);
        assert!(std::fs::read(&picture).unwrap() == before);
        let label = "DDPG, uniform exploration, epsilon 0.1";
        let own =
            text(&mut session, &format!("width=single font=9 curve='{label}' name=ours curve=DDPG reference=DDPG"));
        assert!(own.contains("\nours\n") && own.contains("\nDDPG\n") && own.contains("width=\"252pt\""), "{own}");
        let shaped = text(&mut session, "x=0:2 y=0:50 bands=off height=200 smooth=2");
        assert!(shaped.contains(", mean of 2 points;") && !shaped.contains("100</text>"), "{shaped}");
        // The colour of a run does not depend on which others are shown.
        let plain = options(&[&format!("runs={}", first.runs()[0].directory().path().display())]);
        let composed = plain.figure(&session.reader, &mut |_, _| ()).unwrap();
        let figure = composed.figure.curves().unwrap();
        assert_eq!(
            (figure.panels[0].curves.len(), figure.colors[0].0.as_str(), figure.colors[1].0.as_str()),
            (1, "DDPG", label)
        );
        let alone = text(&mut session, "curve=DDPG");
        assert!(!alone.contains("uniform"), "{alone}");
        let foreign = drawn(&session, &options(&["curve=DDPG", "name=Größe 测试 ★"])).unwrap().remark;
        assert!(foreign.ends_with("The typeface lacks 测试: empty boxes."), "{foreign}");
        let named = drawn(&session, &options(&["runs=nowhere"])).err().unwrap();
        assert!(named.contains("nowhere"), "{named}");
        let error = drawn(&session, &options(&["curve=DPDG"])).err().unwrap();
        assert!(error.contains("did you mean `DDPG`?"), "{error}");
        let error = drawn(&session, &options(&["curve=nothing"])).err().unwrap();
        assert!(
            error.ends_with(&format!(
                "use one of DDPG; {label}; task1-ddpg-seed0; task1-ddpg-uniform-seed4; task1-ddpg-uniform-seed5"
            )),
            "{error}"
        );
        let of_run = drawn(&session, &options(&["curve=task1-ddpg-uniform-seed5"])).unwrap();
        assert_eq!(of_run.seeds, [4, 5], "the curve of its group");
    }

    #[test]
    fn unfinished_runs_are_shown_only_if_none_of_their_group_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let mut session = session(folder.path());
        assert!(drawn(&session, &Composition::default()).is_err());
        run(&mut session, "train until 2\nwait");
        assert_eq!(drawn(&session, &Composition::default()).unwrap().seeds, [0]);
        run(&mut session, "seed 1\ntrain\nwait");
        let one = drawn(&session, &Composition::default()).unwrap();
        assert_eq!(one.seeds, [1]);
        assert!(one.remark.contains("Left out: 1 run not finished"), "{}", one.remark);
        run(&mut session, "watch 1\nresume\nwait");
        let both = drawn(&session, &Composition::default()).unwrap();
        assert_eq!((both.seeds, &*both.remark), (vec![0, 1], ""));
        let outside = tempfile::tempdir().unwrap();
        run(&mut session, &format!("seed 2\ntrain {}/other\nwait", outside.path().display()));
        let more = drawn(&session, &Composition::default()).unwrap();
        let told = format!(" With 1 run from outside {}.", folder.path().display());
        assert_eq!((more.seeds, more.remark), (vec![0, 1, 2], told));
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
}
