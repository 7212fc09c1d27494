//! Tests of README.md and docs: links resolve, commands parse, scripts pass the dry run, sweeps and
//! tasks load, and the generated reference is up to date.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{CommandFactory as _, Parser};

use crate::cli::arguments::{Arguments, Command};
use crate::cli::manual;
use mge_base::json;
use mge_dynamics::EvaluationConfig;
use mge_env::EndReason;
use mge_experiments::sweep::Sweep;
use mge_task as task;
use mge_trainer::{self as trainer, Method, RunConfig, warnings};
use mge_workbench::{Script, Session};

/// A page of Markdown: its path and its text.
struct Page {
    path: PathBuf,
    text: String,
}

/// A fenced code block: its position, the language after the fence, and its text.
struct Block {
    place: String,
    language: String,
    text: String,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// README.md, ARCHITECTURE.md, CHANGELOG.md, CONTRIBUTING.md and every page of docs/.
fn pages() -> Vec<Page> {
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        docs.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect();
    paths.sort();
    paths.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md"].map(|name| root().join(name)));
    let page = |path: PathBuf| Page { text: fs::read_to_string(&path).unwrap(), path };
    paths.into_iter().map(page).collect()
}

impl Page {
    fn name(&self) -> String {
        self.path.strip_prefix(root()).unwrap().display().to_string()
    }

    /// The fenced code blocks, and the lines outside them.
    fn split(&self) -> (Vec<Block>, Vec<&str>) {
        let (mut blocks, mut prose): (Vec<Block>, Vec<&str>) = Default::default();
        let mut is_open = false;
        for (index, line) in self.text.lines().enumerate() {
            match line.strip_prefix("```") {
                Some(_) if is_open => is_open = false,
                Some(language) => {
                    is_open = true;
                    let place = format!("{}:{}", self.name(), index + 1);
                    blocks.push(Block { place, language: language.to_owned(), text: String::new() });
                }
                None if is_open => blocks.last_mut().unwrap().text += &format!("{line}\n"),
                None => prose.push(line),
            }
        }
        assert!(!is_open, "{}: a block of code is not closed", self.name());
        (blocks, prose)
    }

    /// The anchors of the headings, as GitHub generates them.
    fn anchors(&self) -> BTreeSet<String> {
        let headings = self.split().1.into_iter().filter(|line| line.starts_with('#'));
        let anchor = |heading: &str| {
            let text = heading.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
            text.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect()
        };
        headings.map(anchor).collect()
    }

    /// The targets of the links and images.
    fn links(&self) -> Vec<String> {
        let (_, prose) = self.split();
        let targets = |line: &str| -> Vec<String> {
            line.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0.to_owned())).collect()
        };
        prose.into_iter().flat_map(targets).collect()
    }
}

/// The blocks of one language in all pages; fails if there are none.
fn blocks(language: &str) -> Vec<Block> {
    let all = pages().into_iter().flat_map(|page| page.split().0);
    let found: Vec<Block> = all.filter(|block| block.language == language).collect();
    assert!(!found.is_empty(), "no block of code is marked `{language}`");
    found
}

/// The arguments of `mge` in a shell line, if it runs `mge`.
fn arguments(line: &str) -> Option<Vec<String>> {
    let command = line.split(" #").next()?.split(" | ").next()?;
    let command = command.split([';', '&', '<', '>']).next()?.trim().trim_start_matches("MGE_RUNS=runs ");
    let words = shell_words::split(command).ok()?;
    let rest = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["mge", ..] => &words[1..],
        ["cargo", "run", "--release", "--", ..] => &words[4..],
        _ => return None,
    };
    Some([&["mge".to_owned()], rest].concat())
}

#[test]
fn links_resolve_to_files_and_headings() {
    let pages = pages();
    for page in &pages {
        for link in page.links().iter().filter(|link| !link.starts_with("http")) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.path.clone() } else { page.path.parent().unwrap().join(file) };
            let target = target.canonicalize().unwrap_or_else(|_| panic!("{}: `{link}`: no such file", page.name()));
            if !anchor.is_empty() {
                let page = pages.iter().find(|page| page.path.canonicalize().unwrap() == target);
                assert!(page.is_some_and(|page| page.anchors().contains(anchor)), "`{link}`: no such heading");
            }
        }
    }
}

#[test]
fn every_page_of_the_docs_is_linked_from_the_index() {
    let pages = pages();
    let index = pages.iter().find(|page| page.name() == "docs/README.md").expect("docs/README.md lists the pages");
    let links = index.links();
    for page in pages.iter().filter(|page| page.name().starts_with("docs/") && page.name() != index.name()) {
        let file = page.path.file_name().unwrap().to_string_lossy();
        assert!(links.iter().any(|link| *link == *file), "docs/README.md does not link {file}");
    }
}

#[test]
fn commands_are_accepted_by_the_program() {
    for block in blocks("sh") {
        for line in block.text.replace("\\\n", " ").lines() {
            let Some(arguments) = arguments(line) else { continue };
            let parsed = Arguments::try_parse_from(&arguments);
            let parsed = parsed.unwrap_or_else(|error| panic!("{}: `{line}`: {error}", block.place));
            let Some(Command::Train(train)) = parsed.command else { continue };
            let method = train.method.unwrap_or(Method::USUAL);
            let mut config = RunConfig::default_for(task_1(), method);
            config.episodes = train.episodes.unwrap_or(config.episodes);
            let mut set = BTreeSet::new();
            let options = [
                ("epsilon", train.epsilon.as_ref().map(ToString::to_string)),
                ("prior", train.model.clone().map(String::from)),
            ];
            let options = options.into_iter().filter_map(|(key, value)| Some((key, value?)));
            let settings = train.settings.iter().map(|setting| setting.split_once('=').expect("KEY=VALUE"));
            for (key, value) in options.chain(settings.map(|(key, value)| (key, value.to_owned()))) {
                let changed = config.with_unchecked_setting(key, &value);
                config = changed.unwrap_or_else(|error| panic!("{}: `{key}={value}`: {error}", block.place));
                set.insert(key.to_owned());
            }
            config.validate().unwrap_or_else(|error| panic!("{}: {error}", block.place));
            assert_eq!(warnings([(&config, &set)]), [""; 0], "{}: `{line}`", block.place);
        }
    }
}

fn task_1() -> Arc<task::Task> {
    Arc::new(task::shipped().swap_remove(0))
}

/// Whether a text is the path of a setting of a run, right or wrong.
fn looks_like_a_setting(text: &str) -> bool {
    let groups = ["ddpg", "guidance", "practice", "refinement", "evaluation", "checkpoints", "planner", "noise_decay"];
    let (group, rest) = text.split_once('.').unwrap_or_default();
    let is_file = [".json", ".py"].iter().any(|end| text.ends_with(end));
    !is_file && groups.contains(&group) && rest.chars().all(|c| c.is_ascii_lowercase() || "._".contains(c))
}

#[test]
fn every_setting_in_the_pages_exists() {
    let mut keys: BTreeSet<String> = trainer::settings().map(|(path, _)| path).collect();
    keys.extend(trainer::config_keys(&RunConfig::usual_for(task_1())));
    // Sweeps of dynamics models have those of their evaluation.
    let of_models = json::to_value(&EvaluationConfig::default());
    keys.extend(json::leaf_values(&of_models).into_iter().map(|(path, _)| format!("evaluation.{path}")));
    for page in pages().into_iter().filter(|page| page.name() != "CHANGELOG.md") {
        let words = page.text.split(|c: char| c.is_whitespace() || "`=\"'|(),:;".contains(c));
        for word in words.map(|word| word.trim_end_matches('.')).filter(|word| looks_like_a_setting(word)) {
            let is_group = keys.iter().any(|key| key.starts_with(&format!("{word}.")));
            assert!(is_group || keys.contains(word), "{}: there is no setting `{word}`", page.name());
        }
    }
}

/// The rows of a table of the reference: the two cells of each.
fn rows<'a>(page: &'a str, section: &str) -> Vec<(&'a str, &'a str)> {
    let from = page.split_once(&format!("\n## {section}\n")).unwrap_or_else(|| panic!("no section {section}")).1;
    let table = from.split("\n## ").next().unwrap_or_default();
    let row = |line: &'a str| line.strip_prefix("| `")?.strip_suffix(" |")?.split_once("` | ");
    table.lines().filter_map(row).collect()
}

#[test]
fn every_setting_of_the_reference_is_accepted_with_its_default_and_at_both_ends_of_its_range() {
    let page = fs::read_to_string(root().join("docs/reference.md")).unwrap();
    let config = RunConfig::usual_for(task_1());
    let accepted = |key: &str, value: &str| {
        let changed = config.with_unchecked_setting(key, value);
        changed.unwrap_or_else(|error| panic!("`{key}={value}`: {error}"));
    };
    let (defaults, ranges) = (rows(&page, "Settings of a run"), rows(&page, "Numbers of a run"));
    assert!(defaults.len() > 50 && ranges.len() > 45, "{} and {} rows", defaults.len(), ranges.len());
    for (key, value) in defaults {
        accepted(key, value);
    }
    for (key, about) in ranges {
        let (_, range) = about.rsplit_once(" from ").unwrap();
        let (low, rest) = range.split_once(" to ").unwrap();
        let high = rest.split(',').next().unwrap();
        if about.contains("two numbers") {
            accepted(key, &format!("[{low},{high}]"));
        } else {
            [low, high].into_iter().for_each(|value| accepted(key, value));
        }
    }
}

#[test]
fn the_ends_of_episodes_have_one_name_each() {
    for page in ["docs/json.md", "docs/metrics.md"] {
        let text = fs::read_to_string(root().join(page)).unwrap();
        assert!(EndReason::ALL.iter().all(|end| text.contains(&format!("`{end}`"))), "{page}");
    }
    let names = EndReason::ALL.map(EndReason::name);
    assert_eq!(json::to_value(&EndReason::ALL), json::to_value(&names), "in JSON as in logs");
}

#[test]
fn commands_in_prose_exist() {
    // The changelog names commands of former versions too.
    for page in pages().into_iter().filter(|page| page.name() != "CHANGELOG.md") {
        let (_, prose) = page.split();
        for span in prose.iter().flat_map(|line| line.split('`').skip(1).step_by(2)) {
            let mut words = span.split_whitespace();
            if words.next() != Some("mge") || span.contains(['[', '<', '=']) && !span.contains("--") {
                continue;
            }
            let Some(verb) = words.next().filter(|word| !word.starts_with('-')) else { continue };
            // `mge RUN` opens the workbench with a run, by its path.
            let is_argument = |argument: &clap::Arg| argument.get_value_names().is_some_and(|names| names == [verb]);
            let known = manual::commands().iter().any(|command| command.get_name() == verb)
                || verb.contains('/')
                || Arguments::command().get_positionals().any(is_argument);
            assert!(known, "{}: `{span}` is not a command", page.name());
        }
    }
}

#[test]
fn scripts_pass_the_dry_run() {
    let variables = ["out", "seed"].map(|name| (name.to_owned(), "1".to_owned()));
    for block in blocks("mge") {
        let session = Session::new(task::shipped().swap_remove(0), "runs".into());
        let script = Script::parse(&block.text, &block.place, &variables).unwrap_or_else(|error| panic!("{error}"));
        let warnings = script.dry_run(&session).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(warnings, [], "{}", block.place);
    }
}

#[test]
fn tasks_and_sweeps_load() {
    for block in blocks("json task") {
        task::parse(&block.text, &block.place).unwrap_or_else(|error| panic!("{error}"));
    }
    for block in blocks("json sweep") {
        let sweep = Sweep::parse(block.text.as_bytes(), &block.place).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(sweep.warnings(), [""; 0], "{}", block.place);
    }
}

/// `MGE_UPDATE_GOLDEN=1 cargo test reference` rewrites the page.
#[test]
fn the_reference_is_what_the_program_prints() {
    let path = root().join("docs/reference.md");
    if std::env::var_os("MGE_UPDATE_GOLDEN").is_some() {
        fs::write(&path, manual::markdown_page()).unwrap();
    }
    let is_fresh = fs::read_to_string(&path).unwrap() == manual::markdown_page();
    assert!(is_fresh, "docs/reference.md is out of date: regenerate it with `mge man --markdown > docs/reference.md`");
}

#[test]
fn the_page_parser_works() {
    assert_eq!(arguments("mge train task1 --out x  # one run").unwrap(), ["mge", "train", "task1", "--out", "x"]);
    assert_eq!(arguments("cargo run --release -- man > mge.1").unwrap(), ["mge", "man"]);
    assert_eq!(arguments("cargo test --release"), None);
    let page = Page { path: root().join("docs/x.md"), text: "# A b, c\n[x](y.md#z)\n```sh\nmge no\n```\n".to_owned() };
    assert_eq!(page.anchors(), BTreeSet::from(["a-b-c".to_owned()]));
    assert_eq!(page.links(), ["y.md#z"]);
    assert_eq!(page.split().0[0].place, "docs/x.md:3");
}

/// The sources below a folder.
fn sources(folder: PathBuf) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| match path.is_dir() {
            true => sources(path),
            false => vec![path],
        })
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect()
}

#[test]
fn words_that_the_glossary_replaces_are_not_used_in_the_code() {
    let glossary = fs::read_to_string(root().join("docs/glossary.md")).unwrap();
    let (_, replaced) = glossary.split_once("## Words that are not used").unwrap();
    let rows = replaced.lines().filter_map(|line| line.strip_prefix("| `")?.split_once(" | "));
    let words: BTreeSet<&str> =
        rows.flat_map(|(words, _)| words.split([',', '`', ' '])).filter(|w| !w.is_empty()).collect();
    assert!(words.len() > 5, "{words:?}");
    for path in ["src", "crates", "python/src", "benches"].into_iter().flat_map(|folder| sources(root().join(folder))) {
        let source = fs::read_to_string(&path).unwrap();
        let mut identifiers = source.split(|c: char| !c.is_alphanumeric() && c != '_');
        let used = identifiers.find(|identifier| words.contains(identifier));
        assert_eq!(used, None, "{}", path.display());
    }
}
