//! Background requests to the workspace, and their results.

use std::sync::Arc;
use std::time::Duration;

use super::{SLOW, app, at_noon, bring, change_run, empty, press, shot, text, typical, wanted, watch};
use crate::tui::app::App;
use crate::tui::view::playback::Episode;
use crate::tui::view::{Level, Live, ViewModel};
use mge_run::RunState;

/// An episode of the watched run; number 0 is that of the greedy policy.
fn episode(app: &mut App, number: u64) -> Arc<Episode> {
    let run = app.subject.run().unwrap().path.clone();
    app.workspace.past_episode(&run, number).unwrap().unwrap()
}

fn with_live(episode: Arc<Episode>) -> ViewModel {
    let mut view = typical();
    view.watched.as_mut().unwrap().live = Some(Live { episode, networks: None });
    view
}

#[test]
fn the_runs_screen_requests_what_it_shows() {
    let (mut app, _) = app(typical());
    wanted();
    press(&mut app, "5");
    let first = "task1-ddpg-mge-seed0";
    assert_eq!(wanted(), [format!("curves of {first} old")]);
    press(&mut app, "down");
    assert_eq!(wanted(), [format!("curves of old {first}")], "the selected run first");
}

#[test]
fn the_latest_important_line_of_the_log_is_shown() {
    let (mut app, _) = app(empty());
    let mut view = empty();
    for (level, text) in [(Level::Warning, "first"), (Level::Good, "second"), (Level::Info, "third")] {
        view.log.push(at_noon(level, text));
    }
    view.log_total = 3;
    bring(&mut app, view);
    assert_eq!(app.message(), "second");
}

#[test]
fn a_warning_about_what_was_just_done_follows_its_report() {
    let (mut app, _) = app(empty());
    app.show_message(Level::Good, "forking a at episode 100");
    let warning = at_noon(Level::Warning, "epsilon 0 cripples it");
    bring(&mut app, ViewModel { log: vec![warning.clone()], log_total: 1, ..empty() });
    assert_eq!(app.message(), "forking a at episode 100; ! epsilon 0 cripples it");
    app.show_message(Level::Good, "forking b at episode 100");
    let log = vec![warning.clone(), warning, at_noon(Level::Good, "training in b")];
    bring(&mut app, ViewModel { log, log_total: 3, ..empty() });
    assert_eq!(app.message(), "training in b; ! epsilon 0 cripples it");
}

#[test]
fn leaving_when_idle_asks_once_all_runs_are_paused() {
    let mut view = typical();
    view.dirty = false;
    let (mut app, _) = app(view.clone());
    press(&mut app, "q w");
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    bring(&mut app, view);
    assert!(!app.is_leaving() && text(&shot(&mut app, 120, 40)).contains("leave the workbench?"));
}

#[test]
fn the_greedy_episode_is_shown_once_and_may_be_left() {
    let (mut app, _) = app(typical());
    let mut view = typical();
    view.watched.as_mut().unwrap().greedy = Some(episode(&mut app, 0));
    bring(&mut app, view.clone());
    assert!(app.subject.is_of_run());
    press(&mut app, "esc");
    bring(&mut app, view);
    assert!(!app.subject.is_of_run());
}

#[test]
fn a_player_that_stopped_repeating_moves_on_to_the_latest_episode() {
    let (mut app, _) = app(typical());
    let [first, second, third] = [1, 2, 3].map(|number| episode(&mut app, number));
    bring(&mut app, with_live(first.clone()));
    bring(&mut app, with_live(second));
    assert!(Arc::ptr_eq(&app.subject.episode, &first), "it is played to its end");
    (0..10).for_each(|_| app.screens.scene.player.repeat());
    bring(&mut app, with_live(third.clone()));
    assert!(Arc::ptr_eq(&app.subject.episode, &third));
}

#[test]
fn an_untouched_scene_repeats_until_there_is_no_input_for_long() {
    let (mut app, _) = app(empty());
    let is_moving = |app: &App| app.screens.scene.player.is_moving();
    app.screens.scene.player.playing = true;
    for _ in 0..9 {
        app.tick(Duration::from_secs(20));
        assert!(app.screens.scene.player.step() == 0 && is_moving(&app));
    }
    app.tick(Duration::from_secs(20));
    assert!(!is_moving(&app));
    app.event(crossterm::event::Event::FocusGained);
    assert!(is_moving(&app), "input resumes playback");
}

#[test]
fn an_episode_is_requested_only_of_a_run_that_is_being_trained() {
    let requests = |view: ViewModel| {
        let (mut app, _) = app(view);
        wanted();
        app.tick(Duration::ZERO);
        wanted().iter().filter(|what| *what == "an episode").count()
    };
    assert_eq!(requests(typical()), 1);
    let mut over = typical();
    watch(&mut over, 0);
    assert_eq!(requests(over), 0);
}

#[test]
fn playback_stands_still_while_no_scene_is_shown() {
    let is_played = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, keys);
        app.screens.scene.player.playing = true;
        let before = app.screens.scene.player.step();
        app.tick(Duration::from_millis(400));
        app.screens.scene.player.step() != before
    };
    assert!(is_played("1") && is_played("home 4"), "an episode is shown beside the curves, too");
    assert!(!is_played("4") && !is_played("home 5"));
}

#[test]
fn keys_and_pictures_do_not_wait_for_an_episode_that_takes_long_to_read() {
    let (mut app, _) = app(typical());
    SLOW.set(true);
    press(&mut app, "pageup");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(app.subject.past_episode().is_none() && screen.contains("status"), "{screen}");
    press(&mut app, "4 left left 5 down 1");
    assert!(text(&shot(&mut app, 120, 40)).contains("status"));
    SLOW.set(false);
    app.tick(Duration::ZERO);
    assert_eq!(app.subject.past_episode(), Some(693), "the one asked for last");
}
