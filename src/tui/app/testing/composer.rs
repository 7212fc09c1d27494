//! The composer of the learning-curve figure.

use super::{app, grouped, press, shot, text};

const GUIDED: &str = "DDPG-MGE, epsilon 0.8 to 0.05";

/// The latest export after these keys.
fn exported(keys: &str) -> String {
    let (mut app, asked) = app(grouped());
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
