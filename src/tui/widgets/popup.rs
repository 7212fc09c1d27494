//! Frames and wrapped text of popups.

use std::borrow::Cow;

use ratatui::prelude::*;
use ratatui::widgets::{Block, BorderType, Clear};
use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm};

use crate::tui::widgets::theme::Theme;

/// Clears and frames a box of the wanted inner size in the middle of `area`, limited to `area`, and
/// returns its inside.
pub fn frame(title: &str, wanted: (u16, u16), area: Rect, theme: &Theme, buffer: &mut Buffer) -> Rect {
    let width = (wanted.0 + 4).min(area.width);
    let height = (wanted.1 + 2).min(area.height);
    let place = Rect { x: area.x + (area.width - width) / 2, y: area.y + (area.height - height) / 3, width, height };
    Clear.render(place, buffer);
    let block = block().border_style(theme.accent).title(format!(" {title} ")).title_style(theme.strong());
    let inside = block.inner(place);
    block.render(place, buffer);
    Rect { x: inside.x + 1, width: inside.width.saturating_sub(2), ..inside }
}

/// A block with a border.
pub fn block() -> Block<'static> {
    Block::bordered().border_type(BorderType::Rounded)
}

/// Wraps a text at spaces into lines of at most `width` columns; only words longer than a line are
/// broken.
pub fn wrap(text: &str, width: usize) -> Vec<String> {
    let options = Options::new(width)
        .word_separator(WordSeparator::AsciiSpace)
        .word_splitter(WordSplitter::NoHyphenation)
        .wrap_algorithm(WrapAlgorithm::FirstFit);
    text.lines().flat_map(|line| textwrap::wrap(line, &options)).map(Cow::into_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::wrap;

    #[test]
    fn text_is_broken_at_spaces_and_line_ends() {
        assert_eq!(wrap("one two three\n\nfour", 8), ["one two", "three", "", "four"]);
        assert_eq!(wrap("a linear:0.8:0.05", 10), ["a", "linear:0.8", ":0.05"]);
        assert_eq!(wrap("日本語 日本", 5), ["日本", "語", "日本"]);
        assert_eq!(wrap("日本", 1), ["日", "本"]);
    }
}
