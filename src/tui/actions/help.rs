//! The keys for the manual page.

use super::{Context, Script, entries};

/// An action with its keys, its name and a description.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyHelp {
    /// Default keys, separated by commas.
    pub keys: String,
    /// Name in key files and in the palette.
    pub name: &'static str,
    /// What it does, in one line.
    pub about: &'static str,
    /// The verb that does the same in a script.
    pub verb: Option<&'static str>,
}

/// All actions with keys, grouped by context, in the order of the help.
pub fn keys() -> Vec<(&'static str, Vec<KeyHelp>)> {
    let of = |context: Context| {
        let entries = entries().iter().filter(|entry| entry.context == context);
        let help = entries.map(|entry| KeyHelp {
            keys: entry.keys.split_whitespace().collect::<Vec<_>>().join(", "),
            name: entry.name,
            about: entry.about,
            verb: match entry.script {
                Script::Verb(verb) | Script::Like(verb) => Some(verb),
                Script::Nothing => None,
            },
        });
        (context.name(), help.collect())
    };
    Context::ALL.into_iter().filter(|context| *context != Context::Typed).map(of).collect()
}
