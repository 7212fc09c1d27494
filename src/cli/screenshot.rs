//! `mge screenshot`: images of the workbench's screens.

use super::arguments::Screenshot;
use super::interrupt::nothing_to_save;
use super::output::{self, Outcome};
use super::runs::after_script;
use crate::tui::OffscreenWorkbench;
use mge_base::paths::expanded;
use mge_figures::{PICTURE, Provenance, encode};
use mge_run::{RunError, config_hash};

pub fn run(arguments: &Screenshot) -> Outcome {
    let (width, height) = size(&arguments.size)?;
    let screens = arguments.screens.iter().map(|screen| {
        screen
            .split_once('=')
            .ok_or_else(|| format!("--screen {screen}: write FILE=KEYS, such as training.png=\"3 z\""))
    });
    let screens: Vec<(&str, &str)> = screens.collect::<Result<_, _>>()?;
    for (path, _) in &screens {
        output::check_target(&arguments.force.target(&expanded(*path)), &PICTURE)?;
    }
    let session = after_script(&arguments.script)?;
    nothing_to_save()?;
    let (seed, hash) = (session.config().seed, config_hash(session.config())?);
    let mut workbench = OffscreenWorkbench::new(session);
    // A screen depends on the keys of those before it.
    let mut command = vec!["mge".to_owned(), "screenshot".to_owned(), arguments.script.file.display().to_string()];
    command.extend(["--size".to_owned(), arguments.size.clone(), "--dpi".to_owned(), arguments.dpi.to_string()]);
    command.extend(arguments.script.variables.iter().flat_map(|variable| ["--define".to_owned(), variable.clone()]));
    for (path, keys) in screens {
        workbench.press(keys)?;
        command.extend(["--screen".to_owned(), format!("{path}={keys}")]);
        let to = arguments.force.target(&expanded(path));
        let command = shell_words::join(&command);
        let provenance = Provenance::new(command, &[seed], hash.clone());
        let picture = workbench.picture(width, height, &provenance.to_svg());
        let bytes = encode(&to.path, &picture, &provenance, arguments.dpi)?;
        to.write(&bytes, &PICTURE).map_err(RunError::io("write", &to.path))?;
        output::line(path)?;
    }
    Ok(())
}

/// Parses columns and rows, within the supported range.
fn size(text: &str) -> Result<(u16, u16), String> {
    let parsed = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    parsed
        .filter(|size| (60..=400).contains(&size.0) && (20..=200).contains(&size.1))
        .ok_or_else(|| format!("--size {text}: write COLUMNSxROWS, from 60x20 to 400x200, such as 120x36"))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cli::arguments::{Force, Script};

    fn arguments(folder: &Path, screens: &[&str], size: &str) -> Screenshot {
        let file = folder.join("screen.mge");
        std::fs::write(&file, "task task2\nmodel true\nseed 7\n").unwrap();
        let script = Script { file, variables: Vec::new(), runs: folder.join("runs"), quiet: true };
        let screens = screens.iter().map(|screen| screen.replace("DIR", &folder.display().to_string())).collect();
        Screenshot { script, screens, force: Force { force: false }, size: size.to_owned(), dpi: 72 }
    }

    #[test]
    fn screens_are_drawn_in_sequence() {
        let folder = tempfile::tempdir().unwrap();
        let svg = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        run(&arguments(folder.path(), &["DIR/a.svg=", "DIR/c.svg=7", "DIR/b.svg=1 ?", "DIR/b.png="], "80x24")).unwrap();
        assert!(svg("a.svg").contains("task2") && svg("a.svg").contains("Seed: 7"));
        assert!(svg("b.svg").len() != svg("a.svg").len(), "help lies over the screen");
        assert!(svg("c.svg").contains("dashboard") && !svg("c.svg").contains("drawing"), "the figure is finished");
        assert_eq!(Provenance::read(&folder.path().join("b.png")).unwrap().seeds, [7]);
    }

    #[test]
    fn invalid_screens_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error =
            |screens: &[&str], size: &str| run(&arguments(folder.path(), screens, size)).unwrap_err().to_string();
        assert!(
            error(&["DIR/a.png"], "80x24").contains("FILE=KEYS") && error(&["DIR/a.png=1"], "big").contains("120x36")
        );
        assert!(
            error(&["DIR/a.bmp=1"], "80x24").contains(".pdf") && error(&["DIR/a.png=nokey"], "80x24").contains("nokey")
        );
        assert!(!folder.path().join("a.png").exists() && !folder.path().join("a.bmp").exists());
    }
}
