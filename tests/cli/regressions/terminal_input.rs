//! Replies of the terminal are not typed as keys, and external text cannot control it.
//!
//! Decided in `src/tui/terminal/parser.rs` (strings), `crates/base/src/text.rs` (`is_unsafe`, applied to every
//! drawn screen by `Theme::make_safe`) and `src/tui/widgets/theme.rs` (background, character set).

use std::fs;
use std::thread::sleep;
use std::time::Duration;

use portable_pty::CommandBuilder;

use crate::program::MGE;
use crate::terminal::Terminal;

/// The workbench with environment variables, after its tour.
fn open(variables: &[(&str, &str)]) -> (tempfile::TempDir, Terminal) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("runs")).unwrap();
    fs::write(folder.path().join("keys"), "mouse = alt-P alt-] alt-_ alt-^ alt-X\n").unwrap();
    let mut command = CommandBuilder::new(MGE);
    command.cwd(folder.path());
    command.args(["--keys", "keys"]);
    for (name, value) in [("LC_ALL", ""), ("LC_CTYPE", ""), ("LANG", "C.UTF-8"), ("COLORFGBG", "")] {
        command.env(name, value);
    }
    variables.iter().for_each(|(name, value)| command.env(name, value));
    let terminal = Terminal::start(command, "\x1b[?62;22c");
    terminal.wait_for("no episodes yet");
    (folder, terminal)
}

#[test]
fn strings_of_the_terminal_are_not_typed() {
    let (_folder, mut terminal) = open(&[]);
    for string in ["\x1b_Gi=31;OK\x1b\\", "\x1bP>|q(1)q\x1b\\", "\x1b]52;c;qqq\x07", "\x1b^q\x1b\\", "\x1bXq\x07"] {
        terminal.type_text(string);
        // In two reads, further apart than the wait for the rest of a key.
        let (first, rest) = string.split_at(4);
        terminal.type_text(first);
        sleep(Duration::from_millis(150));
        terminal.type_text(rest);
    }
    // The same in their 8-bit forms, encoded in UTF-8 or raw.
    for string in ["\u{9f}Gi=31;OK\u{9c}", "\u{90}>|q(1)q\x1b\\", "\u{9d}52;c;qqq\x07", "\u{9e}q\u{9c}", "\u{98}qq\x07"]
    {
        terminal.type_text(string);
    }
    for introducer in [0x90, 0x98, 0x9d, 0x9e, 0x9f] {
        terminal.type_bytes(&[introducer, b'q', 0x9c]);
    }
    terminal.type_text(&format!("\x1b]{}\x07", "q".repeat(100_000)));
    terminal.type_text(":seed 7\r");
    terminal.wait_for("seed 7");
    // The same introducers are keys if nothing follows.
    for (key, owner) in ["P", "]", "_", "^", "X"].iter().zip(["terminal", "workbench"].iter().cycle()) {
        terminal.type_text(&format!("\x1b{key}"));
        terminal.wait_for(&format!("the {owner} handles the mouse"));
    }
    // A string without an end does not take the keyboard for ever.
    terminal.type_text("\x1b]q");
    sleep(Duration::from_millis(1500));
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
}

#[test]
fn format_controls_never_reach_the_screen() {
    let (_folder, terminal) = open(&[]);
    terminal.type_text(":");
    terminal.type_text("\x1b[200~note a\u{202e}b\u{61c}c\u{200b}d\u{2066}e\u{301}f\x1b[201~");
    terminal.wait_for("note abcde\u{301}f");
    let written = terminal.written();
    assert!(!written.contains(['\u{202e}', '\u{61c}', '\u{200b}', '\u{2066}']), "{written:?}");
}

#[test]
fn a_light_background_is_asked_for() {
    // The accent of the light palette.
    const LIGHT: &str = "38;2;29;78;216";
    let (_folder, terminal) = open(&[("COLORTERM", "truecolor")]);
    terminal.wait_until_written("\x1b]11;?\x07");
    assert!(!terminal.written().contains(LIGHT));
    terminal.type_text("\x1b]11;rgb:ffff/ffff/f0f0\x1b\\");
    terminal.wait_until_written(LIGHT);
}

#[test]
fn the_character_set_of_the_locale_decides_about_ascii() {
    for (variable, locale, is_ascii) in [
        ("LC_ALL", "en_US.ISO-8859-1", true),
        ("LANG", "ja_JP.eucJP", true),
        ("LC_CTYPE", "de_DE.UTF-8", false),
        ("LANG", "C.utf8", false),
    ] {
        let (_folder, terminal) = open(&[(variable, locale)]);
        terminal.wait_until("a screen in the character set", |screen| screen.contents().is_ascii() == is_ascii);
    }
}
