//! Simulates a loss of power: what remains on the disk of the operations so far.
//!
//! A file has the content of its last sync, and a folder the names of its last sync; everything else is lost. In the
//! other extreme all names are kept, and only unsynced contents of files are lost.

use std::collections::BTreeMap;
use std::path::Path;

/// What the disk keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// Synced names and contents.
    Synced,
    /// All names, and synced contents.
    Names,
}

/// A file or a folder, as programs see it and as it was last synced.
#[derive(Debug, Clone)]
enum Node {
    File { seen: Vec<u8>, synced: Vec<u8> },
    Folder { seen: BTreeMap<String, usize>, synced: BTreeMap<String, usize> },
}

/// A folder and everything in it.
#[derive(Debug, Clone)]
pub struct Disk {
    nodes: Vec<Node>,
    root: String,
}

/// An operation of the trace that `faults.c` writes.
#[derive(Debug)]
pub struct Operation<'a> {
    kind: &'a str,
    offset: usize,
    path: &'a str,
    second: &'a str,
    bytes: &'a [u8],
}

/// The operations of a trace.
pub fn operations(mut trace: &[u8]) -> Vec<Operation<'_>> {
    let mut operations = Vec::new();
    while let Some(end) = trace.iter().position(|&byte| byte == b'\n') {
        let line = std::str::from_utf8(&trace[..end]).expect("paths of tests are UTF-8");
        let [kind, offset, length, path, second] = line.split('\t').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        let length: usize = length.parse().unwrap();
        let bytes = &trace[end + 1..end + 1 + length];
        trace = &trace[end + 1 + length..];
        operations.push(Operation { kind, offset: offset.parse().unwrap(), path, second, bytes });
    }
    operations
}

impl Disk {
    /// The present state of a folder, with everything synced.
    pub fn of(root: &Path) -> Self {
        let mut disk = Self { nodes: Vec::new(), root: root.display().to_string() };
        disk.read(root);
        disk
    }

    fn read(&mut self, path: &Path) -> usize {
        let at = self.nodes.len();
        self.nodes.push(Node::Folder { seen: BTreeMap::new(), synced: BTreeMap::new() });
        self.nodes[at] = if path.is_dir() {
            let mut names = BTreeMap::new();
            for entry in std::fs::read_dir(path).unwrap() {
                let entry = entry.unwrap();
                names.insert(entry.file_name().into_string().unwrap(), self.read(&entry.path()));
            }
            Node::Folder { seen: names.clone(), synced: names }
        } else {
            let bytes = std::fs::read(path).unwrap();
            Node::File { seen: bytes.clone(), synced: bytes }
        };
        at
    }

    /// The components of a path below the root.
    fn parts<'a>(&self, path: &'a str) -> Vec<&'a str> {
        path.strip_prefix(&self.root).expect(path).split('/').filter(|part| !part.is_empty()).collect()
    }

    fn find(&self, parts: &[&str]) -> Option<usize> {
        parts.iter().try_fold(0, |at, part| match &self.nodes[at] {
            Node::Folder { seen, .. } => seen.get(*part).copied(),
            Node::File { .. } => None,
        })
    }

    fn names(&mut self, parts: &[&str]) -> &mut BTreeMap<String, usize> {
        let at = self.find(&parts[..parts.len() - 1]).expect("its folder exists");
        match &mut self.nodes[at] {
            Node::Folder { seen, .. } => seen,
            Node::File { .. } => panic!("{parts:?}"),
        }
    }

    fn name(&mut self, path: &str, node: usize) {
        let parts = self.parts(path);
        self.names(&parts).insert((*parts.last().unwrap()).to_owned(), node);
    }

    fn remove(&mut self, path: &str) -> Option<usize> {
        let parts = self.parts(path);
        self.names(&parts).remove(*parts.last().unwrap())
    }

    /// Applies an operation.
    pub fn apply(&mut self, operation: &Operation<'_>) {
        let Operation { kind, offset, path, second, bytes } = *operation;
        let node = self.find(&self.parts(path));
        match kind {
            "create" | "folder" => {
                let new = match kind {
                    "create" => Node::File { seen: Vec::new(), synced: Vec::new() },
                    _ => Node::Folder { seen: BTreeMap::new(), synced: BTreeMap::new() },
                };
                self.nodes.push(new);
                self.name(path, self.nodes.len() - 1);
            }
            "rename" => {
                let moved = self.remove(second).expect(second);
                self.name(path, moved);
            }
            "link" => {
                let linked = self.find(&self.parts(second)).expect(second);
                self.name(path, linked);
            }
            "remove" => _ = self.remove(path),
            // A file that was deleted while open has no name.
            "write" | "truncate" | "sync" => {
                let Some(node) = node else { return };
                self.change(node, kind, offset, bytes);
            }
            "mode" => {}
            other => panic!("{other}"),
        }
    }

    fn change(&mut self, node: usize, kind: &str, offset: usize, bytes: &[u8]) {
        match (&mut self.nodes[node], kind) {
            (Node::Folder { seen, synced }, "sync") => synced.clone_from(seen),
            (Node::File { seen, synced }, "sync") => synced.clone_from(seen),
            (Node::File { seen, .. }, "truncate") => seen.resize(offset, 0),
            (Node::File { seen, .. }, "write") => {
                seen.resize(seen.len().max(offset + bytes.len()), 0);
                seen[offset..offset + bytes.len()].copy_from_slice(bytes);
            }
            (node, kind) => panic!("{kind} of {node:?}"),
        }
    }

    /// Writes what the disk keeps to a folder.
    pub fn restore(&self, kept: Kept, to: &Path) {
        self.write(0, kept, to);
    }

    fn write(&self, node: usize, kept: Kept, to: &Path) {
        match &self.nodes[node] {
            Node::File { synced, .. } => std::fs::write(to, synced).unwrap(),
            Node::Folder { seen, synced } => {
                if !to.is_dir() {
                    std::fs::create_dir(to).unwrap();
                }
                let names = if kept == Kept::Names { seen } else { synced };
                names.iter().for_each(|(name, node)| self.write(*node, kept, &to.join(name)));
            }
        }
    }
}

#[test]
fn only_what_was_synced_outlives_a_loss_of_power() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("old"), "old").unwrap();
    let mut disk = Disk::of(folder.path());
    let root = folder.path().display();
    let trace = format!(
        "create\t0\t0\t{root}/a\t\nwrite\t0\t3\t{root}/a\t\nabcsync\t0\t0\t{root}/a\t\nwrite\t3\t1\t{root}/a\t\nd\
        create\t0\t0\t{root}/b\t\nwrite\t0\t1\t{root}/b\t\nbsync\t0\t0\t{root}\t\nrename\t0\t0\t{root}/c\t{root}/a\n\
        remove\t0\t0\t{root}/old\t\n"
    );
    operations(trace.as_bytes()).iter().for_each(|operation| disk.apply(operation));
    let state = |kept| {
        let to = tempfile::tempdir().unwrap();
        disk.restore(kept, to.path());
        let read = |name: &str| std::fs::read_to_string(to.path().join(name)).ok();
        ["a", "b", "c", "old"].map(read)
    };
    let text = |text: &str| Some(text.to_owned());
    assert_eq!(state(Kept::Synced), [text("abc"), text(""), None, text("old")]);
    assert_eq!(state(Kept::Names), [None, text(""), text("abc"), None]);
}
