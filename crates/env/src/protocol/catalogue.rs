//! The catalogue of tools to which recorded action sets refer: CREATE's own, or one from a file.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::lines::{Lines, LinesError};
use super::recorded::Recorded;
use crate::ActionSet;
use mge_base::validation::ValidationError;
use mge_physics::{NO_OP, Tool, catalogue_tool};

/// Tools by number.
#[derive(Debug, Clone)]
pub struct Catalogue {
    /// None is the no-op.
    tools: BTreeMap<usize, Option<Tool>>,
}

impl Catalogue {
    /// CREATE's catalogue.
    pub fn of_create() -> Self {
        Self { tools: (0..=NO_OP).map(|number| (number, catalogue_tool(number).copied())).collect() }
    }

    /// Reads a catalogue, one tool per line; `origin` names it in errors.
    ///
    /// # Errors
    /// At the first line that is not a tool with a number.
    pub fn read(input: impl BufRead, origin: &str) -> Result<Self, LinesError> {
        let mut tools = BTreeMap::new();
        Lines::new(input, origin).each(|entry: Recorded| {
            let number = entry.tool_id.ok_or_else(|| ValidationError::new("tool_id", "is missing"))?;
            tools.insert(number, if entry.r#type == "no_op" { None } else { Some(entry.tool_at([0.0; 2])?) });
            Ok(())
        })?;
        Ok(Self { tools })
    }

    /// The action set of a recorded episode.
    ///
    /// # Errors
    /// At the first number that is not in the catalogue.
    pub(super) fn action_set(&self, inventory: &[usize]) -> Result<ActionSet, ValidationError> {
        let entry = |(i, number): (usize, &usize)| {
            let missing = || {
                let message = format_args!("is {number}, but the catalogue has no such tool");
                ValidationError::new(format_args!("inventory[{i}]"), message)
            };
            Ok((*number, *self.tools.get(number).ok_or_else(missing)?))
        };
        Ok(ActionSet::new(inventory.iter().enumerate().map(entry).collect::<Result<Vec<_>, _>>()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_catalogue_is_read_and_mistakes_name_the_line() {
        let ramp = r#"{"type":"ramp","tool_id":7,"length":6.5,"angle":0.5,"elasticity":0.25,"friction":1.0}"#;
        let no_op = r#"{"kind":"tool","type":"no_op","tool_id":3,"split":["train"]}"#;
        let read = |text: &str| Catalogue::read(text.as_bytes(), "tools.jsonl");
        let catalogue = read(&format!("{ramp}\n{no_op}\n")).unwrap();
        let set = catalogue.action_set(&[3, 7]).unwrap();
        let tools: Vec<Option<(f64, f64)>> = set.tools().map(|tool| tool.map(|tool| (tool.size, tool.angle))).collect();
        assert_eq!((tools, set.numbers().collect::<Vec<_>>()), (vec![None, Some((6.5, 0.5))], vec![3, 7]));
        let missing = catalogue.action_set(&[3, 8]).unwrap_err().to_string();
        assert_eq!(missing, "inventory[1]: is 8, but the catalogue has no such tool");
        for (text, expected) in [
            (ramp.replace("6.5", "0"), "tools.jsonl:1: length: is 0"),
            (ramp.replace("\"tool_id\":7,", ""), "tools.jsonl:1: tool_id: is missing"),
            (no_op.replace("3", "-3"), "tools.jsonl:1"),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
