//! Groups of runs: runs that differ only in the seed are one line of the list and one curve with a
//! band. They are grouped in the background, by the code that reports use.

use std::collections::hash_map::DefaultHasher;
use std::collections::{BTreeMap, HashMap};
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;

use super::{Curves, RunSummary};
use crate::Loader;
use mge_base::text::counted;
use mge_figures::{Color, colors};
use mge_results::{Groups, LearningRow, Settings, common_name, distinguish};
use mge_run::{Metric, RunHistory, RunState};
use mge_stats::TaskScores;
use mge_stats::aggregate::trimmed_mean;
use mge_stats::bootstrap::quantile;
use mge_trainer::RunConfig;

/// Runs on one task that differ only in the seed.
#[derive(Debug, Clone)]
pub struct RunGroup {
    /// Name of the task.
    pub task: String,
    /// Method, threshold and other distinguishing settings, as in reports.
    pub label: String,
    /// Its name: the [common one](common_name) that users gave its runs, or else its label.
    pub name: String,
    /// Its colour, the same wherever it or one of its runs is shown.
    pub color: Color,
    /// Folders of its runs, ordered by seed.
    pub runs: Vec<PathBuf>,
    /// How many of them were changed during the training, as far as that is known.
    changed: usize,
    /// The number of their seeds, of each of which one run has a curve and counts.
    pub seeds: usize,
    /// The aggregated curves of its runs, if there are several, as far as they have been read.
    pub curves: Option<Arc<GroupCurves>>,
}

impl RunGroup {
    /// How many of its seeds are finished, given all runs.
    pub fn progress(&self, runs: &[Arc<RunSummary>]) -> String {
        let own: Vec<&RunSummary> = runs.iter().map(|run| &**run).filter(|run| self.runs.contains(&run.path)).collect();
        let finished = one_per_seed(&own).into_iter().filter(|run| run.state == RunState::Finished).count();
        format!("{finished} of {} finished", counted(self.seeds, "seed"))
    }

    /// Its label and number of seeds, and those of its runs if several have the same seed, and of changed ones.
    pub fn title(&self) -> String {
        let (seeds, runs) = (self.seeds, self.runs.len());
        let of_runs = if runs > seeds { format!(", {runs} runs") } else { String::new() };
        let changed = if self.changed > 0 { format!(", {} changed", self.changed) } else { String::new() };
        format!("{} ({}{of_runs}{changed})", self.name, counted(seeds, "seed"))
    }
}

/// Aggregated curves of several runs, as far as at least half of them have got. A run that its success ended keeps its
/// last values.
#[derive(Debug, Clone, Default)]
pub struct GroupCurves {
    /// Interquartile means.
    pub middle: Curves,
    /// Lower quartiles.
    pub low: Curves,
    /// Upper quartiles.
    pub high: Curves,
}

impl GroupCurves {
    /// Aggregates the curves of runs, each with whether its success ended it.
    pub fn new(runs: &[(&Curves, bool)]) -> Self {
        let mut group = Self::default();
        let mut values = Vec::with_capacity(runs.len());
        let longest = runs.iter().max_by_key(|(run, _)| run.last_episode());
        for episode in longest.map_or(&[][..], |(run, _)| run.episodes()) {
            // A run that its success ended stays at its end. One whose log is not read has reached no episode.
            let at = |(run, is_solved): &(&Curves, bool)| match is_solved {
                true => (run.last_episode() as u64).clamp(1, *episode),
                false => *episode,
            };
            let reached = runs.iter().filter(|run| run.0.last_episode() as u64 >= at(run)).count();
            if 2 * reached < runs.len() {
                break;
            }
            // Long runs are thinned: skip episodes that one of them lacks.
            let places: Vec<_> =
                runs.iter().filter_map(|run| Some((run.0, run.0.episodes().binary_search(&at(run)).ok()?))).collect();
            if places.len() < reached {
                continue;
            }
            let found = Metric::KEPT.map(|metric| {
                values.clear();
                let of_episode = places.iter().filter_map(|(run, place)| run.get(metric).get(*place));
                values.extend(of_episode.filter(|value| value.is_finite()).map(|value| f64::from(*value)));
                values.sort_unstable_by(f64::total_cmp);
                if values.is_empty() {
                    return [f32::NAN; 3];
                }
                [trimmed_mean(&values), quantile(&values, 0.25), quantile(&values, 0.75)].map(|value| value as f32)
            });
            let seconds = places.iter().map(|(run, place)| run.seconds[*place]).sum::<f32>() / places.len() as f32;
            group.middle.push(*episode, seconds, found.map(|[middle, ..]| middle));
            group.low.push(*episode, seconds, found.map(|[_, low, _]| low));
            group.high.push(*episode, seconds, found.map(|[.., high]| high));
        }
        group
    }
}

/// A grouping of all runs.
#[derive(Debug, Clone, Default)]
pub struct Grouping {
    groups: Vec<RunGroup>,
    /// The group of each run.
    of: HashMap<PathBuf, usize>,
    /// For each run its configuration, which may change, and its row with the settings in which it differs from others.
    rows: Arc<HashMap<PathBuf, (Arc<RunConfig>, LearningRow)>>,
    /// The settings in which no two runs differ.
    common: Arc<Settings>,
}

impl Grouping {
    /// Groups runs. The distinguishing settings are reused if `before` is a grouping of the same runs.
    pub fn new(runs: &[Arc<RunSummary>], before: &Self) -> Self {
        let mut grouping = if before.is_of(runs) {
            Self { rows: before.rows.clone(), common: before.common.clone(), ..Self::default() }
        } else {
            Self::ungrouped(runs)
        };
        let rows = grouping.rows.clone();
        let all = Groups::new(runs.iter().map(|run| &rows[&run.path].1));
        // A label has the colour that the first of its runs had, also when it was another label, unless more runs of
        // another label had it.
        let had = |label: &String| {
            let of_label = all.tasks.iter().flat_map(|task| all.indices(task, label));
            let known: Vec<Color> = of_label.filter_map(|index| Some(before.of(&runs[*index].path)?.color)).collect();
            known.first().map(|first| (*first, known.iter().filter(|color| *color == first).count()))
        };
        let had: Vec<Option<(Color, usize)>> = all.labels.iter().map(had).collect();
        let keeps =
            |(color, count): &(Color, usize)| had.iter().flatten().all(|(of, more)| of != color || more <= count);
        let had = had.iter().map(|had| had.filter(keeps).map(|(color, _)| color));
        let colors = colors(&all.labels.iter().map(String::as_str).zip(had).collect::<Vec<_>>());
        for task in &all.tasks {
            for (label, color) in all.labels.iter().zip(&colors) {
                let of_label = all.indices(task, label).iter().map(|index| &*runs[*index]);
                let members: Vec<&RunSummary> = of_label.filter(|run| !run.damaged).collect();
                if members.is_empty() {
                    continue;
                }
                let curves = one_per_seed(&members).into_iter().map(|run| (&*run.curves, run.is_solved()));
                let curves: Vec<(&Curves, bool)> = curves.collect();
                // The own curves of a single run are enough, and there are none before half of several have been read.
                let of_group = (members.len() > 1).then(|| GroupCurves::new(&curves));
                let names = members.iter().map(|run| run.given_name().unwrap_or_default());
                let group = RunGroup {
                    task: task.clone(),
                    label: label.clone(),
                    name: common_name(names).unwrap_or(label).to_owned(),
                    color: *color,
                    runs: members.iter().map(|run| run.path.clone()).collect(),
                    changed: members.iter().filter(|run| run.changed.is_some()).count(),
                    seeds: curves.len(),
                    curves: of_group.filter(|curves| !curves.middle.episodes().is_empty()).map(Arc::new),
                };
                grouping.of.extend(group.runs.iter().map(|path| (path.clone(), grouping.groups.len())));
                grouping.groups.push(group);
            }
        }
        // Of two groups with one name, both have their labels, too, as in legends.
        let names: Vec<_> = grouping.groups.iter().map(|group| (group.task.clone(), group.name.clone())).collect();
        for (group, own) in grouping.groups.iter_mut().zip(&names) {
            if group.name != group.label && names.iter().filter(|other| *other == own).count() > 1 {
                group.name = format!("{}, {}", group.name, group.label);
            }
        }
        grouping
    }

    /// What the configurations of runs determine.
    fn ungrouped(runs: &[Arc<RunSummary>]) -> Self {
        let mut rows: Vec<_> = runs.iter().map(|run| LearningRow::new(&run.config, &RunHistory::default())).collect();
        let common = distinguish(runs.iter().map(|run| &*run.config).zip(&mut rows).collect());
        let of_run = |(run, row): (&Arc<RunSummary>, LearningRow)| (run.path.clone(), (run.config.clone(), row));
        let rows = runs.iter().zip(rows).map(of_run).collect();
        Self { rows: Arc::new(rows), common: Arc::new(common), ..Self::default() }
    }

    /// Whether it is a grouping of exactly these runs with their current settings.
    fn is_of(&self, runs: &[Arc<RunSummary>]) -> bool {
        let is_known = |run: &Arc<RunSummary>| self.rows.get(&run.path).is_some_and(|(known, _)| *known == run.config);
        self.rows.len() == runs.len() && runs.iter().all(is_known)
    }

    /// The group of a run, if it has been grouped and is not damaged.
    pub fn of(&self, run: &Path) -> Option<&RunGroup> {
        self.of.get(run).map(|index| &self.groups[*index])
    }

    /// The labels of the groups, with their colours.
    pub fn colors(&self) -> Vec<(String, Color)> {
        self.groups.iter().map(|group| (group.label.clone(), group.color)).collect()
    }

    /// The settings in which a run differs from others, unless its method implies them.
    pub fn settings(&self, run: &Path) -> Option<&Settings> {
        self.rows.get(run).map(|(_, row)| &row.settings)
    }

    /// The effective value of any setting that a run uses, by its JSON path.
    pub fn setting(&self, run: &RunSummary, path: &str) -> Option<&Value> {
        let (_, row) = self.rows.get(&run.path)?;
        let common = || self.common.get(path).filter(|_| run.config.uses(path));
        row.settings.get(path).or_else(|| row.implied.get(path)).or_else(common)
    }
}

/// One run of each seed, in their order: the one with the most episodes, the latest of equal ones. Runs with the same
/// seed are not independent.
fn one_per_seed<'a>(runs: &[&'a RunSummary]) -> Vec<&'a RunSummary> {
    let mut furthest: BTreeMap<u64, &RunSummary> = BTreeMap::new();
    for run in runs {
        let known = furthest.entry(run.config.seed).or_insert(run);
        if run.done >= known.done {
            *known = run;
        }
    }
    furthest.into_values().collect()
}

/// The present rolling success of runs of a group: one for each seed, as in reports. None before any of them has begun.
pub fn scores_of(runs: &[&RunSummary]) -> Option<TaskScores> {
    // A run that has not begun does not count as a failure.
    let begun = one_per_seed(runs).into_iter().filter(|run| run.done > 0);
    TaskScores::of_one_task(&begun.map(|run| run.success.unwrap_or(0.0)).collect::<Vec<_>>()).ok()
}

/// Minimum pause between two groupings, as a multiple of the time one takes, so that trainings are not slowed down.
const PAUSE_FACTOR: u32 = 20;
/// Minimum pause between two groupings.
const PAUSE: Duration = Duration::from_millis(500);

/// Keeps a grouping up to date in the background.
#[derive(Debug, Default)]
pub struct Grouper {
    /// The latest grouping.
    pub known: Arc<Grouping>,
    /// The runs may have changed since they were grouped.
    pub stale: bool,
    loader: Loader<u64, Arc<Grouping>>,
}

impl Grouper {
    /// Takes over a finished grouping, and groups the runs again if they have changed and the pause is over. True if
    /// there is a new grouping.
    pub fn poll(&mut self, runs: &[Arc<RunSummary>]) -> bool {
        let is_new = self.loader.poll();
        if is_new && let Some((_, Ok(grouping))) = self.loader.latest(|_| true) {
            self.known = grouping.clone();
        }
        // Runs that have just been found are not listed one by one during the pause.
        let is_due = runs.len() > self.known.rows.len() || self.loader.is_rested(PAUSE, PAUSE_FACTOR);
        if self.stale && !self.loader.is_loading() && is_due {
            self.stale = false;
            let (runs, before) = (runs.to_vec(), self.known.clone());
            let key = key_of(&runs);
            let group = move |_: &_| Ok(Arc::new(Grouping::new(&runs, &before)));
            self.loader.request(key, Duration::MAX, group);
        }
        is_new
    }
}

/// A hash of the runs and their progress.
fn key_of(runs: &[Arc<RunSummary>]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for run in runs {
        (&run.path, &run.name, run.done, run.episodes(), run.curves.last_episode(), run.damaged).hash(&mut hasher);
    }
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_run::EpisodeRecord;
    use mge_stats::aggregate;

    fn run(name: &str, settings: &[(&str, &str)], successes: &[f32]) -> Arc<RunSummary> {
        let path = Path::new("runs").join(name);
        let mut config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        for (key, value) in settings {
            config = config.with_setting(key, value).unwrap();
        }
        let mut curves = Curves::default();
        (1..).zip(successes).for_each(|(episode, success)| curves.push(episode, 0.0, Metric::KEPT.map(|_| *success)));
        let done = successes.len() as u64;
        let success = successes.last().copied().map(f64::from);
        let of_config = RunSummary::new(&path, Arc::new(config), RunState::Finished);
        Arc::new(RunSummary { done, success, curves: Arc::new(curves), ..of_config })
    }

    fn runs() -> Vec<Arc<RunSummary>> {
        vec![
            run("b", &[("method", "ddpg-uniform"), ("seed", "2")], &[0.0, 0.5, 1.0]),
            run("a", &[("method", "ddpg-uniform"), ("seed", "1")], &[0.0, 0.25]),
            run("c", &[("method", "ddpg"), ("seed", "1")], &[0.25]),
            run("d", &[("method", "ddpg"), ("seed", "2")], &[0.0]),
            run("e", &[("method", "ddpg"), ("seed", "3")], &[]),
            run("f", &[("method", "ddpg"), ("seed", "1"), ("ddpg.gamma", "0.5")], &[]),
        ]
    }

    #[test]
    fn a_damaged_run_belongs_to_no_group() {
        let (mut runs, undamaged) = (runs(), runs());
        Arc::make_mut(&mut runs[0]).damaged = true;
        let grouping = Grouping::new(&runs, &Grouping::default());
        assert!(grouping.of(&runs[0].path).is_none());
        assert_eq!(grouping.of(&runs[1].path).map(|group| group.seeds), Some(1));
        assert_ne!(key_of(&runs), key_of(&undamaged));
    }

    #[test]
    fn a_group_keeps_its_colour_whatever_else_comes_and_goes() {
        let mut runs = vec![
            run("a", &[("method", "ddpg"), ("ddpg.tau", "0.5"), ("ddpg.gamma", "0.5")], &[]),
            run("b", &[("method", "ddpg"), ("ddpg.tau", "0.5")], &[]),
            run("c", &[("method", "ddpg"), ("ddpg.tau", "0.5"), ("ddpg.gamma", "0.9")], &[]),
        ];
        let color = |grouping: &Grouping, name: &str| grouping.of(&Path::new("runs").join(name)).unwrap().color;
        let three = Grouping::new(&runs, &Grouping::default());
        let one = Grouping::new(&runs[..1], &Grouping::default());
        assert_eq!(color(&three, "a"), color(&one, "a"), "those made later change nothing, also in another session");
        // Its label names another setting now.
        runs.push(run("d", &[("method", "ddpg")], &[]));
        let four = Grouping::new(&runs, &three);
        let mut extended =
            vec![run("c", &[("seed", "1")], &[]), run("d", &[("seed", "2")], &[]), run("e", &[("seed", "3")], &[])];
        let before = Grouping::new(&extended, &Grouping::default());
        Arc::make_mut(&mut Arc::make_mut(&mut extended[0]).config).episodes += 100;
        assert_eq!(color(&Grouping::new(&extended, &before), "d"), color(&before, "d"), "its oldest run leaves it");
        assert_ne!(three.of(Path::new("runs/a")).unwrap().label, four.of(Path::new("runs/a")).unwrap().label);
        let first = runs.remove(0);
        let without = Grouping::new(&runs, &four);
        for name in ["b", "c"] {
            assert_eq!([&four, &without].map(|now| color(now, name)), [color(&three, name); 2], "{name}");
        }
        runs.push(run("e", &[("method", "ddpg"), ("ddpg.gamma", "0.1")], &[]));
        let taken = Grouping::new(&runs, &without);
        assert_eq!(color(&taken, "e"), color(&three, &first.name), "the colour of what is gone is free");
    }

    fn names(group: &RunGroup) -> Vec<&str> {
        group.runs.iter().filter_map(|path| path.file_name()?.to_str()).collect()
    }

    /// The success of a group of these runs.
    fn success(group: &RunGroup, runs: &[Arc<RunSummary>]) -> f64 {
        let runs: Vec<&RunSummary> =
            runs.iter().map(|run| &**run).filter(|run| group.runs.contains(&run.path)).collect();
        aggregate::iqm(&scores_of(&runs).unwrap())
    }

    #[test]
    fn a_run_extended_beyond_the_others_leaves_their_group() {
        let mut runs = runs();
        let before = Grouping::new(&runs, &Grouping::default());
        let longer = RunConfig { episodes: runs[0].config.episodes + 50, ..(*runs[0].config).clone() };
        runs[0] = Arc::new(RunSummary { config: Arc::new(longer), ..(*runs[0]).clone() });
        let after = Grouping::new(&runs, &before);
        assert_eq!([&before, &after].map(|known| known.of(&runs[0].path).unwrap().runs.len()), [2, 1]);
        assert!(after.of(&runs[0].path).unwrap().curves.is_none(), "its own curves are enough");
    }

    #[test]
    fn a_group_has_no_curves_before_half_of_its_runs_are_read() {
        let mut runs = runs();
        let is_read = |run: &RunSummary| "cde".contains(&*run.name) && !run.curves.episodes().is_empty();
        let read: Vec<usize> = (0..runs.len()).filter(|place| is_read(&runs[*place])).collect();
        let has_curves = |runs: &[Arc<RunSummary>]| {
            Grouping::new(runs, &Grouping::default()).of(Path::new("runs/c")).unwrap().curves.is_some()
        };
        assert!(read.len() == 2 && has_curves(&runs));
        Arc::make_mut(&mut runs[read[0]]).curves = Arc::default();
        assert!(!has_curves(&runs));
    }

    #[test]
    fn runs_that_differ_in_the_seed_alone_are_one_group_with_live_statistics() {
        let runs = runs();
        let grouping = Grouping::new(&runs, &Grouping::default());
        let of = |name: &str| grouping.of(Path::new("runs").join(name).as_path()).unwrap();
        assert_eq!((names(of("a")), names(of("e")), names(of("f"))), (vec!["a", "b"], vec!["c", "d", "e"], vec!["f"]));
        assert!(of("f").label.contains("gamma 0.5") && of("f").runs.len() == 1, "{}", of("f").label);
        assert_eq!(success(of("a"), &runs), 0.625);
        assert_eq!(success(of("c"), &runs), 0.125, "the run that has not begun does not count");
        let mut named = runs.clone();
        (0..5).for_each(|place| Arc::make_mut(&mut named[place]).name = "plain".into());
        let named = Grouping::new(&named, &grouping);
        let name = |run: &str| named.of(Path::new("runs").join(run).as_path()).unwrap().name.clone();
        assert_eq!(["a", "c"].map(name), [of("a"), of("c")].map(|group| format!("plain, {}", group.label)));
        let again = Grouping::new(&runs, &grouping);
        assert!(Arc::ptr_eq(&again.rows, &grouping.rows), "the same runs differ in the same settings");
        let fewer = Grouping::new(&runs[..5], &grouping);
        assert!(fewer.settings(Path::new("runs/c")).unwrap().is_empty());
        for (grouping, run, gamma) in [(&grouping, 2, "0.95"), (&grouping, 5, "0.5"), (&fewer, 2, "0.95")] {
            assert_eq!(grouping.setting(&runs[run], "ddpg.gamma").unwrap().to_string(), gamma, "also a default");
        }
        assert!(!of("c").label.contains("gamma"), "a default is not named: {}", of("c").label);
    }

    #[test]
    fn of_runs_with_the_same_seed_the_furthest_counts() {
        let mut runs = runs();
        runs.push(run("g", &[("method", "ddpg-uniform"), ("seed", "1")], &[1.0, 1.0, 1.0]));
        let before = Grouping::new(&runs[..6], &Grouping::default());
        let grouping = Grouping::new(&runs, &before);
        let group = grouping.of(Path::new("runs/a")).unwrap();
        assert_eq!((names(group), group.seeds), (vec!["a", "g", "b"], 2));
        assert_eq!(success(group, &runs), 1.0);
        assert_eq!(group.curves.as_ref().unwrap().middle.get(Metric::Success), [0.5, 0.75, 1.0]);
        assert!(group.title().ends_with("(2 seeds, 3 runs)"), "{}", group.title());
        let alone = Grouping::new(&[runs[1].clone(), runs[6].clone()], &Grouping::default());
        assert!(alone.of(Path::new("runs/g")).unwrap().title().ends_with("(1 seed, 2 runs)"));
    }

    #[test]
    fn the_curve_of_a_group_goes_as_far_as_half_of_its_runs() {
        let runs = runs();
        let grouping = Grouping::new(&runs, &Grouping::default());
        let curves = grouping.of(Path::new("runs/a")).unwrap().curves.clone().unwrap();
        let of = |curves: &Curves| curves.get(Metric::Success).to_vec();
        assert_eq!(of(&curves.middle), [0.0, 0.375, 1.0]);
        assert_eq!((of(&curves.low), of(&curves.high)), (vec![0.0, 0.3125, 1.0], vec![0.0, 0.4375, 1.0]));
        let three = grouping.of(Path::new("runs/c")).unwrap().curves.clone().unwrap();
        assert_eq!(of(&three.middle), [0.125]);
    }

    #[test]
    fn a_run_is_ended_by_its_success_in_lists_as_in_reports() {
        let solved = run("a", &[("stop.success", "0.75")], &[0.75; 100]);
        let cut_off = RunSummary { state: RunState::Interrupted, ..(*solved).clone() };
        assert!(solved.is_solved() && cut_off.is_solved(), "it was killed before it could say so");
        assert!(!run("b", &[("stop.success", "0.75")], &[0.75; 99]).is_solved(), "too few episodes to tell");
        let record = |episode| EpisodeRecord { episode, rolling_success: 0.75, ..EpisodeRecord::default() };
        let mut history = RunHistory::default();
        (1..=100).for_each(|episode| history.records.push(record(episode)));
        assert!(LearningRow::new(&cut_off.config, &history).is_solved);
    }

    #[test]
    fn thinned_runs_are_aggregated_at_their_common_episodes() {
        let of = |episodes: &[u64]| {
            let mut curves = Curves::default();
            episodes.iter().for_each(|episode| curves.push(*episode, 0.0, Metric::KEPT.map(|_| 1.0)));
            curves
        };
        let [fine, coarse] = [of(&[1, 2, 3]), of(&[1, 3])];
        for runs in [[&fine, &coarse], [&coarse, &fine]] {
            assert_eq!(GroupCurves::new(&runs.map(|run| (run, false))).middle.episodes(), [1, 3]);
        }
        let [short, solved, other] = [of(&[1]), of(&[1]), of(&[1, 2, 3])];
        let all = [(&short, false), (&solved, true), (&other, false)];
        assert_eq!(GroupCurves::new(&all).middle.episodes(), [1, 2, 3], "what its success ended keeps its last value");
        assert_eq!(GroupCurves::new(&[all[0], all[0], all[2]]).middle.episodes(), [1]);
        let unread = (&Curves::default(), true);
        assert_eq!(GroupCurves::new(&[all[2], all[1], unread]).middle.episodes(), [1, 2, 3]);
        assert_eq!(GroupCurves::new(&[all[2], unread, unread]).middle.episodes(), [0; 0], "less than half are read");
    }

    #[test]
    fn runs_that_have_changed_are_grouped_again_after_a_pause() {
        fn finish(grouper: &mut Grouper, runs: &[Arc<RunSummary>]) -> bool {
            while grouper.loader.is_loading() {
                if grouper.poll(runs) {
                    return true;
                }
                std::thread::yield_now();
            }
            false
        }
        let mut grouper = Grouper::default();
        let mut runs = runs();
        assert!(!grouper.poll(&runs) && !grouper.loader.is_loading(), "nothing is known to have changed");
        grouper.stale = true;
        grouper.poll(&runs);
        assert!(finish(&mut grouper, &runs) && grouper.known.of(Path::new("runs/a")).is_some());
        grouper.loader.age(Duration::from_secs(3600), Duration::ZERO);
        Arc::make_mut(&mut runs[4]).done += 1;
        grouper.stale = true;
        grouper.poll(&runs);
        assert!(!grouper.loader.is_loading(), "during the pause");
        grouper.loader.age(Duration::ZERO, PAUSE);
        grouper.poll(&runs);
        assert!(finish(&mut grouper, &runs));
        grouper.loader.age(Duration::ZERO, PAUSE);
        grouper.stale = true;
        grouper.poll(&runs);
        assert!(!grouper.loader.is_loading() && !grouper.stale, "the runs are the same");
        let before = Grouping::new(&runs, &Grouping::default());
        assert!(before.is_of(&runs));
        Arc::make_mut(&mut Arc::make_mut(&mut runs[0]).config).stop.success = Some(0.8);
        assert!(!before.is_of(&runs), "a run that goes on beyond its success loses the setting");
    }
}
