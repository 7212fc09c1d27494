//! The modules of `src/` use only the modules that ARCHITECTURE.md allows: data flows forward.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The modules of the table and the modules that each may use; `None` for all.
fn table() -> BTreeMap<String, Option<BTreeSet<String>>> {
    let text = std::fs::read_to_string("ARCHITECTURE.md").unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, modules, _, uses, _] = cells[..] else { return None };
        let module = modules.strip_prefix('`')?.split_once("/`")?.0.to_owned();
        let uses = match uses {
            "all" => None,
            "-" => Some(BTreeSet::new()),
            listed => Some(listed.split(", ").map(str::to_owned).collect()),
        };
        Some((module, uses))
    };
    text.lines().filter_map(row).collect()
}

/// The modules that the files of a module name, except in their tests.
fn used(folder: &Path, modules: &BTreeSet<String>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if ["tests", "testing"].contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            found.extend(used(&path, modules));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
            let words = lines.flat_map(|line| line.split("crate::").skip(1));
            let named = words.filter_map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_').next());
            found.extend(named.filter(|name| modules.contains(*name)).map(str::to_owned));
        }
    }
    found
}

#[test]
fn modules_use_what_the_architecture_allows() {
    let table = table();
    let folders = std::fs::read_dir("src").unwrap().map(|entry| entry.unwrap()).filter(|entry| entry.path().is_dir());
    let modules: BTreeSet<String> = folders.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(table.keys().cloned().collect::<BTreeSet<_>>(), modules, "the table names every module");
    for (module, allowed) in &table {
        let Some(allowed) = allowed else { continue };
        let mut used = used(&Path::new("src").join(module), &modules);
        used.remove(module);
        assert_eq!(&used, allowed, "{module}");
    }
}
