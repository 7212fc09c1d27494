//! The Log, Models and Figures screens, by keys and mouse.

use super::*;
use crate::tui::testing::at_noon;
use crate::tui::view::ModelSummary;

fn with_log(lines: usize) -> ViewModel {
    // The oldest ones are forgotten.
    let log = (1..=lines).map(|line| at_noon(Level::Info, &format!("line {line}."))).skip(lines.saturating_sub(62));
    ViewModel { log: log.collect(), log_total: lines, ..empty() }
}

#[test]
fn the_log_scrolls_by_line_and_page() {
    for (keys, seen) in [("", 60), ("up", 59), ("up up down", 59), ("pageup", 50), ("pageup pageup pagedown", 50)] {
        let (mut app, _) = app(with_log(60));
        press(&mut app, &format!("8 {keys}"));
        let screen = text(&shot(&mut app, 120, 40));
        let after = format!("line {}.", seen + 1);
        assert!(screen.contains(&format!("line {seen}.")) && !screen.contains(&after), "{keys}: {screen}");
    }
    // The first page is full.
    check(with_log(60), "8 home", &[], "line 1.");
    check(with_log(60), "8 home", &[], "line 30.");
    check(with_log(60), "8 home end", &[], "line 60.");
    // Lines that come later do not move those that are read.
    let (mut app, _) = app(with_log(60));
    press(&mut app, "8 pageup");
    shot(&mut app, 120, 40);
    bring(&mut app, with_log(65));
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("line 50.") && !screen.contains("line 51."), "{screen}");
}

#[test]
fn the_log_shows_what_matters_or_lines_with_words() {
    let shown = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, &format!("8 {keys}"));
        let screen = text(&shot(&mut app, 120, 40));
        ["training in runs/task1", "the action clusters are there"].map(|line| screen.contains(line))
    };
    assert_eq!(shown(""), [true, true]);
    assert_eq!(shown("v"), [false, true]);
    assert_eq!(shown("v v"), [false, false]);
    assert_eq!(shown("v v v"), [true, true]);
    assert_eq!(shown("/ S e e d 0 enter"), [true, false]);
    assert_eq!(shown("/ t a s k tab enter"), [true, false], "the run's name is completed");
    assert_eq!(shown("v v esc"), [true, true]);
    check(typical(), "8 v v", &[], "warnings and errors, esc shows all");
    check(typical(), "8 v v", &[], "No line matches. Escape shows all.");
    let failed = ViewModel { log: vec![at_noon(Level::Error, "no such file")], ..empty() };
    check(failed.clone(), "8 / e r r o r enter", &[], "no such file");
    check(failed.clone(), "8 / e r r o r", &[], "with `error`");
    check(failed, "8 / e r r o r esc", &[], "log ───");
}

#[test]
fn a_removed_model_is_no_longer_selected() {
    let mut view = empty();
    let model = |number: u32| ModelSummary {
        name: format!("models/{number}"),
        about: "".into(),
        fits: true,
        ..ModelSummary::default()
    };
    view.models.extend((0..5).map(model));
    view.models[0].fits = false;
    view.models[0].about = "wrong tools: lacks box; 20 launches".to_owned();
    check(view.clone(), "6 home enter", &[], "trained: wrong tools: lacks box");
    let (mut app, asked) = app(view);
    press(&mut app, "6 end");
    bring(&mut app, empty());
    press(&mut app, "up enter");
    assert_eq!(*asked.borrow(), ["model trained"]);
}

#[test]
fn a_log_that_has_become_shorter_is_shown_from_its_first_line() {
    let (mut app, _) = app(with_log(60));
    press(&mut app, "8 home");
    bring(&mut app, with_log(5));
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("line 1.") && screen.contains("line 5."), "{screen}");
}

#[test]
fn a_long_name_of_a_model_leaves_room_for_its_description() {
    let name = format!("models/{}.safetensors", "x".repeat(60));
    let mut view = empty();
    view.models.push(ModelSummary {
        name: name.clone(),
        about: "another".into(),
        fits: true,
        ..ModelSummary::default()
    });
    view.models.push(ModelSummary {
        name: "talkative".into(),
        about: "y".repeat(100),
        fits: true,
        ..ModelSummary::default()
    });
    let (mut app, _) = app(view);
    press(&mut app, "6");
    let screen = text(&shot(&mut app, 120, 40));
    let row = screen.lines().find(|line| line.contains("xx.safetensors")).unwrap();
    assert!(row.contains(" another ") && !screen.contains(&name), "{screen}");
    assert!(screen.contains("yy.."), "a description that does not fit says so\n{screen}");
}
