//! Compares every screen in its empty, typical and failed state at four sizes with golden files.
//! `MGE_UPDATE_GOLDEN=1 cargo test tui` rewrites the files; review the difference.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use super::{app, change_run, empty, evaluation, failed, forked, grouped, press, shot, text, typical};
use crate::tui::actions::Tab;
use crate::tui::view::{RunSummary, ViewModel};
use mge_run::Practised;
use mge_trainer::Phase;
use mge_workbench::HandPlay;

const SIZES: [(u16, u16); 4] = [(60, 20), (80, 24), (120, 40), (200, 60)];

/// Compares the output of `draw` at every size with the file of that name and size.
fn check(name: &str, draw: impl Fn(u16, u16) -> String) {
    for (width, height) in SIZES {
        let screens = draw(width, height);
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join(format!("src/tui/app/testing/golden/{name}-{width}x{height}.txt"));
        if std::env::var_os("MGE_UPDATE_GOLDEN").is_some() {
            std::fs::write(&path, &screens).unwrap();
        }
        let golden = std::fs::read_to_string(&path).unwrap_or_default();
        let different = golden.lines().zip(screens.lines()).position(|(a, b)| a != b);
        assert!(golden == screens, "{} differs, first in line {different:?}:\n{screens}", path.display());
    }
}

/// All screens of a view, with the given figure selected.
fn screens(view: fn() -> ViewModel, figure: usize) -> impl Fn(u16, u16) -> String {
    move |width, height| {
        let (mut app, _) = app(view());
        app.screens.lists.figure = figure;
        let all = Tab::ALL.map(|tab| {
            app.tab = tab;
            // The preview of a figure needs the regions of a first drawing.
            shot(&mut app, width, height);
            app.tick(Duration::ZERO);
            while app.screens.preview.is_drawing() {
                std::thread::yield_now();
                app.tick(Duration::ZERO);
            }
            format!("=== {}\n{}", tab.title(), text(&shot(&mut app, width, height)))
        });
        all.concat()
    }
}

#[test]
fn empty_screens_say_what_to_press() {
    check("empty", screens(empty, 0));
}

#[test]
fn typical_screens() {
    check("typical", screens(typical, 0));
}

#[test]
fn failed_screens_say_why() {
    check("failed", screens(failed, 1));
}

#[test]
fn screens_of_groups() {
    check("grouped", |width, height| {
        let shots =
            ["4", "4 tab", "4 v", "4 left left", "4 t", "5", "5 tab", "5 tab down", "7 tab end space"].map(|keys| {
                let (mut app, _) = app(grouped());
                press(&mut app, keys);
                format!("=== {keys}\n{}", text(&shot(&mut app, width, height)))
            });
        shots.concat()
    });
}

#[test]
fn screens_of_forks_and_of_two_runs_side_by_side() {
    check("forked", |width, height| {
        const TWO: &str = "5 down space down space V left left";
        let shots = ["4 left", "5", "5 down", TWO, "F"].map(|keys| {
            let (mut app, _) = app(forked());
            press(&mut app, keys);
            format!("=== {keys}\n{}", text(&shot(&mut app, width, height)))
        });
        shots.concat()
    });
}

#[test]
fn screens_during_and_after_practice() {
    check("practice", |width, height| {
        let during = |run: &mut RunSummary| {
            let phase = Phase::Practising { stage: 1, stages: 2, rollouts: 50, reached: 12 };
            (run.preparing, run.done, run.success, run.rate) = (phase.preparation(), 0, None, None);
            (run.curves, run.evaluations) = (Arc::default(), Vec::new());
        };
        let after = |run: &mut RunSummary| {
            run.practised = Some(Practised { rollouts: vec![75, 200], reached: vec![56, 0], actions: 1165 });
            run.needs = vec![0.05, 1.0];
        };
        let states: [fn(&mut RunSummary); 2] = [during, after];
        let shots = states.into_iter().flat_map(|state| ["1", "4", "5"].map(|keys| (state, keys)));
        let shots = shots.map(|(state, keys)| {
            let mut view = typical();
            change_run(&mut view, 1, state);
            let (mut app, _) = app(view);
            press(&mut app, keys);
            format!("=== {keys}\n{}", text(&shot(&mut app, width, height)))
        });
        shots.collect()
    });
}

#[test]
fn screens_of_models_that_are_trained_and_measured() {
    check("models", |width, height| {
        let mut view = typical();
        view.models[0].evaluation = Some(Arc::new(evaluation()));
        view.model_work = Some(("training models/mine.safetensors".into(), Some(0.4)));
        view.model_losses = Arc::new((1..2000).map(|epoch| (epoch as f32).powf(-0.7)).collect());
        let (mut app, _) = app(view);
        press(&mut app, "6");
        text(&shot(&mut app, width, height))
    });
}

/// Help, palette, prompts, lists and questions over the screen, by the keys that open them.
#[test]
fn layers_over_the_screen() {
    const KEYS: [&str; 9] = ["?", "? end", ":", ": e p s i", ": s e e d space x enter", "e", "m", "x", "q"];
    check("layers", |width, height| {
        let shots = KEYS.map(|keys| {
            let (mut app, _) = app(typical());
            press(&mut app, keys);
            format!("=== {keys}\n{}", text(&shot(&mut app, width, height)))
        });
        let (mut app, _) = app(empty());
        app.show_tour();
        shots.concat() + "=== tour\n" + &text(&shot(&mut app, width, height))
    });
}

/// A view of a level of CREATE.
fn level(name: &str) -> ViewModel {
    let mut view = empty();
    view.task = Arc::new(mge_task::load(name).unwrap());
    view.hand.task = view.task.clone();
    view.hand.snapshot = Arc::new(HandPlay::new(view.task.clone(), 0).snapshot().clone());
    view
}

/// Levels and their tools on the Edit screen, palettes of tools over it, and a tool of CREATE in hand.
#[test]
fn screens_of_levels_and_palettes_of_tools() {
    const KEYS: [(&str, &str); 6] = [
        ("create/Cannon", "2 backtab }"),
        ("create/Obstacle", "2"),
        ("create/Push", "2 T down right"),
        ("create/Push", "2 T f a n space 1 0 5 end"),
        ("create/Push", "2 T q q"),
        ("create/Push", "P T t r a m p enter"),
    ];
    check("tools", |width, height| {
        let shots = KEYS.map(|(name, keys)| {
            let (mut app, _) = app(level(name));
            // The palette moves by the rows and columns of its latest drawing.
            for key in keys.split_whitespace() {
                press(&mut app, key);
                shot(&mut app, width, height);
            }
            format!("=== {name}: {keys}\n{}", text(&shot(&mut app, width, height)))
        });
        shots.concat()
    });
}

#[test]
fn every_size_can_be_drawn() {
    for view in [empty, typical, failed] {
        let (mut app, _) = app(view());
        for tab in Tab::ALL {
            app.tab = tab;
            for (width, height) in
                [(1, 1), (10, 3), (59, 20), (60, 19), (61, 21), (99, 20), (100, 20), (60, 90), (300, 20)]
            {
                shot(&mut app, width, height);
            }
        }
    }
    let (mut app, _) = app(empty());
    assert!(text(&shot(&mut app, 40, 7)).contains("too small: 40x7, at"));
    assert!(text(&shot(&mut app, 20, 5)).contains("small:\n20x5, at least 60x20"));
    assert!(text(&shot(&mut app, 40, 12)).contains("no run; t trains one"));
    let (mut app, _) = super::app(typical());
    let small = text(&shot(&mut app, 40, 12));
    assert!(small.contains("success rate") && small.contains("running, 700/2000, success 35 %"), "{small}");
    press(&mut app, "q");
    assert!(text(&shot(&mut app, 40, 12)).contains("leave the workbench?"));
}
