//! Columns of the list of runs, the queue in groups, and the palette.

use super::{app, change_run, grouped, press, shot, text, typical};
use mge_run::RunState;

#[test]
fn a_group_has_the_state_of_its_most_urgent_run() {
    let mut view = grouped();
    for place in 3..6 {
        change_run(&mut view, place, |run| {
            run.state = if place == 3 { RunState::Running } else { RunState::NotStarted };
            (run.active, run.queued) = (place == 3, place != 3);
            run.done += if place == 3 { 500 } else { 0 };
        });
    }
    let (mut app, _) = app(view);
    press(&mut app, "5");
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains("1 running"), "{screen}");
}

#[test]
fn the_palette_recalls_commands_and_completes_arguments() {
    let (mut app, asked) = app(typical());
    press(&mut app, ": s e e d space 7 enter : up enter");
    assert_eq!(*asked.borrow(), ["seed 7", "seed 7"]);
    press(&mut app, ": o p e n space o l d down enter");
    assert_eq!(asked.borrow().last().unwrap(), "open old");
    press(&mut app, ": s e t space d d p g . g a");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("ddpg.gamma") && screen.contains("a number from 0"), "{screen}");
}
