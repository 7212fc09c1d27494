//! Paths as people write them: `~` for their home folder, suffixes in any case, and names of any length.

use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Longest name of a file or folder, in bytes, of the usual file systems.
const MAX_NAME: usize = 255;

/// A path with the user's home folder in place of a first part `~`, as a shell would give it. Every path that the user
/// writes passes through here once: arguments, environment variables, commands, prompts and JSON files.
pub fn expanded(path: impl Into<PathBuf>) -> PathBuf {
    let path = path.into();
    match (path.strip_prefix("~"), std::env::home_dir()) {
        (Ok(rest), Some(home)) if !home.as_os_str().is_empty() => home.iter().chain(rest).collect(),
        _ => path,
    }
}

/// The entries of a folder; none if it does not exist.
///
/// # Errors
/// When the folder cannot be listed.
pub fn entries(folder: &Path) -> io::Result<Vec<PathBuf>> {
    match std::fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        entries => entries?.map(|entry| Ok(entry?.path())).collect(),
    }
}

/// The extension of a path in lower case; empty if there is none.
pub fn suffix(path: &Path) -> String {
    path.extension().and_then(|suffix| suffix.to_str()).unwrap_or_default().to_lowercase()
}

/// The name `start` and `end`. If it is too long for a file system, a hash replaces the rest of `start`, so that equal
/// names stay equal and different ones different.
pub fn fitting(start: &str, end: &str) -> String {
    let Some(room) = MAX_NAME.checked_sub(end.len()).filter(|room| start.len() > *room) else {
        return start.to_owned() + end;
    };
    let hash = &format!("-{:x}", Sha256::digest(start))[..17];
    let kept = (0..=room.saturating_sub(hash.len())).rev().find_map(|length| start.get(..length));
    kept.unwrap_or_default().to_owned() + hash + end
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_first_part_of_a_tilde_is_the_home_folder() {
        let home = std::env::home_dir().unwrap();
        assert_eq!(expanded("~"), home);
        assert_eq!(expanded("~/a/b.json"), home.join("a/b.json"));
        for other in ["", "a/~/b", "./~/a", "~a", "~~/a", "/~", "runs"] {
            assert_eq!(expanded(other), Path::new(other), "{other}");
        }
    }

    #[test]
    fn suffixes_are_compared_without_case() {
        assert_eq!(["a.PNG", "b.x.Svg", "c", ".png"].map(|path| suffix(Path::new(path))), ["png", "svg", "", ""]);
    }

    #[test]
    fn names_too_long_are_cut_and_stay_different() {
        assert_eq!(fitting("a", "-seed1"), "a-seed1");
        let longest = "é".repeat(124);
        assert_eq!(fitting(&longest, "-seed12"), format!("{longest}-seed12"), "255 bytes");
        let names = ["x", "y"].map(|last| fitting(&(longest.clone() + last), "-seed12"));
        assert!(names.iter().all(|name| name.len() <= MAX_NAME && name.ends_with("-seed12")), "{names:?}");
        assert_ne!(names[0], names[1]);
    }
}
