//! Which graphics protocol the terminal supports, and whether its background is light.
//!
//! Terminals with kitty's graphics protocol are recognised by environment variables. Sixel support is
//! read from the reply to a request for primary device attributes, which nearly every terminal sends
//! at once. Until it arrives, and without one, figures are shown in half blocks. The colour of the background is
//! asked for in the same way.

use std::io::{self, Write};

use crossterm::terminal::WindowSize;

/// How pictures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// Two blocks per cell; works in every terminal.
    HalfBlock,
    /// DEC's sixel graphics.
    Sixel,
    /// Kitty's protocol, with Unicode placeholders.
    Kitty,
}

/// How pictures are shown, and how large a cell is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Graphics {
    /// How pictures are shown.
    pub protocol: Protocol,
    /// Width and height of a cell in pixels.
    pub cell: [u16; 2],
}

/// Default size of a cell in pixels.
const CELL: [u16; 2] = [8, 16];

impl Default for Graphics {
    fn default() -> Self {
        Self { protocol: Protocol::HalfBlock, cell: CELL }
    }
}

impl Graphics {
    /// What is known from the system and the environment. If the environment does not name the protocol,
    /// also queries the terminal for its attributes, and for the size of a cell if the system does not report it.
    /// `background`: queries it for the colour of its background too.
    ///
    /// # Errors
    /// When the terminal cannot be written to.
    pub fn find(background: bool) -> io::Result<Self> {
        let cell = cell_of_window();
        let known = from_env(|name| std::env::var(name).ok());
        // The Linux console has no reply to the first, and older ones print it.
        let is_console = std::env::var_os("TERM").is_some_and(|term| term == "linux");
        let questions = [
            (background && !is_console, "\x1b]11;?\x07"),
            (known.is_none() && cell.is_none(), "\x1b[16t"),
            (known.is_none(), "\x1b[c"),
        ];
        let asked: String = questions.into_iter().filter_map(|(wanted, question)| wanted.then_some(question)).collect();
        let mut out = io::stdout();
        out.write_all(asked.as_bytes())?;
        out.flush()?;
        Ok(Self { protocol: known.unwrap_or(Protocol::HalfBlock), cell: cell.unwrap_or(CELL) })
    }
}

/// The size of a cell, if the system reports the size of the window in pixels.
fn cell_of_window() -> Option<[u16; 2]> {
    cell_of(&crossterm::terminal::window_size().ok()?)
}

/// The size of a cell, if the size of the window in pixels is known.
fn cell_of(size: &WindowSize) -> Option<[u16; 2]> {
    let known = size.width > 0 && size.height > 0 && size.columns > 0 && size.rows > 0;
    known.then(|| [size.width / size.columns, size.height / size.rows])
}

/// The protocol according to the environment: `MGE_GRAPHICS` (`kitty`, `sixel`, `half-block`), or
/// the name of a terminal with kitty's protocol. None if the terminal has to be queried.
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
    // A multiplexer inherits the variables of the terminal it was started in.
    let inside = term.starts_with("screen") || term.starts_with("tmux");
    let kitty = ["xterm-kitty", "xterm-ghostty"].contains(&term.as_str())
        || !value("KITTY_WINDOW_ID").is_empty()
        || value("TERM_PROGRAM") == "ghostty";
    (kitty && !inside).then_some(Protocol::Kitty)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terminals_are_recognised_and_mge_graphics_takes_precedence() {
        let env = |variables: &'static [(&str, &str)]| {
            from_env(move |name| variables.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(env(&[("TERM", "xterm-kitty")]), Some(Protocol::Kitty));
        assert_eq!(env(&[("TERM", "xterm-256color"), ("TERM_PROGRAM", "ghostty")]), Some(Protocol::Kitty));
        assert_eq!(env(&[("TERM", "tmux-256color"), ("KITTY_WINDOW_ID", "1")]), None);
        assert_eq!(env(&[("TERM", "linux")]), Some(Protocol::HalfBlock));
        assert_eq!(env(&[("TERM", "xterm-kitty"), ("MGE_GRAPHICS", "half-block")]), Some(Protocol::HalfBlock));
        assert_eq!(env(&[("TERM", "linux"), ("MGE_GRAPHICS", "kitty")]), Some(Protocol::Kitty));
        assert_eq!(env(&[("TERM", "linux"), ("MGE_GRAPHICS", "sixel")]), Some(Protocol::Sixel));
        assert_eq!(env(&[("TERM", "xterm-256color")]), None);
    }

    #[test]
    fn the_size_of_a_cell_needs_the_size_of_the_window_in_cells_and_pixels() {
        let cell = |[columns, rows, width, height]: [u16; 4]| cell_of(&WindowSize { rows, columns, width, height });
        let window = [120, 40, 1200, 800];
        assert_eq!(cell(window), Some([10, 20]));
        for missing in 0..4 {
            let mut window = window;
            window[missing] = 0;
            assert_eq!(cell(window), None, "{window:?}");
        }
    }
}
