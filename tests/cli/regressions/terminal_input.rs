//! What the terminal tells of itself is used, and external text cannot control it.
//!
//! Decided in `src/tui/terminal/graphics.rs` (questions), `crates/base/src/text.rs` (`is_unsafe`, applied to every
//! drawn screen by `Theme::make_safe`) and `src/tui/widgets/theme.rs` (background, character set).

use std::fs;

use portable_pty::CommandBuilder;

use crate::program::MGE;
use crate::terminal::Terminal;

/// A terminal without graphics.
const PLAIN: &str = "\x1b[?62;22c";

/// The workbench with environment variables, in a terminal that answers in this way.
fn open(variables: &[(&str, &str)], answer: &'static str) -> (tempfile::TempDir, Terminal) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("runs")).unwrap();
    let mut command = CommandBuilder::new(MGE);
    command.cwd(folder.path());
    for (name, value) in [("LC_ALL", ""), ("LC_CTYPE", ""), ("LANG", "C.UTF-8"), ("COLORFGBG", "")] {
        command.env(name, value);
    }
    variables.iter().for_each(|(name, value)| command.env(name, value));
    (folder, Terminal::start(command, answer))
}

#[test]
fn format_controls_never_reach_the_screen() {
    let (_folder, terminal) = open(&[], PLAIN);
    terminal.wait_for("no episodes yet");
    terminal.type_text(":");
    terminal.type_text("\x1b[200~note a\u{202e}b\u{61c}c\u{200b}d\u{2066}e\u{301}f\x1b[201~");
    terminal.wait_for("note abcde\u{301}f");
    let written = terminal.written();
    assert!(!written.contains(['\u{202e}', '\u{61c}', '\u{200b}', '\u{2066}']), "{written:?}");
}

#[test]
fn a_known_terminal_is_asked_for_its_background_and_no_other_is_asked() {
    // The accent of the light palette.
    const LIGHT: &str = "38;2;29;78;216";
    const ANSWER: &str = "\x1b]11;rgb:ffff/ffff/f0f0\x1b\\\x1b[?62;22c";
    let known = [("COLORTERM", "truecolor"), ("XTERM_VERSION", "XTerm(390)")];
    let (_folder, terminal) = open(&known, ANSWER);
    terminal.wait_for("no episodes yet");
    assert!(terminal.written().contains("\x1b]11;?") && terminal.written().contains(LIGHT));
    let (_folder, terminal) = open(&known[..1], ANSWER);
    terminal.wait_for("no episodes yet");
    assert!(!terminal.written().contains("\x1b]11;?") && !terminal.written().contains(LIGHT));
}

#[test]
fn the_character_set_of_the_locale_decides_about_ascii() {
    for (variable, locale, is_ascii) in [
        ("LC_ALL", "en_US.ISO-8859-1", true),
        ("LANG", "ja_JP.eucJP", true),
        ("LC_CTYPE", "de_DE.UTF-8", false),
        ("LANG", "C.utf8", false),
    ] {
        let (_folder, terminal) = open(&[(variable, locale)], PLAIN);
        terminal.wait_for("no episodes yet");
        terminal.wait_until("a screen in the character set", |screen| screen.contents().is_ascii() == is_ascii);
    }
}
