//! Columns of the list of runs, the queue in groups, and the palette.

use super::{app, change_run, grouped, press, shot, text, typical};
use mge_run::RunState;

#[test]
fn columns_can_be_chosen_including_settings_and_reset() {
    let (mut app, _) = app(grouped());
    let heading = |app: &mut crate::tui::app::App| {
        let screen = text(&shot(app, 120, 40));
        screen
            .lines()
            .nth(2)
            .unwrap()
            .split_whitespace()
            .filter(|word| word.bytes().all(|byte| byte.is_ascii_alphabetic()))
            .collect::<Vec<_>>()
            .join(" ")
    };
    press(&mut app, "5");
    assert!(heading(&mut app).starts_with("run state episodes success"), "{}", heading(&mut app));
    press(&mut app, "| ctrl-u s e e d space m e t h o d enter");
    assert!(heading(&mut app).starts_with("run state seed method"), "{}", heading(&mut app));
    assert!(text(&shot(&mut app, 120, 40)).contains("ddpg-mge"));
    press(&mut app, "| ctrl-u s u c e s s enter");
    assert!(text(&shot(&mut app, 120, 40)).contains("`success`?"));
    press(&mut app, "ctrl-u enter");
    assert!(heading(&mut app).starts_with("run state episodes success"), "{}", heading(&mut app));
}

#[test]
fn queued_runs_are_counted_in_their_group_and_in_the_border_of_the_list() {
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
    assert!(screen.contains("1 run, 2 q"), "{screen}");
    // 1000, 1600 and 1700 episodes are left.
    assert!(screen.contains("1 training · 2 queued · 12.5 episodes/s · 5:44 left"), "{screen}");
    press(&mut app, "4");
    assert!(text(&shot(&mut app, 200, 60)).contains("3 of 3 seeds finished"));
    let (mut idle, _) = super::app(grouped());
    press(&mut idle, "5");
    assert!(!text(&shot(&mut idle, 200, 60)).contains("training ·"), "nothing is trained");
    let (mut one, _) = super::app(typical());
    press(&mut one, "4");
    assert!(text(&shot(&mut one, 120, 40)).contains("1 training · 12.5 episodes/s"));
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
