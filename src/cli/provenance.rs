//! The command that reproduces a result, as figures, reports and models store it.

/// Options that change no result, and whether they take a value.
const WITHOUT_EFFECT: [(&str, bool); 4] =
    [("--quiet", false), ("--force", false), ("--threads", true), ("--out", true)];

/// The command line of this process, as far as it determines the results.
pub fn command() -> String {
    reproducing(std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()))
}

fn reproducing(arguments: impl IntoIterator<Item = String>) -> String {
    let split = |word: String| match word.split_once('=') {
        Some((option, value)) if option.starts_with("--") => vec![option.to_owned(), value.to_owned()],
        _ => vec![word],
    };
    let mut words = arguments.into_iter().flat_map(split);
    let mut kept = vec!["mge".to_owned()];
    while let Some(word) = words.next() {
        match WITHOUT_EFFECT.iter().find(|(option, _)| *option == word) {
            Some((_, takes_value)) => words.by_ref().take(usize::from(*takes_value)).for_each(drop),
            None => kept.push(word),
        }
    }
    shell_words::join(kept)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_stored_without_what_changes_no_result() {
        let stored = |line: &str| reproducing(shell_words::split(line).unwrap());
        let line = "report runs --quiet --reference=DDPG --force --seed 7";
        assert_eq!(stored(line), "mge report runs --reference DDPG --seed 7");
        assert_eq!(stored("report 'my runs' --threads 3 --seed 4"), "mge report 'my runs' --seed 4");
        assert_eq!(stored("report a --threads"), "mge report a");
        assert_eq!(stored("puzzles bench p --set a=1 --out ."), "mge puzzles bench p --set 'a=1'");
    }
}
