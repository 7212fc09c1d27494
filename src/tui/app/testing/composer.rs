//! The composer of the learning-curve figure.

use std::sync::Arc;

use crossterm::event::Event;

use super::{app, bring, change_run, grouped, press, run_on, run_summary, shot, text, typical};
use crate::tui::actions::Tab;
use crate::tui::app::App;
use crate::tui::screens::figures;
use crate::tui::view::{RunSummary, ViewModel};
use mge_trainer::Method;

const GUIDED: &str = "DDPG-MGE, epsilon 0.8 to 0.05";

/// The latest export after these keys.
fn exported(keys: &str) -> String {
    exported_of(grouped(), keys)
}

fn exported_of(view: ViewModel, keys: &str) -> String {
    let (mut app, asked) = app(view);
    press(&mut app, keys);
    let asked = asked.borrow();
    asked.iter().rfind(|line| line.starts_with("figure")).cloned().unwrap_or_default()
}

#[test]
fn a_figure_is_composed_and_its_script_line_is_shown() {
    assert_eq!(exported("7 tab enter"), "figure learning figures/task1-learning.png");
    assert_eq!(exported("7 tab right down left down right s"), {
        "figure learning figures/task1-learning.svg width=single font=7 axis=log"
    });
    assert_eq!(exported("7 tab down down down right D"), "figure learning figures/task1-learning.pdf success=greedy");
    let steps = "figure learning figures/task1-learning.png against=steps";
    assert_eq!(exported("7 tab down down down right down right enter"), steps, "evaluations have no steps");
    let reference = exported("7 tab down down down down down right right enter");
    assert_eq!(reference, "figure learning figures/task1-learning.png reference=DDPG");
    let named = exported("7 tab end i ctrl-u o u r s enter { enter");
    assert_eq!(
        named,
        format!("figure learning figures/task1-learning.png curve=DDPG name=ours curve='{GUIDED}'"),
        "the last of two curves, named and moved up"
    );
    assert_eq!(
        exported("7 tab end space enter"),
        format!("figure learning figures/task1-learning.png curve='{GUIDED}'")
    );
    let (mut app, _) = app(grouped());
    shot(&mut app, 120, 40);
    press(&mut app, "7 tab right");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(
        screen.contains("figure learning figures/task1-learning.pdf") && screen.contains("width=single"),
        "{screen}"
    );
    press(&mut app, "end space up space");
    assert!(text(&shot(&mut app, 120, 40)).contains("at least one curve"));
    press(&mut app, "esc");
    assert!(!text(&shot(&mut app, 120, 40)).contains("in a script"), "escape leaves the composer");
    assert_eq!(app.tab, Tab::Figures, "but not the screen");
}

#[test]
fn the_marked_runs_are_composed() {
    let runs = "runs=runs/plain-0 runs=runs/plain-1 runs=runs/plain-2";
    assert_eq!(exported("5 space 7 tab enter"), format!("figure learning figures/task1-learning.png {runs}"));
    let (mut app, asked) = app(grouped());
    press(&mut app, "7 tab end space esc 5 space 7");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("learning"), "{screen}");
    press(&mut app, "enter");
    let expected = format!("figure learning figures/task1-learning.png {runs}");
    assert_eq!(asked.borrow().last(), Some(&expected), "edits of other runs' curves are discarded");
}

#[test]
fn the_learning_figure_is_named_after_the_common_task_of_its_runs() {
    let mut view = grouped();
    view.runs.push(Arc::new(RunSummary { done: 1, ..run_on("task4", "other") }));
    assert_eq!(exported_of(view.clone(), "7 tab enter"), "figure learning figures/learning.png");
    let marked = "figure learning figures/task4-learning.png runs=runs/other";
    assert_eq!(exported_of(view, "5 space 7 tab enter"), marked);
}

#[test]
fn some_options_exclude_each_other_and_curves_keep_their_edits() {
    let figure = "figure learning figures/task1-learning.png";
    let greedy = exported("7 tab down down down down right up right enter");
    assert_eq!(greedy, format!("{figure} success=greedy"), "evaluations have no steps");
    assert_eq!(exported(&format!("7 tab down {} enter", "left ".repeat(40))), format!("{figure} font=4"));
    assert_eq!(exported("7 tab down down down down down left enter"), format!("{figure} reference=DDPG"));
    let renamed = exported("7 tab end i ctrl-u x enter i ctrl-u enter enter");
    assert_eq!(renamed, format!("{figure} curve='{GUIDED}' curve=DDPG"), "an empty name restores the label");
    assert_eq!(exported("7 tab end { space enter"), format!("{figure} curve='{GUIDED}'"), "the moved one is selected");
    let marked = exported("7 tab end { tab 5 space 7 tab enter");
    assert!(!marked.contains("curve="), "{marked}: the curves of other runs are not edited");
}

/// Two groups, and a run of a third method with so many episodes.
fn with_planning(done: u64) -> ViewModel {
    let mut view = grouped();
    let mut planning = run_summary("planning-0");
    planning.done = done;
    Arc::make_mut(&mut planning.config).method = Method::Planning;
    view.runs.push(Arc::new(planning));
    view
}

#[test]
fn a_curve_comes_later_and_stays_selected() {
    let figure = "figure learning figures/task1-learning.png";
    assert_eq!(exported("7 tab end up } enter"), format!("{figure} curve=DDPG curve='{GUIDED}'"));
    assert_eq!(exported("7 tab end up } space enter"), format!("{figure} curve=DDPG"), "the moved one is selected");
    assert_eq!(exported("7 tab end } enter"), figure, "there is no later place");
}

#[test]
fn all_curves_but_one_can_be_left_out() {
    let one = exported_of(with_planning(100), "7 tab end space up space enter");
    assert_eq!(one.matches("curve=").count(), 1, "{one}");
    let still_one = exported_of(with_planning(100), "7 tab end space up space up space enter");
    assert_eq!(still_one, one);
}

#[test]
fn curves_are_numbered_as_they_are_shown() {
    let (mut app, _) = app(grouped());
    press(&mut app, "7 tab");
    let rows = |app: &mut App, numbers: [&str; 2]| {
        let screen = text(&shot(app, 120, 40));
        let rows = [format!("{:>3}        {GUIDED}", numbers[0]), format!("{:>3}        DDPG ", numbers[1])];
        assert!(rows.iter().all(|row| screen.contains(row)), "{numbers:?}: {screen}");
    };
    rows(&mut app, ["1", "2"]);
    press(&mut app, "end up space");
    rows(&mut app, ["-", "1"]);
}

#[test]
fn a_run_without_episodes_has_no_curve_to_compose() {
    for (done, is_listed) in [(0, false), (1, true)] {
        let (mut app, _) = app(with_planning(done));
        press(&mut app, "7 tab");
        let screen = text(&shot(&mut app, 120, 40));
        assert_eq!(screen.contains("planning"), is_listed, "{screen}");
    }
}

#[test]
fn the_composer_is_left_without_leaving_the_screen() {
    for key in ["tab", "esc"] {
        let (mut app, _) = app(grouped());
        press(&mut app, &format!("7 tab {key}"));
        let screen = text(&shot(&mut app, 120, 40));
        assert!(app.tab == Tab::Figures && !screen.contains("compose ·"), "{key}: {screen}");
    }
}

#[test]
fn a_long_name_of_a_curve_is_shortened() {
    let (mut app, _) = app(grouped());
    press(&mut app, "7 tab end i ctrl-u");
    app.event(Event::Paste("x".repeat(60)));
    press(&mut app, "enter");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("x.."), "{screen}");
}

#[test]
fn one_marked_run_is_named_as_such() {
    let (mut app, _) = app(typical());
    press(&mut app, "5 space 7 tab");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("compose · the marked run "), "{screen}");
}

#[test]
fn a_reference_without_a_curve_is_dropped() {
    let reference = "7 tab down down down down down right";
    let kept = exported(&format!("{reference} tab tab enter"));
    assert!(kept.contains(&format!("reference='{GUIDED}'")), "{kept}");
    let marked = exported(&format!("{reference} tab 5 space 7 tab enter"));
    assert!(marked.contains("runs=runs/plain-0") && !marked.contains("reference"), "{marked}");
}

#[test]
fn a_picture_is_drawn_again_when_a_run_that_it_shows_has_another_episode() {
    let is_renewed = |keys: &str, run: usize| {
        let (mut app, _) = app(grouped());
        press(&mut app, keys);
        shot(&mut app, 120, 40);
        let wanted = |app: &App| {
            let screens = &app.screens;
            figures::wanted(&screens.lists, &screens.runs, &app.ui(), &app.regions).unwrap().2
        };
        let before = wanted(&app);
        let mut view = app.workspace.view().clone();
        change_run(&mut view, run, |run| run.done += 1);
        bring(&mut app, view);
        wanted(&app) != before
    };
    // The first run is watched, the last three are marked with the group at the top.
    assert!(is_renewed("7", 0) && !is_renewed("7", 3), "the scene");
    assert!(is_renewed("7 down down", 3), "all runs");
    assert!(is_renewed("5 space 7 down down", 3) && !is_renewed("5 space 7 down down", 1), "the marked runs");
}
