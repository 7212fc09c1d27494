//! Changing screens, palette, help, questions, and requests to the terminal.

use super::*;
use crate::tui::effect::Effect;
use mge_workbench::command;

#[test]
fn screens_are_changed_by_number_and_mouse() {
    let (mut app, _) = app(typical());
    for (keys, tab) in [("4", Tab::Training), ("1", Tab::Scene), ("8 esc", Tab::Log)] {
        press(&mut app, keys);
        assert_eq!(app.tab, tab, "after {keys}");
    }
    shot(&mut app, 120, 40);
    let area = tab(&app, Tab::Figures);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (area.x + 1, area.y));
    assert_eq!(app.tab, Tab::Figures);
}

#[test]
fn the_palette_finds_actions_and_layers_close_one_by_one() {
    check(empty(), ": c l u s t e r s enter", &["clusters"], "");
    check(empty(), ": ? esc", &[], "status");
    check(empty(), "?", &[], "select the next object");
    check(empty(), "? esc", &[], "status");
    check(empty(), ": q u a r r e l space 7 enter", &[], "unknown command `quarrel 7`");
}

#[test]
fn suspending_is_a_request_to_the_terminal() {
    let (mut app, _) = app(empty());
    press(&mut app, "ctrl-z");
    assert_eq!((app.request.take(), app.standing_still()), (Some(TerminalRequest::Suspend), String::new()));
    let (training, _) = super::app(typical());
    assert_eq!(training.standing_still(), "task1-ddpg-mge-seed0: not trained until `fg`");
}

#[test]
fn without_colour_and_braille_screens_are_plain_ascii() {
    let (mut app, _) = app(typical());
    app.theme = Theme::new(Palette::Dark, Depth::None, ASCII);
    for tab in Tab::ALL {
        app.tab = tab;
        let screen = shot(&mut app, 120, 40);
        let odd: String = screen.content.iter().map(|cell| cell.symbol()).filter(|s| !s.is_ascii()).collect();
        assert_eq!(odd, "", "{tab:?}");
        let colours = screen.content.iter().any(|cell| cell.fg != ratatui::style::Color::Reset);
        assert!(!colours, "{tab:?} has colours");
    }
}

#[test]
fn layers_and_hints_accept_clicks() {
    let click = MouseEventKind::Down(MouseButton::Left);
    let (mut app, asked) = app(empty());
    press(&mut app, "o");
    let find = |app: &mut App, what: &str| {
        let screen = text(&shot(app, 120, 40));
        let row = screen.lines().count() - 1 - screen.lines().rev().position(|line| line.contains(what)).unwrap();
        let line = screen.lines().nth(row).unwrap();
        (line[..line.find(what).unwrap()].chars().count() as u16, row as u16)
    };
    let at = find(&mut app, "  task3");
    mouse(&mut app, click, at);
    assert_eq!(*asked.borrow(), ["task task3"]);
    let at = find(&mut app, "t train");
    mouse(&mut app, click, at);
    let at = find(&mut app, "seeds ");
    mouse(&mut app, click, at);
    press(&mut app, "backspace 2 enter");
    assert_eq!(asked.borrow().last().unwrap(), "train seeds 2");
    press(&mut app, ":");
    mouse(&mut app, MouseEventKind::ScrollDown, (60, 20));
    let at = find(&mut app, "redo the undone edit");
    mouse(&mut app, click, at);
    assert!(app.layers.is_empty());
    assert_eq!(asked.borrow().last().unwrap(), "redo");
}

#[test]
fn a_question_is_answered_with_the_mouse() {
    let click = MouseEventKind::Down(MouseButton::Left);
    let (mut app, asked) = app(typical());
    press(&mut app, "x");
    let screen = text(&shot(&mut app, 120, 40));
    let row = screen.lines().position(|line| line.contains("y   stop")).unwrap() as u16;
    mouse(&mut app, click, (60, row + 1));
    assert!(asked.borrow().is_empty() && app.layers.is_empty(), "the answer that cancels");
    press(&mut app, "x");
    shot(&mut app, 120, 40);
    mouse(&mut app, click, (60, row));
    assert_eq!(*asked.borrow(), ["stop"]);
}

#[test]
fn a_long_message_is_shown_in_full_above_the_keys() {
    let (mut app, _) = app(typical());
    app.show_message(Level::Error, format!("{}conclusion", "a long reason ".repeat(10)));
    let screen = text(&shot(&mut app, 80, 24));
    assert!(screen.contains("conclusion") && screen.contains("? help"), "{screen}");
    app.screens.scene.player.playing = true;
    app.tick(std::time::Duration::from_millis(40));
    assert!(text(&shot(&mut app, 80, 24)).contains("conclusion"), "also while an episode is played");
}

#[test]
fn tab_names_are_complete_from_eighty_columns_on_and_do_not_move() {
    let (mut app, _) = app(typical());
    let first = text(&shot(&mut app, 80, 24));
    press(&mut app, "7");
    let other = text(&shot(&mut app, 80, 24));
    let tabs = |screen: &str| screen.lines().next().unwrap().to_owned();
    assert!(tabs(&first).contains("3 Schedule  4 Training") && tabs(&first).ends_with('*'), "{first}");
    assert_eq!(tabs(&first), tabs(&other));
}

#[test]
fn the_help_lists_the_actions_of_the_screen_first_and_is_searched() {
    check(empty(), "? z o o m", &[], "show fewer episodes, larger");
    check(empty(), "4 ?", &[], "show the selected curve alone");
    check(empty(), "? l e g e n d", &[], "show or hide the legend");
    check(empty(), "? r e d o enter", &["redo"], "");
}

#[test]
fn escape_closes_every_layer() {
    for keys in ["?", "? z", ":", ": e", "e", "t", "x", "2 T", "2 T b"] {
        let (mut app, asked) = app(typical());
        press(&mut app, keys);
        assert_eq!(app.layers.len(), 1, "{keys}");
        press(&mut app, "esc");
        assert!(app.layers.is_empty() && asked.borrow().is_empty(), "{keys}");
    }
}

#[test]
fn the_palette_is_navigated_and_leaves_the_screen_below_it_as_it_is() {
    check(empty(), ": enter", &[], "");
    check(empty(), ": down enter", &[], "train on task1");
    check(typical(), ": down down enter", &["pause"], "");
    check(typical(), ": down down down up enter", &["pause"], "");
    check(empty(), "p", &[], "there is no run");
    let (mut app, _) = app(typical());
    let before = shot(&mut app, 80, 24);
    press(&mut app, ": e p s i");
    let after = shot(&mut app, 80, 24);
    assert!(text(&after).lines().nth(19).unwrap().starts_with('╰'), "the lower border");
    assert_eq!(before.content[20 * 80..], after.content[20 * 80..]);
    check(typical(), ": pagedown pageup down enter", &["pause"], "");
}

#[test]
fn layers_stay_during_playback_and_disappear_without_room() {
    let (mut app, _) = app(typical());
    app.screens.scene.player.playing = true;
    press(&mut app, "5 /");
    for _ in 0..2 {
        assert!(text(&shot(&mut app, 120, 40)).contains("show runs with"));
        app.tick(std::time::Duration::from_millis(40));
    }
    assert!(!text(&shot(&mut app, 40, 5)).contains("show runs with"));
    app.event(Event::Paste("0".to_owned()));
    assert!(app.changed, "pasted text must be drawn");
}

#[test]
fn an_effect_that_fails_skips_the_rest() {
    let (mut app, asked) = app(typical());
    app.carry_out(vec![Effect::new(|_| Err("refused".to_owned())), Effect::apply(command::Stop)]);
    assert!(asked.borrow().is_empty() && app.message().contains("refused"));
}

#[test]
fn a_prompt_shows_the_end_of_its_line_and_an_error_until_the_line_changes() {
    check(typical(), "5 / o > enter", &[], "`o` is no column or setting");
    check(typical(), "5 / o > enter backspace", &[], "words or regexes, task:4");
    check(empty(), "W", &[], ": save my-task1.json");
    let (mut app, _) = app(typical());
    press(&mut app, "5 /");
    app.event(Event::Paste("-long".repeat(30) + "-end"));
    assert!(text(&shot(&mut app, 120, 40)).contains("-long-end"));
}

#[test]
fn questions_accept_letters_too() {
    let (mut app, asked) = app(typical());
    press(&mut app, "x q");
    assert_eq!(app.layers.len(), 1, "the key that leaves is no answer");
    press(&mut app, "n");
    assert!(app.layers.is_empty() && asked.borrow().is_empty());
    check(typical(), "x w", &[], "stop 1 run?");
}

#[test]
fn a_click_accepts_a_completion_also_below_an_error() {
    let (mut app, _) = app(typical());
    let place = |app: &mut App, what: &str| {
        let screen = text(&shot(app, 120, 40));
        let row = screen.lines().position(|line| line.contains(what));
        (60, row.unwrap_or_else(|| panic!("{what} is not on\n{screen}")) as u16)
    };
    press(&mut app, ": s e t space d d p g . g a enter");
    place(&mut app, "a value is missing");
    let at = place(&mut app, "  ddpg.gamma");
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    place(&mut app, ": set ddpg.gamma ");
    // A click on a row that was drawn before the text was typed.
    press(&mut app, "ctrl-u s e t space d");
    shot(&mut app, 120, 40);
    press(&mut app, "d p g . g a");
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (60, 20));
    place(&mut app, ": set ddpg.ga");
    check(empty(), ": down down t r a i n enter", &[], "train on task1");
}

#[test]
fn what_a_selected_line_of_the_palette_has_no_room_for_is_below_it() {
    let (mut app, _) = app(empty());
    press(&mut app, ": t a s k space down");
    let screen = text(&shot(&mut app, 80, 24));
    assert!(screen.contains("away from the bucket below it."), "{screen}");
}

#[test]
fn the_list_of_keys_tells_where_one_is_and_has_pages_and_an_end() {
    let (mut app, _) = app(empty());
    let all = crate::tui::actions::entries().len();
    for (key, place) in [
        ("?", " 1-37".to_owned()),
        ("pagedown", " 1-37".to_owned()),
        ("pagedown", "-74".to_owned()),
        ("end", format!("-{all}")),
        ("home", " 1-37".to_owned()),
    ] {
        press(&mut app, key);
        let screen = text(&shot(&mut app, 120, 40));
        assert!(screen.contains(&format!("{place} of {all} ")), "{key}: {screen}");
    }
}
