//! The state of the terminal after a panic, and bursts of input, in a pseudo-terminal: each test starts the test
//! executable again as a program that takes over the terminal.

use std::io::Read;
use std::time::Duration;

use crossterm::event::{Event as Input, KeyCode};
use portable_pty::CommandBuilder;
use ratatui::widgets::Paragraph;

use super::pseudo_terminal::Terminal;
use crate::tui::terminal::events::{Event, listen, read_input};
use crate::tui::terminal::{Notify, Screen, TerminalError, take_held};

fn start(test: &str) -> Terminal {
    start_by(r#"exec "$@""#, test)
}

/// Starts a program by a line of the shell, whose arguments are the program and its arguments.
fn start_by(line: &str, test: &str) -> Terminal {
    let mut command = CommandBuilder::new("sh");
    command.args(["-c", line, "sh"]);
    command.arg(std::env::current_exe().unwrap());
    command.args([&format!("{}::{test}", module_path!().trim_start_matches("mge::")), "--exact", "--ignored"]);
    command.args(["--nocapture", "--test-threads=1"]);
    Terminal::start(command, "\x1b[?62c")
}

fn show(screen: &mut Screen, text: &str) {
    screen.draw(|frame| frame.render_widget(Paragraph::new(text), frame.area())).unwrap();
}

fn wait_for_a_key() {
    std::io::stdin().read_exact(&mut [0]).unwrap();
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_whose_screen_panics() {
    let mut screen = Screen::open(true).unwrap();
    show(&mut screen, "before the panic");
    wait_for_a_key();
    panic!("on purpose");
}

#[test]
fn a_panic_of_the_screen_restores_the_terminal_and_is_then_reported() {
    let mut terminal = start("program_whose_screen_panics");
    terminal.wait_for("before the panic");
    terminal.wait_until_taken();
    terminal.type_text(" ");
    assert_eq!(terminal.wait_for_exit(), 101);
    terminal.wait_until_restored();
    terminal.wait_for("on purpose");
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_with_a_thread_that_panics() {
    let mut screen = Screen::open(true).unwrap();
    show(&mut screen, "before the panic");
    wait_for_a_key();
    let worker = std::thread::Builder::new().name("worker".to_owned());
    assert!(worker.spawn(|| panic!("on purpose")).unwrap().join().is_err());
    show(&mut screen, &format!("alive: {}", take_held().join("; ")));
    wait_for_a_key();
    drop(screen);
    assert!(std::thread::spawn(|| panic!("after the screen")).join().is_err());
}

#[test]
fn a_panic_of_another_thread_leaves_the_screen_alive() {
    let mut terminal = start("program_with_a_thread_that_panics");
    terminal.wait_for("before the panic");
    terminal.type_text(" ");
    terminal.wait_for("alive: thread `worker`");
    terminal.wait_until_taken();
    terminal.type_text(" ");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
    terminal.wait_for("after the screen");
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_that_needs_a_terminal() {
    assert!(matches!(Screen::open(true), Err(TerminalError::NotATerminal)));
}

#[test]
fn a_screen_needs_input_and_output_of_a_terminal_that_is_not_dumb() {
    for line in [r#"exec env TERM=dumb "$@""#, r#"exec "$@" < /dev/null"#, r#"exec "$@" > /dev/null"#] {
        assert_eq!(start_by(line, "program_that_needs_a_terminal").wait_for_exit(), 0, "{line}");
    }
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_that_notifies() {
    let mut screen = Screen::open(false).unwrap();
    screen.notify(Notify::Desktop, "it is done").unwrap();
    show(&mut screen, "notified");
    wait_for_a_key();
}

#[test]
fn notifications_are_requested_of_the_terminal_and_the_mouse_only_if_wanted() {
    let mut terminal = start("program_that_notifies");
    terminal.wait_for("notified");
    terminal.wait_until_written("\x1b]9;mge: it is done\x07");
    terminal.wait_until("no mouse", |screen| screen.mouse_protocol_mode() == vt100::MouseProtocolMode::None);
    terminal.type_text(" ");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_that_does_not_quit() {
    let mut screen = Screen::open(true).unwrap();
    let (_sender, events) = listen().unwrap();
    show(&mut screen, "listening");
    events.recv().unwrap();
    show(&mut screen, "asked to quit");
    std::thread::sleep(Duration::from_secs(600));
}

#[test]
fn a_second_signal_restores_the_terminal_and_ends_the_program() {
    let mut terminal = start("program_that_does_not_quit");
    terminal.wait_for("listening");
    terminal.signal("INT");
    terminal.wait_for("asked to quit");
    // An earlier one would count as the same event.
    std::thread::sleep(mge_base::stop::SAME_SIGNAL * 2);
    terminal.signal("TERM");
    assert_eq!(terminal.wait_for_exit(), 143);
    terminal.wait_until_restored();
}

#[test]
#[ignore = "run as a program by the test below"]
fn program_that_counts_what_arrives() {
    let mut screen = Screen::open(true).unwrap();
    let (sender, events) = listen().unwrap();
    read_input(sender).unwrap();
    let (mut keys, mut reports, mut pasted) = (0, 0, 0);
    loop {
        show(&mut screen, &format!("keys {keys}, reports {reports}, pasted {pasted}."));
        for event in std::iter::once(events.recv().unwrap()).chain(events.try_iter()) {
            match event {
                Event::Input(Ok(Input::Key(key))) if key.code == KeyCode::Char('q') => return,
                Event::Input(Ok(Input::Key(_))) => keys += 1,
                Event::Input(Ok(Input::Mouse(_))) => reports += 1,
                Event::Input(Ok(Input::Paste(text))) => pasted += text.len(),
                other => panic!("{other:?}"),
            }
        }
    }
}

#[test]
fn bursts_of_keys_mouse_reports_and_pastes_all_arrive() {
    const BURST: usize = 1 << 16;
    let mut terminal = start("program_that_counts_what_arrives");
    terminal.wait_for("keys 0, reports 0, pasted 0.");
    // Escape, which could also be the beginning of a sequence.
    terminal.type_text("\x1b");
    terminal.wait_for("keys 1, reports 0, pasted 0.");
    terminal.type_text(&"a".repeat(BURST - 1));
    terminal.wait_for("keys 65536, reports 0, pasted 0.");
    let report = "\x1b[<35;10;5M";
    let count = 80;
    terminal.type_text(&report.repeat(count));
    terminal.wait_for(&format!("keys 65536, reports {count}, pasted 0."));
    terminal.type_text(&format!("\x1b[200~{}\x1b[201~", "b".repeat(BURST)));
    terminal.wait_for(&format!("keys 65536, reports {count}, pasted 65536."));
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}
