//! What a result depends on, known by its content: a file by its hash, the program by its version and commit, the
//! machine by the kind of its processor.

use std::path::Path;
use std::str::FromStr;
use std::sync::OnceLock;

use derive_more::Display;
use educe::Educe;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

static VERSION: OnceLock<&str> = OnceLock::new();

/// Version of the program and, if known, the commit that it was built from; that of this library unless
/// [`set_version`] was called.
pub fn version() -> &'static str {
    VERSION.get_or_init(|| env!("CARGO_PKG_VERSION"))
}

/// Sets what [`version`] returns. Only the first call counts, and only before the first use.
pub fn set_version(version: &'static str) {
    let _ = VERSION.set(version);
}

/// SHA-256 of some bytes, in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A file, known by its content: equal if the hashes are. As text `NAME@sha256:HASH`.
#[derive(Debug, Clone, Display, Educe, Eq)]
#[display("{name}{MARK}{sha256}")]
#[educe(PartialEq)]
pub struct FileId {
    /// The file's name without folder and extension, for people.
    #[educe(PartialEq = false)]
    pub name: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

impl FileId {
    /// The identity of a file with these bytes; `place` is its path, of which only the name is kept: that of its folder
    /// for a model of a sweep, all of which are called `model`.
    pub fn new(place: impl AsRef<Path>, bytes: &[u8]) -> Self {
        let place = place.as_ref();
        let stem = place.file_stem().unwrap_or_default();
        let folder = place.parent().and_then(Path::file_name).filter(|_| stem == "model");
        Self { name: folder.unwrap_or(stem).to_string_lossy().into_owned(), sha256: sha256(bytes) }
    }

    /// The first digits of the hash, enough to tell files apart.
    pub fn digits(&self) -> &str {
        self.sha256.get(..8).unwrap_or(&self.sha256)
    }
}

impl FromStr for FileId {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        let (name, sha256) = text.rsplit_once(MARK).ok_or(())?;
        let is_hash = sha256.len() == 64 && sha256.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        if is_hash { Ok(Self { name: name.to_owned(), sha256: sha256.to_owned() }) } else { Err(()) }
    }
}

const MARK: &str = "@sha256:";

/// What results depend on besides settings: the program, the processor, and the files that it read.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of the program: [`version()`].
    pub mge_version: String,
    /// Kind of the processor; empty if it is not recorded.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub processor: String,
    /// The dynamics models in use, as [`FileId`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<String>,
}

impl Origin {
    /// In what this differs from an earlier origin, as phrases; values that are not recorded are not compared.
    pub fn changes(&self, before: &Self) -> Vec<String> {
        let models = |origin: &Self| origin.models.join(", ");
        let values = [
            ("the program", before.mge_version.clone(), self.mge_version.clone()),
            ("the kind of processor", before.processor.clone(), self.processor.clone()),
            ("the model", models(before), models(self)),
        ];
        let differing = values.into_iter().filter(|(_, a, b)| !a.is_empty() && !b.is_empty() && a != b);
        differing.map(|(what, a, b)| format!("{what} is {b}, not {a}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_their_content() {
        let file = FileId::new("a/mine.v2.safetensors", b"abc");
        assert_eq!(file.name, "mine.v2");
        assert_eq!(file.digits(), "ba7816bf");
        assert_eq!(file, FileId::new("b/yours.safetensors", b"abc"));
        assert_ne!(file, FileId::new("a/mine.v2.safetensors", b"abd"));
        let text = file.to_string();
        assert_eq!(text.parse::<FileId>().map(|read| read.name), Ok(file.name));
        for wrong in ["a.safetensors", "a@sha256:", &text[..text.len() - 1], &text.to_uppercase()] {
            assert!(wrong.parse::<FileId>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn only_recorded_values_are_compared() {
        let origin = |processor: &str| Origin { processor: processor.to_owned(), ..Origin::default() };
        assert_eq!(origin("a").changes(&origin("")), [""; 0]);
        assert_eq!(origin("a").changes(&origin("b")), ["the kind of processor is a, not b"]);
    }
}
