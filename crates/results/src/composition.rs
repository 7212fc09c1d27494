//! Options of a figure of learning curves: the runs, the curves with their names and order, and the style.
//! They are the options of the command `figure` and of `mge figures --set`.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::num::NonZeroUsize;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use super::comparison::without_duplicates;
use super::error::ResultsError;
use super::figures::learning_curves;
use super::found::{FoundRun, RunReader, find_runs, is_listed_run};
use super::groups::{Groups, label_of};
use super::row::{LearningRow, TrainedRun};
use super::settings::distinguish;
use mge_base::atomic::parent_of;
use mge_base::paths::{entries, expanded};
use mge_base::spelling::unknown;
use mge_base::sync::lock;
use mge_base::text::counted;
use mge_figures::{Against, Color, Figure, LearningCurves, PlotStyle, Success, colors, lacking, text_of};
use mge_run::{RunDirectory, RunError, RunHistory, RunState, config_hash};
use mge_stats::Bootstrap;
use mge_stats::rolling::rolling_mean;
use mge_trainer::RunConfig;

/// The content and style of a figure of learning curves. By default all curves, as in reports.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Composition {
    /// Folders of runs: each a run, or one that holds runs.
    pub runs: Vec<PathBuf>,
    /// Labels of the curves to show, or their texts in a legend, in its order, with optional other names; empty for all.
    pub curves: Vec<(String, Option<String>)>,
    /// Label of the reference curve.
    pub reference: Option<String>,
    /// Which success is shown.
    pub success: Success,
    /// The quantity on the x axis.
    pub against: Against,
    /// Size, font size, axes and bands.
    pub style: PlotStyle,
    /// Number of points in the moving average of the curves; 0 and 1 for none.
    pub smooth: usize,
    /// The colours that labels have elsewhere, which are no option: the others get theirs in the order in which their
    /// runs were made.
    pub colors: Vec<(String, Color)>,
}

/// A composed figure with its provenance.
pub struct Composed {
    /// The figure.
    pub figure: Box<dyn Figure + Send>,
    /// Seeds of the runs shown.
    pub seeds: Vec<u64>,
    /// Hash of their configurations.
    pub config_hash: String,
    /// Which runs are left out, and where curves end; empty for nothing special.
    pub remark: String,
}

/// The names of the options and their values.
pub const OPTIONS: [(&str, &str); 13] = [
    ("runs", "a run's folder, or one that holds runs; may be given again"),
    ("curve", "a curve's name or label; may be given again"),
    ("name", "another name for the preceding curve"),
    ("reference", "the curve that the others are compared with"),
    ("success", "training or greedy"),
    ("against", "episodes, actions or charged"),
    ("width", "single or double: the columns of the page"),
    ("font", "size of the labels in points, from 4 to 16"),
    ("x", "the ends of the x axis, such as 0:500"),
    ("y", "the ends of the y axis in percent, such as 0:60"),
    ("bands", "on or off: the intervals around the curves"),
    ("height", "of a panel in points, from 80 to 600"),
    ("smooth", "points in a moving average, from 1 to 1000"),
];

/// Options with two values, the default first.
const SUCCESS: [(&str, Success); 2] = [("training", Success::Training), ("greedy", Success::Greedy)];
/// `steps` is the name of charged actions in scripts of earlier versions.
const AGAINST: [(&str, Against); 4] = [
    ("episodes", Against::Episodes),
    ("actions", Against::Actions),
    ("charged", Against::Charged),
    ("steps", Against::Charged),
];
const WIDTH: [(&str, bool); 2] = [("double", false), ("single", true)];
const BANDS: [(&str, bool); 2] = [("on", false), ("off", true)];

fn read<T: Copy>(values: &[(&'static str, T)], key: &str, word: &str) -> Result<T, String> {
    let known = values.iter().find(|(name, _)| *name == word);
    let names = || values.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(" or ");
    known.map(|(_, value)| *value).ok_or_else(|| format!("{key} is {}, not `{word}`", names()))
}

/// The name of a value, unless it is the default, the first.
fn unless_default<T: PartialEq>(values: &[(&'static str, T)], value: &T) -> Option<String> {
    let place = values.iter().position(|(_, known)| known == value);
    place.filter(|place| *place > 0).map(|place| values[place].0.to_owned())
}

/// The ends of an axis: two numbers with a colon between them.
fn ends(text: &str) -> Result<[f64; 2], String> {
    let read = || {
        let (from, to) = text.split_once(':')?;
        Some([from.trim().parse::<f64>().ok()?, to.trim().parse().ok()?])
    };
    let found = read().filter(|[from, to]| from < to && from.is_finite() && to.is_finite());
    found.ok_or_else(|| format!("`{text}` is not like 0:500: two numbers, the smaller first"))
}

fn number<T: FromStr + PartialOrd + Display>(text: &str, range: RangeInclusive<T>) -> Result<T, String> {
    let found = text.parse().ok().filter(|number| range.contains(number));
    found.ok_or_else(|| format!("`{text}` is not a number from {} to {}", range.start(), range.end()))
}

impl Composition {
    /// The composition with these options. Only `runs`, `curve` and `name` may be given again.
    ///
    /// # Errors
    /// Which of them is invalid, and why.
    pub fn with_options<'a>(mut self, options: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Self, String> {
        let mut known = BTreeSet::new();
        for (key, value) in options {
            let is_again = !["runs", "curve", "name"].contains(&key) && !known.insert(key);
            let set = if is_again { Err(format!("`{key}` is given twice")) } else { self.set(key, value) };
            set.map_err(|reason| format!("{key}={value}: {reason}"))?;
        }
        Ok(self)
    }

    fn set(&mut self, key: &str, value: &str) -> Result<(), String> {
        match key {
            "runs" => self.runs.push(expanded(value)),
            "curve" if self.curves.iter().any(|(label, _)| label == value) => {
                return Err(format!("the curve `{value}` is named twice"));
            }
            "curve" => self.curves.push((value.to_owned(), None)),
            "name" => match self.curves.last_mut() {
                Some((label, Some(_))) => return Err(format!("the curve `{label}` has a name already")),
                Some((_, name)) => *name = Some(value.to_owned()),
                None => return Err("name= must follow the curve= that it renames".to_owned()),
            },
            "reference" => self.reference = Some(value.to_owned()),
            "success" => self.success = read(&SUCCESS, key, value)?,
            "against" => self.against = read(&AGAINST, key, value)?,
            "width" => self.style.single = read(&WIDTH, key, value)?,
            "font" => self.style.font = number(value, PlotStyle::FONTS)?,
            "x" => self.style.x = Some(ends(value)?),
            "y" => self.style.y = Some(ends(value)?),
            "bands" => self.style.without_bands = read(&BANDS, key, value)?,
            "height" => self.style.height = number(value, PlotStyle::HEIGHTS)?,
            "smooth" => self.smooth = number(value, 1..=1000)?,
            _ => return Err(unknown("option", &OPTIONS.map(|(name, _)| name), key)),
        }
        if self.success == Success::Greedy && self.against != Against::Episodes {
            return Err("greedy evaluations are drawn against episodes".to_owned());
        }
        Ok(())
    }

    /// The options that differ from the defaults, as [`Self::with_options`] takes them.
    pub fn options(&self) -> Vec<(&'static str, String)> {
        let runs = self.runs.iter().map(|path| ("runs", path.display().to_string()));
        let curves = self.curves.iter().flat_map(|(label, name)| {
            std::iter::once(("curve", label.clone())).chain(name.clone().map(|name| ("name", name)))
        });
        let others = [
            ("reference", self.reference.clone()),
            ("success", unless_default(&SUCCESS, &self.success)),
            ("against", unless_default(&AGAINST, &self.against)),
            ("width", unless_default(&WIDTH, &self.style.single)),
            ("font", Some(self.style.font).filter(|size| *size != PlotStyle::FONT).map(|size| size.to_string())),
            ("x", self.style.x.map(|[from, to]| format!("{from}:{to}"))),
            ("y", self.style.y.map(|[from, to]| format!("{from}:{to}"))),
            ("bands", unless_default(&BANDS, &self.style.without_bands)),
            ("height", Some(self.style.height).filter(|is| *is != PlotStyle::HEIGHT).map(|is| is.to_string())),
            ("smooth", Some(self.smooth).filter(|points| *points > 1).map(|points| points.to_string())),
        ];
        let others = others.into_iter().filter_map(|(key, value)| Some((key, value?)));
        runs.chain(curves).chain(others).collect()
    }

    /// Reads the runs through `reader`, which reads only what has changed, and composes their curves. Each group
    /// shows its finished runs or, if it has none, its started ones up to the end of the shortest. `on_progress` is
    /// called with the numbers of runs read and of all runs.
    ///
    /// # Errors
    /// When there is nothing to show, a curve does not exist, or a run cannot be read.
    pub fn figure(
        &self,
        reader: &Mutex<RunReader>,
        on_progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Composed, ResultsError> {
        let paths = find_runs(&self.runs)?;
        // The lock is held while runs are read, but not while the figure is composed.
        let mut kept = lock(reader);
        let mut found = kept.read(&paths, &mut |read| on_progress(read, paths.len())).all()?;
        drop(kept);
        let known = label_among_all(&mut found, &self.runs, &self.colors);
        let all: Vec<String> = found.iter().map(|run| run.trained.row.label()).collect();
        let runs = without_duplicates(shown(found)).0;
        let known_names = Groups::new(runs.iter().map(|run| &run.trained.row)).legend();
        // Lists show runs by their names.
        let names = runs.iter().map(|run| (run.trained.row.label(), run.name()));
        let asked = self.by_label(&known_names.iter().cloned().chain(names).collect::<Vec<_>>())?;
        let runs = asked.chosen(runs)?;
        let drawn: BTreeSet<String> = runs.iter().map(|run| run.trained.row.label()).collect();
        let left = all.iter().filter(|label| self.curves.is_empty() || drawn.contains(*label)).count() - runs.len();
        let left = (left > 0).then(|| {
            let left = counted(left, "run");
            format!(" Left out: {left} not finished, or with the settings and seed of another.")
        });
        let unfinished = runs.iter().filter(|run| run.state != RunState::Finished).count();
        let unfinished = (unfinished > 0).then(|| format!(" {} drawn not finished.", counted(unfinished, "run")));
        let mut configs: Vec<_> = runs.iter().map(|run| &run.config).collect();
        configs.sort_by_key(|config| config.seed);
        let config_hash = config_hash(&configs);
        let mut seeds: Vec<u64> = configs.iter().map(|config| config.seed).collect();
        seeds.dedup();
        let drawn = |mut run: FoundRun| {
            let mut points = self.smooth;
            if self.style.x.is_some() {
                run.refine(&mut points)?;
            }
            if let Some(points) = NonZeroUsize::new(points) {
                smooth(&mut run.trained, points);
            }
            Ok(run.trained)
        };
        let runs = runs.into_iter().map(drawn).collect::<Result<Vec<TrainedRun>, RunError>>()?;
        let bootstrap = &Bootstrap::default();
        let shown = (runs, self.against, self.success, self.style.x);
        let kept = lock(reader).curves.take().filter(|(known, _)| *known == shown);
        let curves = match kept {
            Some((_, curves)) => curves,
            None => learning_curves(&shown.0, bootstrap, self.success, self.against, self.style.x)?,
        };
        lock(reader).curves = Some((shown, curves.clone()));
        let text = |(label, name): &(String, Option<String>)| {
            (label.clone(), name.clone().unwrap_or_else(|| text_of(&known_names, label).to_owned()))
        };
        let chosen: Vec<(String, String)> = asked.curves.iter().map(text).collect();
        let (legend, style) = (if chosen.is_empty() { known_names } else { chosen }, self.style);
        let remark = left.unwrap_or_default() + &unfinished.unwrap_or_default() + &curves.remark;
        let figure = LearningCurves {
            legend,
            reference: asked.reference,
            style,
            colors: known,
            smooth: self.smooth,
            remark,
            ..curves
        };
        let boxes = lacking(&figure.legend.iter().map(|(_, shown)| &**shown).collect::<String>());
        let boxes = if boxes.is_empty() { boxes } else { format!(" The typeface lacks {boxes}: empty boxes.") };
        Ok(Composed { remark: format!("{}{boxes}", figure.remark), figure: Box::new(figure), seeds, config_hash })
    }

    /// The composition with the labels of the chosen curves and of the reference, of which it may have the texts in a
    /// legend.
    ///
    /// # Errors
    /// [`ResultsError::NoLabel`].
    pub fn by_label(&self, legend: &[(String, String)]) -> Result<Self, ResultsError> {
        let mut found = self.clone();
        let asked = found.curves.iter_mut().map(|(label, _)| label).chain(&mut found.reference);
        for text in asked {
            *text = label_of(legend, text)?;
        }
        Ok(found)
    }

    /// The runs of the chosen curves and of the reference.
    fn chosen(&self, mut runs: Vec<FoundRun>) -> Result<Vec<FoundRun>, ResultsError> {
        let asked = self.curves.iter().map(|(label, _)| label).chain(&self.reference);
        runs.retain(|run| self.curves.is_empty() || asked.clone().any(|asked| *asked == run.trained.row.label()));
        if runs.is_empty() { Err(ResultsError::NothingStarted) } else { Ok(runs) }
    }
}

/// Makes each value of the curves of a run the mean of it and those before it, `points` in all. The runs are smoothed
/// rather than their intervals, the mean of which would be too wide.
fn smooth(run: &mut TrainedRun, points: NonZeroUsize) {
    for curve in [&mut run.training, &mut run.greedy, &mut run.actions, &mut run.charged] {
        let means = rolling_mean(&curve.iter().map(|[_, y]| *y).collect::<Vec<_>>(), points);
        curve.iter_mut().zip(means).for_each(|([_, y], mean)| *y = mean);
    }
}

/// Labels runs as among all runs in their folders where only some of these were `asked` for, so that a run has the same
/// name and colour whichever are shown. Returns all labels, with their colours.
fn label_among_all(found: &mut [FoundRun], asked: &[PathBuf], had: &[(String, Color)]) -> Vec<(String, Color)> {
    let folders: BTreeSet<&Path> =
        found.iter().filter(|run| asked.contains(&run.path)).map(|run| parent_of(&run.path)).collect();
    let is_other = |path: &PathBuf| is_listed_run(path) && found.iter().all(|run| run.path != *path);
    let others = folders.into_iter().flat_map(|folder| entries(folder).unwrap_or_default());
    // What cannot be read has no label.
    let config = |path: PathBuf| Some((RunConfig::of(&RunDirectory::open(&path).ok()?).ok()?, path));
    let others: Vec<(RunConfig, PathBuf)> = others.filter(is_other).filter_map(config).collect();
    let mut rows: Vec<LearningRow> =
        others.iter().map(|(config, _)| LearningRow::new(config, &RunHistory::default())).collect();
    let shown = found.iter_mut().map(|run| (&run.config, &mut run.trained.row));
    distinguish(shown.chain(others.iter().map(|(config, _)| config).zip(&mut rows)).collect());
    let found = found.iter().map(|run| (&run.path, &run.trained.row));
    let mut all: Vec<_> = found.chain(others.iter().map(|(_, path)| path).zip(&rows)).collect();
    all.sort_by_cached_key(|(path, _)| {
        let made = path.metadata().and_then(|folder| folder.created()).ok();
        (made.is_none(), made)
    });
    let labels = Groups::new(all.into_iter().map(|(_, row)| row)).labels;
    let kept = |label: &String| had.iter().find(|(known, _)| known == label).map(|(_, color)| *color);
    let given = colors(&labels.iter().map(|label| (&**label, kept(label))).collect::<Vec<_>>());
    labels.into_iter().zip(given).collect()
}

/// The finished runs of every group or, if it has none, its runs with at least one point.
fn shown(found: Vec<FoundRun>) -> Vec<FoundRun> {
    let group = |run: &FoundRun| (run.trained.row.task.clone(), run.trained.row.label());
    let is_finished = |run: &FoundRun| run.state == RunState::Finished;
    let finished: BTreeSet<_> = found.iter().filter(|run| is_finished(run)).map(group).collect();
    let has_points = |run: &FoundRun| !run.trained.training.is_empty();
    found.into_iter().filter(|run| has_points(run) && (is_finished(run) || !finished.contains(&group(run)))).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_run::{EpisodeRecord, Event, RunWriter};

    /// A folder with a run of 2000 episodes whose success rises by a thousandth each, after some of them.
    fn run_after(episodes: u64) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let directory = RunDirectory::create(folder.path().join("a"), &config).unwrap();
        let mut writer = RunWriter::open(&directory, 0).unwrap();
        for episode in 1..=episodes {
            let rolling_success = episode as f64 / 1000.0;
            let record =
                EpisodeRecord { episode, environment_steps: episode, rolling_success, ..EpisodeRecord::default() };
            writer.record(&Event::EpisodeFinished(record)).unwrap();
        }
        folder
    }

    #[test]
    fn a_curve_has_as_many_points_as_there_are_episodes_to_see() {
        let points = |episodes: u64, options: &str| {
            let folder = run_after(episodes);
            let options = format!("runs={} {options}", folder.path().display());
            let options = options.split_whitespace().map(|option| option.split_once('=').unwrap());
            let composition = Composition::default().with_options(options).unwrap();
            let drawn = composition.figure(&Mutex::default(), &mut |_, _| ()).unwrap();
            let curve = &drawn.figure.curves().unwrap().panels[0].curves[0];
            (curve.x.len(), curve.x[0], curve.x.last().copied(), curve.y.last().copied())
        };
        assert_eq!(points(2000, ""), (100, 20.0, Some(2000.0), Some(2.0)));
        assert_eq!(points(2000, "x=0:200"), (100, 2.0, Some(200.0), Some(0.2)));
        assert_eq!(points(2000, "x=100:600 against=actions"), (101, 100.0, Some(600.0), Some(0.6)));
        assert_eq!(points(450, ""), (90, 5.0, Some(450.0), Some(0.45)), "not finished");
        // The mean of 5 points that are 20 episodes apart, and of 50 that are 2 apart.
        assert_eq!(points(200, "smooth=5").3.map(|y| (1000.0 * y).round()), Some(196.0));
        let smoothed = |options| points(2000, options).3.map(|y| (1000.0 * y).round());
        assert_eq!([smoothed("smooth=5"), smoothed("smooth=5 x=0:2000")], [Some(1960.0), Some(1951.0)]);
    }

    #[test]
    fn another_style_does_not_resample_the_curves() {
        let folder = run_after(20);
        let reader = Mutex::new(RunReader::default());
        let first = |option: (&str, &str)| {
            let runs = ("runs", folder.path().to_str().unwrap());
            let composition = Composition::default().with_options([runs, option]).unwrap();
            composition.figure(&reader, &mut |_, _| ()).unwrap().figure.curves().unwrap().panels[0].curves[0].y[0]
        };
        assert_eq!(first(("font", "9")), 0.001);
        // Marks the kept curves by a value that is not in the files.
        lock(&reader).curves.as_mut().unwrap().1.panels[0].curves[0].y[0] = 0.77;
        assert_eq!([first(("height", "200")), first(("against", "actions"))], [0.77, 0.0]);
    }

    #[test]
    fn the_interval_of_a_smoothed_curve_is_that_of_the_smoothed_seeds() {
        // The seeds alternate between 0 and 1; the mean of two successive values is always a half.
        let row =
            |seed| LearningRow { task: "task1".to_owned(), method: "ddpg".to_owned(), seed, ..Default::default() };
        let run = |seed, [a, b]: [f64; 2]| TrainedRun {
            row: row(seed),
            training: vec![[1.0, a], [2.0, b], [3.0, a]],
            greedy: Vec::new(),
            actions: Vec::new(),
            charged: Vec::new(),
        };
        let last = |points| {
            let mut runs = [run(0, [0.0, 1.0]), run(1, [1.0, 0.0])];
            runs.iter_mut().for_each(|run| smooth(run, NonZeroUsize::new(points).unwrap()));
            let figure =
                learning_curves(&runs, &Bootstrap::default(), Success::Training, Against::Episodes, None).unwrap();
            let curve = &figure.panels[0].curves[0];
            [curve.low[2], curve.y[2], curve.high[2]]
        };
        assert_eq!(last(2), [0.5; 3]);
        let [low, value, high] = last(1);
        assert!(low < value && value < high, "each value alone");
    }
}
