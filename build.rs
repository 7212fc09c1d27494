//! Names the program's version and, in a checkout of its repository, the commit that it is built from.

use std::path::Path;
use std::process::Command;

fn main() {
    let version = env!("CARGO_PKG_VERSION");
    let version = commit().map_or_else(|| version.to_owned(), |commit| format!("{version} ({commit})"));
    println!("cargo::rustc-env=MGE_VERSION={version}");
    for path in ["build.rs", "Cargo.toml", "src", "crates"] {
        println!("cargo::rerun-if-changed={path}");
    }
    // A new commit changes the log; a missing file would rebuild the program every time.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| Path::new(log).exists()) {
        println!("cargo::rerun-if-changed={log}");
    }
}

/// The commit, with a mark if files differ from it. None outside of this package's own repository.
fn commit() -> Option<String> {
    let top = git(&["rev-parse", "--show-toplevel"])?;
    let is_own = Path::new(&top).canonicalize().ok()? == Path::new(env!("CARGO_MANIFEST_DIR")).canonicalize().ok()?;
    let described = git(&["describe", "--always", "--dirty=, changed", "--exclude=*", "--abbrev=10"])?;
    is_own.then_some(described)
}

/// What git prints; None if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git")
        .env("GIT_OPTIONAL_LOCKS", "0")
        .args(arguments)
        .output()
        .ok()
        .filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}
