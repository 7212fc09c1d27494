//! What surrounds the screens: tabs, messages, keys, and terminals too small for a screen.

use std::sync::Arc;

use ratatui::style::Modifier;

use super::{app, empty, press, shot, text, typical};
use crate::tui::actions::Tab;
use crate::tui::effect::Effect;
use crate::tui::screens::HitRegion;
use crate::tui::view::Level;
use mge_workbench::command;

/// The smallest screen, less one column or one row.
const TOO_SMALL: [(u16, u16); 2] = [(59, 20), (60, 19)];

#[test]
fn a_terminal_too_small_in_one_direction_says_so() {
    let (mut app, asked) = app(typical());
    assert!(text(&shot(&mut app, 60, 20)).contains("? help"));
    for (width, height) in TOO_SMALL {
        let screen = text(&shot(&mut app, width, height));
        assert!(screen.contains(&format!("terminal too small: {width}x{height}, at least 60x20")), "{screen}");
    }
    press(&mut app, "p");
    assert!(asked.borrow().is_empty(), "nothing unseen is done");
    shot(&mut app, 60, 20);
    press(&mut app, "p");
    assert_eq!(*asked.borrow(), ["pause"]);
}

#[test]
fn a_run_that_has_ended_does_not_keep_a_command_from_the_others() {
    let (mut app, asked) = app(typical());
    let effects = vec![Effect::new(|_| Err("it has ended".to_owned())), Effect::apply(command::Pause)];
    assert_eq!(Effect::each(effects).carry_out(&mut app), Err("it has ended".to_owned()));
    assert_eq!(*asked.borrow(), ["pause"]);
}

#[test]
fn a_message_takes_at_most_a_third_of_the_screen_and_covers_nothing() {
    let (mut app, _) = app(typical());
    let mut panels = |text_shown: &str| {
        app.show_message(Level::Error, text_shown.to_owned());
        text(&shot(&mut app, 80, 24)).lines().take(21).map(str::to_owned).collect::<Vec<_>>()
    };
    let still = panels("short");
    assert!(panels(&"two lines ".repeat(12)) == still && panels(&"three lines ".repeat(16)) != still);
    app.show_message(Level::Error, "a long reason ".repeat(75));
    let screen = text(&shot(&mut app, 80, 24));
    let rows = screen.lines().filter(|line| line.contains("a long reason")).count();
    assert!(rows == 8 && screen.contains("╰") && screen.contains("? help"), "the screen above is whole\n{screen}");
}

#[test]
fn only_the_tab_of_the_screen_is_highlighted() {
    let (mut app, _) = app(typical());
    for (key, tab) in (1..).zip(Tab::ALL) {
        press(&mut app, &key.to_string());
        let screen = shot(&mut app, 120, 40);
        let highlighted = app.regions.iter().filter_map(|(area, region)| match region {
            HitRegion::Tab(tab) if screen[(area.x, area.y)].modifier.contains(Modifier::REVERSED) => Some(*tab),
            _ => None,
        });
        assert_eq!(highlighted.collect::<Vec<_>>(), [tab]);
    }
}

#[test]
fn the_name_of_the_task_is_shown_at_a_distance_from_the_tabs() {
    let first_line = |name: &str| {
        let mut view = empty();
        Arc::make_mut(&mut view.task).name = name.to_owned();
        let (mut app, _) = app(view);
        let screen = shot(&mut app, 120, 40);
        let is_tab = |region: &HitRegion| matches!(region, HitRegion::Tab(_));
        let tabs = app.regions.iter().filter(|(_, region)| is_tab(region)).map(|(area, _)| area.right()).max();
        (text(&screen).lines().next().unwrap().to_owned(), 120 - usize::from(tabs.unwrap()))
    };
    let (_, room) = first_line("task1");
    // A space follows the name.
    assert!(!first_line(&"n".repeat(room - 1)).0.contains("nn"), "no column is left between them");
    assert!(first_line(&"n".repeat(room - 2)).0.ends_with(&"n".repeat(room - 2)));
}

#[test]
fn a_key_and_its_word_in_the_last_line_can_be_clicked() {
    let (mut app, _) = app(typical());
    let screen = shot(&mut app, 120, 40);
    let hints = app.regions.iter().filter(|(_, region)| matches!(region, HitRegion::Hint(_)));
    let hints: Vec<_> = hints.map(|(area, _)| *area).collect();
    assert!(hints.len() > 3);
    for area in hints {
        let is_blank = |x: u16| x >= 120 || screen[(x, area.y)].symbol() == " ";
        assert!(!is_blank(area.x) && !is_blank(area.right() - 1) && is_blank(area.right()), "{area:?}");
    }
}
