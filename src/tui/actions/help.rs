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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_action_with_keys_is_listed_in_its_context() {
        let listed = keys();
        let with_keys = entries().iter().filter(|entry| !entry.keys.is_empty());
        assert_eq!(listed.iter().map(|(_, help)| help.len()).sum::<usize>(), with_keys.count());
        let (context, help) = &listed[0];
        assert_eq!(*context, "everywhere");
        let redo = help.iter().find(|help| help.name == "redo").unwrap();
        assert_eq!((redo.keys.as_str(), redo.verb), ("U, ctrl-r", Some("redo")));
        assert!(listed.iter().all(|(context, _)| *context != "typed"));
    }
}
