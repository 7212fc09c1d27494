//! Tool sets: what a model knows, in one order and under one name.

use super::error::{DynamicsError, Result};
use crate::physics::ToolKind;

/// Names of a tool set in canonical order, joined by hyphens.
pub fn tool_set_name(tools: &[ToolKind]) -> String {
    tools.iter().map(|tool| tool.name()).collect::<Vec<_>>().join("-")
}

/// The tool set in canonical order.
///
/// # Errors
/// When it is empty or names a type twice.
pub fn canonical_tool_set(tools: &[ToolKind]) -> Result<Vec<ToolKind>> {
    let mut sorted = tools.to_vec();
    sorted.sort_unstable();
    sorted.dedup();
    if sorted.is_empty() || sorted.len() != tools.len() {
        return Err(DynamicsError::ToolSet { given: tool_set_name(tools) });
    }
    Ok(sorted)
}
