//! Tools that are chosen by their pictures.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::picker::Pictured;
use super::search::Searched;
use crate::tui::scene::picture;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::theme::Theme;
use mge_physics::{NO_OP, Tool, ToolKind, catalogue_tool};
use mge_task::Property;

/// A tool that can be chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolItem {
    /// The tool; its position does not matter.
    pub tool: Tool,
    /// Its description.
    text: String,
    /// It is one of CREATE's catalogue, not the usual one of its type.
    is_variant: bool,
}

impl ToolItem {
    fn new(tool: Tool, is_variant: bool) -> Self {
        Self { tool, text: tool_text(&tool, true), is_variant }
    }

    /// Every type, then the tools of CREATE's catalogue.
    pub fn all() -> Vec<Self> {
        let usual = |kind| Self::new(Tool::new(kind, [0.0; 2]), false);
        let of_catalogue = |number| Some(Self::new(*catalogue_tool(number)?, true));
        ToolKind::ALL.into_iter().map(usual).chain((0..NO_OP).filter_map(of_catalogue)).collect()
    }
}

impl Searched for ToolItem {
    fn names(&self) -> Vec<&str> {
        vec![self.tool.kind.name()]
    }

    fn about(&self) -> &str {
        &self.text
    }
}

impl Pictured for ToolItem {
    const ROWS: u16 = 4;

    fn shown_name(&self, columns: usize) -> String {
        let name = self.tool.kind.name();
        if !self.is_variant {
            return name.to_owned();
        }
        // What tells it from the others of its type is kept.
        let text = tool_text(&self.tool, false);
        let properties = &text[name.len()..];
        shortened(&(shortened(name, columns.saturating_sub(properties.len()), false) + properties), columns, true)
    }

    fn draw(&self, area: Rect, theme: &Theme, buffer: &mut Buffer) {
        picture(&self.tool, area, theme, buffer);
    }

    fn family(&self) -> Option<&str> {
        self.is_variant.then(|| self.tool.kind.name())
    }
}

/// The type of a tool, its size and its unusual properties, with the names of the properties or only their initials.
pub fn tool_text(tool: &Tool, named: bool) -> String {
    let size = Some((Property::Size, Property::Size.of(tool))).filter(|_| tool.kind.has_size());
    let others = Property::unusual(tool).into_iter().filter(|(property, _)| *property != Property::Size);
    let word = |(property, value): (Property, f64)| match property {
        _ if named => format!(" {property} {value}"),
        Property::Size => format!(" {value}"),
        _ => format!(" {}{value}", &property.name()[..1]),
    };
    tool.kind.to_string() + &size.into_iter().chain(others).map(word).collect::<String>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tool_of_the_catalogue_is_named_with_its_size_and_all_that_is_unusual() {
        let tool = Tool::new(ToolKind::Trampoline, [0.0; 2]);
        assert_eq!(ToolItem::new(tool, false).shown_name(17), "trampoline");
        let tool = tool.with_size(14.0);
        let text = tool_text(&tool, false);
        assert!(text.starts_with("trampoline 14"), "{text}");
        let names = ToolItem::all().into_iter().filter(|item| item.is_variant).map(|item| (item.shown_name(17), item));
        for (name, item) in names {
            let text = tool_text(&item.tool, false);
            assert!(
                name.len() <= 17 && name.ends_with(text.trim_start_matches(item.tool.kind.name())),
                "{name}: {text}"
            );
        }
    }
}
