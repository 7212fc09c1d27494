//! Draws the pictures of screens in `docs/images`, with the canvas of the figures:
//!
//! ```sh
//! cargo test --release -p mge --lib pictures -- --ignored
//! ```

use std::path::Path;
use std::time::Duration;

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::{Buffer, Cell};
use ratatui::style::{Color, Modifier};

use super::super::App;
use super::press;
use crate::tui::view::SessionWorkspace;
use crate::tui::widgets::theme::{Depth, Marker, Palette, Theme};
use mge_base::atomic::Target;
use mge_figures::{self as figures, Canvas, Family, PICTURE, Pen, Provenance, Rect, TextFormat, encode};
use mge_workbench::{FIRST_TASK, Script, Session};

/// The session behind the pictures.
const SESSION: &str = "clusters
wait
episodes 1500
method ddpg
train ${out}/ddpg-0
method ddpg-mge
epsilon linear:0.5:0:750
seed 1
train ${out}/ddpg-mge-1
seed 0
train ${out}/ddpg-mge-0
wait";

/// The pictures, each with the keys that lead to it from the one before.
const PICTURES: [(&str, &str); 4] =
    [("scene.png", "1 end"), ("edit.png", "2 backtab"), ("training.png", "4"), ("tools.png", "2 T")];

#[test]
#[ignore = "trains for some minutes and rewrites docs/images"]
fn the_pictures_of_the_documentation() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = Session::on_task(FIRST_TASK, folder.path().to_owned()).unwrap();
    let variables = [("out".to_owned(), folder.path().display().to_string())];
    Script::parse(SESSION, "pictures", &variables).unwrap().run(&mut session, |_| {}).unwrap();
    let provenance = Provenance::new("cargo test -p mge --lib pictures -- --ignored", &[0, 1], "");
    let theme = Theme::new(Palette::Dark, Depth::True, Marker::Braille);
    let mut app = App::new(Box::new(SessionWorkspace::new(session)), theme);
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images");
    for (name, keys) in PICTURES {
        keys.split(' ').for_each(|key| press(&mut app, key));
        let picture = svg(&settled(&mut app), &provenance.to_svg());
        let to = Target { path: images.join(name), force: true };
        to.write(&encode(&to.path, &picture, &provenance, 144).unwrap(), &PICTURE).unwrap();
    }
}

/// The screen once nothing more is read or drawn in the background.
fn settled(app: &mut App) -> Buffer {
    let mut terminal = Terminal::new(TestBackend::new(120, 36)).unwrap();
    let mut drawn = 0;
    // Parts that depend on the layout of the previous frame appear in the second frame.
    while drawn < 2 || app.screens.preview.is_drawing() || app.is_reading_runs() {
        app.tick(Duration::from_millis(20));
        terminal.draw(|frame| app.draw(frame)).unwrap();
        drawn += 1;
        std::thread::sleep(Duration::from_millis(5));
    }
    terminal.backend().buffer().clone()
}

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
fn svg(screen: &Buffer, head: &str) -> String {
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
fn draw_row(canvas: &Canvas, row: &[&Cell], top: f64) {
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
fn draw_block(canvas: &Canvas, symbol: &str, n: usize, top: f64, ink: figures::Color) {
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

/// Converts a colour. A named or indexed colour, which this theme does not have, becomes
/// `other`.
fn colour(colour: Color, other: Color) -> figures::Color {
    match (colour, other) {
        (Color::Rgb(r, g, b), _) | (_, Color::Rgb(r, g, b)) => figures::Color(r, g, b, 1.0),
        _ => figures::Color(0, 0, 0, 1.0),
    }
}
