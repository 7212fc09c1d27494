//! Converts the SVG of a page to PDF.

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::writers::ExtGraphicsState;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{Path, PathSegment, Point, Transform};
use resvg::usvg::{Group, Node, Paint, Tree};

use super::error::FigureError;
use super::provenance::Provenance;
use super::render::{POINTS, tree};

/// A one-page PDF, with text as outlines and the provenance as document information.
///
/// # Errors
/// When the SVG is invalid.
pub fn pdf(svg: &str, provenance: &Provenance) -> Result<Vec<u8>, FigureError> {
    let tree = tree(svg)?;
    let (width, height) = (tree.size().width() * POINTS, tree.size().height() * POINTS);
    let page = Page::of(&tree);

    let [catalog, pages, only, content, information] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([only]).count(1);
    let mut sheet = pdf.page(only);
    sheet.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = sheet.resources();
    let mut states = resources.ext_g_states();
    for opacity in &page.opacities {
        let share = f32::from(*opacity) / 255.0;
        states
            .insert(Name(state(*opacity).as_bytes()))
            .start::<ExtGraphicsState<'_>>()
            .non_stroking_alpha(share)
            .stroking_alpha(share);
    }
    states.finish();
    resources.finish();
    sheet.finish();
    let packed = compress_to_vec_zlib(&page.content.finish(), 6);
    pdf.stream(content, &packed).filter(Filter::FlateDecode);
    let mut facts = pdf.document_info(information);
    for (keyword, text) in provenance.chunks() {
        facts.pair(Name(keyword.replace(' ', "").as_bytes()), TextStr(&text));
    }
    facts.finish();
    Ok(pdf.finish())
}

/// Name of the graphics state for an opacity.
fn state(opacity: u8) -> String {
    format!("a{opacity}")
}

/// The drawing operators of a page, and the opacities they use.
struct Page {
    content: Content,
    opacities: Vec<u8>,
}

impl Page {
    fn of(tree: &Tree) -> Self {
        let mut page = Self { content: Content::new(), opacities: Vec::new() };
        // All strokes of figures are round.
        page.content.set_line_cap(LineCapStyle::RoundCap).set_line_join(LineJoinStyle::RoundJoin);
        let to_points = Transform::from_row(POINTS, 0.0, 0.0, -POINTS, 0.0, tree.size().height() * POINTS);
        page.group(tree.root(), to_points);
        page
    }

    /// Groups of figures have a transformation and a clip, and no opacity of their own.
    fn group(&mut self, group: &Group, around: Transform) {
        let transform = around.pre_concat(group.transform());
        self.content.save_state();
        // Figures clip to rectangles only.
        if let Some(clip) = group.clip_path() {
            for part in clip.root().children() {
                if let Node::Path(path) = part {
                    self.outline(path.data(), transform.pre_concat(clip.transform()));
                    self.content.clip_nonzero().end_path();
                }
            }
        }
        for node in group.children() {
            match node {
                Node::Group(group) => self.group(group, transform),
                Node::Text(text) => self.group(text.flattened(), transform),
                Node::Path(path) => {
                    self.content.save_state();
                    self.path(path, transform);
                    self.content.restore_state();
                }
                Node::Image(_) => {}
            }
        }
        self.content.restore_state();
    }

    fn path(&mut self, path: &resvg::usvg::Path, transform: Transform) {
        if let Some((fill, color)) = path.fill().and_then(|fill| Some((fill, color(fill.paint())?))) {
            self.opacity(fill.opacity().get());
            self.content.set_fill_rgb(color[0], color[1], color[2]);
            self.outline(path.data(), transform);
            self.content.fill_nonzero();
        }
        if let Some((stroke, color)) = path.stroke().and_then(|stroke| Some((stroke, color(stroke.paint())?))) {
            self.opacity(stroke.opacity().get());
            self.content.set_stroke_rgb(color[0], color[1], color[2]);
            let scale = transform.get_scale().0;
            self.content.set_line_width(stroke.width().get() * scale);
            if let Some(lengths) = stroke.dasharray() {
                self.content.set_dash_pattern(lengths.iter().map(|length| length * scale), 0.0);
            }
            self.outline(path.data(), transform);
            self.content.stroke();
        }
    }

    fn opacity(&mut self, opacity: f32) {
        let opacity = (opacity * 255.0).round() as u8;
        if !self.opacities.contains(&opacity) {
            self.opacities.push(opacity);
        }
        self.content.set_parameters(Name(state(opacity).as_bytes()));
    }

    fn outline(&mut self, path: &Path, transform: Transform) {
        // A degenerate transformation leaves nothing to draw.
        let Some(path) = path.clone().transform(transform) else { return };
        let mut last = Point::zero();
        for segment in path.segments() {
            match segment {
                PathSegment::MoveTo(to) => _ = self.content.move_to(to.x, to.y),
                PathSegment::LineTo(to) => _ = self.content.line_to(to.x, to.y),
                PathSegment::QuadTo(control, to) => {
                    // The equivalent cubic curve.
                    let near = |end: Point| [(2.0 * control.x + end.x) / 3.0, (2.0 * control.y + end.y) / 3.0];
                    let ([ax, ay], [bx, by]) = (near(last), near(to));
                    self.content.cubic_to(ax, ay, bx, by, to.x, to.y);
                }
                PathSegment::CubicTo(a, b, to) => _ = self.content.cubic_to(a.x, a.y, b.x, b.y, to.x, to.y),
                PathSegment::Close => _ = self.content.close_path(),
            }
            if let PathSegment::MoveTo(to)
            | PathSegment::LineTo(to)
            | PathSegment::QuadTo(_, to)
            | PathSegment::CubicTo(_, _, to) = segment
            {
                last = to;
            }
        }
    }
}

/// The colour of a paint. Figures use only plain colours.
fn color(paint: &Paint) -> Option<[f32; 3]> {
    match paint {
        Paint::Color(color) => Some([color.red, color.green, color.blue].map(|channel| f32::from(channel) / 255.0)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::{TextFormat, svg};
    use crate::geometry::Rect;
    use crate::style::INK;

    #[test]
    fn shapes_texts_and_clips_are_in_the_same_place() {
        let place = Rect::new(150.0, 60.0, 156.0, 66.0);
        let drawings: [&dyn Fn(&crate::Canvas); 3] = [
            &|canvas| canvas.fill(&place.corners(), INK),
            &|canvas| canvas.text(place.center(), "I", TextFormat::LABEL.centered()),
            &|canvas| canvas.within(&place, &[[0.0, 0.0]], |_| canvas.fill(&place.corners(), INK)),
        ];
        for (n, draw) in drawings.into_iter().enumerate() {
            let page = Page::of(&tree(&svg([200.0, 100.0], 1.0, "", draw)).unwrap());
            let content = String::from_utf8(page.content.finish().to_vec()).unwrap();
            // The first path is the background.
            let starts: Vec<&str> = content.lines().filter_map(|line| line.strip_suffix(" m")).skip(1).collect();
            assert!(!starts.is_empty(), "{content}");
            for start in starts {
                let numbers: Vec<f64> = start.split(' ').map(|number| number.parse().unwrap()).collect();
                assert!((149.0..157.0).contains(&numbers[0]) && (33.0..41.0).contains(&numbers[1]), "{n}: {start}");
            }
        }
    }
}
