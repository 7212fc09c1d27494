//! The workbench in a real pseudo-terminal: a whole session, and every way out.
#![cfg(unix)]

use std::io::{Read, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};

/// The program in a pseudo-terminal, with what its screen shows.
struct Terminal {
    master: Box<dyn MasterPty + Send>,
    writer: Box<dyn Write + Send>,
    child: Box<dyn Child + Send + Sync>,
    screen: Arc<Mutex<vt100::Parser>>,
    before: String,
}

impl Terminal {
    fn open(folder: &Path, arguments: &[&str]) -> Self {
        let size = PtySize { rows: 40, cols: 120, pixel_width: 0, pixel_height: 0 };
        let pair = native_pty_system().openpty(size).unwrap();
        let before = modes(&*pair.master);
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_mge"));
        command.args(arguments);
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        let child = pair.slave.spawn_command(command).unwrap();
        let screen = Arc::new(Mutex::new(vt100::Parser::new(lines(40), lines(120), 0)));
        let mut reader = pair.master.try_clone_reader().unwrap();
        let writer = pair.master.take_writer().unwrap();
        let shown = Arc::clone(&screen);
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut bytes) {
                shown.lock().unwrap().process(&bytes[..count]);
            }
        });
        // The slave stays open, so that the modes can still be asked for after the end.
        std::mem::forget(pair.slave);
        Self { master: pair.master, writer, child, screen, before }
    }

    fn contents(&self) -> String {
        self.screen.lock().unwrap().screen().contents()
    }

    fn wait_for(&self, text: &str) {
        self.wait_until(&format!("`{text}`"), |screen| screen.contains(text));
    }

    fn wait_until(&self, what: &str, holds: impl Fn(&str) -> bool) {
        let start = Instant::now();
        while !holds(&self.contents()) {
            assert!(start.elapsed() < Duration::from_secs(90), "waited for {what} on\n{}", self.contents());
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn type_text(&mut self, text: &str) {
        self.writer.write_all(text.as_bytes()).unwrap();
        self.writer.flush().unwrap();
    }

    fn wait_for_exit(&mut self) -> u32 {
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.exit_code();
            }
            assert!(start.elapsed() < Duration::from_secs(60), "it does not end:\n{}", self.contents());
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// The terminal is as it was: line modes, screen, cursor, mouse and paste.
    fn assert_restored(&self) {
        thread::sleep(Duration::from_millis(100));
        assert_eq!(modes(&*self.master), self.before, "the line modes differ");
        let parser = self.screen.lock().unwrap();
        let screen = parser.screen();
        assert!(!screen.alternate_screen(), "still on the alternate screen");
        assert!(!screen.hide_cursor(), "the cursor is hidden");
        assert!(!screen.bracketed_paste(), "paste is still bracketed");
        assert_eq!(screen.mouse_protocol_mode(), vt100::MouseProtocolMode::None, "the mouse is still captured");
    }

    fn signal(&self, signal: &str) {
        let id = self.child.process_id().unwrap().to_string();
        assert!(std::process::Command::new("kill").args([signal, &id]).status().unwrap().success());
    }
}

fn lines(count: u16) -> std::num::NonZero<u16> {
    std::num::NonZero::new(count).unwrap()
}

fn modes(master: &dyn MasterPty) -> String {
    format!("{:?}", master.get_termios().unwrap())
}

#[test]
fn a_whole_session_trains_edits_exports_resizes_and_leaves() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = Terminal::open(folder.path(), &[]);
    terminal.wait_for("welcome, 1/4");
    terminal.type_text("x");
    terminal.wait_for("no episodes yet");
    terminal.type_text(":model true\r");
    terminal.wait_for("model    true");
    terminal.type_text("N\x1540\r");
    terminal.wait_for("trains 40 episodes");
    terminal.type_text("t");
    terminal.wait_for("40/40");
    terminal.wait_for("finished");
    terminal.type_text("\tl");
    terminal.wait_for("(edited)");
    terminal.wait_for("out of date");
    terminal.type_text("f");
    terminal.wait_for("into figures/");
    assert!(folder.path().join("figures/task1-scene.png").is_file());
    assert!(folder.path().join("figures/task1-learning.csv").is_file());
    terminal.master.resize(PtySize { rows: 24, cols: 80, pixel_width: 0, pixel_height: 0 }).unwrap();
    terminal.screen.lock().unwrap().screen_mut().set_size(lines(24), lines(80));
    terminal.wait_until("80 columns", |screen| {
        screen.lines().nth(1).is_some_and(|line| line.chars().count() <= 80 && line.contains("success rate"))
    });
    terminal.type_text("q");
    terminal.wait_for("not saved");
    terminal.type_text("y");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.assert_restored();
}

#[test]
fn signals_end_it_with_the_terminal_restored_and_the_run_checkpointed() {
    for (signal, status) in [("-TERM", 143), ("-INT", 130), ("-HUP", 129)] {
        let folder = tempfile::tempdir().unwrap();
        let mut terminal = Terminal::open(folder.path(), &["--task", "task3"]);
        terminal.wait_for("welcome");
        terminal.type_text("x");
        terminal.type_text(":model uniform\r");
        terminal.wait_for("model    uniform");
        terminal.type_text("t");
        terminal.wait_for("running");
        terminal.signal(signal);
        assert_eq!(terminal.wait_for_exit(), status, "{signal}");
        terminal.assert_restored();
        let run = folder.path().join("runs/task3-ddpg-mge-seed0");
        let log = std::fs::read_to_string(run.join("log.txt")).unwrap();
        assert!(log.contains("stopped"), "{log}");
    }
}

#[test]
fn a_stop_and_a_return_keep_the_screen() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = Terminal::open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.signal("-TSTP");
    terminal.wait_until("the shell's screen", |screen| !screen.contains("welcome"));
    terminal.assert_restored();
    terminal.signal("-CONT");
    terminal.wait_for("welcome");
    terminal.type_text("xq");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.assert_restored();
}

#[test]
fn a_wrong_key_file_and_a_missing_terminal_are_one_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("keys"), "trian = t\n").unwrap();
    let run = |arguments: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_mge"))
            .args(arguments)
            .current_dir(folder.path())
            .stdin(std::process::Stdio::null())
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (status, error) = run(&["--keys", "keys"]);
    assert_eq!(status, Some(1));
    assert_eq!(error.lines().count(), 1, "{error}");
    assert!(error.contains("keys:1: there is no action `trian`, did you mean `train`?"), "{error}");
    let (status, error) = run(&[]);
    assert_eq!((status, error.lines().count()), (Some(1), 1), "{error}");
    assert!(error.contains("needs a terminal") && error.contains("mge script"), "{error}");
}
