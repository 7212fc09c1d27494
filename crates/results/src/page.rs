//! A report as one HTML page that can be sent: text, sortable tables, and the figures in it as SVG.

use std::path::Path;

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, html};

use mge_base::atomic::Format;

/// The page around the text: style, and the order of a table's rows by the column that is clicked.
const FRAME: &str = include_str!("page.html");
/// Where the text is in the frame.
const TEXT: &str = "<!-- report -->";
/// What the head of every page has.
const GENERATOR: &str = "<meta name=\"generator\" content=\"mge\">";

/// The format of such pages.
pub const PAGE: Format<'static> = Format {
    name: "a report",
    is: &|found| str::from_utf8(found).is_ok_and(|text| text.lines().take(10).any(|line| line == GENERATOR)),
};

/// The page of a report in Markdown, whose links to figures begin at `folder`. Of a figure without an SVG file, it has
/// only the caption.
pub fn page(markdown: &str, folder: &Path) -> String {
    let mut text = String::new();
    html::push_html(&mut text, Parser::new_ext(markdown, Options::ENABLE_TABLES).map(|event| shown(event, folder)));
    FRAME.replace(TEXT, &text)
}

fn shown<'a>(event: Event<'a>, folder: &Path) -> Event<'a> {
    match event {
        Event::Start(Tag::Image { dest_url, link_type, title, id }) => {
            let picture = std::fs::read(folder.join(&*dest_url).with_extension("svg"));
            let picture = picture.map(|svg| format!("data:image/svg+xml;base64,{}", BASE64_STANDARD.encode(svg)));
            let dest_url = picture.map_or(CowStr::Borrowed(""), CowStr::from);
            Event::Start(Tag::Image { dest_url, link_type, title, id })
        }
        Event::Html(html) | Event::InlineHtml(html) => Event::Text(html),
        event => event,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_the_tables_and_the_figures_and_no_foreign_markup() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.svg"), "<svg/>").unwrap();
        let text = "# Runs\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\n![A](a.png) ![B](b.png)\n\n<script>x</script>\n";
        let page = page(text, folder.path());
        assert!(page.contains("<td>1</td>") && page.contains("<h1>Runs</h1>"), "{page}");
        assert!(page.contains("src=\"data:image/svg+xml;base64,PHN2Zy8+\" alt=\"A\""), "{page}");
        assert!(page.contains("&lt;script&gt;x"), "{page}");
        assert!((PAGE.is)(page.as_bytes()) && !(PAGE.is)(b"<html>"));
    }
}
