//! The fuzz target `interface`: the whole workbench as a function of bytes that stand for keys, the mouse and pastes.

use std::time::Duration;

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::app::App;
use super::view::SessionWorkspace;
use super::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_workbench::{Command, Session};

/// Maximum number of frames drawn for one input.
const FRAMES: usize = 12;
/// Resizes the terminal to the next two bytes. Not a valid byte of UTF-8.
const RESIZE: u8 = 0xff;
/// Lets time pass. Not a valid byte of UTF-8.
const WAIT: u8 = 0xfe;
/// An event of the mouse: the next three bytes are its kind, column and row.
const MOUSE: u8 = 0xfd;
/// Pastes the bytes up to the next one like it.
const PASTE: u8 = 0xfc;

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
    let mut app = App::new(Box::new(workspace), theme);
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).expect("it never fails");
    let mut rest = input;
    for _ in 0..FRAMES {
        let end = rest.iter().position(|byte| matches!(*byte, RESIZE | WAIT)).unwrap_or(rest.len());
        for event in events(&rest[..end]) {
            app.event(event);
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

/// Keys by bytes from 0x80.
const KEYS: [KeyCode; 12] = [
    KeyCode::Up,
    KeyCode::Down,
    KeyCode::Left,
    KeyCode::Right,
    KeyCode::Home,
    KeyCode::End,
    KeyCode::PageUp,
    KeyCode::PageDown,
    KeyCode::Delete,
    KeyCode::BackTab,
    KeyCode::F(1),
    KeyCode::F(4),
];
/// What the mouse does by the byte after [`MOUSE`].
const ACTS: [MouseEventKind; 6] = [
    MouseEventKind::Down(MouseButton::Left),
    MouseEventKind::Drag(MouseButton::Left),
    MouseEventKind::Up(MouseButton::Left),
    MouseEventKind::Moved,
    MouseEventKind::ScrollUp,
    MouseEventKind::ScrollDown,
];

/// The events that bytes stand for.
fn events(mut bytes: &[u8]) -> Vec<Event> {
    let key = |code, modifiers| Event::Key(KeyEvent::new(code, modifiers));
    let mut events = Vec::new();
    while let [first, rest @ ..] = bytes {
        bytes = rest;
        events.push(match (*first, rest) {
            (MOUSE, [kind, column, row, after @ ..]) => {
                bytes = after;
                let kind = ACTS[usize::from(*kind) % ACTS.len()];
                let (column, row) = (u16::from(*column), u16::from(*row));
                Event::Mouse(MouseEvent { kind, column, row, modifiers: KeyModifiers::NONE })
            }
            (PASTE, _) => {
                let end = rest.iter().position(|byte| *byte == PASTE).unwrap_or(rest.len());
                bytes = rest.get(end + 1..).unwrap_or_default();
                Event::Paste(String::from_utf8_lossy(&rest[..end]).into_owned())
            }
            (b'\r', _) => key(KeyCode::Enter, KeyModifiers::NONE),
            (b'\t', _) => key(KeyCode::Tab, KeyModifiers::NONE),
            (0x1b, _) => key(KeyCode::Esc, KeyModifiers::NONE),
            (0x7f, _) => key(KeyCode::Backspace, KeyModifiers::NONE),
            (control @ ..0x20, _) => key(KeyCode::Char(char::from(control | 0x60)), KeyModifiers::CONTROL),
            (letter @ 0x20..0x80, _) => key(KeyCode::Char(char::from(letter)), KeyModifiers::NONE),
            (other, _) => key(KEYS[usize::from(other - 0x80) % KEYS.len()], KeyModifiers::NONE),
        });
    }
    events
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
