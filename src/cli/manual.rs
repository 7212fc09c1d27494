//! `mge man`: the manual page of the command line, and `docs/reference.md`, generated from the tables that the program
//! itself uses; `mge completions`.

use std::io;
use std::sync::Arc;

use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;

use super::arguments;
use super::output::{self, Outcome};
use crate::tui;
use mge_base::json;
use mge_base::validation::Setting;
use mge_dynamics::{MODEL_SETTINGS, TRAIN_SETTINGS};
use mge_task as task;
use mge_task::RULES;
use mge_trainer as trainer;
use mge_trainer::{RunConfig, config_keys};
use mge_workbench::{Verb, verbs};

/// Environment variables and what they do.
const ENVIRONMENT: [(&str, &str); 8] = [
    ("MGE_RUNS", "Folder for runs."),
    ("MGE_NOTIFY", "How to announce that a training is finished or has failed: bell, desktop or off."),
    ("XDG_CACHE_HOME", "Folder of the cache of models, `mge/models`; else `~/.cache`."),
    ("MGE_THEME", "Words such as `light,256,ascii`: dark, light, colour-blind; none, 256, true; braille, ascii."),
    (
        "MGE_GRAPHICS",
        "How figures are shown: as kitty, sixel or iterm2 pictures, or none, as charts and scenes in text.",
    ),
    ("NO_COLOR", "No colours, if it is not empty."),
    ("COLORTERM, TERM", "They determine the colours that the terminal can show."),
    (
        "COLORFGBG, LC_ALL, LC_CTYPE, LANG",
        "Background, unless the terminal tells it, and characters: only ASCII if the character set of the locale is not UTF-8.",
    ),
];

/// Exit statuses and what they mean.
const EXIT_STATUS: [(&str, &str); 4] = [
    ("0", "The command succeeded."),
    ("1", "The command failed: one line on standard error says why and what to do."),
    ("2", "Wrong usage."),
    (
        "128 + N",
        "Signal N ended the command, such as 130 for SIGINT, 138 for SIGUSR1 and 143 for SIGTERM: work that can be continued is saved, and one line says how. SIGUSR2 and SIGXCPU have the same effect. A second signal, at least half a second later, ends it at once.",
    ),
];

/// What is said about the settings of a run.
const SETTINGS: &str = "`--set KEY=VALUE`, or `set KEY VALUE` in a script, changes one. The defaults are those of the default method. `prior` \
     is what `--model` chooses, and `model` in sweeps and Python.";

/// Writes the manual page to standard output, or the whole reference as Markdown.
pub fn print(markdown: bool) -> Outcome {
    let page = if markdown { markdown_page() } else { roff_page()? };
    Ok(output::lines(page)?)
}

/// Writes the script by which a shell completes commands and options to standard output.
pub fn completions(shell: Shell) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut arguments::command(), "mge", &mut script);
    Ok(output::lines(String::from_utf8_lossy(&script))?)
}

/// The sections after the commands, titles and texts: keys, command language, settings, environment and exit status.
fn sections() -> [(&'static str, String); 8] {
    let key = |entry: &tui::Entry| {
        // An action without a key is typed into the palette.
        let keys = match entry.keys {
            "" => format!(":{}", entry.name),
            keys => keys.split_whitespace().collect::<Vec<_>>().join(", "),
        };
        let verb = if entry.verb.is_empty() { String::new() } else { format!(" (in a script: {})", entry.verb) };
        (keys, format!("{}: {}{verb}", entry.name, entry.about()))
    };
    let of_context = |entries: &[tui::Entry]| {
        format!("\n### {}\n{}", entries[0].context.name(), table(["keys", "action"], entries.iter().map(key)))
    };
    let contexts = tui::entries().chunk_by(|a, b| a.context == b.context);
    let contexts: String = contexts.filter(|entries| !entries[0].keys.is_empty()).map(of_context).collect();
    let verb = |verb: &Verb| (verb.usage(), verb.help.to_owned());
    let owned = |(term, text): (&str, &str)| (term.to_owned(), text.to_owned());
    let of_models = MODEL_SETTINGS.into_iter().chain(TRAIN_SETTINGS);
    [
        ("Keys of the workbench", contexts),
        ("Commands of scripts and of the palette", table(["command", "effect"], verbs().map(verb))),
        ("Settings of a run", format!("\n{SETTINGS}\n{}", table(["setting", "default"], default_settings()))),
        ("Numbers of a run", ranges(trainer::settings())),
        ("Numbers of a task", ranges(RULES.into_iter().map(|row| (format!("rules.{}", row.path), row)))),
        ("Numbers of a dynamics model", ranges(of_models.map(|row| (row.path.to_owned(), row)))),
        ("Environment", table(["variable", "meaning"], ENVIRONMENT.map(owned))),
        ("Exit status", table(["status", "meaning"], EXIT_STATUS.map(owned))),
    ]
}

/// A table of numeric settings with their meanings and ranges.
fn ranges(settings: impl Iterator<Item = (String, Setting)>) -> String {
    let item = |(path, Setting { about, range, .. })| (path, format!("{about}: {range}"));
    table(["number", "meaning and range"], settings.map(item))
}

/// A table of terms and their meanings.
fn table([terms, meanings]: [&str; 2], items: impl IntoIterator<Item = (String, String)>) -> String {
    let rows = items.into_iter().map(|(term, text)| format!("| `{}` | {} |\n", cell(&term), cell(&text)));
    format!("\n| {terms} | {meanings} |\n|---|---|\n{}", rows.collect::<String>())
}

/// All commands of `mge`, including nested ones, with their full names.
pub(super) fn commands() -> Vec<Command> {
    fn below(command: &Command, path: &str, found: &mut Vec<Command>) {
        for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
            let path = format!("{path} {}", inner.get_name());
            found.push(inner.clone().bin_name(&path).display_name(&path));
            below(inner, &path, found);
        }
    }
    let mut found = Vec::new();
    below(&arguments::command(), "mge", &mut found);
    found
}

/// The full name, such as `mge dynamics train`.
fn full_name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).to_owned()
}

fn roff_page() -> io::Result<String> {
    let mut page = Vec::new();
    Man::new(arguments::command()).render(&mut page)?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}

pub(super) fn markdown_page() -> String {
    let sections = sections();
    let titles = sections.iter().map(|(title, _)| *title);
    let link = |title: &str| format!("- [{title}](#{})\n", title.to_lowercase().replace(' ', "-"));
    let contents: String = ["Command line"].into_iter().chain(titles).map(link).collect();
    let mut out = format!(
        "# Reference\n\nThis page is generated by `mge man --markdown`; the option `--help` of a command prints its part.\n\n\
         {contents}\n## Command line\n"
    );
    markdown_help(&mut out, "mge", arguments::grouped(arguments::command().bin_name("mge").term_width(100)));
    commands().into_iter().for_each(|command| markdown_help(&mut out, &full_name(&command), command));
    out.extend(sections.map(|(title, text)| format!("\n## {title}\n{text}")));
    out
}

/// The help of a command as printed, independent of the environment.
fn markdown_help(out: &mut String, name: &str, command: Command) {
    let mut command =
        command.term_width(100).disable_help_subcommand(true).mut_args(|argument| argument.hide_env_values(true));
    let help = command.render_help().to_string();
    let lines: Vec<&str> = help.lines().map(str::trim_end).collect();
    *out += &format!("\n### {name}\n\n```text\n{}\n```\n", lines.join("\n").trim());
}

/// Escapes a text for a table cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

/// Every setting of a run with its path and default.
fn default_settings() -> Vec<(String, String)> {
    let config = RunConfig::usual_for(Arc::new(task::shipped().swap_remove(0)));
    let keys = config_keys(&config);
    let mut values = json::to_value(&config);
    let mut value = |key: &String| json::at_mut(&mut values, key).map(|value| json::text(value)).unwrap_or_default();
    let values: Vec<String> = keys.iter().map(&mut value).collect();
    keys.into_iter().zip(values).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_verb_action_and_setting_is_in_the_manual() {
        let (page, markdown) = (roff_page().unwrap(), markdown_page());
        let contains = |text: &str| markdown.contains(&cell(text));
        for verb in verbs() {
            assert!(contains(verb.help), "{}", verb.name);
        }
        for (path, setting) in trainer::settings() {
            assert!(contains(&path) && contains(&format!("{}: {}", setting.about, setting.range)), "{path}");
        }
        assert!(tui::entries().iter().filter(|entry| !entry.keys.is_empty()).all(|entry| contains(entry.name)));
        for command in ["mge train", "mge dynamics train", "mge tasks check"] {
            assert!(contains(command), "{command}");
        }
        assert!(markdown.contains("| `ddpg.gamma` | 0.95 |"));
        assert!(page.starts_with(".ie") || page.contains(".TH mge"), "{}", &page[..80]);
    }
}
