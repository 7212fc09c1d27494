//! Forks, and two runs side by side.

use std::sync::Arc;

use super::{app, change_run, forked, press, shot, text};
use crate::tui::actions::Tab;

#[test]
fn a_fork_is_asked_for_at_the_crosshair_or_at_the_end_of_the_selected_run() {
    let (mut forking, asked) = app(forked());
    press(&mut forking, "4 left F");
    let screen = text(&shot(&mut forking, 120, 40));
    let episode = forking.subject.past_episode().unwrap();
    assert!(screen.contains(&format!(": fork {episode} ")), "{screen}");
    press(&mut forking, "e p s i l o n = 0 . 1 enter");
    assert_eq!(*asked.borrow(), [format!("fork {episode} epsilon=0.1")]);
    let (mut forking, asked) = app(forked());
    press(&mut forking, "5 home F x enter");
    assert!(text(&shot(&mut forking, 120, 40)).contains("`x` is not KEY=VALUE"));
    press(&mut forking, "backspace enter");
    assert_eq!(*asked.borrow(), ["fork 1200"]);
}

#[test]
fn two_marked_runs_are_shown_with_their_differences_and_an_episode_of_the_watched_one() {
    let (mut app, _) = app(forked());
    press(&mut app, "5 space down down space V");
    assert_eq!(app.tab, Tab::Training);
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains("ddpg.gamma") && screen.contains("fork.run"), "{screen}");
    press(&mut app, "left");
    let number = app.subject.past_episode().unwrap();
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains(&format!("episode {number} of first-at500")), "{screen}");
    press(&mut app, "esc esc 5 esc 4");
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains("training · first-at500"), "the watched run, after its mark was removed\n{screen}");
}

#[test]
fn comparing_two_runs_watches_the_first_if_neither_is_watched() {
    let (mut app, asked) = app(forked());
    press(&mut app, "5 down space down space V");
    assert_eq!(*asked.borrow(), ["open runs/first"]);
    let screen = text(&shot(&mut app, 120, 40));
    assert!(!screen.contains("no setting differs"), "two runs that are not watched are no pair\n{screen}");
    let (mut with_watched, asked) = super::app(forked());
    press(&mut with_watched, "5 space down down space V");
    assert!(asked.borrow().is_empty(), "one of them is watched already: {:?}", asked.borrow());
}

#[test]
fn differences_of_two_runs_take_a_third_of_the_screen_and_are_shortened() {
    let mut view = forked();
    change_run(&mut view, 3, |run| {
        let config = Arc::make_mut(&mut run.config);
        (config.episodes, config.seed) = (1500, 7);
        config.fork.as_mut().unwrap().changes.push("ddpg.tau=0.01".to_owned());
    });
    let (mut app, _) = app(view);
    press(&mut app, "5 space down down space V");
    // Six settings differ, and there are five rows with the names of the runs.
    let screen = text(&shot(&mut app, 60, 20));
    assert!(screen.contains("fork.changes") && screen.contains("1 to 4 of 6: +"), "{screen}");
    assert!(!screen.contains("fork.run") && screen.contains("..tau=0.01"), "{screen}");
    press(&mut app, "+");
    let others = text(&shot(&mut app, 60, 20));
    assert!(others.contains("5 to 6 of 6") && others.contains("fork.run"), "{others}");
    press(&mut app, "+");
    assert_eq!(text(&shot(&mut app, 60, 20)), screen, "after the last page comes the first");
    press(&mut app, "+ esc + + 5 V");
    assert_eq!(text(&shot(&mut app, 60, 20)), screen, "a comparison begins with the first page");
    press(&mut app, "+ 5 space space 4");
    assert_eq!(text(&shot(&mut app, 60, 20)), screen, "so do other marks");
}
