//! Forks, and two runs side by side.

use std::sync::Arc;

use super::{app, change_run, forked, press, shot, text, watch};
use crate::tui::actions::Tab;
use crate::tui::app::App;

fn names(app: &mut App) -> Vec<String> {
    let screen = text(&shot(app, 200, 60));
    let is_name = |word: &&str| word.starts_with("first") || *word == "other";
    let rows = screen.lines().skip(3).take(4);
    rows.filter_map(|row| row.split_whitespace().find(is_name).map(str::to_owned)).collect()
}

#[test]
fn forks_are_listed_below_their_origin_in_every_order() {
    let (mut app, _) = app(forked());
    press(&mut app, "5");
    assert_eq!(names(&mut app), ["other", "first", "first-at500", "first-at500-at700"]);
    press(&mut app, "s S");
    assert_eq!(names(&mut app), ["other", "first", "first-at500", "first-at500-at700"], "by name, reversed");
    // A fork whose origin is not listed is not indented below another run.
    press(&mut app, "/ a t 5 0 0 enter");
    assert_eq!(names(&mut app), ["first-at500", "first-at500-at700"]);
    let (mut app, _) = app_of_a_ring();
    press(&mut app, "5");
    assert_eq!(names(&mut app).len(), 4, "runs that name each other as origin are listed once");
}

fn app_of_a_ring() -> (App, std::rc::Rc<std::cell::RefCell<Vec<String>>>) {
    let mut view = forked();
    let mut config = (*view.runs[1].config).clone();
    config.fork = Some(crate::trainer::Fork {
        run: "first-at500-at700".into(),
        episode: 1,
        changes: Vec::new(),
        tasks: Vec::new(),
    });
    change_run(&mut view, 1, |run| run.config = Arc::new(config));
    app(view)
}

#[test]
fn a_fork_is_asked_for_at_the_crosshair_or_at_the_end_of_the_selected_run() {
    let (mut forking, asked) = app(forked());
    press(&mut forking, "4 left F");
    let screen = text(&shot(&mut forking, 120, 40));
    let episode = forking.subject.past_episode().unwrap();
    assert!(screen.contains(&format!("> {episode}")) && screen.contains("fork first-at500"), "{screen}");
    press(&mut forking, "e p s i l o n = 0 . 1 enter");
    assert_eq!(*asked.borrow(), [format!("fork {episode} epsilon=0.1")]);
    let (mut forking, asked) = app(forked());
    press(&mut forking, "5 home F x enter");
    assert!(text(&shot(&mut forking, 120, 40)).contains("`x` is not KEY=VALUE"));
    press(&mut forking, "backspace enter");
    assert_eq!(*asked.borrow(), ["open runs/other", "fork 300"]);
}

#[test]
fn two_marked_runs_are_shown_with_their_differences_and_the_same_episode_of_both() {
    let (mut app, _) = app(forked());
    press(&mut app, "5 down space down space V");
    assert_eq!(app.tab, Tab::Training);
    let screen = text(&shot(&mut app, 200, 60));
    assert!(screen.contains("ddpg.gamma") && screen.contains("fork.run"), "{screen}");
    press(&mut app, "left");
    let number = app.subject.past_episode().unwrap();
    let beside = app.subject.beside().unwrap();
    assert_eq!(
        (beside.number, beside.run.ends_with("first"), app.subject.run().unwrap().name.as_str()),
        (number, true, "first-at500")
    );
    let screen = text(&shot(&mut app, 200, 60));
    for name in ["first", "first-at500"] {
        assert!(screen.contains(&format!("episode {number} of {name}")), "{name}\n{screen}");
    }
    press(&mut app, "esc esc");
    assert!(app.subject.beside().is_none(), "only past episodes have one beside them");
    press(&mut app, "left v");
    assert!(app.subject.beside().is_none(), "one run alone");
}

#[test]
fn an_episode_missing_from_the_other_run_is_reported() {
    let mut view = forked();
    watch(&mut view, 1);
    let (mut app, _) = app(view);
    press(&mut app, "5 home space down space V left left");
    let beside = app.subject.beside().unwrap();
    assert!(beside.episode.is_err(), "the other run has 300 episodes");
    assert!(text(&shot(&mut app, 120, 40)).contains("other has no episode"));
}

#[test]
fn a_new_comparison_replaces_the_previous_one() {
    let (mut app, _) = app(forked());
    let beside = |app: &App| app.subject.beside().map(|beside| beside.run.clone());
    press(&mut app, "5 down space down space V left");
    assert!(beside(&app).unwrap().ends_with("first"));
    press(&mut app, "5 up space up space V down");
    assert!(beside(&app).unwrap().ends_with("other"));
}

#[test]
fn comparing_two_runs_watches_the_first_if_neither_is_watched() {
    let (mut app, asked) = app(forked());
    press(&mut app, "5 space down space V");
    assert_eq!(*asked.borrow(), ["open runs/first"]);
}
