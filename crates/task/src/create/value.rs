//! Values in level files, as JSON or as expressions in strings; errors give their path.

use serde_json::Value as Json;

use super::expression::{Value, evaluate};
use mge_base::validation::ValidationError;

/// Two numbers of a level file. Here and below, `path` names the value in errors.
pub(super) fn pair(json: &Json, path: &str) -> Result<[f32; 2], ValidationError> {
    as_pair(&value(json, path)?).ok_or_else(|| ValidationError::new(path, "must be two numbers, [x, y]"))
}

/// A value that is a list of two numbers.
pub(super) fn as_pair(value: &Value) -> Option<[f32; 2]> {
    let Value::List(values) = value else { return None };
    match values[..] {
        [Value::Number(x), Value::Number(y)] => Some([x as f32, y as f32]),
        _ => None,
    }
}

/// A number of a level file.
pub(super) fn number(json: &Json, path: &str) -> Result<f64, ValidationError> {
    match value(json, path)? {
        Value::Number(number) => Ok(number),
        _ => Err(ValidationError::new(path, "must be a number")),
    }
}

/// True or false in a level file; false if it is missing.
pub(super) fn boolean(json: &Option<Json>, path: &str) -> Result<bool, ValidationError> {
    match json.as_ref().map(|json| value(json, path)).transpose()? {
        None => Ok(false),
        Some(Value::Truth(boolean)) => Ok(boolean),
        Some(_) => Err(ValidationError::new(path, "must be true or false")),
    }
}

/// A value of a level file, written as JSON or as an expression in a string.
pub(super) fn value(json: &Json, path: &str) -> Result<Value, ValidationError> {
    match json {
        Json::String(text) => evaluate(text).map_err(|message| ValidationError::new(path, message)),
        Json::Bool(boolean) => Ok(Value::Truth(*boolean)),
        Json::Number(number) => Ok(Value::Number(number.as_f64().unwrap_or(f64::NAN))),
        Json::Array(values) => {
            let values = values.iter().enumerate().map(|(index, item)| value(item, &format!("{path}[{index}]")));
            Ok(Value::List(values.collect::<Result<_, _>>()?))
        }
        Json::Null | Json::Object(_) => Err(ValidationError::new(path, "must be a number, a list or an expression")),
    }
}
