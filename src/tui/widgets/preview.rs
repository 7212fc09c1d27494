//! The preview on the Figures screen: a figure drawn at display size and encoded for the terminal, in
//! the background.

use std::sync::Arc;
use std::time::Duration;

use image::{DynamicImage, RgbImage};
use ratatui::buffer::Buffer;
use ratatui::layout::{Rect, Size};
use ratatui::widgets::Widget;
use ratatui_image::picker::Picker;
use ratatui_image::protocol::Protocol;
use ratatui_image::protocol::halfblocks::Halfblocks;
use ratatui_image::{Image, Resize};

use crate::tui::widgets::layout::centred;
use crate::tui::widgets::theme::{ASCII, Depth, Theme};
use mge_figures::Figure;
use mge_guidance::ActionPrior;
use mge_results::Composition;
use mge_task::Task;
use mge_workbench::{FigureJob, FigureKind, Loader};

/// The picture to show. It is drawn again when any of this changes.
#[derive(Debug, Clone, PartialEq)]
pub struct PreviewRequest {
    /// The kind of figure.
    pub kind: FigureKind,
    /// What the figure shows, and how.
    pub composition: Composition,
    /// The task.
    pub task: Arc<Task>,
    /// The action clusters.
    pub prior: Option<Arc<ActionPrior>>,
    /// A hash of the runs and of their finished episodes.
    pub progress: u64,
    /// Available columns and rows.
    pub room: [u16; 2],
}

impl PreviewRequest {
    /// Whether it is for the same figure, of which only the contents may have changed.
    fn is_like(&self, other: &Self) -> bool {
        (self.kind, &self.composition, self.room) == (other.kind, &other.composition, other.room)
    }
}

/// The picture of a figure, drawn in the background.
#[derive(Default)]
pub struct Preview {
    /// How the terminal shows pictures, if not in half blocks.
    pub graphics: Option<Picker>,
    picture: Loader<PreviewRequest, Protocol>,
}

/// Minimum time between two pictures of a figure whose contents change.
const PAUSE: Duration = Duration::from_secs(2);
/// The same as a multiple of the time a picture takes to draw, so that trainings are not slowed down.
const PAUSE_FACTOR: u32 = 40;
/// Pixels per half-block cell, before averaging.
const FINE: [u16; 2] = [6, 12];

impl Preview {
    /// Takes over a finished picture, and starts drawing the wanted one if it is a different one. True if
    /// there is something new to show.
    pub fn update(&mut self, wanted: &PreviewRequest, figure: impl FnOnce() -> Result<FigureJob, String>) -> bool {
        let is_new = self.picture.poll();
        let is_rested = self.picture.is_rested(PAUSE, PAUSE_FACTOR);
        let is_current = |known: &PreviewRequest| known == wanted || (!is_rested && known.is_like(wanted));
        if self.picture.is_loading() || self.picture.latest(is_current).is_some() {
            return is_new;
        }
        match figure() {
            Ok(figure) => {
                let (graphics, room) = (self.graphics.clone(), wanted.room);
                let draw = move |_: &_| picture(&*figure(&mut |_, _| ())?.figure, graphics.as_ref(), room);
                self.picture.request(wanted.clone(), Duration::ZERO, draw);
                is_new
            }
            Err(reason) => {
                self.picture.set(wanted.clone(), Err(reason));
                true
            }
        }
    }

    /// Whether a picture is being drawn.
    #[cfg(test)]
    pub fn is_drawing(&self) -> bool {
        self.picture.is_loading()
    }

    /// Drops the picture, because a terminal that was left no longer has it.
    pub fn forget(&mut self) {
        self.picture = Loader::default();
    }

    /// Draws the picture of a kind of figure in the middle of `area`. Pictures of pixels, which may show
    /// through layers, are not drawn while `under` one.
    ///
    /// # Errors
    /// The text to show if there is no picture.
    pub fn draw(
        &self,
        kind: FigureKind,
        under: bool,
        area: Rect,
        theme: &Theme,
        buffer: &mut Buffer,
    ) -> Result<(), String> {
        let picture = match self.picture.latest(|wanted| wanted.kind == kind) {
            Some((_, Ok(picture))) => picture,
            Some((_, Err(reason))) => return Err(reason.clone()),
            None => return Err("drawing ...".to_owned()),
        };
        let is_plain = theme.depth == Depth::None || theme.marker == ASCII;
        if is_plain && matches!(picture, Protocol::Halfblocks(_)) {
            return Err("a terminal without colours or blocks shows no pictures; they can be exported".to_owned());
        }
        let Size { width, height } = picture.size();
        if width > area.width || height > area.height {
            return Err("drawing ...".to_owned());
        }
        if under && matches!(picture, Protocol::Sixel(_) | Protocol::ITerm2(_)) {
            return Ok(());
        }
        let place = centred(width, height, area);
        Image::new(picture).render(place, buffer);
        if matches!(picture, Protocol::Halfblocks(_)) {
            fit_colours(place, theme, buffer);
        }
        Ok(())
    }
}

/// Draws the figure as large as fits, keeping its proportions.
fn picture(figure: &dyn Figure, graphics: Option<&Picker>, room: [u16; 2]) -> Result<Protocol, String> {
    let cell = graphics.map_or(FINE, |picker| [picker.font_size().width, picker.font_size().height]);
    let pixels: [f64; 2] = std::array::from_fn(|axis| f64::from(room[axis]) * f64::from(cell[axis]));
    let size = figure.size();
    let scale = (pixels[0] / size[0]).min(pixels[1] / size[1]);
    let cells: [u16; 2] = std::array::from_fn(|axis| {
        ((size[axis] * scale / f64::from(cell[axis])).round() as u16).clamp(1, room[axis].max(1))
    });
    let [width, height] = [0, 1].map(|axis| u32::from(cells[axis]) * u32::from(cell[axis]));
    let bytes = figure.to_rgb(width, height).map_err(|error| error.to_string())?;
    let image = RgbImage::from_raw(width, height, bytes).ok_or("the picture has the wrong size")?;
    let (image, size) = (DynamicImage::from(image), Size::new(cells[0], cells[1]));
    let drawn = match graphics {
        None => Halfblocks::new(image, size).map(Protocol::Halfblocks),
        Some(picker) => picker.new_protocol(image, size, Resize::Fit(None)),
    };
    drawn.map_err(|error| error.to_string())
}

/// Converts half blocks to colours that the terminal can show.
fn fit_colours(area: Rect, theme: &Theme, buffer: &mut Buffer) {
    for position in area.positions() {
        let cell = &mut buffer[position];
        let (above, below) = (theme.fit(cell.fg), theme.fit(cell.bg));
        cell.set_fg(above).set_bg(below);
    }
}

#[cfg(test)]
mod tests {
    use ratatui::style::Color;

    use super::*;
    use crate::tui::widgets::theme::{Marker, Palette};
    use mge_figures::TaskGrid;
    use mge_workbench::DrawnFigure;
    use ratatui_image::picker::ProtocolType;

    fn figure() -> Result<FigureJob, String> {
        let figure = Box::new(TaskGrid { tasks: vec![mge_task::load("task1").unwrap()] });
        Ok(Box::new(|_| Ok(DrawnFigure { figure, seeds: vec![], config_hash: String::new(), remark: String::new() })))
    }

    fn wanted(kind: FigureKind) -> PreviewRequest {
        let task = Arc::new(mge_task::load("task1").unwrap());
        PreviewRequest { kind, composition: Composition::default(), task, prior: None, progress: 0, room: [40, 20] }
    }

    /// A picture by a protocol, or in half blocks.
    fn shown(protocol: Option<ProtocolType>) -> Preview {
        let graphics = protocol.map(|protocol| {
            let mut picker = Picker::halfblocks();
            picker.set_protocol_type(protocol);
            picker
        });
        let mut preview = Preview { graphics, ..Preview::default() };
        let wanted = wanted(FigureKind::Scene);
        assert!(!preview.update(&wanted, figure));
        while !preview.update(&wanted, || panic!("it is being drawn already")) {
            std::thread::yield_now();
        }
        preview
    }

    fn drawn(preview: &Preview, covered: bool, theme: &Theme) -> Buffer {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 20));
        preview.draw(FigureKind::Scene, covered, buffer.area, theme, &mut buffer).unwrap();
        buffer
    }

    fn theme(depth: Depth) -> Theme {
        Theme::new(Palette::Dark, depth, Marker::Braille)
    }

    #[test]
    fn each_protocol_uses_its_own_sequences() {
        let text = |protocol, covered| {
            let buffer = drawn(&shown(protocol), covered, &theme(Depth::True));
            buffer.content.iter().map(|cell| cell.symbol()).collect::<String>()
        };
        assert!(text(Some(ProtocolType::Sixel), false).contains("\x1bP"));
        assert!(!text(Some(ProtocolType::Sixel), true).contains("\x1bP"), "a layer cannot cover it");
        assert!(text(Some(ProtocolType::Kitty), false).contains("\x1b_G"));
        assert!(text(Some(ProtocolType::Iterm2), false).contains("\x1b]1337"));
        assert!(text(None, false).contains('▀'));
    }

    #[test]
    fn half_blocks_use_colours_of_the_terminal() {
        let preview = shown(None);
        let buffer = drawn(&preview, false, &theme(Depth::Ansi256));
        assert!(buffer.content.iter().all(|cell| !matches!(cell.bg, Color::Rgb(..))));
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 20));
        let drawn = preview.draw(FigureKind::Scene, false, buffer.area, &theme(Depth::None), &mut buffer);
        assert!(drawn.unwrap_err().contains("without colours"));
    }

    #[test]
    fn changed_contents_are_drawn_after_a_pause_and_another_figure_at_once() {
        let mut preview = shown(None);
        let same = wanted(FigureKind::Scene);
        let changed = PreviewRequest { progress: 1, ..same.clone() };
        let is_drawn = |preview: &mut Preview, wanted: &PreviewRequest| {
            let mut is_asked = false;
            preview.update(wanted, || {
                is_asked = true;
                Err(String::new())
            });
            is_asked
        };
        assert!(!is_drawn(&mut preview, &changed), "during the pause");
        assert!(!is_drawn(&mut preview, &same));
        assert!(is_drawn(&mut preview, &PreviewRequest { kind: FigureKind::Clusters, ..changed }));
    }

    #[test]
    fn a_picture_is_centred_and_neither_cut_off_nor_kept_for_another_terminal() {
        let mut preview = shown(None);
        let theme = theme(Depth::True);
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 40));
        let drawing = Err("drawing ...".to_owned());
        for small in [Rect::new(0, 0, 3, 40), Rect::new(0, 0, 40, 3)] {
            assert_eq!(preview.draw(FigureKind::Scene, false, small, &theme, &mut buffer), drawing);
        }
        let area = buffer.area;
        assert_eq!(preview.draw(FigureKind::Scene, false, area, &theme, &mut buffer), Ok(()));
        let is_drawn = |y: u16| (0..40u16).any(|x| buffer[(x, y)].bg != Color::Reset);
        assert_eq!([0, 5, 20, 34, 39].map(is_drawn), [false, false, true, false, false]);
        preview.forget();
        assert_eq!(preview.draw(FigureKind::Scene, false, area, &theme, &mut buffer), drawing);
    }

    #[test]
    fn the_reason_for_a_missing_picture_is_shown() {
        let mut preview = Preview::default();
        let wanted = wanted(FigureKind::Clusters);
        assert!(preview.update(&wanted, || Err("no clusters".into())));
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 20));
        let shown = preview.draw(FigureKind::Clusters, false, buffer.area, &theme(Depth::True), &mut buffer);
        assert_eq!(shown, Err("no clusters".to_owned()));
    }
}
