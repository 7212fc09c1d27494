//! The settings in which runs differ, and the labels made of them.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;

use serde_json::{Value, json};

use super::row::LearningRow;
use mge_base::identity::{FileId, sha256};
use mge_base::json;
use mge_dynamics::{shipped_for, tool_set_name};
use mge_guidance::EpsilonSchedule;
use mge_task::{self as task, Task};
use mge_trainer::{Method, ModelFile, PriorSource, RunConfig};

/// The key in a row's settings for its whole epsilon schedule, present if the short form is ambiguous.
const WHOLE_SCHEDULE: &str = "epsilon";

/// The key in a row's settings for the run and the episode that it was forked from.
const FORK: &str = "fork";
/// The effective value of a setting that has none: `null` and an empty table cell would stand for a setting that the
/// method does not use.
const NONE: &str = "none";
/// Value of `subgoals` and `scene` for a shipped task, or one without variants.
const UNCHANGED: &str = "unchanged";
/// Number of digits of its hash that name a variant of a task.
const DIGITS: usize = 6;
/// Name of the model without ablations.
const WHOLE_MODEL: &str = "full";

/// Effective values of settings by JSON path.
pub type Settings = BTreeMap<String, Value>;

/// Gives each row every setting in which the runs differ, with its effective value, so that runs with the same label
/// differ only in the seed: the defaults of its method are [implied](LearningRow::implied) in the label. All rows that are shown or compared together must be given together,
/// each with its configuration. Returns the settings in which the runs do not differ.
pub fn distinguish(mut runs: Vec<(&RunConfig, &mut LearningRow)>) -> Settings {
    let configs: Vec<&RunConfig> = runs.iter().map(|(config, _)| *config).collect();
    let mut settings: Vec<Settings> = configs.iter().map(|config| compared_settings(config)).collect();
    name_task_variants(&configs, &mut settings);
    name_models(&configs, &mut settings);
    let differing = complete(&mut settings, |run, path| configs[run].uses(path));
    let mut defaults: BTreeMap<String, Settings> = BTreeMap::new();
    let mut common = Settings::new();
    for ((config, row), settings) in runs.iter_mut().zip(settings) {
        let kind = format!("{} {}", config.method, config.task.rules.start_noise);
        let default = defaults.entry(kind).or_insert_with(|| default_settings(config));
        let (differ, same): (Settings, Settings) = settings.into_iter().partition(|(path, _)| differing.contains(path));
        let is_usual = |path: &String, value: &Value| default.get(path).map_or(value == NONE, |usual| usual == value);
        (row.implied, row.settings) = differ.into_iter().partition(|(path, value)| is_usual(path, value));
        common.extend(same);
    }
    distinguish_schedules(&mut runs);
    common
}

/// The paths at which settings differ. A setting that only some have becomes [`NONE`] in the others that use it.
pub fn complete(settings: &mut [Settings], uses: impl Fn(usize, &str) -> bool) -> BTreeSet<String> {
    let mut paths: BTreeSet<String> = settings.iter().flat_map(BTreeMap::keys).cloned().collect();
    paths.retain(|path| {
        let (mut first, mut differs) = (None, false);
        for (_, settings) in settings.iter_mut().enumerate().filter(|(number, _)| uses(*number, path)) {
            if !settings.contains_key(path) {
                settings.insert(path.clone(), NONE.into());
            }
            let value = &settings[path];
            differs |= first.get_or_insert_with(|| value.clone()) != value;
        }
        differs
    });
    paths
}

impl LearningRow {
    /// Name of its method, threshold and settings, as in legends and tables.
    pub fn label(&self) -> String {
        let mut label = match self.method.parse::<Method>() {
            Ok(method) if self.has_threshold(method) => {
                format!("{}, epsilon {}", method.label(), self.threshold())
            }
            Ok(method) => method.label().to_owned(),
            Err(_) => self.method.clone(),
        };
        for (key, value) in self.settings.iter().filter(|(key, _)| *key != WHOLE_SCHEDULE) {
            let _ = write!(label, ", {} {}", if key == "prior" { "model" } else { key }, json::text(value));
        }
        label
    }

    /// Whether its epsilon is part of its name: one that is not its method's default, or a schedule of clusters.
    fn has_threshold(&self, method: Method) -> bool {
        let is_usual = !method.has_clusters() || self.epsilon.starts_with("need:");
        method.uses("epsilon") && (self.own_epsilon || !is_usual)
    }

    /// The epsilon schedule in short form, or in full if the short form is ambiguous.
    fn threshold(&self) -> String {
        let parts: Vec<&str> = self.epsilon.split(':').collect();
        match (self.settings.contains_key(WHOLE_SCHEDULE), parts.as_slice()) {
            (false, ["linear", from, to, _]) => format!("{from} to {}", self.end.as_deref().unwrap_or(to)),
            (true, ["points", points]) => format!("drawn {}", points.replace(',', ", ")),
            _ => self.epsilon.parse().map_or(self.epsilon.clone(), |known: EpsilonSchedule| known.describe()),
        }
    }
}

/// A label, from which, until it fits, the part after the method that most of all labels have is left out, unless another
/// label has all that would remain.
pub fn short_label(label: &str, all: &BTreeSet<&str>, fits: impl Fn(&str) -> bool) -> String {
    let mut parts: Vec<&str> = label.split(", ").collect();
    let method = Method::ALL.map(Method::label).into_iter().filter(|method| label.contains(method));
    let first = method.map(|method| method.split(", ").count()).max().unwrap_or(1);
    let have =
        |parts: &[&str]| all.iter().filter(|of| parts.iter().all(|part| of.split(", ").any(|it| it == *part))).count();
    let is_known_without = |parts: &[&str], at: usize| have(&[&parts[..at], &parts[at + 1..]].concat()) > 1;
    while !fits(&parts.join(", "))
        && let Some(common) = (first..parts.len())
            .filter(|at| have(&parts[*at..=*at]) > 1 && !is_known_without(&parts, *at))
            .max_by_key(|at| have(&parts[*at..=*at]))
    {
        parts.remove(common);
    }
    parts.join(", ")
}

/// The differences of two runs: JSON paths of `config.json` with both effective values; one that is
/// missing or has no effect is empty.
pub fn differences(first: &RunConfig, second: &RunConfig) -> Vec<(String, [String; 2])> {
    let mut all = [effective_settings(first), effective_settings(second)];
    if first.prior == second.prior {
        all.iter_mut().for_each(|settings| _ = settings.remove("prior"));
    }
    let paths: BTreeSet<&String> = all.iter().flat_map(BTreeMap::keys).collect();
    let differing = paths.into_iter().filter(|path| all[0].get(*path) != all[1].get(*path));
    let value = |number: usize, path: &String| {
        let is_used = [first, second][number].uses(path);
        all[number].get(path).filter(|_| is_used).map_or_else(String::new, json::text)
    };
    let values = differing.map(|path| (path.clone(), [0, 1].map(|number| value(number, path))));
    // A setting without effect in both makes no difference.
    values.filter(|(_, [first, second])| first != second).collect()
}

/// The default settings of a run with this method.
fn default_settings(config: &RunConfig) -> Settings {
    let mut settings = compared_settings(&RunConfig::default_for(config.task.clone(), config.method));
    // Without variants, as `name_task_variants` would find.
    settings.extend(["subgoals", "scene"].map(|part| (part.to_owned(), UNCHANGED.into())));
    settings
}

/// The effective value of every setting: where a configuration leaves a value to the task, that of the task.
fn effective_settings(config: &RunConfig) -> Settings {
    let settings = leaf_settings(&json::to_value(config)).into_iter();
    // Settings of earlier versions are compared like all others.
    let named = |(path, value): (String, Value)| (path.strip_prefix("removed.").unwrap_or(&path).to_owned(), value);
    let mut settings: Settings = settings.map(named).collect();
    // Whole tasks; that a fork changed its task is among its changes.
    settings.remove("fork.tasks");
    if config.start_noise.is_none() {
        settings.insert("start_noise".to_owned(), json::to_value(&config.task.rules.start_noise));
    }
    settings
}

/// The values in a configuration by their paths: numbers, booleans and texts.
pub fn leaf_settings(config: &Value) -> Settings {
    let value = |value: &Value| match value {
        Value::Number(_) | Value::Bool(_) => value.clone(),
        value => Some(json::text(value)).filter(|text| !text.is_empty()).unwrap_or_else(|| NONE.to_owned()).into(),
    };
    json::leaf_values(config).into_iter().map(|(path, found)| (path, value(found))).collect()
}

/// Settings by path, without those that every label includes or that do not affect learning.
fn compared_settings(config: &RunConfig) -> Settings {
    let is_compared = |path: &str| {
        let elsewhere = ["method", "seed", "epsilon", "stop.minutes"].contains(&path)
            || ["task.", "checkpoints.", "fork."].iter().any(|prefix| path.starts_with(prefix));
        !elsewhere && config.uses(path)
    };
    let mut settings = effective_settings(config);
    settings.retain(|path, _| is_compared(path));
    let fork = config.fork.as_ref().map_or(NONE.to_owned(), |fork| format!("of {} at {}", fork.run, fork.episode));
    settings.insert(FORK.to_owned(), fork.into());
    if let (Some(id), Some(prior)) = (model_of(config), settings.get_mut("prior")) {
        let is_learned = shipped_for(&config.task.tool_set()).is_some_and(|model| model.id() == *id);
        *prior = if is_learned { String::from(PriorSource::Learned) } else { id.sha256.clone() }.into();
    }
    settings
}

/// A text that two configurations share if they train in the same way: with the same seed and values of all settings
/// that affect learning.
pub(super) fn training_key(config: &RunConfig) -> String {
    let epsilon = config.method.uses("epsilon").then(|| config.epsilon.to_string());
    let settings = compared_settings(config);
    json!([config.task, config.method, config.seed, epsilon, settings]).to_string()
}

/// Adds the `subgoals` of each run's task and the rest of its `scene`: names that distinguish the tasks with the same
/// name.
fn name_task_variants(configs: &[&RunConfig], settings: &mut [Settings]) {
    let shipped = task::shipped();
    let scene = |task: &Task| json!(Task { subgoals: Vec::new(), search_actions: 0, ..task.clone() });
    let subgoals = variant_names(configs, &shipped, true, |task| json!(task.subgoals));
    let scenes = variant_names(configs, &shipped, false, scene);
    for ((settings, subgoals), scene) in settings.iter_mut().zip(subgoals).zip(scenes) {
        settings.insert("subgoals".to_owned(), subgoals.into());
        settings.insert("scene".to_owned(), scene.into());
    }
}

/// A name for each run that distinguishes a part of its task from those of other tasks with the same name, made of its
/// content. If that part may be `made_by_seed`, as subgoals that are proposed, variants of which each belongs to one
/// seed have the same name.
fn variant_names(
    configs: &[&RunConfig],
    shipped: &[Task],
    made_by_seed: bool,
    part: impl Fn(&Task) -> Value,
) -> Vec<String> {
    let content = |task: &Task| sha256(part(task).to_string().as_bytes());
    let is_used = |task: &&Task| configs.iter().any(|config| config.task.name == task.name);
    let usual: HashMap<&str, String> =
        shipped.iter().filter(is_used).map(|task| (&*task.name, content(task))).collect();
    let own: Vec<String> = configs.iter().map(|config| content(&config.task)).collect();
    // The seeds of the runs of each variant.
    let mut variants: HashMap<&str, BTreeMap<&String, BTreeSet<u64>>> = HashMap::new();
    for (config, own) in configs.iter().zip(&own) {
        variants.entry(&config.task.name).or_default().entry(own).or_default().insert(config.seed);
    }
    let name = |(config, own): (&&RunConfig, &String)| {
        let (known, usual) = (&variants[&*config.task.name], usual.get(&*config.task.name));
        if usual.map_or(known.len() == 1, |usual| usual == own) {
            return UNCHANGED.to_owned();
        }
        let changed = || known.iter().filter(|(content, _)| Some(**content) != usual).map(|(_, seeds)| seeds);
        let seeds: BTreeSet<&u64> = changed().flatten().collect();
        let count = changed().count();
        let one_for_each_seed = count > 1 && seeds.len() == count && changed().all(|seeds| seeds.len() == 1);
        match made_by_seed && one_for_each_seed {
            true => "changed".to_owned(),
            false => format!("variant {}", &own[..DIGITS]),
        }
    };
    configs.iter().zip(&own).map(name).collect()
}

/// Names model files by their stem without the tool set, so that runs on tasks with different tool sets
/// can have the same label. A model with several names has the first; two models with the same name on one task also
/// have the first digits of their hashes, or their paths in runs of earlier versions.
fn name_models(configs: &[&RunConfig], settings: &mut [Settings]) {
    let content = |settings: &Settings| settings.get("prior").map(json::text);
    let mut stems: BTreeMap<String, String> = BTreeMap::new();
    for (config, settings) in configs.iter().zip(settings.iter()) {
        if let (Some(stem), Some(content)) = (model_stem(config), content(settings)) {
            let first = stems.entry(content).or_insert_with(|| stem.clone());
            *first = stem.min(first.clone());
        }
    }
    let name = |config: &RunConfig, settings: &Settings| {
        model_stem(config)?;
        Some(short_name(stems.get(&content(settings)?)?, config))
    };
    let mut contents: BTreeMap<(&str, String), BTreeSet<String>> = BTreeMap::new();
    for (config, settings) in configs.iter().zip(settings.iter()) {
        // If shipped models are compared too, the full model of a study is not called so.
        let learned = (config.prior == PriorSource::Learned).then(|| WHOLE_MODEL.to_owned());
        if let (Some(name), Some(content)) = (learned.or_else(|| name(config, settings)), content(settings)) {
            contents.entry((&config.task.name, name)).or_default().insert(content);
        }
    }
    let ambiguous: BTreeSet<&String> =
        contents.iter().filter(|(_, contents)| contents.len() > 1).map(|((_, name), _)| name).collect();
    for (config, settings) in configs.iter().zip(settings) {
        let (Some(name), Some(content)) = (name(config, settings), content(settings)) else { continue };
        let shown = match model_of(config) {
            _ if content == String::from(PriorSource::Learned) => continue,
            _ if !ambiguous.contains(&name) => name,
            Some(id) => format!("{} ({})", stems[&content], id.digits()),
            None => continue,
        };
        settings.insert("prior".to_owned(), shown.into());
    }
}

/// The model of a run that is known by its content.
fn model_of(config: &RunConfig) -> Option<&FileId> {
    let PriorSource::ModelFile(ModelFile { id, .. }) = &config.prior else { return None };
    id.as_ref()
}

/// The name of a run's model file, without its extension.
fn model_stem(config: &RunConfig) -> Option<String> {
    let PriorSource::ModelFile(ModelFile { id, path }) = &config.prior else { return None };
    let of_path = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
    id.as_ref().map(|id| id.name.clone()).or_else(of_path)
}

/// The part of a model's name that distinguishes it from others of the tool set of a run's task.
fn short_name(stem: &str, config: &RunConfig) -> String {
    match stem.strip_prefix(&tool_set_name(&config.task.tool_set())) {
        Some("") => WHOLE_MODEL.to_owned(),
        Some(rest) if rest.starts_with('-') => rest[1..].to_owned(),
        _ => stem.to_owned(),
    }
}

/// Adds the whole schedule to the settings where two schedules have the same short form in a label, except to the default
/// one of a method.
fn distinguish_schedules(runs: &mut [(&RunConfig, &mut LearningRow)]) {
    let mut schedules: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (_, row) in runs.iter() {
        schedules.entry(row.label()).or_default().insert(row.epsilon.clone());
    }
    for (_, row) in runs.iter_mut().filter(|(config, row)| config.method.uses("epsilon") && row.own_epsilon) {
        if schedules.get(&row.label()).is_some_and(|schedules| schedules.len() > 1) {
            row.settings.insert(WHOLE_SCHEDULE.to_owned(), row.epsilon.clone().into());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{find_runs, read_runs};
    use mge_run::{Event, RunDirectory, RunHistory, RunState, RunWriter};
    use mge_trainer::Method;

    #[test]
    fn labels_have_the_settings_that_differ_from_the_defaults() {
        let folder = tempfile::tempdir().unwrap();
        let task = Arc::new(mge_task::load("task1").unwrap());
        let other = Arc::new(mge_task::load("task2").unwrap());
        let make = |name: &str, task: &Arc<mge_task::Task>, settings: &[(&str, &str)]| {
            let mut config = RunConfig::new(task.clone());
            for (key, value) in settings {
                config = config.with_setting(key, value).unwrap();
            }
            RunDirectory::create(folder.path().join("runs").join(name), &config).unwrap();
        };
        make("a", &task, &[("epsilon", "0.1"), ("ddpg.gamma", "0.7")]);
        make("b", &task, &[("epsilon", "0.1"), ("seed", "1")]);
        make("c", &task, &[("epsilon", "linear:0.5:0:10")]);
        make("d", &task, &[("epsilon", "linear:0.5:0:20")]);
        make("e", &task, &[("method", "ddpg"), ("epsilon", "0.3"), ("guidance.horizon", "3")]);
        // On another task, too, another model is another method.
        make("f", &other, &[("epsilon", "0.1"), ("prior", "true")]);
        std::fs::create_dir(folder.path().join("runs/nothing")).unwrap();

        let paths = find_runs(&[folder.path().to_owned()]).unwrap();
        let runs = read_runs(&paths).unwrap();
        let labels: Vec<String> = runs.iter().map(|run| run.trained.row.label()).collect();
        let expected = [
            "DDPG-MGE, epsilon 0.1, ddpg.gamma 0.7",
            "DDPG-MGE, epsilon 0.1",
            "DDPG-MGE, epsilon 0.5 to 0 over 10 episodes",
            "DDPG-MGE, epsilon 0.5 to 0 over 20 episodes",
            "DDPG",
            "DDPG-MGE, epsilon 0.1, model true",
        ];
        assert_eq!(labels, expected);
        assert!(runs.iter().all(|run| run.state == RunState::NotStarted && run.trained.row.episodes == 0));
        assert_eq!(find_runs(&paths[..1]).unwrap(), paths[..1]);
        assert_eq!(find_runs(&[folder.path().to_owned(), paths[0].clone()]).unwrap(), paths);
        let error = find_runs(&[folder.path().join("runs/nothing")]).unwrap_err().to_string();
        assert!(error.contains("holds no runs"), "{error}");
    }

    #[test]
    fn a_label_has_the_schedule_in_force_and_the_epsilon_that_is_reached() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let config = RunConfig { episodes: 500, ..config.with_setting("epsilon", "linear:0.5:0:1000").unwrap() };
        let run = RunDirectory::create(folder.path().join("run"), &config).unwrap();
        let label = || read_runs(&[run.path().to_owned()]).unwrap()[0].trained.row.label();
        assert_eq!(label(), "DDPG-MGE, epsilon 0.5 to 0.25", "the run ends before it is 0");
        let set = Event::ScheduleChanged { episode: 0, schedule: "0.125".to_owned() };
        RunWriter::open(&run, 0).unwrap().record(&set).unwrap();
        assert_eq!(label(), "DDPG-MGE, epsilon 0.125");
    }

    #[test]
    fn a_shortened_label_keeps_what_sets_it_apart() {
        let labels =
            ["DDPG-MGE, epsilon 0.3, gamma 0.95, success none", "DDPG-MGE, epsilon 0.5, gamma 0.95, success none"];
        let all = BTreeSet::from([labels[0], labels[1], "DDPG, gamma 0.95, success 0.9"]);
        let short = |columns: usize| labels.map(|label| short_label(label, &all, |text| text.len() <= columns));
        assert_eq!(short(60), labels);
        assert_eq!(short(40), ["DDPG-MGE, epsilon 0.3, success none", "DDPG-MGE, epsilon 0.5, success none"]);
        assert_eq!(short(10), ["DDPG-MGE, epsilon 0.3", "DDPG-MGE, epsilon 0.5"]);
        let all = ["DDPG", "DDPG, uniform exploration, gamma 0.9", "DDPG, uniform exploration, gamma 0.9, tau 0.1"];
        let shortest = all.map(|label| short_label(label, &BTreeSet::from(all), |_| false));
        let expected = [all[0], all[1], "DDPG, uniform exploration, tau 0.1"];
        assert_eq!(shortest, expected, "no two read the same, and each tells its method");
    }

    #[test]
    fn settings_that_differ_by_method_alone_are_omitted() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let usual = Method::ALL.map(|method| RunConfig::default_for(task.clone(), method));
        let other = usual[0].with_setting("ddpg.tau", "0.1").unwrap();
        let labels = |configs: &[RunConfig]| -> Vec<String> {
            let mut rows: Vec<LearningRow> =
                configs.iter().map(|config| LearningRow::new(config, &RunHistory::default())).collect();
            distinguish(configs.iter().zip(&mut rows).collect());
            rows.iter().map(LearningRow::label).collect()
        };
        let alone = |config: &RunConfig| LearningRow::new(config, &RunHistory::default()).label();
        let mge = |settings: &[(&str, &str)]| {
            let start = RunConfig::default_for(task.clone(), Method::DdpgMge);
            settings.iter().fold(start, |config, (key, value)| config.with_setting(key, value).unwrap())
        };
        let variants = [
            mge(&[]),
            mge(&[("prior", "m/bucket-box.safetensors")]),
            mge(&[("guidance.clusters", r#"{"fixed": 5}"#)]),
            mge(&[("refinement.every", "50")]),
            mge(&[("method", "ddpg-mge-adaptive")]),
            mge(&[("method", "ddpg-mge-adaptive"), ("refinement.every", "0")]),
        ];
        let named = labels(&variants);
        assert_eq!(named.iter().collect::<BTreeSet<_>>().len(), variants.len(), "{named:?}");
        let all = labels(&usual);
        assert_eq!(all, usual.each_ref().map(alone));
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), Method::ALL.len());
        let adaptive = &usual[5];
        assert_eq!(alone(adaptive), "adaptive DDPG-MGE");
        let both = labels(&[usual[0].clone(), other.clone(), adaptive.clone()]);
        let expected = ["DDPG", "DDPG, ddpg.tau 0.1", "adaptive DDPG-MGE"];
        assert_eq!(both, expected, "a setting that somebody changed is shown only where it is changed");
        assert_eq!(labels(&[other, adaptive.clone()]), expected[1..]);
        let needs =
            ["need:0.5:0.25:20", "need:0.3:0.25:20"].map(|spec| adaptive.with_setting("epsilon", spec).unwrap());
        assert!(labels(&needs)[1].contains("by need, 0.3 clusters"), "two schedules of one kind are distinguished");
        let own = labels(&[adaptive.clone(), adaptive.with_setting("epsilon", "need:0.5:0.25:10").unwrap()]);
        let whole = "by need, 0.5 clusters and 0.25 noise, over 10 greedy attempts";
        assert_eq!(own, ["adaptive DDPG-MGE".to_owned(), format!("adaptive DDPG-MGE, epsilon {whole}")]);
        let without_clusters = RunConfig::default_for(task.clone(), Method::DdpgAdaptive);
        let changes = [("epsilon", "need:0:0.75:20"), ("epsilon", "need:0:0.1:20"), ("granularity", "step")];
        let changed = changes.map(|(key, value)| without_clusters.with_setting(key, value).unwrap());
        assert_eq!(labels(&changed).iter().collect::<BTreeSet<_>>().len(), 3, "{:?}", labels(&changed));
        let constant = without_clusters.with_setting("epsilon", "0.3").unwrap();
        assert_eq!([&without_clusters, &constant].map(alone), ["adaptive DDPG", "adaptive DDPG, epsilon 0"]);
        // Each method has its own colour, whatever the other methods are.
        let names: Vec<&str> = all.iter().map(String::as_str).collect();
        let colours = |names: &[&str]| -> Vec<String> {
            mge_figures::series(names).iter().map(|series| format!("{:?}", series.color)).collect()
        };
        assert_eq!(colours(&names).iter().collect::<BTreeSet<_>>().len(), names.len());
        assert_eq!(colours(&names[5..6]), colours(&names)[5..6]);
    }

    #[test]
    fn a_changed_task_is_distinguished_from_the_shipped_one() {
        let folder = tempfile::tempdir().unwrap();
        let mut task = task::load("task1").unwrap();
        for (name, changed) in [("a", false), ("b", true)] {
            task.subgoals[0].radius += f32::from(u8::from(changed));
            let config = RunConfig::new(Arc::new(task.clone())).with_setting("epsilon", "0.1").unwrap();
            RunDirectory::create(folder.path().join(name), &config).unwrap();
        }
        let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
        let labels: Vec<String> = runs.iter().map(|run| run.trained.row.label()).collect();
        assert_eq!(labels, ["", ", subgoals variant eea501"].map(|how| format!("DDPG-MGE, epsilon 0.1{how}")));
    }

    #[test]
    fn tasks_with_the_same_name_are_not_pooled() {
        // Numbers stand for different positions of the subgoal; 0 for the shipped one.
        let labels = |name: &str, runs: &[(u64, u8)]| -> Vec<String> {
            let configs = runs.iter().map(|&(seed, position)| {
                let mut task = Task { name: name.to_owned(), ..task::load("task1").unwrap() };
                task.subgoals[0].position[0] += f32::from(position) / 100.0;
                RunConfig { seed, ..RunConfig::default_for(Arc::new(task), Method::Ddpg) }
            });
            let configs: Vec<RunConfig> = configs.collect();
            let mut rows: Vec<LearningRow> =
                configs.iter().map(|config| LearningRow::new(config, &RunHistory::default())).collect();
            distinguish(configs.iter().zip(&mut rows).collect());
            rows.iter().map(|row| row.label().replace("DDPG, subgoals ", "")).collect()
        };
        // The same subgoals have the same name, whatever the other runs are.
        let [one, other] = ["variant 7a2a62", "variant 10e51b"];
        assert_eq!(labels("task1", &[(0, 0), (0, 1), (1, 1)]), ["DDPG", one, one]);
        assert_eq!(labels("task1", &[(0, 0), (0, 1)]), ["DDPG", one]);
        assert_eq!(labels("task1", &[(0, 0), (0, 2), (0, 1)]), ["DDPG", other, one]);
        assert_eq!(labels("task1", &[(0, 0), (0, 1), (1, 2)]), ["DDPG", "changed", "changed"], "proposed by seed");
        assert_eq!(labels("mine", &[(0, 1), (1, 1)]), ["DDPG", "DDPG"]);
        assert_eq!(labels("mine", &[(0, 1), (0, 2)]), [one, other]);
        assert_eq!(labels("mine", &[(0, 1), (1, 1), (2, 2)]), [one, one, other]);
    }

    #[test]
    fn settings_without_effect_are_no_difference() {
        let config = |settings: &[(&str, &str)]| {
            let start = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
            settings.iter().fold(start, |config, (key, value)| config.with_setting(key, value).unwrap())
        };
        let found = |first: &[(&str, &str)], second: &[(&str, &str)]| differences(&config(first), &config(second));
        let plain = ("method", "ddpg");
        assert_eq!(found(&[plain, ("guidance.horizon", "3")], &[plain, ("guidance.horizon", "4")]), []);
        let other = found(&[plain], &[("epsilon", "0.2"), ("guidance.horizon", "4")]);
        let (_, values) = other.iter().find(|(path, _)| path == "guidance.horizon").unwrap();
        assert_eq!(*values, [String::new(), "4".to_owned()], "plain DDPG has no horizon");
    }

    #[test]
    fn models_are_named_by_their_ablation_on_all_tasks() {
        let labels = |models: &[(&str, &str)]| -> Vec<String> {
            let folder = tempfile::tempdir().unwrap();
            for (n, (task, model)) in models.iter().enumerate() {
                let config = RunConfig::new(Arc::new(mge_task::load(task).unwrap()));
                let config = config.with_setting("epsilon", "0.1").unwrap().with_setting("prior", model).unwrap();
                RunDirectory::create(folder.path().join(n.to_string()), &config).unwrap();
            }
            let runs = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap();
            runs.iter().map(|run| run.trained.row.label()).collect()
        };
        let [whole, ablated] = ["full", "absolute"].map(|model| format!("DDPG-MGE, epsilon 0.1, model {model}"));
        let models = [
            ("task1", "m/bucket-box.safetensors"),
            ("task1", "m/bucket-box-absolute.safetensors"),
            ("task3", "m/square-floor.safetensors"),
            ("task3", "m/square-floor-absolute.safetensors"),
        ];
        assert_eq!(labels(&models), [whole.clone(), ablated.clone(), whole, ablated]);
        let same_name = labels(&[("task1", "m/a.safetensors"), ("task1", "n/a.safetensors")]);
        let expected = ["m", "n"].map(|folder| format!("DDPG-MGE, epsilon 0.1, model {folder}/a.safetensors"));
        assert_eq!(same_name, expected);
    }
}
