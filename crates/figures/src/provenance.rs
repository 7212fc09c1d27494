//! Provenance of a figure, embedded in its file.

use std::fmt::Write as _;

use super::xml::escaped;

/// The command, seeds, config and program behind a figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// The command line that reproduces the figure.
    pub command: String,
    /// The seeds behind the data.
    pub seeds: Vec<u64>,
    /// Hash of the effective configuration.
    pub config_hash: String,
    /// Version of the program.
    pub version: String,
}

impl Provenance {
    /// Provenance of this program's version.
    pub fn new(command: impl Into<String>, seeds: &[u64], config_hash: impl Into<String>) -> Self {
        Self {
            command: command.into(),
            seeds: seeds.to_vec(),
            config_hash: config_hash.into(),
            version: mge_base::identity::version().to_owned(),
        }
    }

    /// Keywords and texts, as for a PNG's text chunks.
    pub(super) fn chunks(&self) -> [(&'static str, String); 4] {
        let seeds = self.seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
        [
            ("Software", format!("mge {}", self.version)),
            ("Command", self.command.clone()),
            ("Seed", seeds),
            ("Config hash", self.config_hash.clone()),
        ]
    }

    /// Adds the text chunks to a PNG's header.
    pub(super) fn describe<W: std::io::Write>(
        &self,
        encoder: &mut png::Encoder<'_, W>,
    ) -> Result<(), png::EncodingError> {
        for (keyword, text) in self.chunks() {
            if text.chars().all(|character| u32::from(character) < 256) {
                encoder.add_text_chunk(keyword.to_owned(), text)?;
            } else {
                encoder.add_itxt_chunk(keyword.to_owned(), text)?;
            }
        }
        Ok(())
    }

    /// An SVG `metadata` element.
    pub fn to_svg(&self) -> String {
        let mut text = String::from("<metadata>\n");
        for (keyword, value) in self.chunks() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{keyword}: {}", escaped(&value));
        }
        text + "</metadata>\n"
    }
}
