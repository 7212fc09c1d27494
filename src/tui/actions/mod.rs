//! Actions: everything that can be bound to a key. One table of actions and the verbs of the command
//! language are the source of the key map, the hints of the footer, the help, the palette and the
//! manual page.

mod context;
mod table;

pub use context::{Context, HAND, Tab};

use std::sync::LazyLock;

use super::app::App;
use super::effect::Effect;
use super::screens::{Screens, Ui};
use mge_workbench::{Verb, verbs};

/// What an action does.
#[derive(Debug, Clone, Copy)]
pub enum Run {
    /// Carries out its verb. If that needs arguments, opens the palette with the verb typed in.
    Verb,
    /// Changes the app.
    Do(fn(&mut App)),
    /// Changes only the state of the screens.
    Change(fn(&mut Screens, &Ui<'_>)),
    /// Changes the state of the screens, and returns what else is to be done.
    Effects(fn(&mut Screens, &Ui<'_>) -> Vec<Effect>),
}

/// An action in a context, with its name, keys and description.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Where it applies.
    pub context: Context,
    /// Name in the palette.
    pub name: &'static str,
    /// Keys, separated by spaces.
    pub keys: &'static str,
    /// Word in the footer; empty if it is not shown there.
    pub hint: &'static str,
    /// The verb with which a script does the same, or the same with suitable arguments; empty if the action concerns
    /// only the screen. For moving and resizing it is the verb for a subgoal; those for other objects are like it.
    pub verb: &'static str,
    /// What it does, in one line; empty if the help text of its verb says it.
    about: &'static str,
    /// What it does.
    pub run: Run,
}

impl Entry {
    /// Its first key.
    pub fn key(&self) -> &'static str {
        self.keys.split(' ').next().unwrap_or_default()
    }

    /// The verb that does the same, if there is one.
    pub fn same_verb(&self) -> Option<&'static Verb> {
        verbs().find(|verb| verb.name == self.verb).filter(|_| self.about.is_empty())
    }

    /// What it does, in one line.
    pub fn about(&self) -> &'static str {
        self.same_verb().map_or(self.about, |verb| verb.help)
    }
}

/// All entries, grouped by context; verbs that can only be typed come last.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let rows = table::ROWS.iter().flat_map(|(context, rows)| rows.iter().map(move |row| (*context, *row)));
        let entry =
            |(context, (name, keys, hint, verb, about, run))| Entry { context, name, keys, hint, verb, about, run };
        let mut entries: Vec<Entry> = rows.map(entry).collect();
        let has_key = |verb: &Verb| entries.iter().any(|entry| entry.verb == verb.name && entry.about.is_empty());
        let typed: Vec<Entry> = verbs().filter(|verb| !has_key(verb)).map(typed).collect();
        entries.extend(typed);
        entries
    });
    &ENTRIES
}

/// The entry of a verb without a default key.
fn typed(verb: &'static Verb) -> Entry {
    // Leaked once, for the lifetime of the program.
    let name = verb.name.replace(' ', "-").leak();
    Entry { context: Context::Typed, name, keys: "", hint: "", verb: verb.name, about: "", run: Run::Verb }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_every_entry_is_explained() {
        for (index, entry) in entries().iter().enumerate() {
            let others = &entries()[index + 1..];
            assert!(others.iter().all(|other| other.name != entry.name), "{}", entry.name);
            assert!(!entry.about().is_empty() && entry.about().len() <= 80, "{}", entry.name);
            // Colours and bell are changed so seldom that no key is spent on them.
            let is_typed = entry.context == Context::Typed || entry.name == "theme";
            assert_eq!(entry.keys.is_empty(), is_typed, "{}", entry.name);
        }
    }

    #[test]
    fn every_named_verb_exists_and_every_verb_has_exactly_one_entry() {
        for entry in entries().iter().filter(|entry| !entry.verb.is_empty()) {
            assert!(verbs().any(|verb| verb.name == entry.verb), "{}: {}", entry.name, entry.verb);
        }
        for verb in verbs() {
            let same = entries().iter().filter(|entry| entry.same_verb().is_some_and(|same| same.name == verb.name));
            assert_eq!(same.count(), 1, "{}", verb.name);
        }
    }
}
