//! A program in a real pseudo-terminal: types, reads the screen, and checks how the program leaves the terminal. Every
//! wait is for a condition, checked whenever the program writes; the limits allow for a busy machine.

use std::io::{Read, Write};
use std::num::NonZero;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, SlavePty, native_pty_system};
use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};

/// The folder of the tests' cache of models, instead of the user's. Unit tests have none, and train no models.
const FOLDER: Option<&str> = option_env!("CARGO_TARGET_TMPDIR");

/// Longest wait for a condition.
const PATIENCE: Duration = Duration::from_secs(120);

type Parser = vt100::Parser<Answers>;

/// A program in a pseudo-terminal, and its screen.
pub struct Terminal {
    /// `None` once the terminal is closed.
    master: Option<Box<dyn MasterPty + Send>>,
    reader: Option<JoinHandle<()>>,
    closing: Arc<AtomicBool>,
    /// Kept open, so that the line modes can be read after the program has ended.
    _slave: Box<dyn SlavePty + Send>,
    writer: Arc<Mutex<Box<dyn Write + Send>>>,
    child: Box<dyn Child + Send + Sync>,
    screen: Arc<Watched>,
    before: String,
}

/// The screen, with a notification when the program has written something.
struct Watched {
    parser: Mutex<Parser>,
    /// The latest output of the program, at least the last megabyte.
    written: Mutex<Vec<u8>>,
    news: Condvar,
}

/// Answers the program's queries: the position of the cursor, the status and the attributes of the terminal.
struct Answers {
    attributes: &'static str,
    due: Vec<u8>,
}

impl vt100::Callbacks for Answers {
    fn unhandled_csi(
        &mut self,
        screen: &mut vt100::Screen,
        first: Option<u8>,
        _: Option<u8>,
        parameters: &[&[u16]],
        kind: char,
    ) {
        match (first, parameters, kind) {
            (None, [[6]], 'n') => {
                let (row, column) = screen.cursor_position();
                self.due.extend(format!("\x1b[{};{}R", row + 1, column + 1).bytes());
            }
            (None, [[5]], 'n') => self.due.extend(b"\x1b[0n"),
            (None, _, 'c') => self.due.extend(self.attributes.bytes()),
            _ => {}
        }
    }
}

impl Terminal {
    /// Starts a program in a terminal of 120 columns and 40 rows, which answers a request for primary device attributes
    /// with `attributes`.
    pub fn start(mut command: CommandBuilder, attributes: &'static str) -> Self {
        let pair = native_pty_system().openpty(size(120, 40)).unwrap();
        let before = modes(&*pair.master);
        command.env("TERM", "xterm-256color");
        if let Some(folder) = FOLDER {
            command.env("XDG_CACHE_HOME", format!("{folder}/cache"));
        }
        for name in ["TERM_PROGRAM", "KITTY_WINDOW_ID", "VTE_VERSION", "TMUX", "NO_COLOR", "MGE_THEME", "MGE_RUNS"] {
            command.env_remove(name);
        }
        let child = pair.slave.spawn_command(command).unwrap();
        let answers = Answers { attributes, due: Vec::new() };
        let parser = Parser::new_with_callbacks(lines(40), lines(120), 0, answers);
        let screen = Arc::new(Watched { parser: Mutex::new(parser), written: Mutex::default(), news: Condvar::new() });
        let writer = Arc::new(Mutex::new(pair.master.take_writer().unwrap()));
        let reader = pair.master.try_clone_reader().unwrap();
        let (shown, answering) = (Arc::clone(&screen), Arc::clone(&writer));
        let closing = Arc::new(AtomicBool::new(false));
        let closed = Arc::clone(&closing);
        let reader = Some(thread::spawn(move || follow(reader, &shown, &answering, &closed)));
        Self { master: Some(pair.master), reader, closing, _slave: pair.slave, writer, child, screen, before }
    }

    fn parser(&self) -> MutexGuard<'_, Parser> {
        self.screen.parser.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until a condition holds. `what` describes it if it never does.
    pub fn wait_until(&self, what: &str, mut holds: impl FnMut(&vt100::Screen) -> bool) {
        let start = Instant::now();
        let mut parser = self.parser();
        while !holds(parser.screen()) {
            assert!(start.elapsed() < PATIENCE, "waited for {what} on\n{}", parser.screen().contents());
            // Line modes and files change without output, so check again from time to time.
            let woken = self.screen.news.wait_timeout(parser, Duration::from_millis(100));
            parser = woken.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Waits until the screen shows a text.
    pub fn wait_for(&self, text: &str) {
        self.wait_until(&format!("`{text}`"), |screen| screen.contents().contains(text));
    }

    /// Waits until the program has written these bytes, which the screen need not show.
    pub fn wait_until_written(&self, bytes: &str) {
        let bytes = bytes.as_bytes();
        self.wait_until(&format!("{bytes:?}"), |_| {
            let written = self.screen.written.lock().unwrap();
            written.windows(bytes.len()).any(|window| window == bytes)
        });
    }

    /// The latest output of the program.
    pub fn written(&self) -> String {
        String::from_utf8_lossy(&self.screen.written.lock().unwrap()).into_owned()
    }

    /// Types a text, which may have control characters.
    pub fn type_text(&self, text: &str) {
        self.type_bytes(text.as_bytes());
    }

    /// Types bytes.
    pub fn type_bytes(&self, bytes: &[u8]) {
        let mut writer = self.writer.lock().unwrap();
        writer.write_all(bytes).unwrap();
        writer.flush().unwrap();
    }

    /// Changes the size of the terminal.
    pub fn resize(&self, columns: u16, rows: u16) {
        self.parser().screen_mut().set_size(lines(rows), lines(columns));
        self.master.as_ref().unwrap().resize(size(columns, rows)).unwrap();
    }

    /// Closes the terminal, as by closing its window, even if the program writes all the time.
    pub fn hang_up(&mut self) {
        self.closing.store(true, Ordering::Release);
        self.reader.take().unwrap().join().unwrap();
        *self.writer.lock().unwrap() = Box::new(std::io::sink());
        self.master = None;
    }

    fn modes(&self) -> Option<String> {
        self.master.as_deref().map(|master| modes(master))
    }

    /// Sends the program a signal, such as `TERM`.
    pub fn signal(&self, signal: &str) {
        let id = self.child.process_id().unwrap().to_string();
        assert!(Command::new("kill").args([format!("-{signal}"), id]).status().unwrap().success());
    }

    /// Waits until a signal has stopped the program: if it were continued earlier, it would stop afterwards.
    pub fn wait_until_stopped(&self) {
        let process = Pid::from_raw(self.process() as i32).unwrap();
        let options = WaitIdOptions::STOPPED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        self.wait_until("the program to stop", |_| waitid(WaitId::Pid(process), options).unwrap().is_some());
    }

    /// The program's process number.
    pub fn process(&self) -> u32 {
        self.child.process_id().unwrap()
    }

    /// Waits for the program's end and returns its exit status.
    pub fn wait_for_exit(&mut self) -> u32 {
        let start = Instant::now();
        let mut killer = self.child.clone_killer();
        let (ended, end) = std::sync::mpsc::channel::<()>();
        let watchdog = thread::spawn(move || {
            if end.recv_timeout(PATIENCE) == Err(std::sync::mpsc::RecvTimeoutError::Timeout) {
                let _ = killer.kill();
            }
        });
        let status = self.child.wait().unwrap();
        drop(ended);
        watchdog.join().unwrap();
        assert!(start.elapsed() < PATIENCE, "it did not end:\n{}", self.parser().screen().contents());
        status.exit_code()
    }

    /// Waits until line modes, screen, cursor, mouse and paste are as before the program.
    pub fn wait_until_restored(&self) {
        self.wait_until("the terminal to be restored", |screen| {
            self.modes().as_ref() == Some(&self.before)
                && !screen.alternate_screen()
                && !screen.hide_cursor()
                && !screen.bracketed_paste()
                && screen.mouse_protocol_mode() == vt100::MouseProtocolMode::None
        });
    }

    /// Waits until the program has set up the terminal for its screen.
    pub fn wait_until_taken(&self) {
        self.wait_until("the program's screen", |screen| {
            self.modes().as_ref() != Some(&self.before) && screen.alternate_screen() && screen.bracketed_paste()
        });
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // Only a failed test leaves the program running.
        let _ = self.child.kill();
    }
}

/// Shows the program's output and answers its queries, until it ends or the terminal is closed.
fn follow(
    mut reader: Box<dyn Read + Send>,
    screen: &Watched,
    writer: &Mutex<Box<dyn Write + Send>>,
    closing: &AtomicBool,
) {
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = reader.read(&mut bytes) {
        if closing.load(Ordering::Acquire) {
            return;
        }
        let mut written = screen.written.lock().unwrap();
        written.extend(&bytes[..count]);
        if written.len() > 2 << 20 {
            written.drain(..1 << 20);
        }
        drop(written);
        let mut parser = screen.parser.lock().unwrap_or_else(PoisonError::into_inner);
        parser.process(&bytes[..count]);
        let answers = std::mem::take(&mut parser.callbacks_mut().due);
        drop(parser);
        screen.news.notify_all();
        if !answers.is_empty() {
            let mut writer = writer.lock().unwrap();
            let _ = writer.write_all(&answers).and_then(|()| writer.flush());
        }
    }
}

fn size(cols: u16, rows: u16) -> PtySize {
    PtySize { rows, cols, pixel_width: cols * 8, pixel_height: rows * 16 }
}

fn lines(count: u16) -> NonZero<u16> {
    NonZero::new(count).unwrap()
}

fn modes(master: &dyn MasterPty) -> String {
    format!("{:?}", master.get_termios())
}
