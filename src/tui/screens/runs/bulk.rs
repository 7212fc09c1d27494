//! Bulk actions: what actions do with the marked runs, or with those of the selected line.

use super::super::Ui;
use crate::tui::effect::Effect;
use crate::tui::layers::{Question, some_of};
use crate::tui::view::RunSummary;
use mge_base::text::counted;
use mge_run::RunState;
use mge_workbench::{Command, command};

/// Pauses runs, or resumes paused ones. Of several, paused ones stay paused unless all are paused.
pub fn pause(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    if let [run] = runs
        && !is_going(run)
    {
        return vec![Effect::info(format!("{} is {}: there is nothing to pause", run.name, run.state_word()))];
    }
    let going = || runs.iter().copied().filter(|run| is_going(run));
    let all_paused = going().all(|run| run.state == RunState::Paused);
    let wanted = going().filter(|run| runs.len() == 1 || all_paused || run.state == RunState::Running);
    let command = |run: &RunSummary| -> Command {
        match run.state {
            RunState::Running => command::Pause.into(),
            _ => command::Resume { until: None }.into(),
        }
    };
    let waits = going().any(|run| run.queued);
    let waits = if waits { "; those that wait begin as cores become free: {stop} prevents it" } else { "" };
    let wanted: Vec<_> = wanted.map(|run| (run, command(run))).collect();
    let going = format!("{} {}", if all_paused { "resuming" } else { "pausing" }, wanted.len());
    let going = if wanted.is_empty() { none_going(runs) } else { going };
    let report = Effect::info(ui.text(&format!("{going}{waits}")));
    on_each(wanted.into_iter()).into_iter().chain(Some(report).filter(|_| runs.len() > 1)).collect()
}

/// Whether a run is queued, being trained or paused.
fn is_going(run: &RunSummary) -> bool {
    run.queued || matches!(run.state, RunState::Running | RunState::Paused)
}

/// Continues runs; of several, not those that are finished and get no more episodes.
pub fn go_on(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let is_over = |run: &&RunSummary| {
        let gets_more = ui.view.extends_to.is_some_and(|episodes| run.config.extends_to(episodes));
        runs.len() > 1 && run.state == RunState::Finished && !run.config.has_more(run.done) && !gets_more
    };
    let (over, others): (Vec<&RunSummary>, Vec<&RunSummary>) = runs.iter().copied().partition(is_over);
    let resumed = |run: &RunSummary| command::Continue { folder: Some(run.path.clone()), until: None };
    let mut effects: Vec<Effect> = others.iter().map(|run| Effect::apply(resumed(run))).collect();
    let mut told = format!("continuing {}", if others.is_empty() { "none".into() } else { names(&others) });
    if !over.is_empty() {
        told = format!("{told}; finished: {} of {}; `:episodes N` sets more episodes", over.len(), runs.len());
    }
    effects.extend(Some(Effect::info(told)).filter(|_| runs.len() > 1));
    effects
}

/// The names of runs, or of some of them and the number of the others.
fn names(runs: &[&RunSummary]) -> String {
    // Several may have one name.
    let folder = |run: &RunSummary| run.given_name().map_or_else(String::new, |_| format!(" ({})", run.folder()));
    some_of(runs.iter().map(|run| run.name.clone() + &folder(run)))
}

/// That no run is being trained or waits for it.
fn none_going(runs: &[&RunSummary]) -> String {
    format!("none of {} is being trained", names(runs))
}

/// Deletes runs after a question, except those that are queued, being trained or paused.
pub fn delete(runs: &[&RunSummary], ui: &Ui) -> Vec<Effect> {
    let (going, ended): (Vec<&RunSummary>, Vec<&RunSummary>) = runs.iter().copied().partition(|run| is_going(run));
    if ended.is_empty() {
        return vec![Effect::info(format!("not ended yet: {}; {}", names(&going), ui.text("{stop} stops it")))];
    }
    let them = if ended.len() > 1 { "them" } else { "it" };
    let undo = ui.text(&format!("{{undo}} here, or `restore`, brings {them} back"));
    let what = names(&ended);
    let mut text = format!("With all files: {what}. To the trash, `.trash` beside them: {undo}, until you empty it.");
    if !going.is_empty() {
        text = format!("{text} Not deleted, because they have not ended: {}.", going.len());
    }
    let title = format!("delete {}?", counted(ended.len(), "run"));
    let delete = Effect::apply(command::Delete(ended.iter().map(|run| run.path.clone()).collect()));
    vec![Effect::open(Question::warning(&title, text, vec![('y', "delete", delete)]))]
}

/// Stops a single run in any state, or those of several runs that are being trained; asks first if any is.
pub fn stop(runs: &[&RunSummary], _: &Ui) -> Vec<Effect> {
    let stopped: Vec<&RunSummary> = runs.iter().copied().filter(|run| runs.len() == 1 || is_going(run)).collect();
    if stopped.is_empty() {
        return vec![Effect::info(none_going(runs))];
    }
    let (title, what) = (format!("stop {}?", counted(stopped.len(), "run")), names(&stopped));
    let text = format!(
        "{what}: in training, after the current episode, with a checkpoint; in the queue, at once. It can be continued \
         later."
    );
    let asks = stopped.iter().any(|run| is_going(run));
    let stop = on_each(stopped.into_iter().map(|run| (run, command::Stop.into())));
    if !asks {
        return stop;
    }
    vec![Effect::open(Question::warning(&title, text, vec![('y', "stop", Effect::all(stop))]))]
}

/// Applies its command to each run.
pub fn on_each<'a>(runs: impl Iterator<Item = (&'a RunSummary, Command)>) -> Vec<Effect> {
    let run = runs.map(|(run, command)| (run.path.clone(), command));
    // One that has ended meanwhile does not keep the command from the others.
    vec![Effect::each(run.map(|(path, command)| Effect::new(move |app| app.apply_to(&path, command))).collect())]
}
