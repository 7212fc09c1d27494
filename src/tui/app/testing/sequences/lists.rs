//! The Log, Models and Figures screens, by keys and mouse.

use super::*;
use crate::tui::testing::at_noon;
use crate::tui::view::ModelSummary;

fn with_log(lines: usize) -> ViewModel {
    ViewModel { log: (1..=lines).map(|line| at_noon(Level::Info, &format!("line {line}."))).collect(), ..empty() }
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
    check(with_log(60), "8 home", &[], "line 1.");
    check(with_log(60), "8 home end", &[], "line 60.");
}

#[test]
fn a_removed_model_is_no_longer_selected() {
    let mut view = empty();
    let model = |number: u32| ModelSummary { name: format!("models/{number}"), about: "".into(), evaluation: None };
    view.models.extend((0..5).map(model));
    let (mut app, asked) = app(view);
    press(&mut app, "6 end");
    bring(&mut app, empty());
    press(&mut app, "up enter");
    assert_eq!(*asked.borrow(), ["model learned"]);
    check(empty(), "6 end v", &[], "there is nothing to measure");
}

#[test]
fn an_option_of_the_composed_figure_is_selected_with_a_click() {
    let (mut app, asked) = app(grouped());
    press(&mut app, "7 tab");
    shot(&mut app, 120, 40);
    let axis = region(&app, |area, region| matches!(region, HitRegion::Row(2)).then_some((area.x, area.y)));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), axis);
    press(&mut app, "right enter");
    assert_eq!(*asked.borrow(), ["figure learning figures/task1-learning.png axis=log"]);
}
