//! What pictures the terminal can show, found out without ever waiting for long.
//!
//! The environment names the terminals with kitty's graphics protocol. Sixel is told by
//! the answer to a request for primary device attributes, which nearly every terminal
//! gives at once; one that does not answer in [`PATIENCE`] shows half blocks. An answer
//! that comes later is harmless: the event reader knows it and drops it.

use std::time::Duration;

/// How pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Two blocks a cell, in every terminal.
    HalfBlock,
    /// DEC's sixel graphics.
    Sixel,
    /// Kitty's protocol, with Unicode placeholders.
    Kitty,
}

/// How pictures are shown, and how large a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Graphics {
    /// How.
    pub protocol: Protocol,
    /// Width and height of a cell in pixels.
    pub cell: [u16; 2],
}

/// How long the terminal may take to answer.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_millis(100);
/// A cell's size if nobody says it.
const CELL: [u16; 2] = [8, 16];

impl Default for Graphics {
    fn default() -> Self {
        Self { protocol: Protocol::HalfBlock, cell: CELL }
    }
}

impl Graphics {
    /// What the terminal can show. Asks the terminal, so the screen must be ours and
    /// nobody may read events meanwhile. Also returns what was typed meanwhile.
    pub fn detect() -> (Self, String) {
        let size = crossterm::terminal::window_size().ok();
        let known = size.filter(|size| size.width > 0 && size.height > 0 && size.columns > 0 && size.rows > 0);
        let known = known.map(|size| [size.width / size.columns, size.height / size.rows]);
        if let Some(protocol) = from_env(|name| std::env::var(name).ok()) {
            return (Self { protocol, cell: known.unwrap_or(CELL) }, String::new());
        }
        let answer = Answer::read(&ask(known.is_none()));
        let protocol = if answer.sixel { Protocol::Sixel } else { Protocol::HalfBlock };
        (Self { protocol, cell: known.or(answer.cell).unwrap_or(CELL) }, answer.typed)
    }
}

/// What the environment says: `MGE_GRAPHICS` (`kitty`, `sixel`, `half-block`), or the
/// name of a terminal with kitty's protocol. None if the terminal has to be asked.
fn from_env(variable: impl Fn(&str) -> Option<String>) -> Option<Protocol> {
    let value = |name: &str| variable(name).unwrap_or_default();
    match value("MGE_GRAPHICS").as_str() {
        "kitty" => return Some(Protocol::Kitty),
        "sixel" => return Some(Protocol::Sixel),
        "half-block" => return Some(Protocol::HalfBlock),
        _ => {}
    }
    let term = value("TERM");
    if term == "linux" || term == "dumb" {
        return Some(Protocol::HalfBlock);
    }
    // A multiplexer keeps the variables of the terminal it was started in.
    let inside = term.starts_with("screen") || term.starts_with("tmux");
    let kitty = ["xterm-kitty", "xterm-ghostty"].contains(&term.as_str())
        || !value("KITTY_WINDOW_ID").is_empty()
        || value("TERM_PROGRAM") == "ghostty";
    (kitty && !inside).then_some(Protocol::Kitty)
}

/// Asks for attributes, and for the size of a cell if that is wanted; what came back.
#[cfg(unix)]
fn ask(size: bool) -> Vec<u8> {
    use std::io::Write;
    use std::time::Instant;

    let mut out = std::io::stdout();
    let question: &[u8] = if size { b"\x1b[16t\x1b[c" } else { b"\x1b[c" };
    if out.write_all(question).and_then(|()| out.flush()).is_err() {
        return Vec::new();
    }
    let input = rustix::stdio::stdin();
    let end = Instant::now() + PATIENCE;
    let mut answer = Vec::new();
    while !Answer::is_whole(&answer) {
        let left = end.saturating_duration_since(Instant::now());
        let timeout = rustix::event::Timespec { tv_sec: 0, tv_nsec: i64::from(left.subsec_nanos()) };
        let mut wanted = [rustix::event::PollFd::new(&input, rustix::event::PollFlags::IN)];
        if left.is_zero() || !matches!(rustix::event::poll(&mut wanted, Some(&timeout)), Ok(1..)) {
            break;
        }
        let mut bytes = [0; 256];
        match rustix::io::read(input, &mut bytes) {
            Ok(count @ 1..) => answer.extend(&bytes[..count]),
            _ => break,
        }
    }
    answer
}

#[cfg(not(unix))]
fn ask(_: bool) -> Vec<u8> {
    Vec::new()
}

/// What the terminal answered.
#[derive(Debug, Default, PartialEq)]
struct Answer {
    sixel: bool,
    cell: Option<[u16; 2]>,
    /// What a person typed in between; keys that are no characters are lost.
    typed: String,
}

impl Answer {
    /// Whether the attributes, which come last, are there.
    fn is_whole(bytes: &[u8]) -> bool {
        sequences(bytes).any(|piece| matches!(piece, Piece::Sequence(body) if is_attributes(body)))
    }

    fn read(bytes: &[u8]) -> Self {
        let mut answer = Self::default();
        for piece in sequences(bytes) {
            match piece {
                Piece::Text(text) => answer.typed += &String::from_utf8_lossy(text),
                Piece::Sequence(body) if is_attributes(body) => {
                    let attributes = &body[1..body.len() - 1];
                    answer.sixel = attributes.split(|byte| *byte == b';').any(|attribute| attribute == b"4");
                }
                Piece::Sequence(body) => answer.cell = answer.cell.or_else(|| cell_size(body)),
            }
        }
        answer
    }
}

fn is_attributes(body: &[u8]) -> bool {
    body.starts_with(b"?") && body.ends_with(b"c")
}

/// `6;HEIGHT;WIDTHt`
fn cell_size(body: &[u8]) -> Option<[u16; 2]> {
    let text = std::str::from_utf8(body).ok()?.strip_prefix("6;")?.strip_suffix('t')?;
    let (height, width) = text.split_once(';')?;
    let size = [width.parse().ok()?, height.parse().ok()?];
    (size[0] > 0 && size[1] > 0).then_some(size)
}

enum Piece<'a> {
    /// Typed characters.
    Text(&'a [u8]),
    /// What follows `ESC [`, up to and with its final byte.
    Sequence(&'a [u8]),
}

fn sequences(mut bytes: &[u8]) -> impl Iterator<Item = Piece<'_>> {
    std::iter::from_fn(move || {
        if bytes.is_empty() {
            return None;
        }
        if let Some(body) = bytes.strip_prefix(b"\x1b[") {
            let end = body.iter().position(|byte| (0x40..=0x7e).contains(byte)).map_or(body.len(), |at| at + 1);
            bytes = &body[end..];
            return Some(Piece::Sequence(&body[..end]));
        }
        let skipped = usize::from(bytes[0] == 0x1b);
        let end = bytes[skipped..].iter().position(|byte| *byte == 0x1b).map_or(bytes.len(), |at| at + skipped);
        let text = &bytes[skipped..end];
        bytes = &bytes[end..];
        Some(Piece::Text(text))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_names_terminals_and_is_overruled_by_our_variable() {
        let env = |variables: &'static [(&str, &str)]| {
            from_env(move |name| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(env(&[("TERM", "xterm-kitty")]), Some(Protocol::Kitty));
        assert_eq!(env(&[("TERM", "xterm-256color"), ("TERM_PROGRAM", "ghostty")]), Some(Protocol::Kitty));
        assert_eq!(env(&[("TERM", "tmux-256color"), ("KITTY_WINDOW_ID", "1")]), None);
        assert_eq!(env(&[("TERM", "linux")]), Some(Protocol::HalfBlock));
        assert_eq!(env(&[("TERM", "xterm-kitty"), ("MGE_GRAPHICS", "half-block")]), Some(Protocol::HalfBlock));
        assert_eq!(env(&[("TERM", "xterm-256color")]), None);
    }

    #[test]
    fn answers_are_told_from_what_is_typed() {
        let answer = Answer::read(b"q\x1b[6;20;10t:\x1b[?62;4;22cp");
        assert_eq!(answer, Answer { sixel: true, cell: Some([10, 20]), typed: "q:p".into() });
        assert_eq!(Answer::read(b"\x1b[?64;14c"), Answer::default());
        assert_eq!(Answer::read(b"\x1bOA\x1b"), Answer { typed: "OA".into(), ..Answer::default() });
        assert!(!Answer::is_whole(b"\x1b[?62;4") && Answer::is_whole(b"x\x1b[?62;4c"));
    }
}
