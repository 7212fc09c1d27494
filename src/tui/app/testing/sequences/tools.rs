//! Tools: chosen from palettes, changed with keys and the wheel, placed by hand.

use ratatui::style::Modifier;

use super::*;

/// A task with one tool, a ramp, that `backtab` selects.
fn with_ramp() -> ViewModel {
    let mut view = empty();
    let kind = mge_physics::ToolKind::Ramp;
    Arc::make_mut(&mut view.task).tools =
        vec![task::ToolSpec { kind, position: [0.5, 0.5], form: task::Form::default() }];
    view
}

#[test]
fn a_tool_is_found_and_added_clear_of_the_ball() {
    check(empty(), "2 T s e e _ s a w enter enter", &["tool add see_saw 0 0"], "");
    check(empty(), "2 T s e s a w enter enter", &["tool add see_saw 0 0"], "");
    check(empty(), "2 T f a n space 3 4 5 space 6 0 enter", &["tool add fan 0 0 angle=345 force=60"], "");
    check(empty(), "2 T q q enter", &[], "nothing matches");
    check(empty(), "2 T esc", &[], "objects");
    check(empty(), "2 B c a n n o n enter enter", &["placeable cannon"], "");
    let mut view = empty();
    Arc::make_mut(&mut view.task).ball.position = [0.0, 0.05];
    let (mut app, asked) = app(view);
    press(&mut app, "2 T b o x enter enter");
    assert_ne!(asked.borrow()[0], "tool add box 0 0");
    let line = asked.borrow()[0].clone();
    let place = line.strip_prefix("tool add box ").unwrap();
    assert!(place.split(' ').all(|value| value.parse::<f32>().unwrap().abs() < 0.8), "near the middle: {line}");
}

#[test]
fn the_tool_palette_is_navigated_by_keys_and_mouse() {
    let (mut app, asked) = app(empty());
    press(&mut app, "2 T");
    shot(&mut app, 120, 40);
    // A row has six tools: down and right lead from the first to the eighth, a circle.
    press(&mut app, "down right pagedown pageup end home down right enter enter");
    assert_eq!(*asked.borrow(), ["tool add circle 0 0"]);
    press(&mut app, "T");
    let screen = text(&shot(&mut app, 120, 40));
    let (row, line) = screen.lines().enumerate().find(|(_, line)| line.contains("square")).unwrap();
    let column = line.split("square").next().unwrap().chars().count();
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), (column as u16, row as u16 - 1));
    press(&mut app, "enter");
    assert_eq!(asked.borrow().last().unwrap(), "tool add square 0 0");
    press(&mut app, "T");
    shot(&mut app, 120, 40);
    mouse(&mut app, MouseEventKind::ScrollDown, (60, 20));
    press(&mut app, "enter enter");
    assert_eq!(asked.borrow().last().unwrap(), "tool add trampoline 0 0");
}

#[test]
fn the_properties_of_a_tool_are_stepped_and_typed() {
    check(with_ramp(), "2 backtab )", &["tool set 1 size=16.5"], "");
    check(with_ramp(), "2 backtab (", &["tool set 1 size=15.5"], "");
    check(with_ramp(), "2 backtab", &[], "at x 0.50, y 0.50: arrows or the mouse move it");
    check(with_ramp(), "2 backtab E backspace backspace backspace 3 enter", &[], "is not KEY=VALUE");
    let typed = "tool set 1 size=16 angle=0 radius=1 elasticity=0.5 friction=7";
    check(with_ramp(), "2 backtab E backspace backspace 7 enter", &[typed], "");
    check(with_ramp(), "2 E", &[], "no tool is selected");
    let mut view = with_ramp();
    Arc::make_mut(&mut view.task).tools[0].kind = mge_physics::ToolKind::Cannon;
    check(view, "2 backtab )", &["tool set 1 angle=75"], "");
}

#[test]
fn the_wheel_turns_the_selected_tool() {
    let (mut app, asked) = app(with_ramp());
    press(&mut app, "2");
    let at = cell(&mut app, [0.5, 0.5]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), at);
    assert_eq!(app.screens.scene.selected(), Some(Object::Part(task::Part::Tool(0))));
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    assert_eq!(asked.borrow().last().unwrap(), "tool set 1 angle=15");
}

#[test]
fn other_parts_of_a_level_are_selected_and_moved() {
    let mut view = empty();
    view.task = Arc::new(task::load("create/Obstacle").unwrap());
    let [x, y] = view.task.marker.as_ref().unwrap().ball.position;
    let (mut app, asked) = app(view);
    press(&mut app, "2");
    let at = cell(&mut app, [x, y]);
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), at);
    mouse(&mut app, MouseEventKind::Up(MouseButton::Left), at);
    press(&mut app, ") delete");
    assert!(app.message().contains("can only be removed in its file"), "{}", app.message());
    press(&mut app, "right");
    assert_eq!(*asked.borrow(), [format!("part move marker {} {y}", ((x + 0.01) * 1000.0).round() / 1000.0)]);
}

#[test]
fn levels_are_in_the_list_of_tasks() {
    check(empty(), "o s e s a w enter", &["task create/Seesaw"], "");
}

#[test]
fn the_wheel_turns_no_tool_while_another_is_in_hand() {
    let (mut app, asked) = app(with_ramp());
    let at = cell(&mut app, [0.5, 0.5]);
    press(&mut app, "P backtab");
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    assert!(asked.borrow().is_empty(), "{:?}", asked.borrow());
}

#[test]
fn the_tool_palette_has_pages_and_typing_resets_its_selection() {
    // A page has five rows of six tools; the first family is that of the bucket.
    check(empty(), "2 T", &[], "1 of 19: bucket");
    for (keys, place) in [
        ("pagedown", "31 of "),
        ("pagedown pagedown pageup", "31 of "),
        ("right right left", "2 of "),
        ("down down up", "7 of "),
    ] {
        let (mut app, _) = app(empty());
        press(&mut app, "2 T r a m p enter");
        shot(&mut app, 120, 40);
        press(&mut app, keys);
        let screen = text(&shot(&mut app, 120, 40));
        assert!(screen.contains(&format!(" {place}")), "{keys}: {screen}");
    }
    check(empty(), "2 T right right b o x enter enter", &["tool add box 0 0"], "");
}

#[test]
fn the_wheel_changes_the_size_of_a_tool_without_an_angle() {
    let mut view = with_ramp();
    Arc::make_mut(&mut view.task).tools[0].kind = mge_physics::ToolKind::Circle;
    let (mut app, asked) = app(view);
    let at = cell(&mut app, [0.0, 0.0]);
    press(&mut app, "2 backtab");
    shot(&mut app, 120, 40);
    mouse(&mut app, MouseEventKind::ScrollUp, at);
    assert!(asked.borrow().concat().starts_with("tool set 1 size="), "{:?}", asked.borrow());
}

#[test]
fn a_tool_is_shown_where_it_is_dragged() {
    let (mut app, _) = app(with_ramp());
    let (from, to) = (cell(&mut app, [0.5, 0.5]), cell(&mut app, [-0.5, -0.6]));
    mouse(&mut app, MouseEventKind::Down(MouseButton::Left), from);
    mouse(&mut app, MouseEventKind::Drag(MouseButton::Left), to);
    assert_eq!(shot(&mut app, 120, 40)[to].fg, app.theme.tool);
}

#[test]
fn home_leaves_the_cursor_of_the_tool_palette_at_the_end() {
    check(empty(), "2 T b o home x enter enter", &["tool add box 0 0"], "");
}

#[test]
fn only_the_selected_tool_is_highlighted() {
    let (mut app, _) = app(empty());
    press(&mut app, "2 T right");
    let screen = shot(&mut app, 120, 40);
    // The inside of the palette.
    let cells = (4..31u16).flat_map(|row| (6..114u16).map(move |column| (column, row)));
    let reversed = cells.filter(|at| screen[*at].modifier.contains(Modifier::REVERSED));
    let rows: Vec<u16> = reversed.map(|(_, row)| row).collect();
    assert!(rows.len() == 18 && rows.iter().all(|row| *row == rows[0]), "{rows:?}");
}
