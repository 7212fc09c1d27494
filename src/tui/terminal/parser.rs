//! Parses the bytes of a terminal into events. No byte of an event is lost: incomplete sequences wait
//! for the rest; unknown sequences and strings, such as late replies to another program, are skipped. crossterm's
//! parser is not public, and termina's does not tell whether a sequence is unfinished.

use crossterm::event::{Event, KeyCode, KeyEvent, KeyModifiers, MouseButton, MouseEvent, MouseEventKind};

/// Bytes of a paste after which an event is sent; a longer paste becomes several events.
const MAX_PASTE: usize = 1 << 20;
const PASTE_BEGINS: &[u8] = b"\x1b[200~";
const PASTE_ENDS: &[u8] = b"\x1b[201~";
/// Longest control sequence; anything longer is discarded. Also the length up to which a string is kept.
const MAX_SEQUENCE: usize = 1024;

/// What a terminal sends.
#[derive(Debug, Clone, PartialEq)]
pub enum Received {
    /// A key, a mouse event, a paste or a change of focus.
    Event(Event),
    /// The primary device attributes: whether the terminal supports sixel graphics.
    Attributes { sixel: bool },
    /// Width and height of a cell in pixels.
    CellSize([u16; 2]),
    /// Whether the background is light.
    Background { light: bool },
}

/// The parser's state between two reads.
#[derive(Debug, Default)]
pub struct Parser {
    /// Bytes not parsed yet.
    buffer: Vec<u8>,
    /// The text so far of an unfinished paste.
    pasted: Option<Vec<u8>>,
    /// An unfinished string: the byte that introduced it, and its beginning. In an 8-bit form the introducer is not
    /// ASCII: 0xc2 if it was encoded in UTF-8, or else the byte itself.
    string: Option<Vec<u8>>,
}

/// What a sequence of bytes begins with.
enum Found {
    /// A complete sequence: its length in bytes and its meaning, if it has one.
    Whole(usize, Option<Received>),
    /// An incomplete sequence.
    Partial,
}

impl Parser {
    /// Parses bytes and appends the events to `received`.
    pub fn advance(&mut self, bytes: &[u8], received: &mut Vec<Received>) {
        self.buffer.extend_from_slice(bytes);
        let mut done = 0;
        while done < self.buffer.len() {
            if self.pasted.is_some() || self.string.is_some() {
                let end = if self.pasted.is_some() { self.paste(done, received) } else { self.string(done, received) };
                let Some(after) = end else { return };
                done = after;
                continue;
            }
            let rest = &self.buffer[done..];
            match rest {
                _ if rest.starts_with(PASTE_BEGINS) => {
                    self.pasted = Some(Vec::new());
                    done += PASTE_BEGINS.len();
                }
                // DCS, SOS, OSC, PM and APC; without a third byte, a key with Alt.
                [0x1b, introducer @ (b'P' | b'X' | b']' | b'^' | b'_'), _, ..] => {
                    self.string = Some(vec![*introducer]);
                    done += 2;
                }
                // The same in 8 bits, which are no key.
                [0xc2, 0x90 | 0x98 | 0x9d..=0x9f, ..] => {
                    self.string = Some(vec![0xc2]);
                    done += 2;
                }
                [introducer @ (0x90 | 0x98 | 0x9d..=0x9f), ..] => {
                    self.string = Some(vec![*introducer]);
                    done += 1;
                }
                [0xc2, 0x9b, ..] => drop(self.buffer.splice(done..done + 2, *b"\x1b[")),
                [0x9b, ..] => drop(self.buffer.splice(done..=done, *b"\x1b[")),
                _ => match find(rest) {
                    Found::Whole(length, meaning) => {
                        received.extend(meaning);
                        done += length;
                    }
                    Found::Partial => break,
                },
            }
        }
        self.buffer.drain(..done);
    }

    /// Continues a paste at an index of the buffer. Returns the index after its end marker; if there is none
    /// yet, the buffer keeps only the bytes that may be the beginning of one.
    fn paste(&mut self, from: usize, received: &mut Vec<Received>) -> Option<usize> {
        let rest = &self.buffer[from..];
        let end = rest.windows(PASTE_ENDS.len()).position(|window| window == PASTE_ENDS);
        let taken = end.unwrap_or(rest.len().saturating_sub(PASTE_ENDS.len() - 1));
        let mut text = self.pasted.take().unwrap_or_default();
        text.extend_from_slice(&rest[..taken]);
        if end.is_some() || text.len() >= MAX_PASTE {
            received.push(Received::Event(Event::Paste(String::from_utf8_lossy(&text).into_owned())));
            text.clear();
        }
        if end.is_some() {
            return Some(from + taken + PASTE_ENDS.len());
        }
        self.pasted = Some(text);
        self.buffer.drain(..from + taken);
        None
    }

    /// Continues a string at an index of the buffer, as [`Self::paste`]. BEL, ST (`ESC \` or 0x9c), CAN or SUB ends it,
    /// and ESC before another byte cuts it off. Only its beginning is kept, so that it may have any length.
    fn string(&mut self, from: usize, received: &mut Vec<Received>) -> Option<usize> {
        let rest = &self.buffer[from..];
        let mut string = self.string.take().unwrap_or_default();
        // Elsewhere 0x9c may be a part of a character.
        let is_raw = string.first().is_some_and(|introducer| (0x90..=0x9f).contains(introducer));
        let ends = |at: &usize| match rest[*at..] {
            [0x07 | 0x18 | 0x1a | 0x1b, ..] | [0xc2] | [0xc2, 0x9c, ..] => true,
            [0x9c, ..] => is_raw,
            _ => false,
        };
        let taken = (0..rest.len()).find(ends).unwrap_or(rest.len());
        let room = MAX_SEQUENCE.saturating_sub(string.len());
        string.extend_from_slice(&rest[..taken.min(room)]);
        match rest[taken..] {
            [] | [0x1b] | [0xc2] => {
                self.string = Some(string);
                self.buffer.drain(..from + taken);
                None
            }
            [0x1b, next, ..] if next != b'\\' => {
                // An empty string is a key with Alt, before a key that sends a sequence.
                if let [introducer @ 0..0x80] = string[..] {
                    received.push(key(KeyCode::Char(char::from(introducer)), KeyModifiers::ALT));
                }
                Some(from + taken)
            }
            [last, ..] => {
                received.extend(reply(&string));
                Some(from + taken + if matches!(last, 0x1b | 0xc2) { 2 } else { 1 })
            }
        }
    }

    /// Whether the beginning of a key, sequence or string has been received; an unfinished paste does not count.
    pub fn is_partial(&self) -> bool {
        self.is_in_string() || (self.pasted.is_none() && !self.buffer.is_empty())
    }

    /// Whether a string is unfinished.
    pub fn is_in_string(&self) -> bool {
        self.string.is_some()
    }

    /// Interprets buffered bytes as complete: an Escape key, or Alt with a character. Gives up an unfinished string.
    pub fn flush(&mut self, received: &mut Vec<Received>) {
        if !self.is_partial() {
            return;
        }
        let bytes = std::mem::take(&mut self.buffer);
        if self.string.take().is_some() {
            return;
        }
        received.push(match bytes[..] {
            [0x1b, b] if b.is_ascii_graphic() => key(KeyCode::Char(char::from(b)), KeyModifiers::ALT),
            [0x1b, ..] => key(KeyCode::Esc, KeyModifiers::NONE),
            // An incomplete UTF-8 character is discarded.
            _ => return,
        });
    }
}

fn key(code: KeyCode, modifiers: KeyModifiers) -> Received {
    Received::Event(Event::Key(KeyEvent::new(code, modifiers)))
}

fn find(bytes: &[u8]) -> Found {
    match bytes {
        [0x1b, b'[', rest @ ..] => control_sequence(rest),
        [0x1b, b'O' | b'P' | b'X' | b']' | b'^' | b'_'] => Found::Partial,
        [0x1b, b'O', last, ..] => Found::Whole(3, letter_key(*last).map(|code| key(code, KeyModifiers::NONE))),
        // Escape pressed twice, or before a key that sends a sequence.
        [0x1b, 0x1b, ..] => Found::Whole(1, Some(key(KeyCode::Esc, KeyModifiers::NONE))),
        [0x1b, rest @ ..] => match character(rest) {
            Found::Whole(length, Some(Received::Event(Event::Key(pressed)))) => {
                let pressed = KeyEvent { modifiers: pressed.modifiers | KeyModifiers::ALT, ..pressed };
                Found::Whole(1 + length, Some(Received::Event(Event::Key(pressed))))
            }
            Found::Whole(length, _) => Found::Whole(1 + length, None),
            Found::Partial => Found::Partial,
        },
        _ => character(bytes),
    }
}

/// One character, or a key that sends a control character.
fn character(bytes: &[u8]) -> Found {
    let one = |code, modifiers| Found::Whole(1, Some(key(code, modifiers)));
    let Some(first) = bytes.first() else { return Found::Partial };
    let length = match first {
        b'\r' => return one(KeyCode::Enter, KeyModifiers::NONE),
        b'\t' => return one(KeyCode::Tab, KeyModifiers::NONE),
        0x7f => return one(KeyCode::Backspace, KeyModifiers::NONE),
        0 => return one(KeyCode::Char(' '), KeyModifiers::CONTROL),
        1..=0x1a => return one(KeyCode::Char(char::from(first - 1 + b'a')), KeyModifiers::CONTROL),
        0x1c..=0x1f => return one(KeyCode::Char(char::from(first - 0x1c + b'4')), KeyModifiers::CONTROL),
        0x20..=0x7e => 1,
        0xc2..=0xdf => 2,
        0xe0..=0xef => 3,
        0xf0..=0xf4 => 4,
        _ => return Found::Whole(1, None),
    };
    let Some(encoded) = bytes.get(..length) else { return Found::Partial };
    match std::str::from_utf8(encoded).ok().and_then(|text| text.chars().next()) {
        Some(typed) if typed.is_control() => Found::Whole(length, None),
        Some(typed) => Found::Whole(length, Some(key(KeyCode::Char(typed), KeyModifiers::NONE))),
        // Bytes that can only continue a character begin nothing else.
        None => Found::Whole(1 + encoded[1..].iter().take_while(|byte| (0x80..=0xbf).contains(*byte)).count(), None),
    }
}

/// What follows `ESC [`.
fn control_sequence(rest: &[u8]) -> Found {
    const PREFIX: usize = 2;
    match rest {
        // The function keys of the Linux console.
        [b'[', last, ..] => {
            let code = (b'A'..=b'E').contains(last).then(|| KeyCode::F(last - b'A' + 1));
            return Found::Whole(PREFIX + 2, code.map(|code| key(code, KeyModifiers::NONE)));
        }
        [b'['] => return Found::Partial,
        // Mouse reports in the original X10 encoding.
        [b'M', button, column, row, ..] => {
            let place = [column, row].map(|at| u16::from(at.saturating_sub(32)));
            return Found::Whole(PREFIX + 4, mouse(u16::from(button.saturating_sub(32)), place, false));
        }
        [b'M', ..] => return Found::Partial,
        _ => {}
    }
    let Some(end) = rest.iter().position(|byte| !(0x20..=0x3f).contains(byte)) else {
        return if rest.len() < MAX_SEQUENCE { Found::Partial } else { Found::Whole(PREFIX + rest.len(), None) };
    };
    if !(0x40..=0x7e).contains(&rest[end]) {
        // The sequence is cut off by a byte that cannot belong to it.
        return Found::Whole(PREFIX + end, None);
    }
    Found::Whole(PREFIX + end + 1, meaning(&rest[..end], rest[end]))
}

/// The meaning of a control sequence with these parameters and this final byte.
fn meaning(parameters: &[u8], last: u8) -> Option<Received> {
    let text = std::str::from_utf8(parameters).ok()?;
    if let Some(attributes) = text.strip_prefix('?') {
        let sixel = attributes.split(';').any(|attribute| attribute == "4");
        return (last == b'c').then_some(Received::Attributes { sixel });
    }
    if let Some(report) = text.strip_prefix('<') {
        let [button, column, row] = numbers(report)[..] else { return None };
        return matches!(last, b'M' | b'm').then(|| mouse(button, [column, row], last == b'm')).flatten();
    }
    if text.starts_with(['=', '>']) {
        return None;
    }
    let numbers = numbers(text);
    let modifiers = modifiers(numbers.get(1).copied().unwrap_or(1));
    match (last, &numbers[..]) {
        (b't', [6, height, width]) if *height > 0 && *width > 0 => Some(Received::CellSize([*width, *height])),
        (b'M', [button, column, row]) => mouse(button.saturating_sub(32), [*column, *row], false),
        (b'I', _) => Some(Received::Event(Event::FocusGained)),
        (b'O', _) => Some(Received::Event(Event::FocusLost)),
        (b'Z', _) => Some(key(KeyCode::BackTab, KeyModifiers::SHIFT)),
        (b'~', [number, ..]) => numbered_key(*number).map(|code| key(code, modifiers)),
        (b'u', [9, ..]) if modifiers.contains(KeyModifiers::SHIFT) => Some(key(KeyCode::BackTab, modifiers)),
        (b'u', [code, ..]) => coded_key(*code).map(|code| key(code, modifiers)),
        // A cursor position report, which was never requested.
        (b'R', [row, _]) if *row != 1 => None,
        _ => letter_key(last).map(|code| key(code, modifiers)),
    }
}

/// The meaning of a string, which begins with the byte that introduced it: the colour of the background (OSC 11), as
/// `rgb:` or `rgba:` and one to four hexadecimal digits for each part.
fn reply(string: &[u8]) -> Option<Received> {
    let colour = std::str::from_utf8(string).ok()?.strip_prefix("]11;")?;
    let parts = colour.strip_prefix("rgb:").or_else(|| colour.strip_prefix("rgba:"))?.split('/');
    let share = |part: &str| {
        let most = 16_u32.checked_pow(u32::try_from(part.len()).ok()?)?.checked_sub(1).filter(|most| *most > 0)?;
        Some(f64::from(u32::from_str_radix(part, 16).ok()?) / f64::from(most))
    };
    let [red, green, blue, ..] = parts.map(share).collect::<Option<Vec<f64>>>()?[..] else { return None };
    Some(Received::Background { light: 0.299 * red + 0.587 * green + 0.114 * blue > 0.5 })
}

fn numbers(text: &str) -> Vec<u16> {
    text.split(';').filter_map(|number| number.parse().ok()).collect()
}

fn modifiers(sent: u16) -> KeyModifiers {
    let bits = sent.saturating_sub(1);
    let all = [(1, KeyModifiers::SHIFT), (2, KeyModifiers::ALT), (4, KeyModifiers::CONTROL)];
    all.into_iter().filter(|(bit, _)| bits & bit != 0).fold(KeyModifiers::NONE, |held, (_, modifier)| held | modifier)
}

fn letter_key(last: u8) -> Option<KeyCode> {
    Some(match last {
        b'A' => KeyCode::Up,
        b'B' => KeyCode::Down,
        b'C' => KeyCode::Right,
        b'D' => KeyCode::Left,
        b'H' => KeyCode::Home,
        b'F' => KeyCode::End,
        b'M' => KeyCode::Enter,
        b'P'..=b'S' => KeyCode::F(last - b'P' + 1),
        _ => return None,
    })
}

/// The key with a character code, which for some keys is that of a control character.
fn coded_key(code: u16) -> Option<KeyCode> {
    Some(match code {
        8 | 127 => KeyCode::Backspace,
        9 => KeyCode::Tab,
        13 => KeyCode::Enter,
        27 => KeyCode::Esc,
        _ => KeyCode::Char(char::from_u32(code.into())?),
    })
}

fn numbered_key(number: u16) -> Option<KeyCode> {
    Some(match number {
        1 | 7 => KeyCode::Home,
        2 => KeyCode::Insert,
        3 => KeyCode::Delete,
        4 | 8 => KeyCode::End,
        5 => KeyCode::PageUp,
        6 => KeyCode::PageDown,
        11..=15 => KeyCode::F((number - 10) as u8),
        17..=21 => KeyCode::F((number - 11) as u8),
        23 | 24 => KeyCode::F((number - 12) as u8),
        _ => return None,
    })
}

/// A mouse report; columns and rows are sent 1-based.
fn mouse(sent: u16, [column, row]: [u16; 2], released: bool) -> Option<Received> {
    let button = |number| match number {
        0 => MouseButton::Left,
        1 => MouseButton::Middle,
        _ => MouseButton::Right,
    };
    let number = (sent & 0b11) | ((sent & 0b1100_0000) >> 4);
    let kind = match (number, sent & 0b10_0000 != 0) {
        (0..=2, _) if released => MouseEventKind::Up(button(number)),
        (0..=2, false) => MouseEventKind::Down(button(number)),
        (0..=2, true) => MouseEventKind::Drag(button(number)),
        (3, false) => MouseEventKind::Up(MouseButton::Left),
        (3..=5, true) => MouseEventKind::Moved,
        (4, false) => MouseEventKind::ScrollUp,
        (5, false) => MouseEventKind::ScrollDown,
        (6, false) => MouseEventKind::ScrollLeft,
        (7, false) => MouseEventKind::ScrollRight,
        _ => return None,
    };
    let modifiers = modifiers(((sent >> 2) & 0b111) + 1);
    let (column, row) = (column.saturating_sub(1), row.saturating_sub(1));
    Some(Received::Event(Event::Mouse(MouseEvent { kind, column, row, modifiers })))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::input::Key;

    /// The meaning of bytes that arrive in pieces of a size.
    fn received(bytes: &[u8], piece: usize) -> Vec<Received> {
        let mut parser = Parser::default();
        let mut received = Vec::new();
        bytes.chunks(piece).for_each(|piece| parser.advance(piece, &mut received));
        parser.flush(&mut received);
        received
    }

    fn shown(received: &Received) -> String {
        match received {
            Received::Event(Event::Key(key)) => Key::from(*key).to_string(),
            Received::Event(Event::Paste(text)) => format!("paste {text}"),
            Received::Event(Event::Mouse(mouse)) => format!("{:?} {} {}", mouse.kind, mouse.column, mouse.row),
            other => format!("{other:?}"),
        }
    }

    #[test]
    fn keys_reports_and_pastes_are_parsed_however_they_are_split() {
        for (bytes, expected) in [
            (&b"aZ:"[..], &["a", "Z", ":"][..]),
            ("ä日😀".as_bytes(), &["ä", "日", "😀"]),
            (b"\x00\x1bOM\x1b[9u", &["ctrl-space", "enter", "tab"]),
            (b"\x1b[1~\x1b[7~\x1b[4~\x1b[8~", &["home", "home", "end", "end"]),
            (b"\x1b[2~\x1b[6~", &["Insert", "pagedown"]),
            (b"\x1b[[A\x1b[[E", &["f1", "f5"]),
            (b"\x1b[32;10;5M\x1b[<1;1;1M\x1b[<67;1;1M", &["Down(Left) 9 4", "Down(Middle) 0 0", "ScrollRight 0 0"]),
            (b"\x1b[I\x1b[O", &["Event(FocusGained)", "Event(FocusLost)"]),
            (b"\x1b[6;0;10t\x1b[6;20;0tx", &["x"]),
            (b"\x1b\xffa\x1b\xc3(\x1b\xc3", &["a", "(", "esc"]),
            (b"\r\t\x7f\x03\x1a", &["enter", "tab", "backspace", "ctrl-c", "ctrl-z"]),
            (b"\x1b[A\x1b[1;2D\x1b[1;5C\x1bOB", &["up", "shift-left", "ctrl-right", "down"]),
            (b"\x1b[Z\x1b[3~\x1b[5~\x1b[H\x1b[F", &["backtab", "delete", "pageup", "home", "end"]),
            (b"\x1bOP\x1b[15~\x1b[24~\x1b[1;2R\x1b[[B", &["f1", "f5", "f12", "shift-f3", "f2"]),
            (b"\x1b[17~\x1b[21~\x1c\x1b[97;5u", &["f6", "f10", "ctrl-4", "ctrl-a"]),
            (b"\x1b[13;2u\x1b[27u\x1b[9;2u\x1b[127;5u", &["shift-enter", "esc", "backtab", "ctrl-backspace"]),
            (b"\x1b[<66;1;1M\x1b[M#!!", &["ScrollLeft 0 0", "Up(Left) 0 0"]),
            (b"\x1bx\x1b\x1b", &["alt-x", "esc", "esc"]),
            (b"\x1b\x1b[A", &["esc", "up"]),
            (b"\x1b[<0;10;5M\x1b[<32;11;5M\x1b[<0;11;5m", &["Down(Left) 9 4", "Drag(Left) 10 4", "Up(Left) 10 4"]),
            (b"\x1b[<35;1;1M\x1b[<64;1;1M\x1b[<65;2;2M", &["Moved 0 0", "ScrollUp 0 0", "ScrollDown 1 1"]),
            (b"\x1b[M !!", &["Down(Left) 0 0"]),
            (b"\x1b[200~a\x1b[Ab\n\x1b[201~q", &["paste a\x1b[Ab\n", "q"]),
            (b"\x1b[200~\x1b[201~", &["paste "]),
            (b"\x1b[?62;4;22c\x1b[6;20;10t", &["Attributes { sixel: true }", "CellSize([10, 20])"]),
            (b"\x1b[?62;14c", &["Attributes { sixel: false }"]),
            (b"\x1b[12;40Rx", &["x"]),
            (b"\xff\xc3(\x1b[5\x1b[B", &["(", "down"]),
            (b"a\x1b_Gi=31;OK\x1b\\b\x1bP>|term(1)q\x07c\x1b^q\x1b\\\x1bXq\x1b\\d", &["a", "b", "c", "d"]),
            (b"\x1b]52;c;cQ==\x07\x1b]0;\xe2\x82\xac\xffq\x1b\\a\x1bPq\x18b\x1b_q\x1ac", &["a", "b", "c"]),
            (b"\x1b]q\x1b[A\x1b_q\x1bOB\x1bP\x1b\\\x1b^\x07a", &["up", "down", "a"]),
            (b"\x1bP\x1b[A\x1b]\x1b]\x1b[B", &["alt-P", "up", "alt-]", "alt-]", "down"]),
            (b"\x1b_\x1b\x1b[A", &["alt-_", "esc", "up"]),
            (b"\xc2\x90q\x1b\\a\xc2\x9dq\xc2\x9cb\x9eq\x9cc\xc2\x9f\x1b[A\x98q\x07d", &["a", "b", "c", "up", "d"]),
            (b"\x1b]\xc3\x9cq\x07a\xc2\x9b3~\x9bAb\xc2\x85c\xe2\x98d", &["a", "delete", "up", "b", "c", "d"]),
            (b"\x1b]11;rgb:ffff/ffff/dddd\x07", &["Background { light: true }"]),
            (b"\x1b]11;rgba:0/0/0/f\x1b\\", &["Background { light: false }"]),
            (b"\x1b]11;?\x07\x1b]11;rgb:1/2\x07\x1b]11;rgb:-1/+2/\x07\x1b]10;rgb:f/f/f\x07a", &["a"]),
            (b"\x1b]11;rgb:fffff0000/0/0\x07\x1b]11;rgb:\xff/0/0\x07a", &["a"]),
            (b"\x1b[>1;97u\x1b[=1;97u\x1b[?1;2$y\x1b[>0;276;0cx", &["x"]),
        ] {
            for piece in [1, 2, 3, 1024] {
                let found: Vec<String> = received(bytes, piece).iter().map(shown).collect();
                assert_eq!(found, expected, "{bytes:?} in pieces of {piece}");
            }
        }
    }

    #[test]
    fn escape_alone_is_a_key_only_when_nothing_follows() {
        let mut parser = Parser::default();
        let mut received = Vec::new();
        parser.advance(b"\x1b", &mut received);
        assert!(received.is_empty() && parser.is_partial());
        parser.flush(&mut received);
        assert_eq!(received.iter().map(shown).collect::<Vec<_>>(), ["esc"]);
        assert!(!parser.is_partial());
        parser.advance(b"\x1bO", &mut received);
        parser.flush(&mut received);
        assert_eq!(received.iter().map(shown).collect::<Vec<_>>(), ["esc", "alt-O"]);
        parser.advance(b"\x1b[", &mut received);
        parser.advance(&[b'1'; MAX_SEQUENCE], &mut received);
        assert!(!parser.is_partial(), "an endless sequence is discarded");
        parser.advance(b"\x1b[200~half", &mut received);
        assert!(!parser.is_partial(), "a paste may be slow");
    }

    #[test]
    fn a_string_may_have_any_length_and_is_given_up_when_nothing_follows() {
        let mut parser = Parser::default();
        let mut received = Vec::new();
        parser.advance(b"\x1b_", &mut received);
        for _ in 0..100 {
            parser.advance(&[b'q'; 4096], &mut received);
        }
        assert!(received.is_empty() && parser.is_in_string());
        assert!(parser.buffer.len() + parser.string.as_ref().unwrap().len() <= MAX_SEQUENCE, "it is not kept");
        parser.advance(b"\x1b\\a\x1bPq\x1b", &mut received);
        assert!(parser.is_in_string());
        parser.flush(&mut received);
        assert!(!parser.is_partial());
        parser.advance(b"b", &mut received);
        for alone in [&b"\x1bP"[..], b"\x1bX", b"\x1b]", b"\x1b^", b"\x1b_"] {
            parser.advance(alone, &mut received);
            assert!(parser.is_partial() && !parser.is_in_string(), "a key with Alt has the short wait");
            parser.flush(&mut received);
        }
        let keys: Vec<_> = received.iter().map(shown).collect();
        assert_eq!(keys, ["a", "b", "alt-P", "alt-X", "alt-]", "alt-^", "alt-_"]);
    }

    #[test]
    fn mouse_reports_name_the_modifiers_that_are_held() {
        let held = |report: &[u8]| match &received(report, 1024)[..] {
            [Received::Event(Event::Mouse(mouse))] => mouse.modifiers,
            other => panic!("{other:?}"),
        };
        assert_eq!(held(b"\x1b[<0;1;1M"), KeyModifiers::NONE);
        assert_eq!(held(b"\x1b[<4;1;1M"), KeyModifiers::SHIFT);
        assert_eq!(held(b"\x1b[<88;1;1M"), KeyModifiers::ALT | KeyModifiers::CONTROL);
    }

    #[test]
    fn a_long_paste_becomes_several_events() {
        let mut parser = Parser::default();
        let mut received = Vec::new();
        parser.advance(PASTE_BEGINS, &mut received);
        for _ in 0..3 {
            parser.advance(&vec![b'a'; MAX_PASTE / 2], &mut received);
        }
        parser.advance(PASTE_ENDS, &mut received);
        let length = |received: &Received| match received {
            Received::Event(Event::Paste(text)) => text.len(),
            _ => 0,
        };
        assert_eq!(received.iter().map(length).sum::<usize>(), MAX_PASTE / 2 * 3);
        assert_eq!(received.len(), 2);
    }
}
