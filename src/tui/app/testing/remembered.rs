//! What is remembered between sessions.

use super::{app, grouped, press, shot, text};
use crate::tui::app::Remembered;

#[test]
fn choices_are_made_again_in_the_next_session() {
    let folder = tempfile::tempdir().unwrap();
    let (mut first, _) = app(grouped());
    press(&mut first, "5");
    first.seeds = 3;
    press(&mut first, ": b e l l enter");
    first.remembered().save(folder.path()).unwrap();
    let (mut second, asked) = app(grouped());
    second.restore(Remembered::load(folder.path()).unwrap());
    assert_eq!(second.remembered(), first.remembered());
    assert_eq!(*asked.borrow(), ["set method ddpg-mge", "set epsilon linear:0.8:0.05:1500"]);
    let screen = text(&shot(&mut second, 120, 40));
    assert!(screen.contains("runs in runs"), "{screen}");
    press(&mut second, "t down down");
    assert!(text(&shot(&mut second, 120, 40)).contains("seeds      > 3"));
}

#[test]
fn nothing_is_remembered_without_a_folder_or_in_a_damaged_file_and_foreign_files_stay() {
    let folder = tempfile::tempdir().unwrap();
    let (app, _) = app(grouped());
    let missing = folder.path().join("runs");
    app.remembered().save(&missing).unwrap();
    assert!(!missing.exists() && Remembered::load(&missing).is_none());
    let file = folder.path().join(".workbench.json");
    std::fs::write(&file, "mine").unwrap();
    assert!(Remembered::load(folder.path()).is_none() && app.remembered().save(folder.path()).is_err());
    assert_eq!(std::fs::read_to_string(file).unwrap(), "mine");
}
