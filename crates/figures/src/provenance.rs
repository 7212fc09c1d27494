//! Provenance of a figure, embedded in its file.

use std::fmt::Write as _;

use super::error::FigureError;
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

    fn from_chunks(find: impl Fn(&str) -> Option<String>) -> Option<Self> {
        Some(Self {
            version: find("Software")?.strip_prefix("mge ")?.to_owned(),
            command: find("Command")?,
            seeds: find("Seed")?.split_whitespace().map(|seed| seed.parse().ok()).collect::<Option<_>>()?,
            config_hash: find("Config hash")?,
        })
    }

    /// Adds the text chunks to a PNG's header; text outside Latin-1 is written as UTF-8.
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

    /// One line per keyword, for a GIF's comment.
    pub(super) fn to_comment(&self) -> String {
        self.chunks().map(|(keyword, text)| format!("{keyword}: {text}")).join("\n")
    }

    /// Reads back the provenance in a PNG written by this program.
    ///
    /// # Errors
    /// When the file cannot be read, is not a PNG, or carries no provenance.
    pub fn read(path: &std::path::Path) -> Result<Self, FigureError> {
        let unreadable = |message: String| FigureError::Unreadable { path: path.to_owned(), message };
        let file = std::fs::File::open(path).map_err(|source| FigureError::io(path, source))?;
        let reader = png::Decoder::new(std::io::BufReader::new(file))
            .read_info()
            .map_err(|error| unreadable(error.to_string()))?;
        let info = reader.info();
        let find = |keyword: &str| {
            let plain = info.uncompressed_latin1_text.iter().find(|chunk| chunk.keyword == keyword);
            let utf8 = info.utf8_text.iter().find(|chunk| chunk.keyword == keyword);
            plain.map(|chunk| chunk.text.clone()).or_else(|| utf8.and_then(|chunk| chunk.get_text().ok()))
        };
        Self::from_chunks(find).ok_or_else(|| unreadable("the image carries no provenance of this program".to_owned()))
    }
}
