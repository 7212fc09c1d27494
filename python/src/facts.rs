//! Facts about episodes (the `info` of Gymnasium), as columns.

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::arrays::{fill, zeros};
use mge_env::{EndReason, Info, Placement, VectorEnvironment};

/// Placement outcomes in the order of their codes, from 1; 0 means "not known yet". The length is that of the enum, so
/// that a new variant before the last does not compile unless it is listed.
const PLACEMENTS: [Placement; Placement::NoOp as usize + 1] =
    [Placement::Placed, Placement::Overlap, Placement::Collision, Placement::Invalid, Placement::NoOp];

/// The names of the codes of `placement` and `end`, as in `mge env serve`; None for code 0, "not yet".
#[pyfunction]
pub fn words() -> [Vec<Option<String>>; 2] {
    fn names(values: &[impl serde::Serialize]) -> Vec<Option<String>> {
        let name = |value| serde_json::to_value(value).ok().and_then(|name| name.as_str().map(str::to_owned));
        std::iter::once(None).chain(values.iter().map(name)).collect()
    }
    [names(&PLACEMENTS), names(&EndReason::ALL)]
}

/// Facts about some episodes, as columns.
pub struct Facts {
    success: Py<PyArray1<bool>>,
    subgoals: Py<PyArray2<bool>>,
    placed: Py<PyArray1<i64>>,
    placement: Py<PyArray1<u8>>,
    end: Py<PyArray1<u8>>,
    /// Numbers of the tools in the action sets, where agents choose among tools.
    tools: Option<Py<PyArray2<i64>>>,
}

impl Facts {
    /// Empty facts about `count` episodes.
    pub fn new(py: Python<'_>, count: usize, env: &VectorEnvironment) -> Self {
        let tools = env.tool_count().map(|tools| PyArray2::zeros(py, [count, tools], false).unbind());
        Self {
            tools,
            success: zeros(py, count),
            subgoals: PyArray2::zeros(py, [count, env.template().loaded_task().subgoals.len()], false).unbind(),
            placed: zeros(py, count),
            placement: zeros(py, count),
            end: zeros(py, count),
        }
    }

    /// Writes the facts of every environment.
    pub fn write<'a>(&self, py: Python<'_>, infos: impl Iterator<Item = &'a Info> + Clone) -> PyResult<()> {
        fill(py, &self.success, infos.clone().map(|info| info.goal))?;
        fill(py, &self.placed, infos.clone().map(|info| info.placed as i64))?;
        fill(py, &self.placement, infos.clone().map(|info| info.placement.map_or(0, |placement| placement as u8 + 1)))?;
        fill(py, &self.end, infos.clone().map(|info| info.end.map_or(0, |end| end as u8 + 1)))?;
        fill(py, &self.subgoals, infos.flat_map(|info| info.subgoals.iter().copied()))
    }

    /// Writes the numbers of the tools in the action sets.
    pub fn write_tools(&self, py: Python<'_>, numbers: impl Iterator<Item = usize>) -> PyResult<()> {
        let Some(tools) = &self.tools else { return Ok(()) };
        fill(py, tools, numbers.map(|number| number as i64))
    }

    /// The arrays by name.
    pub fn dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("is_success", &self.success)?;
        dict.set_item("subgoals", &self.subgoals)?;
        dict.set_item("placed", &self.placed)?;
        dict.set_item("placement", &self.placement)?;
        dict.set_item("end", &self.end)?;
        if let Some(tools) = &self.tools {
            dict.set_item("tools", tools)?;
        }
        Ok(dict)
    }
}
