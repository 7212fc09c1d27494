//! The preview on the Figures screen: a figure made in the background and, for a terminal that shows pictures, drawn at
//! display size and encoded.

use std::sync::Arc;
use std::time::Duration;

use image::{DynamicImage, RgbImage};
use ratatui::prelude::*;
use ratatui_image::picker::Picker;
use ratatui_image::protocol::Protocol;
use ratatui_image::{Image, Resize};

use crate::tui::widgets::layout::centred;
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

/// A figure made in the background.
#[derive(Default)]
pub struct Preview {
    /// How the terminal shows pictures, if it does.
    pub graphics: Option<Picker>,
    made: Loader<PreviewRequest, Made>,
}

/// What was made of a figure: a picture, or for a terminal that shows none, the figure itself.
enum Made {
    Picture(Protocol),
    Figure(Box<dyn Figure + Send>),
}

/// Minimum time between two pictures of a figure whose contents change.
const PAUSE: Duration = Duration::from_secs(2);
/// The same as a multiple of the time a picture takes to draw, so that trainings are not slowed down.
const PAUSE_FACTOR: u32 = 40;

impl Preview {
    /// Takes over a finished picture, and starts drawing the wanted one if it is a different one. True if
    /// there is something new to show.
    pub fn update(&mut self, wanted: &PreviewRequest, figure: impl FnOnce() -> Result<FigureJob, String>) -> bool {
        let is_new = self.made.poll();
        let is_rested = self.made.is_rested(PAUSE, PAUSE_FACTOR);
        let is_current = |known: &PreviewRequest| known == wanted || (!is_rested && known.is_like(wanted));
        if self.made.is_loading() || self.made.latest(is_current).is_some() {
            return is_new;
        }
        let (figure, graphics, room) = (figure(), self.graphics.clone(), wanted.room);
        self.made.request(wanted.clone(), Duration::ZERO, move |_| {
            let figure = figure?(&mut |_, _| ())?.figure;
            match graphics {
                Some(picker) => picture(&*figure, &picker, room).map(Made::Picture),
                None => Ok(Made::Figure(figure)),
            }
        });
        is_new
    }

    /// Whether a picture is being drawn.
    #[cfg(test)]
    pub fn is_drawing(&self) -> bool {
        self.made.is_loading()
    }

    /// Drops the picture, because a terminal that was left no longer has it.
    pub fn forget(&mut self) {
        self.made = Loader::default();
    }

    /// Draws the picture of a kind of figure in the middle of `area`. Those that may show through layers are not drawn
    /// while `under` one. For a terminal that shows no pictures, returns what it was asked for and the figure.
    ///
    /// # Errors
    /// The text to show if there is nothing yet.
    pub fn draw(
        &self,
        kind: FigureKind,
        under: bool,
        area: Rect,
        buffer: &mut Buffer,
    ) -> Result<Option<(&PreviewRequest, &dyn Figure)>, String> {
        let picture = match self.made.latest(|wanted| wanted.kind == kind) {
            Some((_, Ok(Made::Picture(picture)))) => picture,
            Some((wanted, Ok(Made::Figure(figure)))) => return Ok(Some((wanted, &**figure))),
            Some((_, Err(reason))) => return Err(reason.clone()),
            None => return Err("drawing ...".to_owned()),
        };
        let Size { width, height } = picture.size();
        if width > area.width || height > area.height {
            return Err("drawing ...".to_owned());
        }
        if !(under && matches!(picture, Protocol::Sixel(_) | Protocol::ITerm2(_))) {
            Image::new(picture).render(centred(width, height, area), buffer);
        }
        Ok(None)
    }
}

/// Draws the figure as large as fits.
fn picture(figure: &dyn Figure, picker: &Picker, room: [u16; 2]) -> Result<Protocol, String> {
    let cell = picker.font_size();
    let [width, height] = [(room[0], cell.width), (room[1], cell.height)].map(|(n, of)| u32::from(n) * u32::from(of));
    let bytes = figure.to_rgb(width, height).map_err(|error| error.to_string())?;
    let image = RgbImage::from_raw(width, height, bytes).ok_or("the picture has the wrong size")?;
    let (image, size) = (DynamicImage::from(image), Size::new(room[0], room[1]));
    picker.new_protocol(image, size, Resize::Fit(None)).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_figures::TaskGrid;
    use mge_results::Composed;
    use ratatui_image::picker::ProtocolType;

    fn figure() -> Result<FigureJob, String> {
        let figure = Box::new(TaskGrid { tasks: vec![mge_task::load("task1").unwrap()] });
        Ok(Box::new(|_| Ok(Composed { figure, seeds: vec![], config_hash: String::new(), remark: String::new() })))
    }

    fn wanted(kind: FigureKind) -> PreviewRequest {
        let task = Arc::new(mge_task::load("task1").unwrap());
        PreviewRequest { kind, composition: Composition::default(), task, prior: None, progress: 0, room: [40, 20] }
    }

    /// A picture by a protocol, or the figure itself.
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

    #[test]
    fn each_protocol_uses_its_own_sequences() {
        let text = |protocol, covered| {
            let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 20));
            let preview = shown(protocol);
            let figure = preview.draw(FigureKind::Scene, covered, buffer.area, &mut buffer).unwrap();
            assert_eq!(figure.is_some(), protocol.is_none());
            buffer.content.iter().map(|cell| cell.symbol()).collect::<String>()
        };
        assert!(text(Some(ProtocolType::Sixel), false).contains("\x1bP"));
        assert!(!text(Some(ProtocolType::Sixel), true).contains("\x1bP"), "a layer cannot cover it");
        assert!(text(Some(ProtocolType::Kitty), false).contains("\x1b_G"));
        assert!(text(Some(ProtocolType::Iterm2), false).contains("\x1b]1337"));
        assert_eq!(text(None, false).trim(), "");
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
        let mut preview = shown(Some(ProtocolType::Halfblocks));
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 40));
        let drawing = |preview: &Preview, area: Rect, buffer: &mut Buffer| {
            preview.draw(FigureKind::Scene, false, area, buffer).map(|figure| figure.is_some())
        };
        let not_yet = Err("drawing ...".to_owned());
        for small in [Rect::new(0, 0, 3, 40), Rect::new(0, 0, 40, 3)] {
            assert_eq!(drawing(&preview, small, &mut buffer), not_yet);
        }
        let area = buffer.area;
        assert_eq!(drawing(&preview, area, &mut buffer), Ok(false));
        let is_drawn = |y: u16| (0..40u16).any(|x| buffer[(x, y)].symbol() != " ");
        assert_eq!([0, 5, 20, 34, 39].map(is_drawn), [false, false, true, false, false]);
        preview.forget();
        assert_eq!(drawing(&preview, area, &mut buffer), not_yet);
    }

    #[test]
    fn the_reason_for_a_missing_picture_is_shown() {
        let mut preview = Preview::default();
        let wanted = wanted(FigureKind::Clusters);
        while !preview.update(&wanted, || Err("no clusters".into())) {
            std::thread::yield_now();
        }
        let mut buffer = Buffer::empty(Rect::new(0, 0, 40, 20));
        let shown = preview.draw(FigureKind::Clusters, false, buffer.area, &mut buffer);
        assert_eq!(shown.err(), Some("no clusters".to_owned()));
    }
}
