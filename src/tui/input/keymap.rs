//! Key bindings: the defaults of the table of actions, changed by a key file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::tui::actions::{Context, Entry, entries, named};
use crate::tui::input::{Key, KeyError};
use mge_base::bounded;
use mge_base::spelling::suggestion;

/// The key bindings of all actions.
#[derive(Debug, Clone)]
pub struct Keymap {
    bindings: Vec<(Key, &'static Entry)>,
}

/// A key file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KeymapError {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    /// A line is not `name = key key`.
    #[error("{origin}:{line}: `{text}` is not NAME = KEY...: write `train = t`, or `train =` for no key")]
    Form { origin: String, line: usize, text: String },
    /// No action has the name.
    #[error("{origin}:{line}: there is no action `{name}`{} (`?` in the workbench lists all names)", suggestion(*.nearest))]
    Unknown { origin: String, line: usize, name: String, nearest: Option<&'static str> },
    /// A word is not a key.
    #[error("{origin}:{line}: {source}")]
    Key { origin: String, line: usize, source: KeyError },
    /// Two actions that can apply at the same time share a key.
    #[error("{origin}:{line}: key `{key}` of `{name}` already belongs to `{other}`: give one of them another key")]
    Clash { origin: String, line: usize, key: String, name: &'static str, other: &'static str },
    /// The workbench could not be left.
    #[error(
        "{origin}: neither `quit` nor `palette` has a key, so that the workbench could not be left: give one of them a key"
    )]
    NoWayOut { origin: String },
}

impl Default for Keymap {
    fn default() -> Self {
        let keys = |entry: &'static Entry| {
            // A test checks that all default keys parse.
            entry.keys.split_whitespace().filter_map(move |key| Some((key.parse().ok()?, entry)))
        };
        Self { bindings: entries().iter().flat_map(keys).collect() }
    }
}

impl Keymap {
    /// The defaults, changed by the file at `path`: lines `name = key key`, comments
    /// after `#`. The keys of a line replace all other keys of its action.
    ///
    /// # Errors
    /// When the file cannot be read or a line is invalid; names file and line.
    pub fn load(path: &Path) -> Result<Self, KeymapError> {
        let text = bounded::read_text(path).map_err(|source| KeymapError::Io { path: path.to_owned(), source })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Like [`Keymap::load`], for text; `origin` names it in errors.
    ///
    /// # Errors
    /// When a line is invalid.
    pub fn parse(text: &str, origin: &str) -> Result<Self, KeymapError> {
        let mut changed: HashMap<&str, (usize, &'static Entry, Vec<Key>)> = HashMap::new();
        for (line, raw) in (1..).zip(text.lines()) {
            if let Some((entry, keys)) = read_line(raw, origin, line)? {
                changed.insert(entry.name, (line, entry, keys));
            }
        }
        let mut map = Self::default();
        map.bindings.retain(|(_, bound)| !changed.contains_key(bound.name));
        let mut of_key: HashMap<Key, Vec<&'static Entry>> = HashMap::new();
        map.bindings.iter().for_each(|(key, entry)| of_key.entry(*key).or_default().push(entry));
        let mut changed: Vec<_> = changed.into_values().collect();
        changed.sort_by_key(|(line, ..)| *line);
        for (line, entry, keys) in changed {
            for key in keys {
                let bound = of_key.entry(key).or_default();
                if let Some(other) = bound.iter().find(|other| can_meet(entry, other)) {
                    let (key, name, other) = (key.to_string(), entry.name, other.name);
                    return Err(KeymapError::Clash { origin: origin.to_owned(), line, key, name, other });
                }
                // Given twice, it is bound once.
                if !bound.iter().any(|known| known.name == entry.name) {
                    bound.push(entry);
                    map.bindings.push((key, entry));
                }
            }
        }
        if !map.bindings.iter().any(|(_, entry)| ["quit", "palette"].contains(&entry.name)) {
            return Err(KeymapError::NoWayOut { origin: origin.to_owned() });
        }
        Ok(map)
    }

    /// The entry of a key in the given contexts, innermost first.
    pub fn entry(&self, key: Key, contexts: &[Context]) -> Option<&'static Entry> {
        contexts.iter().find_map(|context| {
            let bound = self.bindings.iter().find(|(bound, entry)| *bound == key && entry.context == *context);
            bound.map(|(_, entry)| *entry)
        })
    }

    /// The keys of an entry in text form.
    pub fn keys(&self, entry: &Entry) -> Vec<String> {
        let own = self.bindings.iter().filter(|(_, bound)| bound.name == entry.name);
        own.map(|(key, _)| key.to_string()).collect()
    }

    /// Replaces each `{name}` in a text by the first key of the action with that name, or by `:`, the key of
    /// the palette, if the action has none.
    pub fn fill(&self, text: &str) -> String {
        let mut filled = String::new();
        for (index, part) in text.split(['{', '}']).enumerate() {
            match self.bindings.iter().find(|(_, entry)| entry.name == part) {
                _ if index % 2 == 0 => filled += part,
                Some((key, _)) => filled += &key.to_string(),
                None if named(part).is_some() => filled += ":",
                None => filled += &format!("{{{part}}}"),
            }
        }
        filled
    }

    /// Key and entry of each hint in the footer for the given contexts, innermost first.
    pub fn hints(&self, contexts: &[Context]) -> Vec<(String, &'static Entry)> {
        let of_context = |context: &Context| {
            let context = *context;
            entries().iter().filter(move |entry| entry.context == context && !entry.hint.is_empty())
        };
        let hint = |entry: &'static Entry| {
            let (key, _) = self.bindings.iter().find(|(_, bound)| bound.name == entry.name)?;
            // A key of an inner context shadows the same key of an outer one.
            let reached = self.entry(*key, contexts).is_some_and(|reached| reached.name == entry.name);
            reached.then(|| (key.to_string(), entry))
        };
        contexts.iter().flat_map(of_context).filter_map(hint).collect()
    }
}

/// Whether two different actions can apply at the same time.
fn can_meet(a: &Entry, b: &Entry) -> bool {
    let on_every_screen = |entry: &Entry| matches!(entry.context, Context::Everywhere | Context::Typed);
    a.name != b.name && (a.context == b.context || on_every_screen(a) || on_every_screen(b))
}

type Line = Option<(&'static Entry, Vec<Key>)>;

fn read_line(raw: &str, origin: &str, line: usize) -> Result<Line, KeymapError> {
    let origin = origin.to_owned();
    let text = raw.trim();
    if text.is_empty() || text.starts_with('#') {
        return Ok(None);
    }
    let Some((name, keys)) = text.split_once('=') else {
        return Err(KeymapError::Form { origin, line, text: text.to_owned() });
    };
    // `#` alone is a key; before a word, or after the keys, it begins a comment.
    let words: Vec<&str> = keys.split_whitespace().collect();
    let is_comment = |word: &&str| word.starts_with('#') && (words.len() > 1 || word.len() > 1);
    let keys = &words[..words.iter().position(is_comment).unwrap_or(words.len())];
    let name = name.trim();
    let Some(entry) = named(name) else {
        let nearest = mge_base::spelling::nearest(entries().iter().map(|entry| entry.name), name);
        return Err(KeymapError::Unknown { origin, line, name: name.to_owned(), nearest });
    };
    let keys = keys.iter().map(|key| key.parse()).collect::<Result<Vec<Key>, KeyError>>();
    keys.map(|keys| Some((entry, keys))).map_err(|source| KeymapError::Key { origin, line, source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_keys_parse_and_never_clash() {
        let map = Keymap::default();
        let written: usize = entries().iter().map(|entry| entry.keys.split_whitespace().count()).sum();
        assert_eq!(map.bindings.len(), written, "every default key parses");
        for (index, (key, a)) in map.bindings.iter().enumerate() {
            for (other, b) in &map.bindings[index + 1..] {
                assert!(key != other || !can_meet(a, b), "{key}: {} and {}", a.name, b.name);
            }
        }
    }

    /// The name of the action of a key on every screen; empty if it has none.
    fn action(map: &Keymap, key: &str) -> &'static str {
        let entry = map.entry(key.parse().unwrap(), &[Context::Everywhere, Context::Typed]);
        entry.map_or("", |entry| entry.name)
    }

    #[test]
    fn a_file_changes_and_removes_keys() {
        let map = Keymap::parse("# mine\ntrain = f10 f9  # go\nquit =\n", "keys").unwrap();
        assert_eq!(action(&map, "f10"), "train");
        assert_eq!(action(&map, "f9"), "train");
        assert_eq!(action(&map, "t"), "");
        assert_eq!(action(&map, "q"), "");
        let typed = Keymap::parse("set = f9", "keys").unwrap();
        assert_eq!(action(&typed, "f9"), "set");
        let hash = Keymap::parse("train = #\npause = # none", "keys").unwrap();
        assert_eq!(action(&hash, "#"), "train");
        assert_eq!(action(&hash, "p"), "");
        let comment = Keymap::parse("pause = #none", "keys").unwrap();
        assert_eq!(action(&comment, "p"), "");
        let swapped = Keymap::parse("train = p\npause = t", "keys").unwrap();
        assert_eq!(action(&swapped, "p"), "train");
    }

    #[test]
    fn only_the_last_line_of_an_action_counts() {
        let map = Keymap::parse("train = f9\ntrain = f10", "keys").unwrap();
        assert_eq!(map.keys(named("train").unwrap()), ["f10"]);
    }

    #[test]
    fn mistakes_name_file_and_line() {
        for (text, message) in [
            ("\ntrian = t", "keys:2: there is no action `trian`: did you mean `train`?"),
            ("train = hyper-t", "keys:1: unknown key `hyper-t`"),
            ("train t", "keys:1: `train t` is not NAME = KEY"),
            ("train = q", "keys:1: key `q` of `train` already belongs to `quit`"),
            ("play = t", "keys:1: key `t` of `play` already belongs to `train`"),
            ("play = .", "keys:1: key `.` of `play` already belongs to `step-on`"),
            ("quit =\npalette =", "keys: neither `quit` nor `palette` has a key"),
        ] {
            let error = Keymap::parse(text, "keys").unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn a_file_is_loaded_or_named_in_the_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("keys");
        let error = Keymap::load(&path).unwrap_err().to_string();
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        std::fs::write(&path, "train = f9").unwrap();
        assert_eq!(Keymap::load(&path).unwrap().keys(named("train").unwrap()), ["f9"]);
    }

    #[test]
    fn an_action_without_a_key_is_found_in_the_palette() {
        let map = Keymap::parse("train =", "keys").unwrap();
        assert_eq!(map.fill("{pause} or {train}, not {nothing}"), "p or :, not {nothing}");
    }

    #[test]
    fn inner_contexts_come_first() {
        let map = Keymap::default();
        let contexts = [Context::Hand, Context::Everywhere];
        let name = |key: &str| map.entry(key.parse().unwrap(), &contexts).unwrap().name;
        assert_eq!((name("space"), name("t")), ("hand-place", "train"));
        let hints = map.hints(&contexts);
        assert_eq!((hints[0].0.as_str(), hints[0].1.name), ("enter", "hand-place"));
        assert_eq!(hints.iter().filter(|(key, _)| key == "enter").count(), 1);
        let over_the_scene = map.hints(&[Context::Hand, Context::Playback]);
        assert!(over_the_scene.iter().all(|(_, entry)| entry.name != "play"), "space places the tool");
    }
}
