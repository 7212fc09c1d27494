//! The commands in README.md and `docs/` whose output is shown: a block of `sh`, followed by one of `text output`. The
//! blocks of a page run in their order, in one folder with links to those of the repository.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::{env, fs};

use crate::program::{CACHE, MGE, text};

/// The pages that show outputs, and how many at least.
const PAGES: [(&str, usize); 10] = [
    ("README.md", 1),
    ("docs/first-experiment.md", 6),
    ("docs/work-with-runs.md", 5),
    ("docs/author-a-task.md", 3),
    ("docs/create.md", 4),
    ("docs/json.md", 4),
    ("docs/methods.md", 1),
    ("docs/puzzles.md", 2),
    ("docs/sweeps.md", 3),
    ("docs/train-a-model.md", 3),
];

/// The blocks of commands of a page, each with the output that the page shows.
fn blocks(page: &str) -> Vec<(String, String)> {
    let mut fences = page.split("\n```").skip(1).step_by(2).peekable();
    let mut found = Vec::new();
    while let Some(block) = fences.next() {
        let (Some(commands), Some(next)) = (block.strip_prefix("sh\n"), fences.peek()) else { continue };
        if let Some(output) = next.strip_prefix("text output\n") {
            found.push((commands.to_owned(), output.to_owned()));
        }
    }
    found
}

/// A line in which every number is `#`, and every amount of space is one.
fn shape(line: &str) -> String {
    let mut shape = String::new();
    for c in line.chars() {
        match c {
            '0'..='9' if shape.ends_with('#') => {}
            '0'..='9' => shape.push('#'),
            '.' if shape.ends_with('#') => {}
            ' ' if shape.ends_with(' ') => {}
            _ => shape.push(c),
        }
    }
    shape.replace("-#", "#")
}

/// Whether a line has the shape that a page shows, in which `...` stands for any text.
fn is_like(line: &str, shown: &str) -> bool {
    let line = shape(line);
    let parts: Vec<String> = shown.split("...").map(shape).collect();
    let [first, middle @ .., last] = &parts[..] else { return line == shape(shown) };
    let Some(mut rest) = line.strip_prefix(first.as_str()) else { return false };
    for part in middle {
        let Some((_, after)) = rest.split_once(part.as_str()) else { return false };
        rest = after;
    }
    rest.ends_with(last.as_str())
}

/// Whether an output has the shape that a page shows, in which a line `...` stands for any lines.
fn has_shape(output: &[&str], shown: &[&str]) -> bool {
    match (shown, output) {
        ([], _) => output.is_empty(),
        (["...", rest @ ..], _) => (0..=output.len()).any(|skipped| has_shape(&output[skipped..], rest)),
        ([line, rest @ ..], [first, others @ ..]) => is_like(first, line) && has_shape(others, rest),
        _ => false,
    }
}

#[test]
fn commands_print_what_the_documents_show() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = env::join_paths(
        [Path::new(MGE).parent().expect("a folder").to_owned()]
            .into_iter()
            .chain(env::split_paths(&env::var_os("PATH").unwrap_or_default())),
    );
    let path = path.expect("folders without colons");
    for (page, least) in PAGES {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["assets", "tasks", "tests"] {
            symlink(root.join(name), folder.path().join(name)).expect("a link");
        }
        let found = blocks(&fs::read_to_string(root.join(page)).expect("the page"));
        assert!(found.len() >= least, "{page} shows {} outputs", found.len());
        for (commands, shown) in found {
            let mut shell = Command::new("sh");
            shell.args(["-euc", &commands]).current_dir(&folder).stdin(Stdio::null());
            let ran = shell.env("PATH", &path).env("XDG_CACHE_HOME", CACHE).output().expect("a shell");
            assert!(ran.status.success(), "{page}: {commands}{}", text(&ran.stderr));
            let output = text(&ran.stdout);
            let lines = [&output, &shown].map(|text| text.lines().collect::<Vec<_>>());
            assert!(has_shape(&lines[0], &lines[1]), "{page}: {commands}prints\n{output}instead of\n{shown}");
        }
    }
}

#[test]
fn shapes_differ_in_words_and_not_in_numbers() {
    assert_eq!(shape("a  12.5 % \"b\":-3,"), shape("a 0 % \"b\":1784,"));
    assert_ne!(shape("a 12"), shape("b 12"));
    assert_ne!(shape("a-b"), shape("a1b"));
    assert!(has_shape(&["a", "b", "c 1"], &["a", "...", "c 2"]) && !has_shape(&["a", "b"], &["a"]));
    assert!(is_like("a 12 b c 3", "a 4...b...5") && !is_like("a 12 b", "b...b") && !is_like("a b", "a...c...b"));
}
