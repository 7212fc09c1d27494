//! Screenshots: the cells of a ratatui buffer as SVG, drawn with the canvas of the figures.

use ratatui::buffer::{Buffer, Cell};
use ratatui::style::{Color, Modifier};

use mge_figures::{self as figures, Canvas, Family, Pen, Rect, TextFormat};

/// Width and height of a cell in points: whole pixels at 144 dots per inch.
const CELL: [f64; 2] = [6.0, 11.5];
/// Font size at which characters are as wide as a cell: DejaVu Sans Mono is 0.602 em wide.
const SIZE: f64 = CELL[0] / 0.602_050_78;
/// Distance of the middle of small letters from the top of a cell, chosen so that lines of neighbouring
/// rows join.
const MIDDLE: f64 = 0.588 * CELL[1];
/// Default text and background colours of the picture.
const OWN: [Color; 2] = [Color::Rgb(0xc8, 0xcc, 0xd8), Color::Rgb(0x16, 0x18, 0x21)];

/// The screen as SVG; `head` is inserted after the opening tag.
pub fn svg(screen: &Buffer, head: &str) -> String {
    let size = [f64::from(screen.area.width) * CELL[0], f64::from(screen.area.height) * CELL[1]];
    figures::svg(size, 1.0, head, |canvas| {
        canvas.fill(&canvas.page().corners(), colour(OWN[1], OWN[1]));
        for y in 0..screen.area.height {
            let row: Vec<&Cell> =
                (0..screen.area.width).map(|x| &screen[(screen.area.x + x, screen.area.y + y)]).collect();
            draw_row(canvas, &row, f64::from(y) * CELL[1]);
        }
    })
}

/// Draws a row, backgrounds first, because a character may extend into the next cell.
fn draw_row(canvas: &Canvas<'_>, row: &[&Cell], top: f64) {
    let colours: Vec<[Color; 2]> = row.iter().map(|cell| colours(cell)).collect();
    for run in runs(row.len(), |n| colours[n][1]) {
        if colours[run.start][1] != OWN[1] {
            let area = cells(run.clone(), top, [0.0, 1.0]);
            canvas.fill(&area.corners(), colour(colours[run.start][1], OWN[1]));
        }
    }
    let look = |n: usize| (colours[n][0], row[n].modifier, is_text(row[n].symbol()));
    for run in runs(row.len(), look) {
        let (ink, modifier, text) = look(run.start);
        let mut ink = colour(ink, OWN[0]);
        if modifier.contains(Modifier::DIM) {
            ink.3 = 0.6;
        }
        if text {
            let words: String = run.clone().map(|n| row[n].symbol()).collect();
            let style = TextFormat { family: Family::Mono, size: SIZE, ..TextFormat::LABEL.color(ink) };
            let style = if modifier.contains(Modifier::BOLD) { style.bold() } else { style };
            canvas.text([run.start as f64 * CELL[0], top + MIDDLE], &words, style);
        } else {
            run.clone().for_each(|n| draw_block(canvas, row[n].symbol(), n, top, ink));
        }
        if modifier.contains(Modifier::UNDERLINED) {
            let area = cells(run, top, [0.92, 0.92]);
            canvas.line(&[[area.left, area.top], [area.right, area.top]], Pen::new(ink, 0.6));
        }
    }
}

/// Ranges of consecutive indices with equal values.
fn runs<T: PartialEq>(count: usize, of: impl Fn(usize) -> T) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for n in 0..count {
        match runs.last_mut() {
            Some(run) if of(run.start) == of(n) => run.end = n + 1,
            _ => runs.push(n..n + 1),
        }
    }
    runs
}

/// The area of consecutive cells of a row, between two fractions of its height.
fn cells(run: std::ops::Range<usize>, top: f64, [from, to]: [f64; 2]) -> Rect {
    let x = |n: usize| n as f64 * CELL[0];
    Rect::new(x(run.start), top + from * CELL[1], x(run.end), top + to * CELL[1])
}

/// Whether a symbol is drawn as text; blanks, blocks and braille are not.
fn is_text(symbol: &str) -> bool {
    !matches!(symbol.chars().next(), None | Some(' ' | '▀' | '▄' | '█' | '░' | '\u{2800}'..='\u{28ff}'))
}

/// Draws blocks and braille as shapes, because the typeface lacks them or leaves gaps between them.
fn draw_block(canvas: &Canvas<'_>, symbol: &str, n: usize, top: f64, ink: figures::Color) {
    let part = |from: f64, to: f64| cells(n..n + 1, top, [from, to]).corners();
    match symbol.chars().next() {
        Some('▀') => canvas.fill(&part(0.0, 0.5), ink),
        Some('▄') => canvas.fill(&part(0.5, 1.0), ink),
        Some('█') => canvas.fill(&part(0.0, 1.0), ink),
        Some('░') => canvas.fill(&part(0.0, 1.0), figures::Color { 3: 0.25, ..ink }),
        Some(braille @ '\u{2801}'..='\u{28ff}') => {
            // By bit: three rows of the left column, three of the right, then the lowest row.
            const DOTS: [[f64; 2]; 8] =
                [[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [0.0, 3.0], [1.0, 3.0]];
            // The lowest byte of a braille character.
            let bits = u32::from(braille);
            for [x, y] in DOTS.into_iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1).map(|(_, dot)| dot) {
                let at = [(n as f64 + (x + 0.5) / 2.0) * CELL[0], top + (y + 0.5) / 4.0 * CELL[1]];
                canvas.dot(at, 1.0, ink);
            }
        }
        _ => {}
    }
}

/// Text and background of a cell.
fn colours(cell: &Cell) -> [Color; 2] {
    let own = |colour: Color, n: usize| if colour == Color::Reset { OWN[n] } else { colour };
    let colours = [own(cell.fg, 0), own(cell.bg, 1)];
    if cell.modifier.contains(Modifier::REVERSED) { [colours[1], colours[0]] } else { colours }
}

/// Converts a colour. A named or indexed colour, which an [`OffscreenWorkbench`](crate::tui::OffscreenWorkbench)
/// never shows, becomes `other`.
fn colour(colour: Color, other: Color) -> figures::Color {
    match (colour, other) {
        (Color::Rgb(r, g, b), _) | (_, Color::Rgb(r, g, b)) => figures::Color { 0: r, 1: g, 2: b, 3: 1.0 },
        _ => figures::Color { 0: 0, 1: 0, 2: 0, 3: 1.0 },
    }
}

#[cfg(test)]
mod tests {
    use ratatui::layout::Rect;
    use ratatui::style::Style;

    use super::*;

    /// The colour of a picture of two rows at a cell of the first row and a fractional position from its corner.
    fn drawn(paint: impl Fn(&mut Buffer)) -> impl Fn(u16, f64, f64) -> [u8; 3] {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 3, 2));
        paint(&mut buffer);
        let (width, height) = (3 * 40, 2 * 80);
        let pixels = figures::rgb(&svg(&buffer, ""), width, height).unwrap();
        move |cell, x, y| {
            let (x, y) = ((f64::from(cell) + x) * 40.0, y * 80.0);
            let at = 3 * (y as usize * width as usize + x as usize);
            [pixels[at], pixels[at + 1], pixels[at + 2]]
        }
    }

    const RED: Color = Color::Rgb(255, 0, 0);
    const PAPER: [u8; 3] = [0x16, 0x18, 0x21];

    #[test]
    fn blocks_and_braille_dots_are_where_a_terminal_shows_them() {
        let pixel = drawn(|buffer| {
            buffer.set_string(0, 0, "▀⠁⢀", Style::new().fg(RED));
        });
        assert_eq!([pixel(0, 0.5, 0.25), pixel(0, 0.5, 0.75)], [[255, 0, 0], PAPER]);
        assert_eq!([pixel(1, 0.25, 0.125), pixel(1, 0.75, 0.875)], [[255, 0, 0], PAPER]);
        assert_eq!([pixel(2, 0.25, 0.125), pixel(2, 0.75, 0.875)], [PAPER, [255, 0, 0]]);
    }

    #[test]
    fn the_second_row_is_below_the_first() {
        let pixel = drawn(|buffer| {
            buffer.set_string(0, 1, "▄█░", Style::new().fg(RED));
        });
        for (cell, [upper, lower]) in [(0, [false, true]), (1, [true; 2]), (2, [true; 2])] {
            let is_inked = |y: f64| pixel(cell, 0.5, y) != PAPER;
            assert_eq!([0.25, 0.75, 1.25, 1.75].map(is_inked), [false, false, upper, lower], "cell {cell}");
        }
        assert_eq!((pixel(0, 0.5, 1.75), pixel(1, 0.5, 1.25)), ([255, 0, 0], [255, 0, 0]));
        assert_ne!(pixel(2, 0.5, 1.25), [255, 0, 0], "a light shade");
    }

    #[test]
    fn text_stays_within_its_cells() {
        let pixel = drawn(|buffer| {
            buffer.set_string(2, 1, "M", Style::new().fg(RED));
        });
        let is_inked = |cell: u16, row: f64| {
            let mut places = (0..400).map(|place| [f64::from(place % 20) / 20.0, row + f64::from(place / 20) / 20.0]);
            places.any(|[x, y]| pixel(cell, x, y) != PAPER)
        };
        assert_eq!([0, 1, 2].map(|cell| is_inked(cell, 0.0)), [false; 3]);
        assert_eq!([0, 1, 2].map(|cell| is_inked(cell, 1.0)), [false, false, true]);
    }

    #[test]
    fn backgrounds_are_drawn_for_reversed_cells_too() {
        let pixel = drawn(|buffer| {
            buffer.set_string(0, 0, " ", Style::new().bg(RED));
            buffer.set_string(1, 0, " ", Style::new().fg(RED).add_modifier(Modifier::REVERSED));
        });
        assert_eq!([0, 1, 2].map(|cell| pixel(cell, 0.5, 0.5)), [[255, 0, 0], [255, 0, 0], PAPER]);
    }

    #[test]
    fn text_is_kept_as_text() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 20, 1));
        buffer.set_string(0, 0, "a<b  c", Style::new().fg(RED).add_modifier(Modifier::BOLD));
        let text = svg(&buffer, "");
        assert!(text.contains("a&lt;b") && text.contains("font-weight=\"bold\"") && text.contains("#FF0000"), "{text}");
    }
}
