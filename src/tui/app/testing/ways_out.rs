//! What a panic leaves of the terminal, in a real one: the test starts itself again, in a
//! pseudo-terminal, as a program that takes the terminal and panics.

use std::io::Read;

use portable_pty::CommandBuilder;
use ratatui::widgets::Paragraph;

use super::pseudo_terminal::Terminal;
use crate::tui::terminal::{Screen, take_panics};

fn start(test: &str) -> Terminal {
    let mut command = CommandBuilder::new(std::env::current_exe().unwrap());
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
#[ignore = "the program of the test below"]
fn program_whose_screen_panics() {
    let mut screen = Screen::open(true).unwrap();
    show(&mut screen, "before the panic");
    wait_for_a_key();
    panic!("on purpose");
}

#[test]
fn a_panic_of_the_screen_restores_the_terminal_and_then_tells() {
    let mut terminal = start("program_whose_screen_panics");
    terminal.wait_for("before the panic");
    terminal.wait_until_taken();
    terminal.type_text(" ");
    assert_eq!(terminal.wait_for_exit(), 101);
    terminal.wait_until_restored();
    terminal.wait_for("on purpose");
}

#[test]
#[ignore = "the program of the test below"]
fn program_with_a_thread_that_panics() {
    let mut screen = Screen::open(true).unwrap();
    show(&mut screen, "before the panic");
    wait_for_a_key();
    let worker = std::thread::Builder::new().name("worker".to_owned());
    assert!(worker.spawn(|| panic!("on purpose")).unwrap().join().is_err());
    show(&mut screen, &format!("alive: {}", take_panics().join("; ")));
    wait_for_a_key();
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
}
