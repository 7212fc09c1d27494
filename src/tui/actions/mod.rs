//! Actions: everything that can be bound to a key. One table of actions and the verbs of the command
//! language are the source of the key map, the hints of the footer, the help, the palette and the
//! manual page.

mod action;
mod help;
mod tab;
mod table;

pub use action::{Context, Script, UiAction};
pub use help::{KeyHelp, keys};
pub use tab::Tab;

use std::sync::LazyLock;

use mge_workbench::{Verb, verbs};

/// An action in a context, with its name, keys and description.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The action.
    pub action: UiAction,
    /// Where it applies.
    pub context: Context,
    /// Name in key files and in the palette.
    pub name: &'static str,
    /// Default keys, separated by spaces.
    pub keys: &'static str,
    /// Word in the footer; empty if it is not shown there.
    pub hint: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// How a script does the same.
    pub script: Script,
}

impl Entry {
    /// The verb that is equivalent to the action, if there is one.
    pub fn verb(&self) -> Option<&'static Verb> {
        match self.script {
            Script::Verb(name) => verbs().find(|verb| verb.name == name),
            Script::Like(_) | Script::Nothing => None,
        }
    }
}

/// All entries, grouped by context; those that can only be typed come last.
pub fn entries() -> &'static [Entry] {
    static ENTRIES: LazyLock<Vec<Entry>> = LazyLock::new(|| {
        let mut entries: Vec<Entry> = Vec::new();
        for &(action, context, name, keys, hint, about, script) in table::ROWS {
            let mut entry = Entry { action, context, name, keys, hint, about, script };
            // A test checks that every verb named in the table exists.
            entry.about = entry.verb().filter(|_| about.is_empty()).map_or(about, |verb| verb.help);
            entries.push(entry);
        }
        for verb in verbs() {
            let script = Script::Verb(verb.name);
            if entries.iter().all(|entry| entry.script != script) {
                // Leaked once, for the lifetime of the program.
                let (action, name) = (UiAction::Type(verb.name), verb.name.replace(' ', "-").leak());
                let context = Context::Typed;
                entries.push(Entry { action, context, name, keys: "", hint: "", about: verb.help, script });
            }
        }
        entries
    });
    &ENTRIES
}

/// The entry with a name.
pub fn named(name: &str) -> Option<&'static Entry> {
    entries().iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_every_entry_is_explained() {
        for (index, entry) in entries().iter().enumerate() {
            let others = &entries()[index + 1..];
            assert!(others.iter().all(|other| other.name != entry.name), "{}", entry.name);
            assert!(!entry.about.is_empty() && entry.about.len() <= 80, "{}", entry.name);
            assert_eq!(entry.keys.is_empty(), entry.context == Context::Typed, "{}", entry.name);
        }
    }

    #[test]
    fn every_named_verb_exists_and_every_verb_has_exactly_one_entry() {
        for entry in entries() {
            if let Script::Verb(name) | Script::Like(name) = entry.script {
                assert!(verbs().any(|verb| verb.name == name), "{}: {name}", entry.name);
            }
        }
        for verb in verbs() {
            let same = |entry: &&Entry| entry.script == Script::Verb(verb.name);
            assert_eq!(entries().iter().filter(same).count(), 1, "{}", verb.name);
        }
    }
}
