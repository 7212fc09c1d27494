//! Arguments from Python: what is accepted as a whole number and as an array of numbers, and what is said of the rest.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use numpy::PyReadonlyArray;
use numpy::ndarray::Dimension;
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use serde_json::{Map, Value};

use mge_base::json::leaf_values;

/// Largest number of digits of a wrong number in a message.
const DIGITS: usize = 40;

/// A number in `range` from an integer of Python or NumPy (not a bool); `name` is that of the argument.
pub fn whole<T: TryFrom<i128>>(value: &Bound<'_, PyAny>, name: &str, range: RangeInclusive<i128>) -> PyResult<T> {
    let number = if value.is_instance_of::<PyBool>() { None } else { value.call_method0("__index__").ok() };
    let Some(number) = number else {
        let kind = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!("`{name}` is of type {kind}, and should be a whole number")));
    };
    let fitting = number.extract::<i128>().ok().filter(|number| range.contains(number));
    fitting.and_then(|number| T::try_from(number).ok()).ok_or_else(|| {
        let (least, most) = range.into_inner();
        let number = number.str().map_or_else(|_| "huge".to_owned(), |digits| digits.to_string());
        PyValueError::new_err(format!("`{name}` is {number:.DIGITS$}, and should be from {least} to {most}"))
    })
}

/// Defines a converter for each name of arguments, for pyo3's `from_py_with`.
macro_rules! whole_numbers {
    ($($name:ident: $kind:ty, $least:expr, $most:expr;)*) => {
        $(pub fn $name(value: &Bound<'_, PyAny>) -> PyResult<$kind> {
            whole(value, stringify!($name), $least..=$most)
        })*
    };
}

// Larger numbers than these would exhaust memory, or never end.
whole_numbers! {
    seed: u64, 0, u64::MAX.into();
    stage: usize, 0, i64::MAX.into();
    count: usize, 0, i64::MAX.into();
    steps: u32, 0, u32::MAX.into();
    resamples: u32, 1, 1_000_000;
    num_envs: usize, 1, i32::MAX.into();
}

/// A resolution in dots per inch; None for the usual one.
pub fn dpi(value: &Bound<'_, PyAny>) -> PyResult<Option<u32>> {
    (!value.is_none()).then(|| whole(value, "dpi", 1..=u32::MAX.into())).transpose()
}

/// A number of threads; None for as many as cores.
pub fn num_threads(value: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    (!value.is_none()).then(|| whole(value, "num_threads", 1..=1024)).transpose()
}

/// `whole` for the package's own modules.
#[pyfunction]
#[pyo3(name = "whole")]
pub fn checked(value: &Bound<'_, PyAny>, name: &str, least: i128, most: i128) -> PyResult<i128> {
    whole(value, name, least..=most)
}

/// The settings in keyword arguments, by their JSON paths: `ddpg={"gamma": 0.9}` is `ddpg.gamma`.
pub fn settings(given: &Bound<'_, PyDict>) -> PyResult<Vec<(String, Value)>> {
    let value = json(given, "settings")?;
    Ok(leaf_values(&value).into_iter().map(|(path, value)| (path, value.clone())).collect())
}

/// A value of Python or NumPy as JSON; `name` is that of the argument.
pub fn json(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Value> {
    if let Ok(entries) = value.cast::<PyDict>() {
        let entry = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            let key: String = key.extract()?;
            json(&value, &key).map(|value| (key, value))
        };
        return entries.iter().map(entry).collect::<PyResult<Map<_, _>>>().map(Value::Object);
    }
    if value.is_none() {
        return Ok(Value::Null);
    } else if let Ok(truth) = value.extract::<bool>() {
        return Ok(truth.into());
    } else if let Ok(text) = value.extract::<PathBuf>() {
        return Ok(text.to_string_lossy().into());
    } else if let Ok(values) = value.try_iter() {
        return values.map(|value| json(&value?, name)).collect();
    } else if let Ok(number) = value.extract::<i64>() {
        return Ok(number.into());
    } else if let Ok(number) = value.extract::<u64>() {
        return Ok(number.into());
    }
    let number = value.extract::<f64>().ok().and_then(serde_json::Number::from_f64);
    number.map(Value::Number).ok_or_else(|| {
        let kind = value.get_type().name().map_or_else(|_| "unknown".to_owned(), |kind| kind.to_string());
        PyTypeError::new_err(format!("`{name}` is of type {kind}, and should be a finite number, a text, a bool, None, or a list or dict of these"))
    })
}

/// Memory for this many values, or `MemoryError`.
pub fn room<T>(values: usize) -> PyResult<Vec<T>> {
    let mut room = Vec::new();
    let no_room = |_| PyMemoryError::new_err(format!("there is no memory for {values} values"));
    room.try_reserve_exact(values).map_err(no_room).map(|()| room)
}

/// Converts finite numbers of any type to contiguous float32. `wanted` is the shape, such as `[n, 5]`, in which a word
/// stands for any length.
pub fn numbers<'py, D: Dimension>(
    values: &Bound<'py, PyAny>,
    name: &str,
    wanted: &str,
) -> PyResult<PyReadonlyArray<'py, f32, D>> {
    let numbers = numbers_or_nan(values, name, wanted)?;
    match numbers.as_array().indexed_iter().find(|(_, value)| !value.is_finite()) {
        None => Ok(numbers),
        Some((place, value)) => {
            let place = format!("{place:?}").replace(['(', ')'], "");
            Err(PyValueError::new_err(format!("`{name}` is {value} at index [{place}], and should be finite numbers")))
        }
    }
}

/// Like [`numbers`], also for numbers that are not finite.
pub fn numbers_or_nan<'py, D: Dimension>(
    values: &Bound<'py, PyAny>,
    name: &str,
    wanted: &str,
) -> PyResult<PyReadonlyArray<'py, f32, D>> {
    let numpy = values.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (values,))?;
    let kind = array.getattr("dtype")?;
    if !["f", "i", "u"].contains(&kind.getattr("kind")?.extract::<String>()?.as_str()) {
        return Err(PyTypeError::new_err(format!(
            "`{name}` is of type {kind}, and should be numbers, such as float32"
        )));
    }
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let lengths: Vec<&str> = wanted.trim_matches(['[', ']']).split(", ").collect();
    let fits = |(wanted, length): (&&str, &usize)| wanted.parse().map_or(true, |wanted: usize| wanted == *length);
    if lengths.len() != shape.len() || !lengths.iter().zip(&shape).all(fits) {
        return Err(PyValueError::new_err(format!("`{name}` has the shape {shape:?}, and should have {wanted}")));
    }
    numpy.call_method1("ascontiguousarray", (array, "float32"))?.extract()
}
