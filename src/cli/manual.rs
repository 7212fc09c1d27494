//! `mge man`: the manual page, from the tables the program itself works with.

use std::io::{self, Write};

use clap::CommandFactory;
use clap_mangen::Man;

use super::Outcome;
use super::arguments::Arguments;
use crate::tui;
use crate::workbench::verbs;

/// Environment variables and what they do.
const ENVIRONMENT: [(&str, &str); 6] = [
    ("MGE_RUNS", "Folder for runs."),
    ("MGE_KEYS", "File with your own keys: lines such as `train = t`."),
    (
        "MGE_THEME",
        "Words such as `light,16,ascii`: dark, light, colour-blind; none, 16, 256, true; braille, half-block, ascii.",
    ),
    ("MGE_GRAPHICS", "How figures are shown: kitty, sixel or half-block."),
    ("NO_COLOR", "No colours, if it is not empty."),
    ("COLORTERM, TERM, COLORFGBG, LANG", "From these colours, background and characters of the terminal are told."),
];

/// Writes the manual page to standard output.
pub fn print() -> Outcome {
    let mut page = Vec::new();
    write_page(&mut page)?;
    Ok(io::stdout().lock().write_all(&page)?)
}

fn write_page(out: &mut impl Write) -> io::Result<()> {
    let man = Man::new(Arguments::command());
    man.render_title(out)?;
    man.render_name_section(out)?;
    man.render_synopsis_section(out)?;
    man.render_description_section(out)?;
    man.render_options_section(out)?;
    writeln!(out, ".SH COMMANDS")?;
    for command in Arguments::command().get_subcommands().filter(|command| command.get_name() != "help") {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        item(out, &format!("mge {}", command.get_name()), &about)?;
    }
    writeln!(out, "Each of them tells its options with \\-\\-help.")?;
    writeln!(out, ".SH KEYS OF THE WORKBENCH")?;
    writeln!(out, "{}", escape("In a key file an action that is named has only the keys of its line."))?;
    for (context, keys) in tui::keys() {
        writeln!(out, ".SS {}", escape(context))?;
        for key in keys {
            let keys = if key.keys.is_empty() { "no key".to_owned() } else { key.keys };
            let verb = key.verb.map(|verb| format!(" (in a script: {verb})")).unwrap_or_default();
            item(out, &keys, &format!("{}: {}{verb}", key.name, key.about))?;
        }
    }
    writeln!(out, ".SH COMMANDS OF SCRIPTS AND OF THE PALETTE")?;
    for verb in verbs() {
        item(out, &verb.usage(), verb.help)?;
    }
    writeln!(out, ".SH ENVIRONMENT")?;
    for (name, about) in ENVIRONMENT {
        item(out, name, about)?;
    }
    writeln!(out, ".SH EXIT STATUS")?;
    item(out, "0", "It is done.")?;
    item(out, "1", "It failed: one line on standard error says why and what to do.")?;
    item(out, "2", "Wrong usage.")
}

fn item(out: &mut impl Write, term: &str, text: &str) -> io::Result<()> {
    writeln!(out, ".TP\n\\fB{}\\fR\n{}", escape(term), escape(text))
}

/// A text that roff shows as it is.
fn escape(text: &str) -> String {
    let text = text.replace('\\', "\\e").replace('-', "\\-");
    if text.starts_with(['.', '\'']) { format!("\\&{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_verb_and_action_is_in_the_manual() {
        let mut page = Vec::new();
        write_page(&mut page).unwrap();
        let page = String::from_utf8(page).unwrap();
        for verb in verbs() {
            assert!(page.contains(&escape(verb.help)), "{}", verb.name);
        }
        for (_, keys) in tui::keys() {
            assert!(keys.iter().all(|key| page.contains(&escape(key.name))));
        }
        for command in Arguments::command().get_subcommands() {
            assert!(page.contains(&escape(&format!("mge {}", command.get_name()))), "{}", command.get_name());
        }
        assert!(page.starts_with(".ie") || page.contains(".TH mge"), "{}", &page[..80]);
    }

    #[test]
    fn what_roff_would_take_for_itself_is_escaped() {
        assert_eq!(escape(".x"), "\\&.x");
        assert_eq!(escape("a-b \\"), "a\\-b \\e");
    }
}
