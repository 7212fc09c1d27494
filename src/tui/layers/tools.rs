//! Tools that are chosen by their pictures.

use super::picker::Item;
use mge_physics::{NO_OP, Tool, ToolKind, catalogue_tool};
use mge_task::Property;

/// Every type of tool, then the tools of CREATE's catalogue as variants of it.
pub fn tools() -> Vec<Item<Tool>> {
    let item = |of: Tool, is_variant: bool| {
        let name = of.kind.to_string();
        let variant = is_variant.then(|| tool_text(&of, false).replacen(&name, "", 1));
        Item { name, variant, about: tool_text(&of, true), of }
    };
    let usual = ToolKind::ALL.into_iter().map(|kind| item(Tool::new(kind, [0.0; 2]), false));
    usual.chain((0..NO_OP).filter_map(|number| Some(item(*catalogue_tool(number)?, true)))).collect()
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
