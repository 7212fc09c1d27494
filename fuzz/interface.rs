//! The fuzz target `interface`: the whole workbench as a function of the bytes that a terminal sends.

use std::time::Duration;

use crossterm::event::Event;
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::app::App;
use super::input::Keymap;
use super::terminal::{Parser, Received};
use super::view::SessionWorkspace;
use super::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_workbench::{Command, Session};

/// Maximum number of frames drawn for one input.
const FRAMES: usize = 12;
/// Resizes the terminal to the next two bytes. Not a valid byte of UTF-8.
const RESIZE: u8 = 0xff;
/// Lets time pass. Not a valid byte of UTF-8.
const WAIT: u8 = 0xfe;

/// Feeds terminal input to a workbench in an empty folder. Commands that could touch files outside the folder
/// are refused.
///
/// # Panics
/// When the workbench has a bug.
pub fn interface(input: &[u8]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut session = Session::on_task("task1", folder.path().join("runs")).expect("a shipped task");
    for line in ["model uniform", "method ddpg", "set ddpg.hidden 4", "set ddpg.replay_capacity 20", "episodes 20"] {
        let command = Command::parse(line).expect("a command").expect("not a comment");
        session.apply(command).expect("the settings are in range");
    }
    let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
    let workspace = SessionWorkspace::new(session).allowing(is_harmless);
    let mut app = App::new(Box::new(workspace), theme, Keymap::default());
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("it never fails");
    let mut parser = Parser::default();
    let mut rest = input;
    for _ in 0..FRAMES {
        let end = rest.iter().position(|byte| matches!(*byte, RESIZE | WAIT)).unwrap_or(rest.len());
        let mut received = Vec::new();
        parser.advance(&rest[..end], &mut received);
        parser.flush(&mut received);
        for received in received {
            // Graphics would depend on the terminal.
            if matches!(received, Received::Event(_) | Received::Background { .. }) {
                app.receive(received);
            }
            // Discard the request to the terminal.
            app.request = None;
            if app.is_leaving() {
                return;
            }
        }
        match rest[end..] {
            [RESIZE, columns, rows, ..] => {
                terminal.backend_mut().resize(u16::from(columns).max(1), u16::from(rows).max(1));
                app.event(Event::Resize(columns.into(), rows.into()));
                rest = &rest[end + 3..];
            }
            [WAIT, ..] => {
                app.tick(Duration::from_millis(700));
                rest = &rest[end + 1..];
            }
            _ => rest = &[],
        }
        app.tick(Duration::from_millis(20));
        terminal.draw(|frame| app.draw(frame)).expect("it never fails");
        if rest.is_empty() {
            return;
        }
    }
}

/// Beginnings of commands that name no file, whatever their arguments.
const HARMLESS: [&str; 19] = [
    "subgoal ",
    "goal ",
    "ball ",
    "tool ",
    "undo",
    "redo",
    "proposal ",
    "seed ",
    "method ",
    "episodes ",
    "epsilon ",
    "set ddpg",
    "pause",
    "resume",
    "stop",
    "watch ",
    "place ",
    "reset",
    "guide",
];
/// Whole commands that name no file.
const LINES: [&str; 7] = ["train", "clusters", "evaluate", "model uniform", "task task1", "task task3", "continue"];

/// Whether a command touches no files outside the folder and does not take long.
fn is_harmless(command: &Command) -> bool {
    let line = command.to_string();
    LINES.contains(&&*line) || HARMLESS.iter().any(|verb| line.starts_with(verb))
}
