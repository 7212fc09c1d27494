//! The composition of the learning-curve figure.

use crossterm::event::Event;

use super::{app, bring, change_run, grouped, press, shot, text};
use crate::tui::app::App;
use crate::tui::screens::figures;
use crate::tui::view::ViewModel;

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
    let figure = "figure learning figures/learning";
    assert_eq!(exported("7 tab enter enter"), format!("{figure}.png"));
    let composed = |options: &str, key: &str| {
        let (mut app, asked) = app(grouped());
        press(&mut app, "7 tab");
        app.event(Event::Paste(options.to_owned()));
        press(&mut app, "enter");
        let screen = text(&shot(&mut app, 120, 40));
        press(&mut app, key);
        (screen, asked.borrow().concat())
    };
    let (screen, line) = composed("width=single font=7 bands=off", "s");
    assert_eq!(line, format!("{figure}.svg width=single font=7 bands=off"));
    assert!(screen.contains("in a script: figure learning") && screen.contains("width=single"), "{screen}");
    let (_, line) = composed("curve=DDPG name='of before' reference=DDPG", "tab end enter enter");
    assert_eq!(line, format!("{figure}.png curve=DDPG name='of before' reference=DDPG"), "the prompt keeps them");
    for (options, why) in [
        ("width", "write KEY=VALUE"),
        ("widt=single", "`width`?"),
        ("font=x", "not a number"),
        ("file=../a", "without folder"),
        ("file=a.svg", "without folder and suffix"),
        ("curve=DPDG", "did you mean `DDPG`?"),
    ] {
        assert!(composed(options, "").0.contains(why), "{options}");
    }
}

#[test]
fn the_prompt_explains_every_option_and_names_the_curves() {
    let (mut app, _) = app(grouped());
    press(&mut app, "7 tab");
    for (typed, shown) in
        [("wid", "single or double"), ("ban", "on or off"), ("curve=D", "a curve"), ("fi", "name of the figure")]
    {
        app.event(Event::Paste(typed.to_owned()));
        let screen = text(&shot(&mut app, 120, 40));
        assert!(screen.contains(shown), "{shown}\n{screen}");
        press(&mut app, "ctrl-u");
    }
    let completed = exported("7 tab w i d tab s i n tab f i tab m i n e enter enter");
    assert_eq!(completed, "figure learning figures/mine.png width=single");
    let kept = exported("7 tab f i tab m i n e enter tab enter s");
    assert_eq!(kept, "figure learning figures/mine.svg", "the prompt keeps the name");
}

#[test]
fn the_marked_runs_are_composed() {
    let runs = "runs=runs/plain-0 runs=runs/plain-1 runs=runs/plain-2";
    assert_eq!(exported("5 space 7 tab enter enter"), format!("figure learning figures/learning.png {runs}"));
}

#[test]
fn a_picture_is_drawn_again_when_a_run_that_it_shows_has_another_episode() {
    let is_renewed = |keys: &str, run: usize| {
        let (mut app, _) = app(grouped());
        press(&mut app, keys);
        shot(&mut app, 120, 40);
        let wanted = |app: &App| {
            let screens = &app.screens;
            figures::wanted(screens, &app.ui(), &app.regions).unwrap()
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
