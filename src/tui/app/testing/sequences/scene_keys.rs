//! The Scene screen: playback, overlays and selection, by keys.

use ratatui::style::Color;

use super::*;
use crate::tui::view::Live;
use mge_agent::{Ddpg, DdpgConfig};
use mge_env::Environment;

#[test]
fn playback_is_made_faster_and_slower_and_starts_again() {
    check(empty(), "space >", &[], " speed x8 ");
    check(empty(), "space <", &[], " speed x2 ");
    check(empty(), ">", &[], "stopped · reward 0.00 · speed x8 ");
    check(empty(), "<", &[], "stopped · reward 0.00 · speed x2 ");
    let (mut app, _) = app(empty());
    press(&mut app, ". . .");
    assert_eq!(app.screens.scene.player.step(), 3);
    press(&mut app, "r");
    assert_eq!(app.screens.scene.player.step(), 0);
}

#[test]
fn the_first_episode_is_replayed_from_any_other_of_a_run_that_has_episodes() {
    check(typical(), "pageup home", &[], "episode 1 of 700");
    let mut fresh = typical();
    change_run(&mut fresh, 1, |run| run.done = 0);
    check(fresh, "pageup", &[], "no run with episodes is being watched");
}

#[test]
fn every_overlay_of_an_agent_says_that_none_acts_or_what_it_waits_for() {
    for key in ["b", "i", "g"] {
        check(typical(), key, &[], "no agent acts here");
    }
    let (mut app, _) = app(typical());
    press(&mut app, "2 b I I");
    let screen = text(&shot(&mut app, 80, 24));
    let covered = screen.lines().skip(2).take(20).any(|row| row.contains("no agent"));
    assert!(!covered && screen.contains("· no agent"), "nothing is written over the scene\n{screen}");
    press(&mut app, "1 esc home");
    let screen = text(&shot(&mut app, 80, 24));
    let title = screen.lines().nth(1).unwrap_or_default();
    assert!(title.contains("episode 1 of task") && title.contains("seed0 "), "cut in the middle: {title}");
    check(typical(), "pageup i", &[], "no critic or actor: the checkpoint is being read");
}

#[test]
fn only_an_overlay_that_shows_nothing_is_explained() {
    let message = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, keys);
        app.message()
    };
    assert_eq!(message("a"), "", "there are clusters");
    assert_eq!(message("pageup b"), "", "an agent acts");
    check(empty(), "a", &[], "no action clusters yet");
}

#[test]
fn the_prediction_is_drawn_while_it_is_switched_on() {
    let screen = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, keys);
        text(&shot(&mut app, 120, 40))
    };
    // Two keys that change nothing also remove the message about the episode.
    let without = screen("pageup i i");
    assert_ne!(screen("pageup g"), without);
    assert_eq!(screen("pageup g g"), without);
}

#[test]
fn the_critic_of_a_running_training_colours_the_scene() {
    use rand::SeedableRng;

    let (mut app, _) = app(typical());
    let mut view = typical();
    let episode = app.workspace.past_episode(&view.runs[1].path, 1).unwrap().unwrap();
    let observation = Environment::new(view.task.clone()).observation().len();
    let config = DdpgConfig { hidden: 4, ..DdpgConfig::default() };
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    let networks = Ddpg::new(observation, 2, &config, &mut rng).unwrap();
    view.watched.as_mut().unwrap().live = Some(Live { episode, networks: Some(Arc::new(networks)) });
    bring(&mut app, view);
    let mut coloured = |keys: &str| {
        press(&mut app, keys);
        shot(&mut app, 120, 40).content.iter().filter(|cell| cell.bg != Color::Reset).count()
    };
    let before = coloured("");
    assert!(coloured("b") > before);
    assert_eq!(coloured("b"), before);
}

#[test]
fn objects_are_selected_one_after_the_other_in_both_directions() {
    let (mut app, _) = app(typical());
    let all = app.workspace.view().objects().all();
    press(&mut app, "2");
    for expected in all.iter().rev().chain(all.last()) {
        press(&mut app, "backtab");
        assert_eq!(app.screens.scene.selected(), Some(*expected));
    }
    for expected in &all {
        press(&mut app, "tab");
        assert_eq!(app.screens.scene.selected(), Some(*expected));
    }
}

#[test]
fn proposed_subgoals_are_not_shown_in_past_episodes() {
    let screen = |proposed: bool, keys: &str| {
        let mut view = typical();
        view.proposed.retain(|_| proposed);
        let (mut app, _) = app(view);
        press(&mut app, keys);
        text(&shot(&mut app, 120, 40))
    };
    assert_ne!(screen(true, ""), screen(false, ""));
    assert_eq!(screen(true, "pageup"), screen(false, "pageup"));
}

#[test]
fn a_search_for_subgoals_is_counted_once_their_number_is_known() {
    let mut view = empty();
    view.proposing = Some((3, 50));
    check(view.clone(), "2", &[], "looking for subgoals, proposal 4 of 50");
    view.proposing = Some((0, 0));
    let (mut app, _) = app(view);
    press(&mut app, "2");
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("looking for subgoals") && !screen.contains(", proposal"), "{screen}");
}
