//! Bulk actions: what actions do with the marked runs, or with those of the selected line.

use super::super::Ui;
use super::super::figures::path_of;
use crate::tui::effect::Effect;
use crate::tui::layers::Question;
use crate::tui::view::{Level, RunSummary};
use mge_run::RunState;
use mge_workbench::{Command, FigureKind, command};

/// Number of runs that a question before their deletion names.
const MAX_NAMED: usize = 6;

/// Pauses runs, or resumes paused ones. Of several, paused ones stay paused unless all are paused.
pub fn pause(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let all_paused = runs.iter().all(|run| run.state == RunState::Paused);
    let wanted = runs.iter().filter(|run| runs.len() == 1 || all_paused || run.state == RunState::Running);
    let command = |run: &RunSummary| -> Command {
        match run.state {
            RunState::Paused => command::Resume { until: None }.into(),
            _ => command::Pause.into(),
        }
    };
    on_each(wanted.map(|run| (*run, command(run))), ui)
}

/// Exports the dashboards of runs.
pub fn export(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let what = if let [run] = runs { run.name.clone() } else { format!("{} runs", runs.len()) };
    let dashboard = |run: &&RunSummary| {
        let path = path_of(FigureKind::Dashboard, Some(&run.name), "png");
        let figure = command::Figure::with_defaults(FigureKind::Dashboard, &path);
        [Effect::apply(command::Open(run.path.clone())), Effect::apply(figure)]
    };
    let mut effects: Vec<Effect> = runs.iter().flat_map(dashboard).collect();
    effects.extend(back(ui));
    effects.push(Effect::message(Level::Good, format!("drawing the dashboards of {what} into figures/")));
    effects
}

/// Whether a run is queued, being trained or paused.
fn is_going(run: &RunSummary) -> bool {
    run.queued || matches!(run.state, RunState::Running | RunState::Paused)
}

/// Continues runs; of several, not those that are finished and get no more episodes.
pub fn go_on(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let is_over = |run: &&RunSummary| {
        let gets_more = ui.view.extends_to.is_some_and(|episodes| u64::from(episodes) > run.episodes());
        runs.len() > 1 && run.state == RunState::Finished && run.done >= run.episodes() && !gets_more
    };
    let (over, others): (Vec<&RunSummary>, Vec<&RunSummary>) = runs.iter().copied().partition(is_over);
    let resumed = |run: &RunSummary| command::Continue { folder: Some(run.path.clone()), until: None };
    let mut effects: Vec<Effect> = others.into_iter().map(|run| Effect::apply(resumed(run))).collect();
    if !over.is_empty() {
        let more = ui.text("{episodes} sets more episodes");
        effects.push(Effect::info(format!("finished: {} of {}; {more}", over.len(), runs.len())));
    }
    effects
}

/// Deletes runs after a question, except those that are queued, being trained or paused.
pub fn delete(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let (going, ended): (Vec<&RunSummary>, Vec<&RunSummary>) = runs.iter().copied().partition(|run| is_going(run));
    let what = match (ended.as_slice(), going.as_slice()) {
        ([], [run]) if run.queued => {
            let leave = ui.text("{stop} takes it out of the queue");
            return vec![Effect::info(format!("{} waits for a free core: {leave}", run.name))];
        }
        ([], [run]) => {
            let doing = if run.state == RunState::Paused { "paused" } else { "being trained" };
            return vec![Effect::info(format!("{} is {doing}: {}", run.name, ui.text("{stop} stops it")))];
        }
        ([], _) => return vec![Effect::info(ui.text("none of them has ended: {stop} stops them"))],
        (ended, _) => {
            let names = ended.iter().take(MAX_NAMED).map(|run| run.name.as_str()).collect::<Vec<_>>().join(", ");
            let more = ended.len().saturating_sub(MAX_NAMED);
            if more > 0 { format!("{names} and {more} more") } else { names }
        }
    };
    let undo = ui.text("{undo} here brings back the last one");
    let mut text = format!("With all files: {what}. To the trash, `.trash` beside them: {undo}, until you empty it.");
    if !going.is_empty() {
        text = format!("{text} Not deleted, because they have not ended: {}.", going.len());
    }
    let title = match ended.len() {
        1 => "delete the run?".to_owned(),
        several => format!("delete {several} runs?"),
    };
    let delete = ended.iter().map(|run| Effect::apply(command::Delete(run.path.clone()))).collect();
    vec![Effect::open(Question::warning(&title, text, vec![('y', "delete", Effect::all(delete))]))]
}

/// Stops a single run in any state, or those of several runs that are being trained; asks first if any is.
pub fn stop(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let stopped: Vec<&RunSummary> = runs.iter().copied().filter(|run| runs.len() == 1 || is_going(run)).collect();
    let text = match stopped.as_slice() {
        [] => return vec![Effect::info("none of them is being trained")],
        [run] if run.queued => format!("{} is taken out of the queue. It can be continued later.", run.name),
        [run] => {
            format!("{} ends after the current episode. Its checkpoint is kept: it can be continued later.", run.name)
        }
        runs => format!(
            "{} runs are stopped: those in the queue at once, the others after the current episode. All can be \
             continued later.",
            runs.len()
        ),
    };
    let (title, answer) = match stopped.as_slice() {
        [run] if run.queued => ("leave the queue?", "leave it"),
        [_] => ("stop the training?", "stop"),
        _ => ("stop the runs?", "stop"),
    };
    let asks = stopped.iter().any(|run| is_going(run));
    let stop = on_each(stopped.into_iter().map(|run| (run, command::Stop.into())), ui);
    if !asks {
        return stop;
    }
    vec![Effect::open(Question::warning(title, text, vec![('y', answer, Effect::all(stop))]))]
}

/// Opens each run and applies its command. After several runs, the watched run is opened again.
fn on_each<'a>(runs: impl Iterator<Item = (&'a RunSummary, Command)>, ui: &Ui) -> Vec<Effect> {
    let mut effects = Vec::new();
    let mut last_is_watched = true;
    let mut count = 0;
    for (run, command) in runs {
        if !(ui.is_watched(run) && last_is_watched) {
            effects.push(Effect::apply(command::Open(run.path.clone())));
        }
        last_is_watched = ui.is_watched(run);
        effects.push(Effect::apply(command));
        count += 1;
    }
    // A single run stays open.
    if count > 1 && !last_is_watched {
        effects.extend(back(ui));
    }
    effects
}

/// Opens the watched run again.
fn back(ui: &Ui) -> Option<Effect> {
    ui.subject.run().map(|watched| Effect::apply(command::Open(watched.path.clone())))
}
