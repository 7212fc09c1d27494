//! Suggestions for misspelt names.

/// Longer texts are no misspelt name; comparing them would take time that grows with the
/// square of their length.
pub const LONGEST: usize = 64;

/// The known name most similar to what was typed, if any is similar.
pub fn nearest<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> Option<&'a str> {
    if typed.len() > LONGEST {
        return None;
    }
    let closeness = |name: &str| strsim::jaro_winkler(name, typed);
    let best = known.into_iter().max_by(|a, b| closeness(a).total_cmp(&closeness(b)));
    best.filter(|name| closeness(name) > 0.75)
}

/// `: did you mean X?` with the [`nearest`] known name; empty if none is similar.
pub fn did_you_mean<'a>(known: impl IntoIterator<Item = &'a str>, typed: &str) -> String {
    nearest(known, typed).map(|name| format!(": did you mean `{name}`?")).unwrap_or_default()
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
    fn a_text_longer_than_any_name_is_not_compared() {
        let long = "train".repeat(200_000);
        assert_eq!(nearest([long.as_str()], &long), None);
    }
}
