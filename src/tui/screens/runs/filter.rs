//! The filter of the list of runs: words, and conditions such as `task:4` and `epsilon<0.2`.

use std::collections::BTreeSet;

use regex_lite::Regex;
use serde_json::Value as Json;

use super::super::Ui;
use super::SETTINGS;
use crate::tui::layers::Value as Completion;
use crate::tui::view::RunSummary;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_run::Metric;
use mge_trainer::settings;
use mge_workbench::command::Comparison;

/// Which runs are listed.
#[derive(Debug, Clone, Default)]
pub struct Filter {
    /// What was typed.
    pub text: String,
    terms: Vec<Term>,
}

#[derive(Debug, Clone)]
enum Term {
    /// Part of the text of a run, in lower case.
    Word(String),
    /// The same, as a regular expression.
    Pattern(Regex),
    /// Part of the text in one of its columns, or the whole.
    Text(String, String, bool),
    /// A comparison of one of its columns with a number.
    Compared(String, Comparison, f64),
}

/// A column of a run: its name, a sign that follows it in a condition, what it is, and its value, None if it has none.
type Column = (&'static str, &'static str, &'static str, fn(&RunSummary, &Ui) -> Option<Json>);

/// What a condition may be on, besides settings. Success is a fraction from 0 to 1, epsilon the threshold of the first
/// episode.
#[rustfmt::skip]
const COLUMNS: [Column; 15] = [
    ("task", ":", "name of the task", |run, _| Some(run.config.task.name.as_str().into())),
    ("method", ":", "name of the method", |run, _| Some(run.config.method.name().into())),
    ("state", ":", "such as running or finished", |run, _| Some(run.state_word().into())),
    ("name", ":", "name of the run", |run, _| Some(run.name.as_str().into())),
    ("folder", ":", "folder of the run", |run, _| Some(run.folder().into())),
    ("label", ":", "what tells the group from others", |run, ui| Some(ui.view.groups.of(&run.path).map_or(&run.label, |group| &group.label).as_str().into())),
    ("note", ":", "note on the run", |run, _| Some(run.note.as_str().into())),
    ("seed", "=", "seed", |run, _| Some(run.config.seed.into())),
    ("episodes", ">", "number of episodes that are to be played", |run, _| Some(run.episodes().into())),
    ("done", ">", "number of episodes played", |run, _| Some(run.done.into())),
    ("success", ">", "success in percent, or as a share below 1", |run, _| Some(run.success?.into())),
    ("epsilon", "<", "epsilon threshold of the first episode", |run, _| Some(run.config.epsilon.threshold(0).into())),
    ("charged", "<", "charged actions so far", |run, _| Some(run.latest(Metric::ChargedActions)?.into())),
    ("duration", "<", "seconds of training", |run, _| Some(run.seconds()?.into())),
    ("speed", ">", "episodes a second", |run, _| Some(run.speed()?.into())),
];

/// The names of all columns and settings, with a sign that follows in a condition, and what they are.
pub fn known() -> impl Iterator<Item = [&'static str; 3]> + Clone {
    let settings = SETTINGS.iter().map(|key| {
        let about = settings().find(|(known, _)| known == key).map_or("", |(_, setting)| setting.about);
        [key, "=", about]
    });
    COLUMNS.iter().map(|(name, sign, about, _)| [*name, *sign, *about]).chain(settings)
}

/// The beginnings of conditions on columns, those on columns with few texts, and those on settings.
pub fn completions(ui: &Ui) -> Vec<Completion> {
    let conditions = known().map(|[name, sign, about]| Completion::new(format!("{name}{sign}"), about));
    let texts = COLUMNS[..3].iter().flat_map(|(name, sign, _, value)| {
        let texts = ui.view.runs.iter().filter_map(|run| Some(json::text(&value(run, ui)?)));
        texts.collect::<BTreeSet<_>>().into_iter().map(move |text| Completion::new(format!("{name}{sign}{text}"), ""))
    });
    conditions.chain(texts).collect()
}

impl Filter {
    /// Reads what was typed: words and conditions, all of which must hold.
    ///
    /// # Errors
    /// What is wrong with a condition.
    pub fn parse(text: &str) -> Result<Self, String> {
        let terms = text.split_whitespace().map(term).collect::<Result<_, String>>()?;
        Ok(Self { text: text.trim().to_owned(), terms })
    }

    /// Reads what is being typed: without its last word, if that is only the beginning of a condition.
    ///
    /// # Errors
    /// What is wrong with an earlier condition.
    pub fn begun(text: &str, lines: &[String]) -> Result<Self, String> {
        let (before, last) = text.rsplit_once(' ').unwrap_or(("", text));
        let last = last.to_lowercase();
        let begins =
            || known().any(|[name, ..]| name.starts_with(&last)) && !lines.iter().any(|line| line.contains(&last));
        Self::parse(if term(&last).is_err() || begins() { before } else { text })
    }

    /// Whether it needs the curves of all runs.
    pub fn needs_curves(&self) -> bool {
        self.terms.iter().any(|term| match term {
            Term::Word(_) | Term::Pattern(_) => false,
            Term::Text(column, ..) | Term::Compared(column, ..) => {
                ["charged", "duration", "speed"].contains(&column.as_str())
            }
        })
    }

    /// Whether a run is listed.
    pub fn accepts(&self, run: &RunSummary, ui: &Ui) -> bool {
        self.terms.iter().all(|term| match term {
            Term::Word(word) => line(run).contains(word),
            Term::Pattern(pattern) => pattern.is_match(&line(run)),
            Term::Text(column, text, whole) => value(run, column, ui)
                .map(|value| json::text(&value).to_lowercase())
                .is_some_and(|found| if *whole { found == *text } else { found.contains(text) }),
            // A name or a note may be a number, too.
            Term::Compared(column, comparison, wanted) => value(run, column, ui)
                .and_then(|value| value.as_f64().or_else(|| value.as_str()?.parse().ok()))
                .is_some_and(|found| comparison.holds(found, *wanted)),
        })
    }
}

fn term(word: &str) -> Result<Term, String> {
    let lower = word.to_lowercase();
    // The longer signs come first.
    let compared = Comparison::ALL.iter().find_map(|sign| Some((lower.split_once(sign.name())?, Some(*sign))));
    let Some(((column, value), comparison)) = compared.or_else(|| Some((lower.split_once(':')?, None))) else {
        // A search for a pattern takes several times as long.
        if !lower.contains(['[', '(', '|', '*', '+', '?', '\\', '^', '$', '{']) {
            return Ok(Term::Word(lower));
        }
        let read = Regex::new(&format!("(?i){word}")).map(Term::Pattern);
        return read.map_err(|_| format!("`{word}` is not a regular expression"));
    };
    check(known().map(|[name, ..]| name), column)?;
    // The list shows success in percent.
    let percent = value.strip_suffix('%');
    let number = percent.unwrap_or(value).parse::<f64>().ok().filter(|number| number.is_finite());
    let is_percent = |number: f64| percent.is_some() || (column == "success" && number > 1.0);
    match (comparison, number) {
        (Some(sign), Some(number)) => {
            Ok(Term::Compared(column.to_owned(), sign, if is_percent(number) { number / 100.0 } else { number }))
        }
        _ if value.is_empty() => Err(format!("`{word}` ends without a value")),
        (None | Some(Comparison::Equal), _) => {
            Ok(Term::Text(column.to_owned(), value.to_owned(), comparison.is_some()))
        }
        _ => Err(format!("`{value}` in `{word}` is not a number")),
    }
}

/// Fails if a name is not one of those that are known.
pub fn check(names: impl Iterator<Item = &'static str> + Clone, column: &str) -> Result<(), String> {
    if names.clone().any(|known| known == column) {
        return Ok(());
    }
    let near = did_you_mean(names, column);
    let hint = if near.is_empty() { format!(": {}", COLUMNS.map(|(name, ..)| name).join(", ")) } else { near };
    Err(format!("`{column}` is no column or setting{hint}"))
}

/// The text in which words are searched.
pub fn line(run: &RunSummary) -> String {
    let (task, method, seed) = (&run.config.task.name, run.config.method.name(), run.config.seed);
    format!("{} {} {task} {method} seed {seed} {}", run.name, run.folder(), run.state_word()).to_lowercase()
}

/// The value of a column or setting of a run.
pub fn value(run: &RunSummary, column: &str, ui: &Ui) -> Option<Json> {
    match COLUMNS.iter().find(|(name, ..)| *name == column) {
        Some((.., value)) => value(run, ui),
        None => ui.view.groups.setting(run, column).cloned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(sign: &str, found: f64, wanted: f64) -> bool {
        sign.parse::<Comparison>().unwrap().holds(found, wanted)
    }

    #[test]
    fn conditions_are_read_and_mistakes_explained() {
        let text = " old|new task:4 Method:DDPG-mge epsilon<0.2 seed>=3 ddpg.gamma=0.9 prior:learned hold_tolerance<1 \
                    method=ddpg success>90 success<=5% success>0.5";
        let parsed = Filter::parse(text).unwrap();
        let shown = |term: &Term| match term {
            Term::Word(word) => word.clone(),
            Term::Pattern(pattern) => pattern.to_string(),
            Term::Text(column, text, whole) => format!("{column}{}{text}", if *whole { "=" } else { ":" }),
            Term::Compared(column, _, value) => format!("{column} {value}"),
        };
        let expected = [
            "(?i)old|new",
            "task:4",
            "method:ddpg-mge",
            "epsilon 0.2",
            "seed 3",
            "ddpg.gamma 0.9",
            "prior:learned",
            "hold_tolerance 1",
            "method=ddpg",
            "success 0.9",
            "success 0.05",
            "success 0.5",
        ];
        assert_eq!(parsed.terms.iter().map(shown).collect::<Vec<_>>(), expected);
        for (text, problem) in [
            ("epsilo<0.2", "did you mean `epsilon`?"),
            ("seed<x", "`x` in `seed<x` is not a number"),
            ("tsak:4", "did you mean `task`?"),
            ("seed[0", "`seed[0` is not a regular expression"),
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
