//! The workbench in a real pseudo-terminal: a whole session, and every way to end it.

use std::path::Path;

use crate::program::{MGE, fail, mge};
use crate::terminal::Terminal;
use portable_pty::CommandBuilder;

/// A terminal without graphics.
const PLAIN: &str = "\x1b[?62;22c";

fn open(folder: &Path, arguments: &[&str]) -> Terminal {
    let mut command = CommandBuilder::new(MGE);
    command.args(arguments);
    command.cwd(folder);
    Terminal::start(command, PLAIN)
}

#[test]
fn a_whole_session_trains_edits_exports_resizes_and_quits() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.wait_until("the mouse to be captured", |screen| {
        screen.mouse_protocol_mode() != vt100::MouseProtocolMode::None
    });
    terminal.wait_for("no episodes yet");
    terminal.type_text(":model uniform\r");
    terminal.wait_for("model    uniform");
    terminal.type_text("t");
    terminal.wait_for("train on task1");
    // Down to the number of episodes.
    terminal.type_text("\t12\r");
    terminal.wait_for("12/12");
    terminal.wait_for("finished");
    terminal.type_text("\tl");
    terminal.wait_for("(edited)");
    terminal.type_text("2:model true\r");
    terminal.wait_for("model true");
    terminal.type_text("S");
    terminal.wait_for("proposed: 1; Y accepts");
    terminal.type_text("7\rjj\r");
    terminal.wait_for("drawing figures/learning.png");
    let figures = ["task1-scene.png", "learning.csv"].map(|name| folder.path().join("figures").join(name));
    terminal.wait_until("two figures", |_| figures.iter().all(|path| path.is_file()));
    terminal.type_text("1");
    terminal.resize(80, 24);
    terminal.wait_until("80 columns", |screen| {
        let contents = screen.contents();
        contents.lines().nth(1).is_some_and(|line| line.chars().count() <= 80 && line.contains("success rate"))
    });
    terminal.type_text("q");
    terminal.wait_for("not saved");
    terminal.type_text("y");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
fn signals_restore_the_terminal_and_checkpoint_the_run() {
    for (signal, status) in [("TERM", 143), ("INT", 130), ("HUP", 129), ("QUIT", 131)] {
        let folder = tempfile::tempdir().unwrap();
        let mut terminal = open(folder.path(), &["--task", "task3"]);
        terminal.wait_for("welcome");
        terminal.wait_for("no episodes yet");
        terminal.type_text(":method ddpg\r");
        terminal.wait_for("method   DDPG,");
        terminal.type_text("\tl");
        terminal.wait_for("(edited)");
        terminal.type_text("t\r");
        terminal.wait_for("running");
        let run = folder.path().join("runs/task3-ddpg-seed0");
        let episodes = || std::fs::read_to_string(run.join("metrics.csv")).unwrap_or_default().lines().count();
        terminal.wait_until("the first episode", |_| episodes() > 1);
        terminal.signal(signal);
        assert_eq!(terminal.wait_for_exit(), status, "{signal}");
        terminal.wait_until_restored();
        terminal.wait_for("unsaved edits of task3 are kept in unsaved-task3.json");
        assert!(folder.path().join("unsaved-task3.json").is_file());
        let log = std::fs::read_to_string(run.join("log.txt")).unwrap();
        assert!(log.contains("stopped"), "{log}");
        assert!(run.join("checkpoint").read_dir().unwrap().next().is_some(), "no checkpoint");
    }
}

#[test]
fn quitting_does_not_wait_for_computations() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.type_text(":seed 7\r");
    terminal.wait_for("seed 7");
    // A method whose clusters come from many rollouts of a model, not from practice.
    terminal.type_text(":method ddpg-mge\r");
    for setting in ["most_model_rollouts 100000", "model_rollouts 100000", "horizon 100"] {
        terminal.type_text(&format!(":set guidance.{setting}\r"));
    }
    terminal.type_text(":model true\r:train\r");
    terminal.wait_for("train on task1");
    terminal.type_text("\r");
    terminal.wait_for("0/2000");
    terminal.type_text(":clusters\r");
    terminal.wait_for("computing stage");
    terminal.type_text("q");
    terminal.wait_for("y  ");
    terminal.type_text("y");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
fn closing_the_window_checkpoints_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.wait_for("no episodes yet");
    terminal.type_text(":method ddpg\r");
    terminal.wait_for("method   DDPG,");
    terminal.type_text("t\r");
    terminal.wait_for("running");
    terminal.hang_up();
    assert_eq!(terminal.wait_for_exit(), 129);
    let log = std::fs::read_to_string(folder.path().join("runs/task1-ddpg-seed0/log.txt")).unwrap();
    assert!(log.contains("stopped"), "{log}");
}

#[test]
fn a_figure_is_shown_in_sixels_where_the_terminal_has_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = CommandBuilder::new(MGE);
    command.cwd(folder.path());
    // Only terminals that are known to answer are asked.
    command.env("XTERM_VERSION", "XTerm(390)");
    let mut terminal = Terminal::start(command, "\x1b[?62;4;22c");
    terminal.wait_for("welcome");
    terminal.type_text("7");
    terminal.wait_until_written("\x1bP");
    terminal.type_text("?");
    terminal.wait_for("export the selected figure as SVG");
    terminal.type_text("\x1b");
    terminal.wait_until("a closed palette", |screen| !screen.contents().contains("esc: close"));
    terminal.type_text("8");
    terminal.wait_for("Nothing has happened yet");
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
fn suspending_and_continuing_restores_the_screen() {
    let folder = tempfile::tempdir().unwrap();
    // A shell with job control, which continues the workbench at the enter key.
    let mut command = CommandBuilder::new("sh");
    command.args(["-m", "-c", "$0; echo back in the shell; read line; fg; echo again; read line; fg", MGE]);
    command.cwd(folder.path());
    let mut terminal = Terminal::start(command, PLAIN);
    terminal.wait_for("welcome");
    terminal.wait_for("no episodes yet");
    for shell in ["back in the shell", "again"] {
        // Ctrl-Z
        terminal.type_text("\x1a");
        terminal.wait_for(shell);
        terminal.wait_until("the screen to be left", |screen| !screen.alternate_screen() && !screen.hide_cursor());
        terminal.type_text("\r");
        terminal.wait_until_taken();
        terminal.wait_for("no episodes yet");
    }
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
#[cfg(target_os = "linux")]
fn a_workbench_at_rest_draws_nothing_and_leaves_the_processor_alone() {
    use std::time::Duration;

    /// Processor time in hundredths of a second.
    fn used(process: u32) -> u64 {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
        let after_name: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
        after_name[11].parse::<u64>().unwrap() + after_name[12].parse::<u64>().unwrap()
    }

    let folder = tempfile::tempdir().unwrap();
    let mut terminal = open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.wait_for("no episodes yet");
    // The episode on the screen is played some times without a key: the space key pauses it.
    terminal.type_text(" ");
    // Right after the start there may be something to do.
    let mut quiet = 0;
    for _ in 0..20 {
        let before = (used(terminal.process()), terminal.written());
        std::thread::sleep(Duration::from_millis(500));
        let is_quiet = used(terminal.process()) - before.0 < 10 && terminal.written() == before.1;
        quiet = if is_quiet { quiet + 1 } else { 0 };
        if quiet == 3 {
            break;
        }
    }
    assert_eq!(quiet, 3, "half seconds without work, in a row");
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
}

#[test]
fn bursts_of_input_do_not_block_the_keyboard() {
    let folder = tempfile::tempdir().unwrap();
    let mut terminal = open(folder.path(), &[]);
    terminal.wait_for("welcome");
    terminal.wait_for("no episodes yet");
    let moved = "\x1b[<35;30;10M";
    terminal.signal("STOP");
    terminal.wait_until_stopped();
    terminal.type_text(&moved.repeat(80));
    terminal.signal("CONT");
    terminal.type_text("8");
    terminal.wait_for("Nothing has happened yet");
    terminal.type_text(&"[]".repeat(1 << 15));
    terminal.type_text(&moved.repeat(80));
    terminal.type_text("e");
    terminal.wait_for("step:0.8:0.5:500");
    terminal.type_text(&format!("\x1b[200~{}\x1b[201~\x15", "x".repeat(1 << 16)));
    terminal.type_text("epsilon 0.375\r1");
    terminal.wait_for("epsilon  0.375");
    terminal.type_text("q");
    assert_eq!(terminal.wait_for_exit(), 0);
    terminal.wait_until_restored();
}

#[test]
fn an_unknown_word_and_a_missing_terminal_give_one_line() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [&["trian", "task1"][..], &["trian"]] {
        fail(mge(&folder, arguments), "`trian` is neither a command nor the folder of a run: did you mean `train`?");
    }
    let message = fail(mge(&folder, [""; 0]), "needs a terminal");
    assert!(message.contains("mge script"), "{message}");
}

/// What a terminal sends for what the document says to type: lines of the shell and of the palette, or keys, between
/// which texts may stand in quotes.
fn typed(keys: &str) -> String {
    if keys.starts_with("mge") || keys.starts_with(':') && !keys.starts_with(": ") {
        return format!("{keys}\r");
    }
    let mut is_text = true;
    let pieces = keys.split('"').map(|piece| {
        is_text = !is_text;
        if is_text { piece.to_owned() } else { piece.split_whitespace().map(sent).collect() }
    });
    pieces.collect()
}

fn sent(key: &str) -> &str {
    match key {
        "enter" => "\r",
        "esc" => "\x1b",
        "tab" => "\t",
        "space" => " ",
        "left" => "\x1b[D",
        "right" => "\x1b[C",
        "up" => "\x1b[A",
        "down" => "\x1b[B",
        "ctrl-u" => "\x15",
        // As a table writes it.
        r"\|" => "|",
        key => key,
    }
}

/// Whether the screen has all of `present` and nothing of `absent`.
fn has(screen: &vt100::Screen, present: &[&str], absent: &[&str]) -> bool {
    let contents = screen.contents();
    let is_there = |text: &&str| match *text {
        // The shell waits for a line.
        "$" => contents.trim_end().lines().last() == Some("$"),
        text => contents.contains(text),
    };
    present.iter().all(is_there) && !absent.iter().any(is_there)
}

/// The texts between backticks that appear, and those after "no longer".
fn texts(shown: &str) -> (Vec<&str>, Vec<&str>) {
    let pieces: Vec<&str> = shown.split('`').collect();
    let texts = pieces.chunks_exact(2).map(|piece| (piece[0], piece[1]));
    let (gone, shown): (Vec<_>, Vec<_>) = texts.partition(|(words, _)| words.contains("no longer"));
    (shown.iter().map(|text| text.1).collect(), gone.iter().map(|text| text.1).collect())
}

/// A first day in a terminal of a size: no point shows its texts before its keys, or as what is typed.
fn spend_the_first_day(points: &[&str], columns: u16, rows: u16) {
    let folder = tempfile::tempdir().unwrap();
    // `mge`, and a viewer of figures that shows nothing.
    let programs = tempfile::tempdir().unwrap();
    for (name, program) in [("mge", MGE), ("xdg-open", "/bin/true")] {
        std::os::unix::fs::symlink(program, programs.path().join(name)).unwrap();
    }
    let mut shell = CommandBuilder::new("sh");
    shell.cwd(folder.path());
    shell.env("PS1", "$ ");
    shell.env("PATH", format!("{}:/usr/bin:/bin", programs.path().display()));
    let mut terminal = Terminal::start(shell, PLAIN);
    terminal.resize(columns, rows);
    for point in points {
        let [_, keys, shown] = point.split(" | ").collect::<Vec<_>>()[..] else { panic!("{point}") };
        let keys = keys.trim_matches('`');
        let (shown, gone) = texts(shown);
        assert!(!shown.iter().any(|text| keys.contains(text)), "shows what was typed: {point}");
        let point = format!("at {columns}x{rows}: {point}");
        let before = if keys.starts_with("mge") { [&gone[..], &["$"]].concat() } else { gone.clone() };
        terminal.wait_until(&format!("the screen before {point}"), |screen| has(screen, &before, &shown));
        terminal.type_text(&typed(keys));
        terminal.wait_until(&point, |screen| has(screen, &shown, &gone));
    }
    terminal.wait_until_restored();
    terminal.type_text("exit\r");
    assert_eq!(terminal.wait_for_exit(), 0);
}

#[test]
fn the_first_day_shows_what_its_document_says() {
    let document = include_str!("../../docs/first-day.md");
    let points: Vec<&str> = document.lines().filter(|line| line.starts_with("| ") && line.contains(". ")).collect();
    assert!(points.len() >= 90);
    std::thread::scope(|scope| {
        for (columns, rows) in [(80, 24), (120, 40), (200, 60)] {
            let points = &points;
            scope.spawn(move || spend_the_first_day(points, columns, rows));
        }
    });
}
