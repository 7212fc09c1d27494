//! The form that starts a training: the settings of the next run, what each means, and what the runs will cost.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::Ui;
use super::edit::tool_text;
use crate::tui::effect::Effect;
use crate::tui::layers::{DEFAULT, Field, Form, some_of};
use crate::tui::view::{ModelSummary, RunSummary, comparable, cost_of_an_episode, span};
use crate::tui::widgets::text_input::TextInput;
use mge_base::json;
use mge_base::text::counted;
use mge_trainer::{Method, RunConfig, StopRule, non_default_settings, warnings};
use mge_workbench::{Command, OF_RUN, check_settings, free_name, usual_name};

/// The fields, the beginnings of the commands that set them, and their explanations.
const FIELDS: [(&str, &str, &str); 9] = [
    ("method", "method", "Left and right choose how it explores and learns."),
    ("episodes", "set episodes", "Episodes of each run."),
    ("seeds", "", "Number of runs, which differ in the seed only and are shown as one group."),
    ("first seed", "seed", "It determines everything random."),
    (
        "epsilon",
        "set epsilon",
        "How often actions come from the action clusters: 0.1, linear:0.8:0.05:2000, exp:0.8:0.05:0.999, \
         step:0.8:0.5:500, points:0=0.8,1000=0.3, need:0.25:0.25:10. Emptied: the method's default.",
    ),
    ("model", "model", "Left and right choose what predicts the rollouts behind the action clusters."),
    (
        "success",
        "set stop.success",
        "Success rate of the last 100 episodes at which a run is finished, such as 0.8; none plays all episodes.",
    ),
    ("minutes", "set stop.minutes", "Minutes after which a run stops; it can be continued. None sets no limit."),
    ("name", "", "The folder of the run."),
];
/// Their places.
const METHOD: usize = 0;
const EPISODES: usize = 1;
const SEEDS: usize = 2;
const SEED: usize = 3;
const EPSILON: usize = 4;
const MODEL: usize = 5;
const SUCCESS: usize = 6;
const MINUTES: usize = 7;
const NAME: usize = 8;

/// The form, with the settings of the session and a number of seeds.
pub fn form(ui: &Ui, seeds: u32) -> Form {
    let view = ui.view;
    let mut fields: Vec<Field> = FIELDS.map(|(name, ..)| Field { name, ..Field::default() }).into();
    fields[0].input = TextInput::new(view.settings.method.to_string());
    fields[0].choices = Method::ALL.map(|method| method.to_string()).into();
    for (place, text) in [(EPSILON, DEFAULT), (SUCCESS, "none"), (MINUTES, "none")] {
        fields[place].emptied = text;
    }
    fields[MODEL].choices = view.models.iter().map(|model| model.name.clone()).collect();
    let (runs, models) = (view.runs.clone(), view.models.clone());
    let (settings, folder) = (view.settings.clone(), view.folder.clone());
    let (before, runs_folder) = (settings.clone(), folder.clone());
    let tool = tool_text(&settings.task.placeable.tool([0.0; 2]), true);
    let explain = move |place: usize, texts: &[&str], whole: bool| {
        let settings = chosen(&settings, texts, &models);
        let about = match FIELDS[place] {
            ("method", _, about) => format!("{}. {about}", settings.method.label()),
            (name, ..) if !settings.method.uses(name) => format!("Not used by {}.", settings.method.label()),
            (.., about) => about.to_owned(),
        };
        let value = match place {
            SEEDS => seeds.to_string(),
            NAME => free_name(&runs_folder, &usual_name(&settings), OF_RUN),
            _ if !settings.method.uses(FIELDS[place].0) => "not used".to_owned(),
            _ => value(&settings, place),
        };
        if !whole {
            return [value, String::new()];
        }
        let count = texts[SEEDS].parse().unwrap_or(seeds);
        let cost = cost(&runs, &settings, settings.episodes, count);
        let others = others(&settings);
        let doubts = warnings([(&settings, &BTreeSet::new())]).into_iter().chain(same(&runs, &settings, count));
        let doubts: String = doubts.map(|doubt| format!("\n! {doubt}")).collect();
        [value, format!("{about}\nThe agent places: {tool}.{others}\n{cost}{doubts}")]
    };
    let edited = if view.dirty { "the edited " } else { "" };
    let title = format!("train on {edited}{}", view.task.name);
    let mut form = Form::new(title, fields, explain, move |texts| read(texts, (&before, seeds), &folder));
    form.enter = "start";
    form
}

/// The settings that the fields say. The schedule is the method's default if another method was chosen, or the field
/// was emptied.
fn chosen(before: &RunConfig, texts: &[&str], models: &[ModelSummary]) -> RunConfig {
    let mut settings = match texts[METHOD].parse() {
        Ok(method) if method != before.method => before.with_method(method),
        _ => before.clone(),
    };
    if settings.method != before.method || texts[EPSILON] == DEFAULT {
        settings.epsilon = RunConfig::default_for(settings.task.clone(), settings.method).epsilon;
    }
    // What is wrong with a text is told beside it.
    settings.episodes = texts[EPISODES].parse().unwrap_or(settings.episodes);
    settings.seed = texts[SEED].parse().unwrap_or(settings.seed);
    settings.epsilon = texts[EPSILON].parse().unwrap_or(settings.epsilon);
    if let Some(model) = models.iter().find(|model| model.name == texts[MODEL]) {
        settings.prior = model.source.clone();
    }
    let limit = |text: &str, now| if text.is_empty() { now } else { text.parse().ok() };
    let StopRule { success, minutes } = settings.stop;
    settings.stop = StopRule { success: limit(texts[SUCCESS], success), minutes: limit(texts[MINUTES], minutes) };
    settings
}

/// That runs with the same settings and seeds exist, if so.
pub fn same(runs: &[Arc<RunSummary>], settings: &RunConfig, seeds: u32) -> Option<String> {
    let is_same = |run: &&Arc<RunSummary>| {
        let RunConfig { seed, method, episodes, .. } = *run.config;
        seed.checked_sub(settings.seed).is_some_and(|after| after < seeds.into())
            && (method, episodes) == (settings.method, settings.episodes)
            && *run.config == RunConfig { seed, ..settings.clone() }
    };
    let names: Vec<String> = runs.iter().filter(is_same).map(|run| run.name.clone()).collect();
    (!names.is_empty()).then(|| format!("there are runs with these settings and seeds: {}", some_of(names.into_iter())))
}

/// Sets what the fields say and starts the runs in a folder, given the settings of the session and the usual seeds.
fn read(texts: &[&str], (before, seeds): (&RunConfig, u32), folder: &Path) -> Result<Effect, String> {
    if texts[NAME].contains(['/', '\\']) || texts[NAME].starts_with('.') {
        return Err(format!("`{}` is not a name: it has no / and does not begin with a dot", texts[NAME]));
    }
    let RunConfig { method, epsilon, .. } = chosen(before, texts, &[]);
    let is_kept = !method.uses("epsilon") || epsilon == before.with_method(method).epsilon;
    let default = if is_kept { String::new() } else { epsilon.to_string() };
    let mut texts = texts.to_vec();
    if ["", DEFAULT].contains(&texts[EPSILON]) {
        texts[EPSILON] = &default;
    }
    let set = FIELDS.iter().zip(&texts).filter(|((_, verb, _), text)| !verb.is_empty() && !text.is_empty());
    let lines = set.map(|((_, verb, _), text)| format!("{verb} {}", shell_words::quote(text)));
    let mut lines: Vec<String> = lines.filter(|line| *line != format!("method {}", before.method)).collect();
    let count = if texts[SEEDS].is_empty() { &*seeds.to_string() } else { texts[SEEDS] };
    let with_seeds = if count == "1" { String::new() } else { format!("seeds {count}") };
    let place = folder.join(texts[NAME]).display().to_string();
    let place = if texts[NAME].is_empty() { "".into() } else { shell_words::quote(&place) };
    lines.push(format!("train {place} {with_seeds}"));
    let parsed = lines.iter().map(|line| Command::parse(line).map_err(|error| error.to_string()));
    let commands: Vec<Command> = parsed.filter_map(Result::transpose).collect::<Result<_, String>>()?;
    check_settings(before, folder, &commands).map_err(|error| error.to_string())?;
    let seeds = count.parse().unwrap_or(1);
    Ok(Effect::new(move |app| {
        app.apply_all(commands)?;
        app.seeds = seeds;
        Ok(())
    }))
}

/// The settings without a field that are not the method's defaults, as a line; empty if there are none.
fn others(settings: &RunConfig) -> String {
    let is_field = |key: &str| key == "prior" || FIELDS.iter().any(|(_, verb, _)| verb.ends_with(key));
    let others = non_default_settings(settings).into_iter().filter(|(key, _)| !is_field(key));
    let others: Vec<String> = others.map(|(key, value)| format!("{key} {value}")).collect();
    if others.is_empty() { String::new() } else { format!("\nAlso set: {}.", others.join(", ")) }
}

/// The value of a field in settings.
fn value(settings: &RunConfig, place: usize) -> String {
    let verb = FIELDS[place].1;
    let mut all = json::to_value(settings);
    let value = json::at_mut(&mut all, verb.trim_start_matches("set ")).filter(|_| verb != "model");
    value.map_or_else(|| settings.prior.place(), |value| json::text(value).trim_end_matches(".0").to_owned())
}

/// What runs with these settings will cost together, from the latest ones.
fn cost(runs: &[Arc<RunSummary>], settings: &RunConfig, episodes: u32, seeds: u32) -> String {
    let measured = comparable(runs, &settings.task.name, settings.method, episodes.into());
    let all = format!("{seeds} x {episodes} episodes");
    let Some([actions, seconds]) = cost_of_an_episode(&measured) else {
        return format!("{all}: no run has got far enough to tell what they cost");
    };
    let (episodes, known) = (f64::from(seeds) * f64::from(episodes), counted(measured.len(), "run"));
    let others = match &measured[0].config {
        config if config.method != settings.method => "of other methods",
        config if config.task.name != settings.task.name => "of this method on other tasks",
        _ => "of this method",
    };
    let (actions, time) = (actions * episodes, span(seconds * episodes));
    format!("{all}: about {actions:.0} charged actions, {time} of training (from {known} {others})")
}
