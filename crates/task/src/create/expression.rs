//! The arithmetic expressions in strings of CREATE's level files.

use crate::STANDARD_RADIUS;

/// The value of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Truth(bool),
    List(Vec<Value>),
    /// A number drawn between two others at every reset.
    Uniform(f64, f64),
    /// One of several values, drawn at every reset.
    Choice(Vec<Value>),
}

/// Longest accepted expression, which also bounds the nesting depth.
const MAX_LENGTH: usize = 200;

/// Names that level files use in expressions, with CREATE's values.
const CONSTANTS: [(&str, f64); 8] = [
    // Half widths of random shifts, normalised.
    ("DEF_NOISE", 0.05),
    ("MID_NOISE", 0.1),
    ("HIGH_NOISE", 0.2),
    ("LARGE_NOISE", 0.5),
    // Height of a ball's centre above the middle of the floor it lies on, normalised.
    ("OFFSET", 0.11),
    ("GOAL_RADIUS", STANDARD_RADIUS as f64),
    ("LINE_THICKNESS", 2.0),
    ("np.pi", std::f64::consts::PI),
];

/// Evaluates numbers, `True`, `False`, CREATE's constants, `+ - * /`, parentheses, lists, and the two calls that
/// define random shifts, `uniform` and `random.choice`. Other calls and names are errors.
///
/// # Errors
/// A sentence that names the first part that is not understood.
pub(super) fn evaluate(text: &str) -> Result<Value, String> {
    if text.len() > MAX_LENGTH {
        return Err(format!("is an expression of more than {MAX_LENGTH} characters"));
    }
    let mut reader = Reader { text, rest: text.trim_start() };
    let value = reader.sum()?;
    if !reader.rest.is_empty() {
        return Err(reader.unexpected());
    }
    Ok(value)
}

struct Reader<'a> {
    text: &'a str,
    rest: &'a str,
}

impl<'a> Reader<'a> {
    fn sum(&mut self) -> Result<Value, String> {
        let mut value = self.product()?;
        while let Some(sign) = self.any(["+", "-"]) {
            let term = number(&self.product()?)?;
            value = Value::Number(number(&value)? + if sign == "-" { -term } else { term });
        }
        Ok(value)
    }

    fn product(&mut self) -> Result<Value, String> {
        let mut value = self.factor()?;
        while let Some(sign) = self.any(["*", "/"]) {
            let factor = number(&self.factor()?)?;
            if sign == "/" && factor == 0.0 {
                return Err(format!("`{}` divides by zero", self.text));
            }
            value = Value::Number(if sign == "/" { number(&value)? / factor } else { number(&value)? * factor });
        }
        Ok(value)
    }

    fn factor(&mut self) -> Result<Value, String> {
        if self.take("-") {
            return Ok(Value::Number(-number(&self.factor()?)?));
        }
        if self.take("+") {
            return self.factor();
        }
        if self.take("(") {
            let value = self.sum()?;
            return self.expect(")").map(|()| value);
        }
        if self.take("[") {
            return self.list();
        }
        self.atom()
    }

    fn list(&mut self) -> Result<Value, String> {
        let mut values = Vec::new();
        while !self.take("]") {
            values.push(self.sum()?);
            if !self.take(",") && !self.rest.starts_with(']') {
                return Err(self.unexpected());
            }
        }
        Ok(Value::List(values))
    }

    fn atom(&mut self) -> Result<Value, String> {
        let is_part = |c: char| c.is_ascii_alphanumeric() || c == '.' || c == '_';
        let length = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let word = &self.rest[..length];
        let value = match word {
            "uniform" => {
                self.advance(length);
                return self.uniform();
            }
            "random.choice" => {
                self.advance(length);
                return self.choice();
            }
            "True" => Value::Truth(true),
            "False" => Value::Truth(false),
            _ if word.starts_with(|c: char| c.is_ascii_digit() || c == '.') => {
                let number = word.parse().ok().filter(|number: &f64| number.is_finite());
                Value::Number(number.ok_or_else(|| format!("`{word}` is not a number"))?)
            }
            _ => {
                let constant = CONSTANTS.iter().find(|(name, _)| *name == word);
                Value::Number(constant.ok_or_else(|| self.unexpected())?.1)
            }
        };
        self.advance(length);
        Ok(value)
    }

    /// The arguments of `uniform`.
    fn uniform(&mut self) -> Result<Value, String> {
        self.expect("(")?;
        let low = number(&self.sum()?)?;
        self.expect(",")?;
        let high = number(&self.sum()?)?;
        self.expect(")").map(|()| Value::Uniform(low, high))
    }

    /// The argument of `random.choice`.
    fn choice(&mut self) -> Result<Value, String> {
        self.expect("(")?;
        let Value::List(choices) = self.sum()? else { return Err(self.unexpected()) };
        self.expect(")").map(|()| Value::Choice(choices))
    }

    /// The one of two tokens that comes next, if any.
    fn any(&mut self, tokens: [&'static str; 2]) -> Option<&'static str> {
        tokens.into_iter().find(|token| self.take(token))
    }

    fn expect(&mut self, token: &str) -> Result<(), String> {
        if self.take(token) { Ok(()) } else { Err(self.unexpected()) }
    }

    fn take(&mut self, token: &str) -> bool {
        let found = self.rest.starts_with(token);
        if found {
            self.advance(token.len());
        }
        found
    }

    fn advance(&mut self, length: usize) {
        self.rest = self.rest[length..].trim_start();
    }

    fn unexpected(&self) -> String {
        let known = CONSTANTS.map(|(name, _)| name).join(", ");
        let what = match self.rest.chars().next() {
            Some(_) => format!("unexpected `{}` in", self.rest),
            None => "unexpected end of".to_owned(),
        };
        format!("{what} `{}`: use numbers, + - * /, parentheses, lists and {known}", self.text)
    }
}

fn number(value: &Value) -> Result<f64, String> {
    match value {
        Value::Number(number) => Ok(*number),
        Value::Truth(_) | Value::List(_) | Value::Uniform(..) | Value::Choice(_) => {
            Err("arithmetic is possible only with numbers".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic() {
        let number = |text: &str, expected: f64| {
            let Value::Number(value) = evaluate(text).unwrap() else { panic!("{text} is not a number") };
            assert!((value - expected).abs() < 1e-12, "{text} = {value}");
        };
        number("1", 1.0);
        number(" -0.25 + OFFSET ", -0.14);
        number("110 * np.pi / 180", 110f64.to_radians());
        number("-(2 - -3) * 4 / (1 + 1)", -10.0);
        number("2 - 3 - 4", -5.0);
        number("8 / 4 / 2", 1.0);
        assert_eq!(evaluate("True"), Ok(Value::Truth(true)));
        let list = [Value::Number(1.0), Value::List(vec![Value::Number(0.5)])];
        assert_eq!(evaluate("[1, [.5],]"), Ok(Value::List(list.to_vec())));
    }

    #[test]
    fn errors_name_what_is_not_understood() {
        let long = "(".repeat(100_000);
        let deep = "(".repeat(MAX_LENGTH);
        for (text, part) in [
            ("", "unexpected end of"),
            ("1 +", "unexpected end of"),
            ("uniform(-1)", "`)`"),
            ("__import__('os')", "`__import__('os')`"),
            ("1 ** 2", "`* 2`"),
            ("1 2", "`2`"),
            ("(1", "unexpected end of"),
            ("[1, 2", "unexpected end of"),
            ("[1] + 2", "only with numbers"),
            ("1 / 0", "divides by zero"),
            ("1.2.3", "`1.2.3` is not a number"),
            ("1e400", "`1e400` is not a number"),
            ("π", "`π`"),
            (&long, "more than 200"),
            (&deep, "unexpected end of"),
        ] {
            let error = evaluate(text).unwrap_err();
            assert!(error.contains(part), "{text:.20}: {error:.200}");
        }
    }
}
