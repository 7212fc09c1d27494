//! What the keys of the table of actions do.

use std::sync::LazyLock;

use crate::tui::actions::{Context, Entry, entries};
use crate::tui::input::Key;

/// The keys of all actions.
static BINDINGS: LazyLock<Vec<(Key, &'static Entry)>> = LazyLock::new(|| {
    let keys = |entry: &'static Entry| {
        // A test checks that all keys parse.
        entry.keys.split_whitespace().filter_map(move |key| Some((key.parse().ok()?, entry)))
    };
    entries().iter().flat_map(keys).collect()
});

/// The entry of a key in the given contexts, innermost first.
pub fn entry(key: Key, contexts: &[Context]) -> Option<&'static Entry> {
    let in_context = |context: &Context| {
        let bound = BINDINGS.iter().find(|(bound, entry)| *bound == key && entry.context == *context);
        bound.map(|(_, entry)| *entry)
    };
    contexts.iter().find_map(in_context)
}

/// Replaces each `{name}` in a text by the first key of the action with that name.
pub fn fill(text: &str) -> String {
    let mut filled = text.to_owned();
    for entry in entries().iter().filter(|entry| text.contains('{') && !entry.keys.is_empty()) {
        filled = filled.replace(&format!("{{{}}}", entry.name), entry.key());
    }
    filled
}

/// Key and entry of each hint in the footer for the given contexts, innermost first.
pub fn hints(contexts: &[Context]) -> Vec<(&'static str, &'static Entry)> {
    let of_context = |context: &Context| {
        let context = *context;
        entries().iter().filter(move |entry| entry.context == context && !entry.hint.is_empty())
    };
    let hint = |entry: &'static Entry| {
        let (key, _) = BINDINGS.iter().find(|(_, bound)| bound.name == entry.name)?;
        // A key of an inner context shadows the same key of an outer one.
        let reached = self::entry(*key, contexts).is_some_and(|reached| reached.name == entry.name);
        // One arrow key stands for all.
        reached.then(|| (if entry.name == "right" { "arrows" } else { entry.key() }, entry))
    };
    contexts.iter().flat_map(of_context).filter_map(hint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether two different actions can apply at the same time.
    fn can_meet(a: &Entry, b: &Entry) -> bool {
        let on_every_screen = |entry: &Entry| matches!(entry.context, Context::Everywhere | Context::Typed);
        a.name != b.name && (a.context == b.context || on_every_screen(a) || on_every_screen(b))
    }

    #[test]
    fn keys_parse_and_never_clash() {
        let written: usize = entries().iter().map(|entry| entry.keys.split_whitespace().count()).sum();
        assert_eq!(BINDINGS.len(), written, "every key parses");
        for (index, (key, a)) in BINDINGS.iter().enumerate() {
            for (other, b) in &BINDINGS[index + 1..] {
                assert!(key != other || !can_meet(a, b), "{key:?}: {} and {}", a.name, b.name);
            }
        }
    }

    #[test]
    fn texts_name_the_first_key_of_an_action() {
        assert_eq!(fill("{pause} or {quit}, not {nothing}"), "p or q, not {nothing}");
    }

    #[test]
    fn inner_contexts_come_first() {
        let contexts = [Context::Hand, Context::Everywhere];
        let name = |key: &str| entry(key.parse().unwrap(), &contexts).unwrap().name;
        assert_eq!((name("space"), name("t")), ("hand-place", "train"));
        let hints = |contexts: &[Context]| super::hints(contexts);
        let of_hand = hints(&contexts);
        assert_eq!((of_hand[0].0, of_hand[0].1.name), ("enter", "hand-place"));
        assert_eq!(of_hand.iter().filter(|(key, _)| *key == "enter").count(), 1);
        let over_the_scene = hints(&[Context::Hand, Context::Playback]);
        assert!(over_the_scene.iter().all(|(_, entry)| entry.name != "play"), "space places the tool");
    }
}
