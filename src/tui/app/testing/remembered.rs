//! What is remembered between sessions.

use super::{app, change_run, empty, grouped, press, shot, text, typical};
use crate::tui::app::{App, Remembered};
use crate::tui::view::{SessionWorkspace, ViewModel};
use mge_run::{Event, RunDirectory, RunWriter};
use mge_trainer::RunConfig;

#[test]
fn choices_are_made_again_in_the_next_session() {
    let folder = tempfile::tempdir().unwrap();
    let view = || {
        let settings = grouped().settings.with_setting("ddpg.gamma", "0.9").unwrap();
        ViewModel { settings, file: Some("/mine/puzzle.json".into()), ..grouped() }
    };
    let (mut first, _) = app(view());
    press(&mut first, "5 s | s e e d space d d p g . g a tab enter");
    first.seeds = 3;
    press(&mut first, ": b e l l enter");
    first.remembered().save(folder.path()).unwrap();
    let (mut second, asked) = app(view());
    second.restore(Remembered::load(folder.path()).unwrap(), false);
    assert_eq!(second.remembered(), first.remembered());
    let settings = ["set method ddpg-mge", "set epsilon linear:0.8:0.05:1500", "set ddpg.gamma 0.9"];
    assert_eq!(*asked.borrow(), [&["task /mine/puzzle.json"][..], &settings].concat());
    let (mut named, asked) = app(view());
    named.restore(Remembered::load(folder.path()).unwrap(), true);
    assert_eq!(*asked.borrow(), settings, "the user named another task");
    let screen = text(&shot(&mut second, 120, 40));
    assert!(screen.contains("runs in runs · by success"), "{screen}");
    let heading = screen.lines().find(|line| line.contains("state")).unwrap_or_default();
    assert!(heading.contains("seed ddpg.gamma") && !heading.contains("episodes"), "the chosen columns: {screen}");
    let (mut cut_off, _) = app(view());
    let mut view_of_training = typical();
    let config = RunConfig::new(view_of_training.task.clone());
    let run = RunDirectory::create(folder.path().join("task1-ddpg-mge-seed0"), &config).unwrap();
    let place = view_of_training.runs.iter().position(|run| run.active).unwrap();
    change_run(&mut view_of_training, place, |known| known.path = run.path().to_owned());
    let (training, _) = app(view_of_training);
    training.remembered().save(folder.path()).unwrap();
    let mut elsewhere = RunWriter::open(&run, 0).unwrap();
    elsewhere.record(&Event::Resumed { episode: 0 }).unwrap();
    cut_off.restore(Remembered::load(folder.path()).unwrap(), true);
    assert_eq!(cut_off.message(), "", "another program trains the run");
    drop(elsewhere);
    cut_off.restore(Remembered::load(folder.path()).unwrap(), true);
    let expected = "cut off when the last session ended: task1-ddpg-mge-seed0; C on the Runs screen (5)";
    assert!(cut_off.message().contains(expected), "{}", cut_off.message());
    let (mut later, _) = app(view());
    later.restore(Remembered::load(folder.path()).unwrap(), true);
    assert!(!later.message().contains("cut off"), "it is told once: {}", later.message());
    press(&mut second, "t down down");
    assert!(text(&shot(&mut second, 120, 40)).contains("seeds      > 3"));
}

#[test]
fn a_task_whose_file_is_gone_is_told_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let (first, _) = app(ViewModel { file: Some("/gone.json".into()), ..empty() });
    first.remembered().save(folder.path()).unwrap();
    let session = mge_workbench::Session::on_task("task2", folder.path().to_owned()).unwrap();
    let mut second = App::new(Box::new(SessionWorkspace::new(session)), first.theme.clone());
    second.restore(Remembered::load(folder.path()).unwrap(), false);
    assert!(second.message().contains("not as in the last session: "), "{}", second.message());
    assert_eq!(second.workspace.view().task.name, "task2");
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
