//! Bulk actions: what actions do with the marked runs, or with those of the selected line.

use super::super::Ui;
use crate::run::RunState;
use crate::tui::actions::UiAction;
use crate::tui::effect::Effect;
use crate::tui::layers::Question;
use crate::tui::view::{Level, RunSummary};
use crate::workbench::{Command, FigureKind, command};

/// Applies an action to runs, after one question if something would be lost.
pub(super) fn act_on_all(runs: &[&RunSummary], ui: &Ui, action: UiAction) -> Vec<Effect> {
    let count = runs.len();
    let what = match runs {
        [run] => run.name.clone(),
        _ => format!("{count} runs"),
    };
    match action {
        UiAction::Pause => {
            // Of several runs, paused ones stay paused unless all are paused.
            let all_paused = runs.iter().all(|run| run.state == RunState::Paused);
            let wanted = runs.iter().filter(|run| count == 1 || all_paused || run.state == RunState::Running);
            let command = |run: &RunSummary| -> Command {
                match run.state {
                    RunState::Paused => command::Resume { until: None }.into(),
                    _ => command::Pause.into(),
                }
            };
            on_each(wanted.map(|run| (*run, command(run))), ui)
        }
        UiAction::Stop => stop(runs, ui),
        UiAction::Continue => {
            let resumed = |run: &&RunSummary| command::Continue { folder: Some(run.path.clone()), until: None };
            runs.iter().map(|run| Effect::apply(resumed(run))).collect()
        }
        UiAction::DeleteRun => {
            let name = if let [run] = runs { run.path.display().to_string() } else { what };
            let text = format!("Everything in {name} is deleted from the disk. This cannot be undone.");
            let delete = runs.iter().map(|run| Effect::apply(command::Delete(run.path.clone()))).collect();
            let title = if count == 1 { "delete the run?" } else { "delete the runs?" };
            vec![Effect::open(Question::warning(title, text, vec![('y', "delete", Effect::All(delete))]))]
        }
        UiAction::Export => {
            let dashboard = |run: &&RunSummary| {
                let path = format!("figures/{}-{}.png", run.name, FigureKind::Dashboard.name()).into();
                let figure = command::Figure::with_defaults(FigureKind::Dashboard, path);
                [Effect::apply(command::Open(run.path.clone())), Effect::apply(figure)]
            };
            let mut effects: Vec<Effect> = runs.iter().flat_map(dashboard).collect();
            effects.extend(back(ui));
            effects.push(Effect::ShowMessage(Level::Good, format!("drawing the dashboards of {what} into figures/")));
            effects
        }
        _ => Vec::new(),
    }
}

/// Stops a single run in any state, or those of several runs that are being trained; asks first if any is.
pub fn stop(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let going = |run: &&RunSummary| run.queued || matches!(run.state, RunState::Running | RunState::Paused);
    let stopped: Vec<&RunSummary> = runs.iter().copied().filter(|run| runs.len() == 1 || going(run)).collect();
    let text = match stopped.as_slice() {
        [] => return vec![Effect::info("none of them is being trained")],
        [run] if run.queued => format!("{} is taken out of the queue. It can be continued later.", run.name),
        [run] => format!(
            "{} ends after the current episode, {} of {}. Its checkpoint is kept: it can be continued later.",
            run.name,
            run.done,
            run.episodes()
        ),
        runs => format!(
            "{} runs are stopped: those in the queue at once, the others after the current episode. All can be \
             continued later.",
            runs.len()
        ),
    };
    let title = match stopped.as_slice() {
        [run] if run.queued => "leave the queue?",
        [_] => "stop the training?",
        _ => "stop the runs?",
    };
    let asks = stopped.iter().any(going);
    let stop = on_each(stopped.into_iter().map(|run| (run, command::Stop.into())), ui);
    if !asks {
        return stop;
    }
    vec![Effect::open(Question::warning(title, text, vec![('y', "stop", Effect::All(stop))]))]
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
        effects.push(Effect::Apply(command));
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
