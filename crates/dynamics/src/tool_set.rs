//! Tool sets of models, with canonical order and name.

use std::fmt;
use std::str::FromStr;

use super::config::ModelConfig;
use super::error::{DynamicsError, Result};
use mge_physics::ToolKind;

/// The name of the set of all of CREATE's tools, with their properties.
const CREATE: &str = "create";

/// The tools that a model should support, as users name them.
///
/// `box,bucket` stands for these types in CREATE's default form and material, of any size. `create`
/// stands for all types, with all properties of CREATE's tools.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ToolSet {
    kinds: Vec<ToolKind>,
    properties: bool,
}

impl ToolSet {
    /// The types, in the order in which they were named.
    pub fn kinds(&self) -> &[ToolKind] {
        &self.kinds
    }

    /// `config` for a model of these tools.
    pub fn apply(&self, config: ModelConfig) -> ModelConfig {
        ModelConfig { properties: self.properties, ..config }
    }
}

impl FromStr for ToolSet {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == CREATE {
            return Ok(Self { kinds: ToolKind::ALL.to_vec(), properties: true });
        }
        let kinds = text.split(',').map(|kind| kind.trim().parse());
        let kinds =
            kinds.collect::<Result<_, String>>().map_err(|error| format!("{error} (`{CREATE}` means all of them)"))?;
        Ok(Self { kinds, properties: false })
    }
}

impl fmt::Display for ToolSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.properties {
            return f.write_str(CREATE);
        }
        f.write_str(&self.kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(","))
    }
}

/// Names of a tool set in canonical order, joined by hyphens.
pub fn tool_set_name(tools: &[ToolKind]) -> String {
    tools.iter().map(|tool| tool.name()).collect::<Vec<_>>().join("-")
}

/// The name of a model of these tools, in canonical order.
pub fn model_name(config: &ModelConfig, tools: &[ToolKind]) -> String {
    if config.properties && tools == ToolKind::ALL { CREATE.to_owned() } else { tool_set_name(tools) }
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
