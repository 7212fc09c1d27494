//! What keys do with the selected line of the list, and with the list itself.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::super::Ui;
use super::bulk::on_each;
use super::line::Line;
use super::{Runs, columns, filter, list};
use crate::tui::actions::Tab;
use crate::tui::effect::Effect;
use crate::tui::layers::{Form, Value};
use crate::tui::view::{Level, RunSummary};
use mge_base::text::counted;
use mge_run::{Notes, RunDirectory};
use mge_workbench::{Command, command};

/// What an action does with the selected line.
pub fn on_line(state: &mut Runs, ui: &Ui, act: fn(&mut Runs, &Ui, &Line) -> Vec<Effect>) -> Vec<Effect> {
    let lines = list::lines(state, ui);
    match lines.get(state.selected_row(&lines)) {
        Some(line) => act(state, ui, line),
        None => vec![Effect::info("there is no run")],
    }
}

/// Watches a run, or the first of a group, and reports where it is shown.
pub fn watch(_: &mut Runs, ui: &Ui, line: &Line) -> Vec<Effect> {
    let run = line.runs[0];
    let places = ui.text(
        "{screen-training} shows its curves, {screen-scene} its episodes ({previous-episode} and {next-episode})",
    );
    let text = format!("watching {}: {places}", run.name);
    vec![Effect::apply(command::Open(run.path.clone())), Effect::message(Level::Good, text)]
}

/// Marks or unmarks the runs of a line.
pub fn mark(state: &mut Runs, ui: &Ui, line: &Line) -> Vec<Effect> {
    let runs = &line.runs;
    state.page = 0;
    if runs.iter().all(|run| state.is_marked(run)) {
        runs.iter().for_each(|run| _ = state.marked.remove(&run.path));
        return Vec::new();
    }
    state.marked.extend(runs.iter().map(|run| run.path.clone()));
    let together = ui.text("actions apply to all of them; {compare-runs} shows their curves together");
    vec![Effect::info(format!("{} marked: {together}", state.marked.len()))]
}

/// Unfolds or folds a group: that of the selected line, or the one that its run belongs to.
pub fn fold(state: &mut Runs, ui: &Ui, line: &Line) -> Vec<Effect> {
    let (lines, run) = (list::lines(state, ui), &line.runs[0].path);
    let Some(row) = lines.iter().position(|line| line.group.is_some() && line.has(run)) else {
        return vec![Effect::info("a group of runs that differ in the seed only can be folded")];
    };
    let runs: Vec<&PathBuf> = lines[row].runs.iter().map(|run| &run.path).collect();
    if runs.iter().any(|run| state.unfolded.contains(*run)) {
        runs.into_iter().for_each(|run| _ = state.unfolded.remove(run));
    } else {
        state.unfolded.extend(runs.into_iter().cloned());
    }
    state.select_of(&lines, row);
    Vec::new()
}

/// Shows the marked runs together, or else those of a line. If there are two, one is watched, to show its episodes.
pub fn compare(state: &mut Runs, ui: &Ui, line: &Line) -> Vec<Effect> {
    state.page = 0;
    let mut told = None;
    if state.marked.is_empty() {
        state.marked.extend(line.runs.iter().map(|run| run.path.clone()));
        let text = ui.text("{back} on the Runs screen removes the marks");
        told = Some(Effect::info(format!("{} marked, to be compared: {text}", counted(line.runs.len(), "run"))));
    }
    let watch = match state.acted_on(ui).as_slice() {
        [first, second] if !ui.is_watched(first) && !ui.is_watched(second) => Some(first.path.clone()),
        _ => None,
    };
    let show = Effect::call(|app| {
        app.screens.curves.comparing = true;
        app.show(Tab::Training);
    });
    watch.map(|path| Effect::apply(command::Open(path))).into_iter().chain([show]).chain(told).collect()
}

/// How to act on a single run.
pub const SINGLE: &str = "{fold-group} shows the runs of a group, {mark-run} unmarks";

/// What an action does with a single run; otherwise says that only such can be `done`.
fn on_single(runs: &[&RunSummary], ui: &Ui, done: &str, act: impl FnOnce(&RunSummary) -> Vec<Effect>) -> Vec<Effect> {
    match runs {
        [run] => act(run),
        _ => vec![Effect::info(ui.text(&format!("only a single run can be {done}: {SINGLE}")))],
    }
}

/// Plays the greedy policy of a run.
pub fn evaluate(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    on_single(runs, ui, "evaluated", |run| on_each([(run, command::Evaluate.into())].into_iter()))
}

/// Opens the palette with the command that forks a run, at the past episode that is shown.
pub fn fork(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    on_single(runs, ui, "forked", |run| {
        let past = ui.subject.past_episode().filter(|_| ui.is_watched(run));
        vec![Effect::palette(format!("fork {}", past.unwrap_or(run.done)))]
    })
}

/// The command that sets a text of the run in a folder.
type SetText = fn(PathBuf, String) -> Command;

/// Asks for a text of runs, which is taken as it is typed, unless another program has written one meanwhile.
fn ask(runs: &[&RunSummary], [what, hint]: [&str; 2], text: fn(&RunSummary) -> &str, set: SetText) -> Vec<Effect> {
    let now = |folder: &Path| RunDirectory::at(folder).notes().unwrap_or_default();
    let before: Vec<(PathBuf, Notes)> = runs.iter().map(|run| (run.path.clone(), now(&run.path))).collect();
    let texts: BTreeSet<&str> = runs.iter().map(|run| text(run)).collect();
    let differ = texts.len() > 1;
    let text = if differ { String::new() } else { texts.into_iter().collect() };
    let which = if let [run] = runs { run.name.clone() } else { counted(runs.len(), "run") };
    let title = format!("{what} {which}");
    let read = move |text: &str| {
        if differ && text.is_empty() {
            return Err("they differ: a text replaces all of them, none changes nothing".to_owned());
        }
        let (before, text, which) = (before.clone(), text.to_owned(), which.clone());
        Ok(Effect::new(move |app| {
            let mut found = before.iter().map(|(folder, before)| (now(folder), before));
            if let Some((Notes { name, note, .. }, _)) = found.find(|(now, before)| now != *before) {
                let written = [name, note].join(" ");
                return Err(format!("another program has written `{}`: close this and open it again", written.trim()));
            }
            before.iter().try_for_each(|(folder, _)| app.try_apply(set(folder.clone(), text.clone())))?;
            if before.len() > 1 {
                app.show_message(Level::Good, format!("{text}: {which}"));
            }
            Ok(())
        }))
    };
    vec![Effect::open(Form::prompt(title, hint, text, read))]
}

/// Asks for the note on runs.
pub fn edit_note(runs: &[&RunSummary], _: &Ui) -> Vec<Effect> {
    let set = |folder, text| command::Note { folder, text }.into();
    ask(runs, ["note on", "no text removes it"], |run| &run.note, set)
}

/// Asks for the name of runs.
pub fn rename(runs: &[&RunSummary], _: &Ui) -> Vec<Effect> {
    let set = |folder, name| command::Rename { folder, name }.into();
    ask(runs, ["name of", "no text: that of its folder"], |run| &run.name, set)
}

/// Asks which columns are shown.
pub fn ask_for_columns(state: &Runs) -> Vec<Effect> {
    let completions = columns::known().map(|[name, about]| Value::new(name, about)).collect();
    let read = |text: &str| {
        let words = text.split_whitespace();
        words.clone().try_for_each(|word| filter::check(columns::known().map(|[name, _]| name), word))?;
        let chosen: Vec<String> = words.map(str::to_owned).collect();
        Ok(Effect::call(|app| app.screens.runs.columns = chosen))
    };
    let hint = "columns and settings, such as success ddpg.gamma epsilon; nothing: those that fit";
    let prompt = Form::prompt("show columns", hint, state.columns.join(" "), read);
    vec![Effect::open(prompt.completing(completions))]
}

/// Asks which runs are listed, and lists them as one types.
pub fn ask_for_filter(state: &Runs, ui: &Ui) -> Vec<Effect> {
    let list = |filter: filter::Filter| {
        Effect::call(|app| {
            let runs = &mut app.screens.runs;
            if runs.filter.text != filter.text {
                (runs.filter, runs.selected, runs.row) = (filter, None, 0);
            }
        })
    };
    let read = move |text: &str| filter::Filter::parse(text).map(list);
    let lines: Vec<String> = ui.view.runs.iter().map(|run| filter::line(run)).collect();
    let live = move |text: &str| filter::Filter::begun(text, &lines).map(list);
    let hint = "words or regexes, task:4 method:ddpg-mge state:running note:paper epsilon<0.2 success>=50% seed=3";
    let prompt = Form::prompt("show runs with", hint, &*state.filter.text, read);
    vec![Effect::open(prompt.completing(filter::completions(ui)).live(live))]
}
