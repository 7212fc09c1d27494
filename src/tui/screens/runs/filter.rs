//! The filter of the list of runs: words, and conditions such as `task:4` and `epsilon<0.2`.

use serde_json::Value as Json;

use super::super::Ui;
use super::SETTINGS;
use crate::tui::view::RunSummary;
use mge_base::json;
use mge_base::spelling::did_you_mean;

/// Which runs are listed.
#[derive(Debug, Clone, Default)]
pub struct Filter {
    /// What was typed.
    pub text: String,
    terms: Vec<Term>,
}

#[derive(Debug, Clone)]
enum Term {
    /// Part of the text of a run.
    Word(String),
    /// Part of the text in one of its columns.
    Part(String, String),
    /// A comparison of one of its columns with a number.
    Compared(String, Comparison, f64),
}

/// Whether a number that was found and the wanted one are as a sign says.
type Comparison = fn(f64, f64) -> bool;

/// Comparison signs, the longer ones first.
const SIGNS: [(&str, Comparison); 5] = [
    ("<=", |found, wanted| found <= wanted),
    (">=", |found, wanted| found >= wanted),
    ("<", |found, wanted| found < wanted),
    (">", |found, wanted| found > wanted),
    // Allow for values in single precision, but keep integers apart.
    ("=", |found, wanted| (found - wanted).abs() < (1e-6 * wanted.abs().max(1.0)).min(0.5)),
];

/// What a condition may be on, besides settings. Success is a fraction from 0 to 1, epsilon the threshold of the first
/// episode.
const COLUMNS: [&str; 11] =
    ["task", "method", "state", "name", "label", "note", "seed", "episodes", "done", "success", "epsilon"];

impl Filter {
    /// Reads what was typed: words and conditions, all of which must hold.
    ///
    /// # Errors
    /// What is wrong with a condition.
    pub fn parse(text: &str) -> Result<Self, String> {
        let terms = text.split_whitespace().map(term).collect::<Result<_, String>>()?;
        Ok(Self { text: text.trim().to_owned(), terms })
    }

    /// Whether a run is listed.
    pub fn accepts(&self, run: &RunSummary, ui: &Ui) -> bool {
        self.terms.iter().all(|term| match term {
            Term::Word(word) => line(run).contains(word),
            Term::Part(column, part) => {
                value(run, column, ui).is_some_and(|value| json::text(&value).to_lowercase().contains(part))
            }
            Term::Compared(column, comparison, wanted) => {
                value(run, column, ui).and_then(|value| value.as_f64()).is_some_and(|found| comparison(found, *wanted))
            }
        })
    }
}

fn term(word: &str) -> Result<Term, String> {
    let lower = word.to_lowercase();
    let compared = SIGNS.iter().find_map(|(sign, comparison)| Some((lower.split_once(sign)?, Some(*comparison))));
    let Some(((column, value), comparison)) = compared.or_else(|| Some((lower.split_once(':')?, None))) else {
        return Ok(Term::Word(lower));
    };
    let known = || COLUMNS.into_iter().chain(SETTINGS.iter().map(String::as_str));
    if !known().any(|known| known == column) {
        let near = did_you_mean(known(), column);
        let hint = if near.is_empty() { format!(": {}", COLUMNS.join(", ")) } else { near };
        return Err(format!("`{column}` is no column or setting{hint}"));
    }
    let Some(comparison) = comparison else { return Ok(Term::Part(column.to_owned(), value.to_owned())) };
    let value = value.parse().map_err(|_| format!("`{value}` in `{word}` is not a number"))?;
    Ok(Term::Compared(column.to_owned(), comparison, value))
}

/// The text in which words are searched.
fn line(run: &RunSummary) -> String {
    let (task, method, seed) = (&run.config.task.name, run.config.method.name(), run.config.seed);
    format!("{} {task} {method} seed {seed} {}", run.name, run.state_word()).to_lowercase()
}

/// The value of a column or setting of a run.
fn value(run: &RunSummary, column: &str, ui: &Ui) -> Option<Json> {
    Some(match column {
        "task" => Json::from(&*run.config.task.name),
        "method" => Json::from(run.config.method.name()),
        "state" => Json::from(run.state_word()),
        "name" => Json::from(&*run.name),
        "label" => Json::from(&**ui.view.groups.of(&run.path).map_or(&run.label, |group| &group.label)),
        "note" => Json::from(&*run.note),
        "seed" => Json::from(run.config.seed),
        "episodes" => Json::from(run.episodes()),
        "done" => Json::from(run.done),
        "success" => Json::from(run.success?),
        "epsilon" => Json::from(run.config.epsilon.threshold(0)),
        path => return ui.view.groups.setting(run, path).cloned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(sign: &str, found: f64, wanted: f64) -> bool {
        SIGNS.iter().any(|(known, comparison)| *known == sign && comparison(found, wanted))
    }

    #[test]
    fn conditions_are_read_and_mistakes_explained() {
        let text = " old task:4 Method:DDPG-mge epsilon<0.2 seed>=3 ddpg.gamma=0.9 prior:learned hold_tolerance<1";
        let parsed = Filter::parse(text).unwrap();
        let shown = |term: &Term| match term {
            Term::Word(word) => word.clone(),
            Term::Part(column, part) => format!("{column}:{part}"),
            Term::Compared(column, _, value) => format!("{column} {value}"),
        };
        let expected = [
            "old",
            "task:4",
            "method:ddpg-mge",
            "epsilon 0.2",
            "seed 3",
            "ddpg.gamma 0.9",
            "prior:learned",
            "hold_tolerance 1",
        ];
        assert_eq!(parsed.terms.iter().map(shown).collect::<Vec<_>>(), expected);
        for (text, problem) in [
            ("epsilo<0.2", "did you mean `epsilon`?"),
            ("seed<x", "`x` in `seed<x` is not a number"),
            ("tsak:4", "did you mean `task`?"),
        ] {
            let error = Filter::parse(text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
        assert!(holds("=", f64::from(0.1f32), 0.1) && !holds("<", 0.2, 0.2) && holds("<=", 0.2, 0.2));
        assert!(holds("=", f64::from(1234.567f32), 1234.567) && !holds("=", 0.5, 0.6) && holds(">", 0.6, 0.5));
    }

    #[test]
    fn large_integers_equal_only_themselves() {
        let is_found = |seed: f64| holds("=", seed, 1_234_567_890.0);
        assert!(is_found(1_234_567_890.0) && !is_found(1_234_567_889.0) && !is_found(1_234_567_891.0));
    }
}
