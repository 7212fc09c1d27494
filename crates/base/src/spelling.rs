//! Suggestions for misspelt names.

/// Longer texts are not compared: they are not misspelt names, and comparison time grows with the square of the
/// length.
pub const MAX_COMPARED_LENGTH: usize = 64;

/// The least closeness of a name that is suggested.
pub const SIMILAR: f64 = 0.75;

/// How similar a typed name is to a known one, from 0 to 1.
pub fn closeness(known: &str, typed: &str) -> f64 {
    if typed.len() > MAX_COMPARED_LENGTH { 0.0 } else { strsim::jaro_winkler(known, typed) }
}

/// The known name most similar to the typed one, if any is similar enough.
pub fn nearest<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> Option<&'a str> {
    let best = known.into_iter().max_by(|a, b| closeness(a, typed).total_cmp(&closeness(b, typed)));
    best.filter(|name| closeness(name, typed) > SIMILAR)
}

/// `: did you mean X?` with the [`nearest`] known name; empty if none is similar.
pub fn did_you_mean<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> String {
    suggestion(nearest(known, typed))
}

/// `: did you mean X?`; empty without a name.
pub fn suggestion(name: Option<&str>) -> String {
    name.map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
}

/// The message for a name that is not among the known ones.
pub fn unknown(what: &str, known: &[&str], typed: &str) -> String {
    let hint = did_you_mean(known.iter().copied(), typed);
    format!("unknown {what} `{typed}`: use one of {}{hint}", known.join(", "))
}

/// Gives an enum `ALL`, its variants in their order, and `name()`.
#[macro_export]
macro_rules! names {
    ($enum:ident { $($variant:ident = $name:literal),+ }) => {
        impl $enum {
            /// All of them, in order.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$variant),+];

            /// Its name.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }
    };
}

/// Implements `Display` and `FromStr` for an enum with these [`names!`], or one that has `ALL` and `name()`. `$what`
/// describes the enum in error messages.
#[macro_export]
macro_rules! by_name {
    ($enum:ident, $what:literal, $names:tt) => {
        $crate::names!($enum $names);
        $crate::by_name!($enum, $what);
    };
    ($enum:ident, $what:literal) => {
        impl std::fmt::Display for $enum {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $enum {
            type Err = String;

            fn from_str(text: &str) -> Result<Self, String> {
                let found = Self::ALL.into_iter().find(|known| known.name() == text);
                found.ok_or_else(|| $crate::spelling::unknown($what, &Self::ALL.map(Self::name), text))
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similar_names_are_suggested_and_others_are_not() {
        assert_eq!(did_you_mean(["train", "task"], "trian"), ": did you mean `train`?");
        assert_eq!(did_you_mean(["train", "task"], "zzz"), "");
        assert_eq!(nearest(["task1", "task2"], "task22"), Some("task2"));
    }

    #[test]
    fn an_enum_is_read_by_its_name() {
        #[derive(Debug, Clone, Copy, PartialEq)]
        enum Tool {
            Bucket,
            Square,
        }
        by_name!(Tool, "tool", { Bucket = "bucket", Square = "square" });
        assert_eq!(Tool::Square.to_string().parse(), Ok(Tool::Square));
        let error = "bukket".parse::<Tool>().unwrap_err();
        assert_eq!(error, "unknown tool `bukket`: use one of bucket, square: did you mean `bucket`?");
    }

    #[test]
    fn a_text_longer_than_any_name_is_not_compared() {
        let long = "train".repeat(200_000);
        assert_eq!(nearest([long.as_str()], &long), None);
    }
}
