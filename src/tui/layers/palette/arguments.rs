//! Completions for the arguments of a command: known names, settings with their ranges, files.

use std::sync::Arc;

use crate::tui::actions::Entry;
use crate::tui::layers::search::{Searched, search, similar};
use crate::tui::view::{RunSummary, ViewModel};
use mge_base::json;
use mge_base::paths::{entries, expanded, suffix};
use mge_base::spelling::MAX_COMPARED_LENGTH;
use mge_physics::ToolKind;
use mge_results::OPTIONS;
use mge_task::Property;
use mge_trainer::{Method, RunConfig, config_keys, settings};
use mge_workbench::{FigureKind, Verb};

/// Actions, and other words for each.
const SYNONYMS: [(&str, &str); 13] = [
    ("train", "new start run"),
    ("stop", "kill end cancel"),
    ("undo", "revert"),
    ("quit", "exit close leave"),
    ("screen-log", "history messages"),
    ("help", "keys shortcuts"),
    ("set", "settings parameters hyperparameters options"),
    ("restore", "undelete trash recover"),
    ("delete-run", "remove"),
    ("filter-runs", "search find"),
    ("export-figure", "plot picture"),
    ("theme", "colours colors dark light"),
    ("task", "level load"),
];

/// A completion with a short description, or an action.
#[derive(Debug, Clone, Default)]
pub struct Value {
    /// The verb of which it is an argument, or the document in which it is described; empty for a part of an argument.
    of: &'static str,
    /// The argument as typed.
    pub text: String,
    /// The description.
    pub about: String,
    /// The present value of a setting.
    now: String,
    /// The action, if it is one and no argument, and whether that applies in the current contexts.
    pub action: Option<(&'static Entry, bool)>,
}

impl Value {
    /// A completion.
    pub fn new(text: impl Into<String>, about: impl Into<String>) -> Self {
        Self { text: text.into(), about: about.into(), ..Self::default() }
    }

    fn of(of: &'static str, text: impl Into<String>, about: impl Into<String>) -> Self {
        Self { of, ..Self::new(text, about) }
    }

    /// An action, by the name of its command, or else its own.
    pub fn action(entry: &'static Entry, applies: bool) -> Self {
        let name = entry.same_verb().map_or(entry.name, |verb| verb.name);
        Self { action: Some((entry, applies)), ..Self::new(name, entry.about()) }
    }

    /// The argument as a word of a command.
    pub fn quoted(&self) -> String {
        let is_special = self.text.contains([' ', '\'', '"', '\\', '#']);
        if is_special { shell_words::quote(&self.text).into() } else { self.text.clone() }
    }

    /// The command with this argument, or where it is described; of an action the usage and the description.
    pub fn line(&self) -> String {
        let Self { of, text, .. } = self;
        if let Some((entry, _)) = self.action {
            return format!("{:<28} {}", entry.same_verb().map_or_else(|| text.clone(), Verb::usage), self.about);
        }
        if self.is_document() { format!("docs/{of}: {text}") } else { format!("{of} {}", self.quoted()) }
    }

    /// Whether it is no argument but a page of the documentation or a term of its glossary.
    pub fn is_document(&self) -> bool {
        self.of.ends_with(".md")
    }
}

impl Searched for Value {
    fn texts(&self) -> (Vec<&str>, &str) {
        let action = self.action.map(|(entry, _)| entry.name);
        let synonyms = SYNONYMS.iter().filter(|(of, _)| Some(*of) == action).flat_map(|(_, words)| words.split(' '));
        let document = self.is_document().then_some(self.of);
        ([&*self.text].into_iter().chain(action).chain(document).chain(synonyms).collect(), &self.about)
    }
}

/// Everything that can be completed.
#[derive(Debug, Clone, Default)]
pub struct Arguments {
    /// Tasks, runs, models, settings of the next run, pages of the documentation and terms of its glossary.
    known: Vec<Value>,
    /// The settings of the run that typed commands act on, which can be forked.
    of_run: Vec<Value>,
}

/// Examples of epsilon schedules.
const SCHEDULES: [(&str, &str); 6] = [
    ("0.1", "constant"),
    ("linear:0.8:0.05:2000", "from 0.8 to 0.05 over 2000 episodes"),
    ("exp:0.8:0.05:0.999", "from 0.8 towards 0.05"),
    ("step:0.8:0.5:500", "from 0.8, times 0.5 every 500 episodes"),
    ("points:0=0.8,1000=0.3", "lines between points"),
    ("need:0.25:0.25:10", "by the share of the last 10 greedy attempts that failed"),
];

/// Maximum number of entries of a folder that are considered.
const FILES: usize = 500;

impl Arguments {
    /// The completions for the current view, and for commands on a run.
    pub fn new(view: &ViewModel, on: Option<&RunSummary>) -> Self {
        // A run of the folder is found by its name.
        let run = |run: &Arc<RunSummary>| {
            let path = run.path.strip_prefix(&view.folder).unwrap_or(&run.path);
            Value::of("open", path.display().to_string(), format!("{}, {}", run.name, run.label))
        };
        let tasks = view.tasks.iter().map(|(name, task)| Value::of("task", &**name, &*task.description));
        let models = view.models.iter().map(|model| Value::of("model", &*model.name, &*model.about));
        let runs = view.runs.iter().rev().map(run);
        Self {
            known: tasks.chain(runs).chain(described(&view.settings)).chain(models).chain(documents()).collect(),
            of_run: on.map(|run| described(&run.config)).unwrap_or_default(),
        }
    }

    /// What is known for a verb.
    fn known(&self, verb: &str) -> Vec<Value> {
        self.known.iter().filter(|value| value.of == verb).cloned().collect()
    }

    /// Commands on the tasks, runs, settings and models that are found by a text, and what the documents say of it.
    pub fn lines_with(&self, text: &str) -> Vec<Value> {
        search(self.known.iter().filter(|_| !text.is_empty()), text).into_iter().cloned().collect()
    }

    /// Completions of the last of the words after a verb, or of a misspelt first one the most similar.
    pub fn of(&self, verb: &Verb, words: &[&str]) -> Vec<Value> {
        let (typed, before) = words.split_last().map_or(("", &[][..]), |(typed, before)| (*typed, before));
        if typed.len() > 10 * MAX_COMPARED_LENGTH {
            return Vec::new();
        }
        let candidates: Vec<Value> = match (verb.name, before) {
            ("task", []) => [self.known("task"), files(typed, "json")].concat(),
            ("open" | "continue" | "delete" | "note" | "rename", []) => self.known("open"),
            ("method", []) => Method::ALL.map(|method| Value::new(method.name(), method.label())).into(),
            ("model" | "set", []) => self.known(verb.name),
            ("set", [key]) => {
                let known = self.known("set").into_iter().filter(|setting| setting.text == *key);
                known.map(|setting| Value::new(setting.now, setting.about)).collect()
            }
            ("fork", [_, ..]) => {
                let edited = Value::new("task=edited", "the task as it is edited");
                let own = self.of_run.iter().filter(|known| !["method", "seed"].contains(&&*known.text));
                let own = own.map(|known| Value::new(format!("{}=", known.text), &*known.about));
                std::iter::once(edited).chain(own).collect()
            }
            ("figure", []) => FigureKind::ALL.map(|kind| Value::new(kind.name(), "")).into(),
            ("figure", ["learning", _, ..]) if typed.starts_with("runs=") => {
                self.known("open").iter().map(|run| Value::new(format!("runs={}", run.text), &*run.about)).collect()
            }
            ("figure", ["learning", _, ..]) => OPTIONS.map(|(key, about)| Value::new(format!("{key}="), about)).into(),
            ("epsilon", []) => SCHEDULES.map(|(text, about)| Value::new(text, about)).into(),
            ("tool add" | "placeable", []) => ToolKind::ALL.map(|kind| Value::new(kind.name(), "")).into(),
            ("tool set" | "placeable", [_, ..]) | ("tool add", [_, _, _, ..]) => {
                Property::ALL.map(|property| Value::new(format!("{property}="), property.unit())).into()
            }
            _ => Vec::new(),
        };
        let is_misspelt = before.is_empty() && candidates.iter().all(|candidate| candidate.text != typed);
        let found = search(&candidates, typed);
        let found = if found.is_empty() && is_misspelt { similar(&candidates, typed, 0.0) } else { found };
        found.into_iter().filter(|candidate| candidate.text != typed).cloned().collect()
    }
}

/// The pages of the documentation, and the terms of its glossary with what they mean.
fn documents() -> impl Iterator<Item = Value> {
    let pages = include_str!("../../../../docs/README.md").lines().filter_map(|line| {
        let (title, rest) = line.strip_prefix("- [")?.split_once("](")?;
        let (file, about) = rest.split_once("): ")?;
        Some(Value::of(file, title, about))
    });
    let (terms, _) = include_str!("../../../../docs/glossary.md").split_once("## Words that").unwrap_or_default();
    let rows = terms.lines().filter_map(|line| line.strip_prefix("| ")?.trim_end_matches(" |").split_once(" | "));
    let terms = rows.filter(|(_, meaning)| *meaning != "meaning");
    pages.chain(terms.map(|(term, meaning)| Value::of("glossary.md", term, meaning.replace('`', ""))))
}

/// The settings of a run with their defaults, ranges and present values.
fn described(config: &RunConfig) -> Vec<Value> {
    let all = [config, &RunConfig::default_for(config.task.clone(), config.method)].map(json::to_value);
    let known: Vec<_> = settings().collect();
    let described = |path: String| {
        let [now, usual] = all.each_ref().map(|whole| {
            let found = path.split('.').try_fold(whole, |place, name| place.get(name));
            found.map(json::text).unwrap_or_default()
        });
        let usual = if usual == now { String::new() } else { format!(", by default {usual}") };
        let about = match known.iter().find(|(known, _)| *known == path) {
            Some((_, setting)) => format!("now {now}{usual}; {}: {}", setting.about, setting.range),
            None => format!("now {now}{usual}"),
        };
        Value { now, ..Value::of("set", path, about) }
    };
    config_keys(config).into_iter().map(described).collect()
}

/// Files with an extension, and folders, in the folder of a partly typed path.
fn files(typed: &str, extension: &str) -> Vec<Value> {
    let prefix = &typed[..typed.rfind('/').map_or(0, |slash| slash + 1)];
    let folder = if prefix.is_empty() { ".".into() } else { expanded(prefix) };
    let named = entries(&folder).unwrap_or_default().into_iter().take(FILES).filter_map(|file| {
        let name = file.file_name()?.to_str().filter(|name| !name.starts_with('.'))?;
        match file.is_dir() {
            true => Some(Value::new(format!("{prefix}{name}/"), "folder")),
            false => (suffix(&file) == extension).then(|| Value::new(format!("{prefix}{name}"), "file")),
        }
    });
    let mut found: Vec<Value> = named.collect();
    found.sort_by(|a, b| a.text.cmp(&b.text));
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::testing::{empty, typical};
    use mge_workbench::verbs;

    fn offered(words: &[&str], verb: &str) -> Vec<String> {
        let verb = verbs().find(|known| known.name == verb).unwrap();
        Arguments::new(&typical(), Some(&typical().runs[1]))
            .of(verb, words)
            .into_iter()
            .map(|value| value.text)
            .collect()
    }

    #[test]
    fn completions_that_begin_with_the_typed_text_come_first() {
        assert_eq!(offered(&["ddpg.gam"], "set")[0], "ddpg.gamma");
        assert_eq!(offered(&["DDPG.gam"], "set")[0], "ddpg.gamma");
        let with_an_e = offered(&["e"], "set");
        assert!(with_an_e[0].starts_with('e') && with_an_e.contains(&"method".to_owned()), "{with_an_e:?}");
        assert_eq!(offered(&[""], "open")[0], "task1-ddpg-mge-seed0", "the latest run first");
        assert_eq!(offered(&["ddpg.gamma", ""], "set"), ["0.9"]);
        assert_eq!(offered(&["12", "ddpg.gam"], "fork")[0], "ddpg.gamma=");
        assert!(!offered(&["12", "seed"], "fork").contains(&"seed=".to_owned()), "a fork keeps its seed");
        assert_eq!(offered(&["ol"], "open"), ["old"]);
        assert_eq!(offered(&["task4"], "task"), Vec::<String>::new(), "it is complete");
        assert!(offered(&["task"], "task").contains(&"task4".to_owned()));
        assert_eq!(offered(&["ddpg-u"], "method")[..2], ["ddpg-uniform", "ddpg-uniform-adaptive"]);
        assert_eq!(offered(&["learning", "a.png", "ag"], "figure")[0], "against=");
        assert_eq!(offered(&["learning", "a.png", "runs=ol"], "figure")[0], "runs=old");
        assert_eq!(offered(&["clu"], "figure"), ["clusters"]);
        assert_eq!(offered(&["see"], "tool add"), ["see_saw"]);
        assert_eq!(offered(&["1", "max"], "tool set"), ["max_angle="]);
        let settings = Arguments::new(&empty(), None).known("set");
        let gamma = settings.iter().find(|value| value.text == "ddpg.gamma").unwrap();
        assert!(
            gamma.about.starts_with("now 0.9, by default 0.95; ") && gamma.about.contains("a number from 0 to"),
            "{}",
            gamma.about
        );
    }

    #[test]
    fn files_and_folders_of_the_typed_path_are_offered() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("mine.json"), "").unwrap();
        std::fs::write(folder.path().join("mine.txt"), "").unwrap();
        std::fs::write(folder.path().join(".mine.json"), "").unwrap();
        std::fs::create_dir(folder.path().join("more")).unwrap();
        let typed = format!("{}/m", folder.path().display());
        let names: Vec<String> = files(&typed, "json").into_iter().map(|value| value.text).collect();
        let at = |name: &str| folder.path().join(name).display().to_string();
        assert_eq!(names, [at("mine.json"), format!("{}/", at("more"))]);
        assert!(files("/no/such/folder/x", "json").is_empty());
        let deep = folder.path().join("deep".repeat(30));
        std::fs::create_dir(&deep).unwrap();
        std::fs::write(deep.join("mine.json"), "").unwrap();
        let path = deep.join("mine.json").display().to_string();
        assert_eq!(offered(&[path.trim_end_matches("ine.json")], "task"), [path.as_str()]);
    }
}
