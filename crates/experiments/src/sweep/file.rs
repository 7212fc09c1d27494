//! The syntax of a sweep file: settings and their values.

use std::fmt::Display;
use std::sync::LazyLock;

use serde_json::{Map, Value};

use super::values::{Distribution, Samples, expanded, of_kind};
use crate::error::{ExperimentError, Result};
use mge_base::json;
use mge_base::text::without_mark;
use mge_base::validation::ValidationError;
use mge_task::shipped;
use mge_trainer::RunConfig;

/// Maximum number of combinations of all grids together; more are most likely a mistake.
pub(super) const MAX_COMBINATIONS: usize = 10_000;

/// The settings whose value is a list itself. Of these, a list of numbers is one value.
static LISTS: LazyLock<Vec<String>> = LazyLock::new(|| {
    let config = shipped().into_iter().next().map(|task| json::to_value(&RunConfig::usual_for(task.into())));
    let config = config.unwrap_or_default();
    let lists =
        json::leaf_values(&config).into_iter().filter(|(path, value)| !path.starts_with("task.") && value.is_array());
    lists.map(|(path, _)| path).collect()
});

/// Settings and their values, in file order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Grid {
    /// `train` for agents, the default, or `dynamics` for dynamics models.
    pub kind: Option<Value>,
    /// The settings.
    pub axes: Vec<Axis>,
    /// Combinations that are left out: those with one of the values of each setting.
    pub exclude: Vec<Vec<Axis>>,
}

/// A setting and its values.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Name of the setting.
    pub key: String,
    /// Its values, at least one.
    pub values: Vec<Value>,
    /// Whether it is written as a list, which makes it part of the names of the runs.
    pub is_list: bool,
    /// Whether the values are samples, which vary together with those of the other sampled settings.
    pub is_sampled: bool,
}

/// A setting with one of its values. One for each setting of a grid is a combination.
#[derive(Debug, Clone, Copy)]
pub(super) struct Choice<'a> {
    /// The setting.
    pub axis: &'a Axis,
    /// The index of its value.
    number: usize,
}

impl<'a> Choice<'a> {
    /// Name of the setting.
    pub fn key(&self) -> &'a str {
        &self.axis.key
    }

    /// The value.
    pub fn value(&self) -> &'a Value {
        &self.axis.values[self.number]
    }

    /// JSON path of the value, such as `ddpg.gamma[1]`.
    pub fn path(&self) -> String {
        if self.axis.is_list { format!("{}[{}]", self.axis.key, self.number) } else { self.axis.key.clone() }
    }

    /// An error at the value.
    pub fn wrong(&self, message: impl Display) -> ValidationError {
        ValidationError::new(self.path(), message)
    }
}

/// Reads a sweep file: its grids, with their JSON paths, `.` if there is only one. `origin` names it in errors.
///
/// # Errors
/// At the first mistake, with its line, and when there are too many combinations.
pub(super) fn grids(text: &[u8], origin: &str) -> Result<Vec<(String, Grid)>> {
    let is_list = without_mark(text).trim_ascii_start().starts_with(b"[");
    let objects: Vec<Map<String, Value>> =
        if is_list { json::parse(text, origin)? } else { vec![json::parse(text, origin)?] };
    let (mut grids, mut count) = (Vec::new(), Some(0usize));
    for (number, object) in objects.into_iter().enumerate() {
        let path = if is_list { format!("[{number}]") } else { ".".to_owned() };
        let grid = Grid::new(object).map_err(|problem| invalid(text, origin, &path, problem))?;
        count = count.and_then(|count| count.checked_add(grid.count()?));
        grids.push((path, grid));
    }
    if count.is_none_or(|count| count > MAX_COMBINATIONS) {
        let message = format!("makes more than {MAX_COMBINATIONS} combinations: shorten the lists");
        return Err(invalid(text, origin, ".", ValidationError::new(".", message)));
    }
    Ok(grids)
}

/// The error at the JSON path of a problem, in the grid at the path `grid`, with its line.
pub(super) fn invalid(text: &[u8], origin: &str, grid: &str, problem: ValidationError) -> ExperimentError {
    let problem = if grid == "." { problem } else { problem.within(grid) };
    let line = json::line_of(text, &problem.path).unwrap_or(1);
    ExperimentError::Invalid { origin: format!("{origin}:{line}"), problem }
}

impl Grid {
    /// The grid of an object of settings.
    fn new(entries: Map<String, Value>) -> Result<Self, ValidationError> {
        let (mut grid, mut samples, mut drawn) = (Self::default(), None, Vec::new());
        for (key, value) in entries {
            match (key.as_str(), value) {
                ("kind", value) => grid.kind = Some(value),
                ("samples", value) => samples = Some(of_kind::<Samples>(&key, value)?),
                ("exclude", value) => grid.exclude = exclusions(value)?,
                (_, value @ Value::Object(_)) => {
                    drawn.push(of_kind::<Distribution>(&key, value)?.checked(&key)?);
                    grid.axes.push(Axis { key, values: Vec::new(), is_list: true, is_sampled: true });
                }
                (_, value) => grid.axes.push(Axis::new(key, value)?),
            }
        }
        match samples {
            Some(samples) if !drawn.is_empty() => {
                let columns = samples.draw(&drawn)?.into_iter();
                grid.axes
                    .iter_mut()
                    .filter(|axis| axis.is_sampled)
                    .zip(columns)
                    .for_each(|(axis, values)| axis.values = values);
            }
            None if drawn.is_empty() => {}
            Some(_) => {
                return Err(ValidationError::new(
                    "samples",
                    "no setting has samples: give one {\"uniform\": [0.9, 0.99]}",
                ));
            }
            None => return Err(ValidationError::new("samples", "is missing: give {\"count\": 20, \"seed\": 0}")),
        }
        let unknown = |axis: &&Axis| grid.axes.iter().all(|known| known.key != axis.key);
        match grid.exclude.iter().flatten().find(unknown) {
            Some(axis) => Err(ValidationError::new("exclude", format!("the sweep does not set `{}`", axis.key))),
            None => Ok(grid),
        }
    }

    /// Number of combinations; None if it cannot be represented.
    fn count(&self) -> Option<usize> {
        let samples = self.axes.iter().find(|axis| axis.is_sampled);
        let mut axes = self.axes.iter().filter(|axis| !axis.is_sampled).chain(samples);
        axes.try_fold(1usize, |count, axis| count.checked_mul(axis.values.len()))
    }

    /// All combinations that are not excluded; the last axis varies fastest.
    pub fn combinations<'a>(&'a self) -> Vec<Vec<Choice<'a>>> {
        let mut combinations = vec![Vec::new()];
        for axis in &self.axes {
            let longer = |combination: Vec<Choice<'a>>| {
                let sample = combination.iter().find(|choice| choice.axis.is_sampled && axis.is_sampled);
                let numbers = sample.map_or(0..axis.values.len(), |sample| sample.number..sample.number + 1);
                numbers.map(move |number| [&*combination, &[Choice { axis, number }]].concat())
            };
            combinations = combinations.into_iter().flat_map(longer).collect();
        }
        let has_one = |axis: &Axis, chosen: &[Choice<'_>]| {
            chosen.iter().any(|choice| choice.key() == axis.key && axis.values.contains(choice.value()))
        };
        combinations.retain(|chosen| !self.exclude.iter().any(|all| all.iter().all(|axis| has_one(axis, chosen))));
        combinations
    }

    /// The sweep file of a single combination, which gives the run the same settings and name.
    pub fn alone(&self, chosen: &[Choice<'_>]) -> Value {
        let mut object = Map::new();
        object.extend(self.kind.clone().map(|kind| ("kind".to_owned(), kind)));
        for choice in chosen {
            let value = choice.value().clone();
            object.insert(choice.key().to_owned(), if choice.axis.is_list { Value::Array(vec![value]) } else { value });
        }
        Value::Object(object)
    }
}

impl Axis {
    /// The setting of an entry, with all its values.
    fn new(key: String, value: Value) -> Result<Self, ValidationError> {
        let takes_list = LISTS.contains(&key);
        let is_value = |value: &Value| !value.is_object() && (takes_list || !value.is_array());
        let (values, is_list) = match value {
            Value::Array(values) if takes_list && values.iter().all(Value::is_number) => {
                (vec![Value::Array(values)], false)
            }
            Value::Array(values) => (values, true),
            value => (vec![value], false),
        };
        if values.is_empty() {
            return Err(ValidationError::new(key, "is an empty list: give it a value"));
        }
        if !values.iter().all(is_value) {
            return Err(ValidationError::new(key, "must have values that are numbers, texts, true, false or null"));
        }
        let (values, has_range) = expanded(&key, values)?;
        Ok(Self { key, values, is_list: is_list || has_range, is_sampled: false })
    }
}

/// Reads the entry `exclude`: an object, or a list of objects.
fn exclusions(value: Value) -> Result<Vec<Vec<Axis>>, ValidationError> {
    let objects = if let Value::Array(objects) = value { objects } else { vec![value] };
    let exclusion = |object: Value| {
        let entries: Map<String, Value> = of_kind("exclude", object)?;
        entries.into_iter().map(|(key, value)| Axis::new(key, value)).collect()
    };
    objects.into_iter().map(exclusion).collect()
}
