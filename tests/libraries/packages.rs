//! Every package contains what its sources embed, so that it can be published and built alone.

use std::fs;
use std::path::{Path, PathBuf};

/// The files of a folder and those below it.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

/// How far a path climbs above the folder it starts in.
fn climbs(path: &str) -> usize {
    path.split('/').take_while(|part| *part == "..").count()
}

#[test]
fn no_source_embeds_a_file_from_outside_its_package() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = fs::read_dir(root.join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut embedded = 0;
    for source in crates.chain([root.to_owned()]).map(|package| package.join("src")) {
        for file in files(&source).into_iter().filter(|file| file.extension().is_some_and(|suffix| suffix == "rs")) {
            // Tests are not built with a package.
            let inner = file.strip_prefix(&source).unwrap();
            if inner.to_string_lossy().contains("tests") {
                continue;
            }
            let text = fs::read_to_string(&file).unwrap();
            for after in ["include_str!(\"", "include_bytes!(\""].iter().flat_map(|call| text.split(call).skip(1)) {
                let path = after.split('"').next().unwrap();
                assert!(climbs(path) <= inner.components().count(), "{}: {path}", file.display());
                assert!(file.with_file_name(path).exists(), "{}: {path}", file.display());
                embedded += 1;
            }
        }
    }
    assert!(embedded > 20, "{embedded}");
}
