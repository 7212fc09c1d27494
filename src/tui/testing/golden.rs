//! Every screen in its empty, typical and failed state at four sizes, against files.
//! `MGE_UPDATE_GOLDEN=1 cargo test tui` writes them anew; look at the difference.

use std::path::PathBuf;

use super::{app, empty, failed, shot, text, typical};
use crate::tui::facts::Facts;
use crate::tui::screens::Tab;

const SIZES: [(u16, u16); 4] = [(60, 20), (80, 24), (120, 40), (200, 60)];

fn check(name: &str, facts: fn() -> Facts) {
    for (width, height) in SIZES {
        let (mut app, _) = app(facts());
        let mut screens = String::new();
        for tab in Tab::ALL {
            app.tab = tab;
            // What depends on where things are drawn is there in the second picture.
            shot(&mut app, width, height);
            app.tick(std::time::Duration::ZERO);
            screens += &format!("=== {}\n{}", tab.title(), text(&shot(&mut app, width, height)));
        }
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join(format!("src/tui/testing/golden/{name}-{width}x{height}.txt"));
        if std::env::var_os("MGE_UPDATE_GOLDEN").is_some() {
            std::fs::write(&path, &screens).unwrap();
        }
        let golden = std::fs::read_to_string(&path).unwrap_or_default();
        let different = golden.lines().zip(screens.lines()).position(|(a, b)| a != b);
        assert!(golden == screens, "{} differs, first in line {different:?}:\n{screens}", path.display());
    }
}

#[test]
fn empty_screens_say_what_to_press() {
    check("empty", empty);
}

#[test]
fn typical_screens() {
    check("typical", typical);
}

#[test]
fn failed_screens_say_why() {
    check("failed", failed);
}

#[test]
fn every_size_can_be_drawn() {
    for facts in [empty, typical, failed] {
        let (mut app, _) = app(facts());
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
    assert!(text(&shot(&mut app, 59, 20)).contains("59x20 of 60x20"));
}
