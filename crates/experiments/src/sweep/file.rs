//! The syntax of a sweep file: settings and their values.

use serde::de::{Deserialize, Deserializer, Error, MapAccess, Visitor};
use serde_json::{Map, Value};

use mge_base::validation::ValidationError;

/// Maximum number of combinations of all grids together; more are most likely a mistake.
const MAX_COMBINATIONS: usize = 10_000;

/// The content of a sweep file: one grid, or several.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SweepFile {
    /// The grids, with their JSON paths: `.` if there is only one.
    pub grids: Vec<(String, Grid)>,
}

/// Settings and their values, in file order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Grid {
    /// `train` for agents, the default, or `dynamics` for dynamics models.
    pub kind: Option<Value>,
    /// The settings.
    pub axes: Vec<Axis>,
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
}

/// One combination of a grid: for each axis, the index of its value.
pub(super) type Combination = Vec<usize>;

impl Axis {
    /// JSON path of a value, such as `ddpg.gamma[1]`.
    pub fn path(&self, value: usize) -> String {
        if self.is_list { format!("{}[{value}]", self.key) } else { self.key.clone() }
    }
}

impl SweepFile {
    /// Checks that the number of combinations is not too large.
    pub fn check_size(&self) -> Result<(), ValidationError> {
        let count = self.grids.iter().try_fold(0usize, |sum, (_, grid)| sum.checked_add(grid.count()?));
        if count.is_some_and(|count| count <= MAX_COMBINATIONS) {
            return Ok(());
        }
        let message = format!("makes more than {MAX_COMBINATIONS} combinations: shorten the lists");
        Err(ValidationError::new(".", message))
    }
}

impl Grid {
    /// Number of combinations; None if it cannot be represented.
    fn count(&self) -> Option<usize> {
        self.axes.iter().try_fold(1usize, |count, axis| count.checked_mul(axis.values.len()))
    }

    /// All combinations; the last axis varies fastest.
    pub fn combinations(&self) -> Vec<Combination> {
        let mut combinations = vec![Vec::new()];
        for axis in &self.axes {
            let longer = |combination: &Combination| {
                let combination = combination.clone();
                (0..axis.values.len()).map(move |value| [combination.clone(), vec![value]].concat())
            };
            combinations = combinations.iter().flat_map(longer).collect();
        }
        combinations
    }

    /// The sweep file of a single combination, which gives the run the same settings and name.
    pub fn alone(&self, combination: &Combination) -> Value {
        let mut object = Map::new();
        object.extend(self.kind.clone().map(|kind| ("kind".to_owned(), kind)));
        for (axis, &value) in self.axes.iter().zip(combination) {
            let value = axis.values[value].clone();
            object.insert(axis.key.clone(), if axis.is_list { Value::Array(vec![value]) } else { value });
        }
        Value::Object(object)
    }
}

impl<'de> Deserialize<'de> for SweepFile {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrMany;
        impl<'de> Visitor<'de> for OneOrMany {
            type Value = SweepFile;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object of settings and their values, or a list of such objects")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SweepFile, A::Error> {
                Ok(SweepFile { grids: vec![(".".to_owned(), read_grid(map)?)] })
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<SweepFile, A::Error> {
                let mut grids = Vec::new();
                while let Some(grid) = list.next_element::<Grid>()? {
                    grids.push((format!("[{}]", grids.len()), grid));
                }
                Ok(SweepFile { grids })
            }
        }
        deserializer.deserialize_any(OneOrMany)
    }
}

impl<'de> Deserialize<'de> for Grid {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Settings;
        impl<'de> Visitor<'de> for Settings {
            type Value = Grid;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object of settings and their values")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Grid, A::Error> {
                read_grid(map)
            }
        }
        deserializer.deserialize_map(Settings)
    }
}

/// Reads a grid. Refuses duplicate names: keeping only the last, as JSON parsers do, would silently drop runs.
fn read_grid<'de, A: MapAccess<'de>>(mut map: A) -> Result<Grid, A::Error> {
    let mut grid = Grid::default();
    while let Some((key, value)) = map.next_entry::<String, Value>()? {
        if grid.axes.iter().any(|axis| axis.key == key) || (key == "kind" && grid.kind.is_some()) {
            return Err(A::Error::custom(format_args!("`{key}` is given twice")));
        }
        if key == "kind" {
            grid.kind = Some(value);
            continue;
        }
        let is_list = value.is_array();
        let values = if let Value::Array(values) = value { values } else { vec![value] };
        if values.is_empty() {
            return Err(A::Error::custom(format_args!("the list of `{key}` is empty")));
        }
        if values.iter().any(|value| value.is_object() || value.is_array()) {
            let wanted = "values must be numbers, texts, true, false or null";
            return Err(A::Error::custom(format_args!("{wanted} in the list of `{key}`")));
        }
        grid.axes.push(Axis { key, values, is_list });
    }
    Ok(grid)
}
