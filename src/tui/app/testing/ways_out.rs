//! The state of the terminal after a panic, and bursts of input, in a pseudo-terminal: each test starts the test
//! executable again as a program that takes over the terminal.

use std::io::Read;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use crossterm::event::{Event, KeyCode};
use portable_pty::CommandBuilder;
use ratatui::widgets::Paragraph;

use super::pseudo_terminal::Terminal;
use crate::tui::terminal::{Input, Received, Screen, take_panics};

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

#[test]
#[ignore = "run as a program by the test below"]
fn program_that_counts_what_arrives() {
    let mut screen = Screen::open(true).unwrap();
    let (_bell, wake) = UnixStream::pair().unwrap();
    let mut input = Input::new(wake);
    let (mut keys, mut reports, mut pasted) = (0, 0, 0);
    loop {
        show(&mut screen, &format!("keys {keys}, reports {reports}, pasted {pasted}."));
        let mut received = Vec::new();
        assert!(input.wait(Duration::from_secs(600), &mut received).unwrap());
        for received in received {
            match received {
                Received::Event(Event::Key(key)) if key.code == KeyCode::Char('q') => return,
                Received::Event(Event::Key(_)) => keys += 1,
                Received::Event(Event::Mouse(_)) => reports += 1,
                Received::Event(Event::Paste(text)) => pasted += text.len(),
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
    terminal.type_text(&"a".repeat(BURST));
    terminal.wait_for("keys 65536, reports 0, pasted 0.");
    let report = "\x1b[<35;10;5M";
    let count = BURST.div_ceil(report.len());
    terminal.type_text(&report.repeat(count));
    terminal.wait_for(&format!("keys 65536, reports {count}, pasted 0."));
    terminal.type_text(&format!("\x1b[200~{}\x1b[201~", "b".repeat(BURST)));
    terminal.wait_for(&format!("keys 65536, reports {count}, pasted 65536."));
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}
