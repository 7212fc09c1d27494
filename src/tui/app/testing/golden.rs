//! Compares screens with golden files, one for each screen and size.
//! `MGE_UPDATE_GOLDEN=1 cargo test golden` rewrites the files; review the difference.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::{app, change_run, empty, failed, forked, grouped, press, shot, text, typical};
use crate::tui::actions::Tab;
use crate::tui::view::ViewModel;
use mge_trainer::Phase;
use mge_workbench::HandPlay;

const SIZES: [(u16, u16); 2] = [(80, 24), (160, 50)];

/// The name of a screen's file, its view, and the keys that lead to it.
type Shown = (&'static str, fn() -> ViewModel, &'static str);

const SCREENS: &[Shown] = &[
    ("empty-scene", empty, "1"),
    ("empty-training", empty, "4"),
    ("empty-runs", empty, "5"),
    ("empty-figures", empty, "7"),
    ("empty-log", empty, "8"),
    ("scene", typical, "1"),
    ("edit", typical, "2"),
    ("schedule", typical, "3"),
    ("training", typical, "4"),
    ("runs", typical, "5"),
    ("models", typical, "6"),
    ("figures", typical, "7"),
    ("log", typical, "8"),
    ("failed-scene", failed, "1"),
    ("failed-runs", failed, "5"),
    ("failed-figures", failed, "7 down"),
    ("failed-log", failed, "8"),
    ("group-training", grouped, "4"),
    ("group-seeds", grouped, "4 tab"),
    ("group-comparison", grouped, "5 space down space V"),
    ("group-crosshair", grouped, "4 left left"),
    ("group-runs", grouped, "5"),
    ("group-unfolded", grouped, "5 tab down"),
    ("group-figure", grouped, "7 down down"),
    ("forks", forked, "5 down"),
    ("forks-compared", forked, "5 space down down space V"),
    ("practice-during", during_practice, "1"),
    ("model-training", model_training, "6"),
    ("help", typical, "?"),
    ("palette", typical, ": e p s i"),
    ("palette-error", typical, ": s e e d space x enter"),
    ("prompt", typical, "5 /"),
    ("run-dialog", typical, "t"),
    ("task-picker", typical, "o"),
    ("question", typical, "x"),
    ("compose", grouped, "7 tab"),
    ("level-cannon", || level("create/Cannon"), "2 backtab }"),
    ("level-obstacle", || level("create/Obstacle"), "2"),
    ("level-tools", || level("create/Push"), "2 T down right"),
    ("level-tools-found", || level("create/Push"), "2 T f a n space 1 0 5 end"),
    ("level-hand", || level("create/Push"), "P"),
];

fn during_practice() -> ViewModel {
    let mut view = typical();
    change_run(&mut view, 1, |run| {
        let phase = Phase::Practising { stage: 1, stages: 2, rollouts: 50, reached: 12 };
        (run.preparing, run.done, run.success) = (phase.preparation(), 0, None);
        (run.curves, run.evaluations) = (Arc::default(), Vec::new());
    });
    view
}

fn model_training() -> ViewModel {
    let mut view = typical();
    view.model_work = Some(("training models/mine.safetensors".into(), Some(0.4)));
    view
}

/// A view of a level of CREATE.
fn level(name: &str) -> ViewModel {
    let mut view = empty();
    view.task = Arc::new(mge_task::load(name).unwrap());
    view.hand = HandPlay::new(view.task.clone(), 0);
    view
}

/// The screen of a view after some keys.
fn screen(view: ViewModel, keys: &str, (width, height): (u16, u16)) -> String {
    let (mut app, _) = app(view);
    for key in keys.split_whitespace() {
        press(&mut app, key);
        // A palette of tools moves by the rows and columns of its latest drawing.
        shot(&mut app, width, height);
    }
    // The preview of a figure needs the regions of a first drawing.
    app.tick(Duration::ZERO);
    while app.screens.preview.is_drawing() {
        std::thread::yield_now();
        app.tick(Duration::ZERO);
    }
    text(&shot(&mut app, width, height))
}

#[test]
fn screens_equal_their_golden_files() {
    let mut different = Vec::new();
    for (name, view, keys) in SCREENS {
        for (width, height) in SIZES {
            let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
                .join(format!("src/tui/app/testing/golden/{width}x{height}/{name}.txt"));
            let drawn = screen(view(), keys, (width, height));
            if std::env::var_os("MGE_UPDATE_GOLDEN").is_some() {
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(&path, &drawn).unwrap();
            }
            if std::fs::read_to_string(&path).unwrap_or_default() != drawn {
                different.push(format!("{}:\n{drawn}", path.display()));
            }
        }
    }
    assert!(different.is_empty(), "{} screens differ:\n{}", different.len(), different.join("\n"));
}

#[test]
fn every_size_can_be_drawn() {
    for view in [empty, typical, failed] {
        let (mut app, _) = app(view());
        for tab in Tab::ALL {
            app.tab = tab;
            for (width, height) in
                [(1, 1), (10, 3), (59, 20), (60, 19), (60, 20), (61, 21), (99, 20), (100, 20), (60, 90), (300, 20)]
            {
                shot(&mut app, width, height);
            }
        }
    }
    let (mut app, _) = app(empty());
    assert!(text(&shot(&mut app, 40, 7)).contains("too small: 40x7, at"));
    assert!(text(&shot(&mut app, 20, 5)).contains("small:\n20x5, at least 60x20"));
}
