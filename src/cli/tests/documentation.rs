//! Tests of README.md and docs: links resolve, commands parse, scripts pass the dry run, sweeps and
//! tasks load, and the generated reference is up to date.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;

use crate::cli::arguments::{Arguments, Command};
use crate::cli::manual;
use crate::sweep::Sweep;
use crate::task;
use crate::trainer::RunConfig;
use crate::workbench::{Script, Session};

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

/// README.md, ARCHITECTURE.md, CHANGELOG.md and every page of docs/.
fn pages() -> Vec<Page> {
    let docs = fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        docs.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect();
    paths.sort();
    paths.extend(["README.md", "ARCHITECTURE.md", "CHANGELOG.md"].map(|name| root().join(name)));
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
            let config = RunConfig::new(Arc::new(task::shipped().swap_remove(0)));
            for setting in &train.settings {
                let (key, value) = setting.split_once('=').expect("a setting is KEY=VALUE");
                // The files of `more_tasks` are made by the commands before it.
                let value = if key == "more_tasks" { "task2" } else { value };
                assert!(config.with_setting(key, value).is_ok(), "{}: `{setting}`", block.place);
            }
        }
    }
}

#[test]
fn commands_in_prose_exist() {
    for page in pages() {
        let (_, prose) = page.split();
        for span in prose.iter().flat_map(|line| line.split('`').skip(1).step_by(2)) {
            let mut words = span.split_whitespace();
            if words.next() != Some("mge") || span.contains(['[', '<', '=']) && !span.contains("--") {
                continue;
            }
            let Some(verb) = words.next().filter(|word| !word.starts_with('-')) else { continue };
            let known = manual::commands().iter().any(|command| command.get_name() == verb);
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
        script.dry_run(&session).unwrap_or_else(|error| panic!("{error}"));
    }
}

#[test]
fn tasks_and_sweeps_load() {
    for block in blocks("json task") {
        task::parse(&block.text, &block.place).unwrap_or_else(|error| panic!("{error}"));
    }
    for block in blocks("json sweep") {
        Sweep::parse(block.text.as_bytes(), &block.place).unwrap_or_else(|error| panic!("{error}"));
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
