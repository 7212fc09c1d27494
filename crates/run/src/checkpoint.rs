//! A checkpoint: named sections of bytes in one folder, with a manifest for verifying them.
//!
//! ```text
//! manifest.json       {"format": 1, "mge_version": "..", "episode": 200, "score": 0.35,
//!                      "sections": [{"name": "actor.safetensors", "bytes": 41232, "sha256": ".."}]}
//! actor.safetensors   one file per section, with the section's name
//! ```
//!
//! The trainer defines the meaning of the sections. The folder appears under its name only when
//! it is complete and on disk.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::file::{check_format, parse_json};
use super::folder::{self, write_new};
use super::{Result, RunError, file, number};
use mge_base::atomic::{NewFolder, parent_of};
use mge_base::identity::{self, sha256};

/// The checkpoint format that this program writes, and the newest that it reads.
pub const FORMAT: u64 = 1;

const MANIFEST: &str = "manifest.json";

/// Prefix of an old checkpoint's name while a new one replaces it.
pub(super) const PREVIOUS: &str = ".previous-";

/// The whole state of a training at the end of an episode, as named sections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Episodes finished.
    pub episode: u64,
    /// The score that decides about `best`, if the networks were evaluated at this episode.
    pub score: Option<f64>,
    sections: BTreeMap<String, Vec<u8>>,
}

/// `manifest.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    format: u64,
    mge_version: String,
    /// Episodes finished.
    pub episode: u64,
    /// The score that decides about `best`.
    #[serde(with = "number::optional")]
    pub score: Option<f64>,
    sections: Vec<Section>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Section {
    name: String,
    bytes: u64,
    sha256: String,
}

impl Checkpoint {
    /// A checkpoint without sections, after `episode` episodes.
    pub fn new(episode: u64) -> Self {
        Self { episode, ..Self::default() }
    }

    /// Adds or replaces a section of bytes, such as a safetensors file.
    ///
    /// # Errors
    /// [`RunError::Refused`] if `name` cannot be a file name on every system.
    pub fn insert(&mut self, name: &str, bytes: Vec<u8>) -> Result<()> {
        if !is_section_name(name) {
            return Err(bad_section(name));
        }
        self.sections.insert(name.into(), bytes);
        Ok(())
    }

    /// Adds or replaces a section that holds a value as JSON, such as counters or random streams.
    ///
    /// # Errors
    /// As [`Checkpoint::insert`].
    pub fn insert_json(&mut self, name: &str, value: &impl Serialize) -> Result<()> {
        self.insert(name, serde_json::to_vec(value).expect("plain data"))
    }

    /// The bytes of a section.
    ///
    /// # Errors
    /// [`RunError::Refused`], which names the existing sections.
    pub fn section(&self, name: &str) -> Result<&[u8]> {
        self.sections.get(name).map(Vec::as_slice).ok_or_else(|| {
            let (episode, present) = (self.episode, self.names().collect::<Vec<_>>().join(", "));
            let what = format!("the checkpoint of episode {episode} has no section \"{name}\"; it has {present}");
            RunError::Refused(what)
        })
    }

    /// The value of a section written by [`Checkpoint::insert_json`].
    ///
    /// # Errors
    /// [`RunError::Refused`]; [`RunError::Malformed`] with the place in the JSON.
    pub fn json<T: DeserializeOwned>(&self, name: &str) -> Result<T> {
        parse_json(Path::new(name), self.section(name)?)
    }

    /// The names of the sections, in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.sections.keys().map(String::as_str)
    }

    /// Writes the checkpoint to the folder `path`; replaces an existing one.
    ///
    /// All files are written and synced in a new folder beside it, which is then renamed. The old
    /// checkpoint is renamed just before and removed afterwards; [`Checkpoint::load`] finds it if
    /// the process is killed between the two renames.
    ///
    /// # Errors
    /// [`RunError::Io`]; then the old checkpoint still exists.
    pub fn save(&self, path: &Path) -> Result<()> {
        let new = folder::new_beside(path)?;
        let mut sections = Vec::new();
        for (name, bytes) in &self.sections {
            write_new(&new.path().join(name), bytes)?;
            sections.push(Section { name: name.clone(), bytes: bytes.len() as u64, sha256: sha256(bytes) });
        }
        let manifest = Manifest {
            format: FORMAT,
            mge_version: identity::version().into(),
            episode: self.episode,
            score: self.score,
            sections,
        };
        let text = serde_json::to_vec_pretty(&manifest).expect("plain data");
        write_new(&new.path().join(MANIFEST), &text)?;
        folder::sync(new.path())?;
        swap_in(new, path)
    }

    /// Reads and verifies the checkpoint in the folder `path`.
    ///
    /// # Errors
    /// [`RunError::NoCheckpoint`] if there is none; [`RunError::Refused`] if its format is too new;
    /// [`RunError::Malformed`] or [`RunError::Io`], with the file that does not match the manifest.
    pub fn load(path: &Path) -> Result<Self> {
        Self::load_filtered(path, |_| true)
    }

    /// Like [`Checkpoint::load`], but reads only the sections whose names `is_needed` accepts.
    pub(super) fn load_filtered(path: &Path, is_needed: impl Fn(&str) -> bool) -> Result<Self> {
        let path = &existing(path);
        folder::check(path)?;
        let manifest = Manifest::read(path)?;
        let mut checkpoint = Self::new(manifest.episode);
        checkpoint.score = manifest.score;
        for section in manifest.sections.iter().filter(|section| is_needed(&section.name)) {
            let file = path.join(&section.name);
            if !is_section_name(&section.name) {
                return Err(bad_section(&section.name));
            }
            let bytes = file::read(&file)?;
            if sha256(&bytes) != section.sha256 {
                let reason = "it is damaged (its checksum differs): a fork can continue from an earlier checkpoint";
                return Err(RunError::malformed(&file, None, reason));
            }
            checkpoint.sections.insert(section.name.clone(), bytes);
        }
        Ok(checkpoint)
    }
}

impl Manifest {
    /// Reads only the manifest of the checkpoint in the folder `path`.
    pub fn read(path: &Path) -> Result<Self> {
        let path = &existing(path);
        folder::check(path)?;
        let file = path.join(MANIFEST);
        let Some(bytes) = file::read_optional(&file)? else { return Err(RunError::NoCheckpoint(path.clone())) };
        check_format(&file, &bytes, FORMAT)?;
        parse_json(&file, &bytes)
    }
}

/// Copies a saved checkpoint to another name in the same folder. Files are hard-linked where
/// possible, because files of a checkpoint never change.
pub(super) fn duplicate(from: &Path, to: &Path) -> Result<()> {
    let new = folder::new_beside(to)?;
    for entry in fs::read_dir(from).map_err(RunError::io("read", from))? {
        let source = entry.map_err(RunError::io("read", from))?.path();
        let Some(name) = source.file_name() else {
            continue;
        };
        let target = new.path().join(name);
        if fs::hard_link(&source, &target).is_err() {
            write_new(&target, &file::read(&source)?)?;
        }
    }
    folder::sync(new.path())?;
    swap_in(new, to)
}

/// Renames a complete folder to `path`; an old one there is removed afterwards.
fn swap_in(new: NewFolder, path: &Path) -> Result<()> {
    let previous = previous_of(path);
    if path.exists() {
        remove(&previous)?;
        keep_others(path)?;
        fs::rename(path, &previous).map_err(RunError::io("replace", path))?;
    }
    if let Err(error) = new.rename(path) {
        // Restore the old one; if this fails as well, readers still find it under its other name.
        let _ = fs::rename(&previous, path);
        return Err(RunError::io("write", path)(error));
    }
    folder::sync(parent_of(path))?;
    remove(&previous)
}

/// Removes a checkpoint, if it exists, atomically: even if the process is killed, no partial checkpoint remains.
pub(super) fn remove_whole(path: &Path) -> Result<()> {
    if !path.exists() {
        return Ok(());
    }
    keep_others(path)?;
    // Folders with the new name are removed as leftovers. The rename replaces the empty folder.
    let leaving = folder::new_beside(path)?;
    fs::rename(path, leaving.path()).map_err(RunError::io("remove", path))?;
    // After a power failure it has its new name, or is complete under the old one.
    let folder = parent_of(path);
    folder::sync(folder)?;
    leaving.close().map_err(RunError::io("remove", path))?;
    folder::sync(folder)
}

/// Removes an old checkpoint that was replaced, if it exists.
pub(super) fn remove(path: &Path) -> Result<()> {
    match fs::remove_dir_all(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(RunError::io("remove", path)(error)),
        _ => Ok(()),
    }
}

/// Moves what is not of a checkpoint, such as a user's notes, out of its folder, to `kept-from-NAME` beside it.
fn keep_others(path: &Path) -> Result<()> {
    let own = match Manifest::read(path) {
        // Then it is not known what belongs to it.
        Err(RunError::NoCheckpoint(_) | RunError::Malformed { .. } | RunError::Refused(_)) => Vec::new(),
        manifest => manifest?.sections,
    };
    let is_own = |name: &OsStr| name == MANIFEST || own.iter().any(|section| name == section.name.as_str());
    let names = fs::read_dir(path).and_then(|entries| entries.map(|entry| Ok(entry?.file_name())).collect());
    let mut others: Vec<OsString> = names.map_err(RunError::io("read", path))?;
    others.retain(|name| !is_own(name));
    if others.is_empty() {
        return Ok(());
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let free = |number| path.with_file_name(format!("kept-from-{name}{number}"));
    let numbers = std::iter::once(String::new()).chain((2..).map(|number| format!("-{number}")));
    let Some(kept) = numbers.map(free).find(|kept| !kept.exists()) else { return Ok(()) };
    folder::create(&kept)?;
    for name in others {
        fs::rename(path.join(&name), kept.join(&name)).map_err(RunError::io("keep", &path.join(&name)))?;
    }
    folder::sync(&kept)
}

fn previous_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{PREVIOUS}{name}"))
}

/// `path`, or the old checkpoint's path if a process was killed while replacing it.
fn existing(path: &Path) -> PathBuf {
    let previous = previous_of(path);
    if !path.exists() && previous.exists() { previous } else { path.to_path_buf() }
}

fn bad_section(name: &str) -> RunError {
    let rule = "use lower-case letters, digits, '_', '-' and '.', at most 64";
    RunError::Refused(format!("\"{name}\" cannot name a section: {rule}"))
}

fn is_section_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_-.".contains(c);
    (1..=64).contains(&name.len()) && name.chars().all(allowed) && !name.starts_with('.') && name != MANIFEST
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn removal_accepts_missing_folders_but_not_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("best");
        remove_whole(&path).unwrap();
        fs::write(&path, "kept").unwrap();
        assert!(remove_whole(&path).is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "kept");
        fs::remove_file(&path).unwrap();
        fs::create_dir(&path).unwrap();
        fs::write(path.join("file"), "").unwrap();
        remove_whole(&path).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("kept-from-best/file")).unwrap(), "");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn files_of_the_user_outlive_a_checkpoint_that_is_replaced_or_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("last");
        sample(1).save(&path).unwrap();
        for (episode, kept) in [(2, "kept-from-last"), (3, "kept-from-last-2")] {
            fs::write(path.join("notes.txt"), "mine").unwrap();
            fs::create_dir(path.join("plots")).unwrap();
            sample(episode).save(&path).unwrap();
            assert_eq!(fs::read_to_string(folder.path().join(kept).join("notes.txt")).unwrap(), "mine");
            assert!(folder.path().join(kept).join("plots").is_dir());
            assert_eq!(Checkpoint::load(&path).unwrap(), sample(episode));
        }
        // What belongs to a checkpoint with a damaged manifest is not known.
        fs::write(path.join(MANIFEST), "{").unwrap();
        remove_whole(&path).unwrap();
        assert!(folder.path().join("kept-from-last-3/actor.safetensors").exists());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }

    fn sample(episode: u64) -> Checkpoint {
        let mut checkpoint = Checkpoint::new(episode);
        checkpoint.score = Some(0.25);
        checkpoint.insert("actor.safetensors", vec![episode as u8; 300]).unwrap();
        checkpoint.insert_json("state.json", &(episode, "text")).unwrap();
        checkpoint
    }

    #[test]
    fn a_checkpoint_round_trips_and_replaces_the_old_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("last");
        sample(1).save(&path).unwrap();
        sample(2).save(&path).unwrap();
        let loaded = Checkpoint::load(&path).unwrap();
        assert_eq!(loaded, sample(2));
        assert_eq!(loaded.json::<(u64, String)>("state.json").unwrap(), (2, "text".into()));
        assert_eq!(loaded.names().collect::<Vec<_>>(), ["actor.safetensors", "state.json"]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_random_stream_continues_where_it_was() {
        let mut stream = ChaCha8Rng::seed_from_u64(3);
        let _: [u32; 5] = stream.r#gen();
        let mut checkpoint = Checkpoint::new(0);
        checkpoint.insert_json("streams.json", &stream).unwrap();
        let mut restored: ChaCha8Rng = checkpoint.json("streams.json").unwrap();
        assert_eq!(stream.r#gen::<u64>(), restored.r#gen::<u64>());
    }

    fn check_refused(damage: impl FnOnce(&Path), expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("last");
        sample(1).save(&path).unwrap();
        damage(&path);
        let error = Checkpoint::load(&path).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }

    #[test]
    fn damage_is_found_and_named() {
        let edit = |path: &Path, from: &str, to: &str| {
            let text = fs::read_to_string(path.join(MANIFEST)).unwrap();
            assert!(text.contains(from));
            fs::write(path.join(MANIFEST), text.replacen(from, to, 1)).unwrap();
        };
        let actor = "actor.safetensors";
        check_refused(|p| fs::write(p.join(actor), [1; 299]).unwrap(), "checksum differs");
        check_refused(|p| fs::write(p.join(actor), [7; 300]).unwrap(), "checksum differs");
        check_refused(|p| fs::remove_file(p.join(actor)).unwrap(), "cannot read");
        check_refused(|p| fs::remove_file(p.join(MANIFEST)).unwrap(), "there is no checkpoint in");
        check_refused(|p| edit(p, "\"format\": 1", "\"format\": 2"), "has format 2, and this program");
        check_refused(|p| edit(p, "\"episode\": 1", "\"episode\": \"x\""), "episode: invalid type");
        check_refused(|p| edit(p, actor, "../../secret"), "\"../../secret\" cannot name a section");
        check_refused(|p| fs::write(p.join(MANIFEST), "{\"format\": 1,").unwrap(), "manifest.json, line 1");
    }

    #[test]
    fn manifest_keeps_its_form() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("best");
        let mut checkpoint = Checkpoint::new(12);
        checkpoint.insert("a", b"abc".to_vec()).unwrap();
        checkpoint.save(&path).unwrap();
        let text = fs::read_to_string(path.join(MANIFEST)).unwrap();
        let text = text.replace(identity::version(), "VERSION");
        let golden = r#"{
  "format": 1,
  "mge_version": "VERSION",
  "episode": 12,
  "score": null,
  "sections": [
    {
      "name": "a",
      "bytes": 3,
      "sha256": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    }
  ]
}"#;
        assert_eq!(text, golden);
    }

    #[test]
    fn missing_sections_and_bad_names_have_their_own_errors() {
        let error = sample(4).section("critic").unwrap_err();
        assert_eq!(
            error.to_string(),
            "the checkpoint of episode 4 has no section \"critic\"; it has actor.safetensors, state.json"
        );
        for name in ["", "Actor", "a/b", "..", "manifest.json"] {
            let error = Checkpoint::new(0).insert(name, Vec::new()).unwrap_err();
            assert!(error.to_string().contains("cannot name a section"), "{name}");
        }
    }

    #[test]
    fn a_failed_save_keeps_the_good_one_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("last");
        sample(1).save(&path).unwrap();
        // A file with the name to which the old checkpoint is moved makes the swap fail even for root.
        let previous = previous_of(&path);
        fs::write(&previous, b"in the way").unwrap();
        let error = sample(2).save(&path).unwrap_err();
        assert!(error.to_string().contains(".previous-last"), "{error}");
        assert_eq!(Checkpoint::load(&path).unwrap(), sample(1));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn death_between_the_two_renames_loses_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("last");
        sample(1).save(&path).unwrap();
        fs::rename(&path, previous_of(&path)).unwrap();
        assert_eq!(Checkpoint::load(&path).unwrap(), sample(1));
        sample(2).save(&path).unwrap();
        assert_eq!(Checkpoint::load(&path).unwrap(), sample(2));
    }

    #[test]
    fn a_copy_is_independent_of_the_original() {
        let folder = tempfile::tempdir().unwrap();
        let (last, best) = (folder.path().join("last"), folder.path().join("best"));
        sample(1).save(&last).unwrap();
        duplicate(&last, &best).unwrap();
        sample(2).save(&last).unwrap();
        assert_eq!(Checkpoint::load(&best).unwrap(), sample(1));
    }
}
