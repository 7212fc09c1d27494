//! TensorBoard's event files: TFRecord framing around protobuf `Event` messages.
//!
//! A record is `length: u64 LE, masked crc32c(length): u32 LE, data, masked crc32c(data): u32 LE`,
//! where masked means rotated right by 15 bits plus 0xa282ead8. The messages use a few fields of
//! TensorFlow's `event.proto` and `summary.proto` and are encoded by hand.

use std::path::Path;

use super::append::AppendFile;
use super::{Result, RunError, folder};

/// Writes one event file. Every call appends one complete record, so that TensorBoard can follow live.
#[derive(Debug)]
pub(super) struct TensorBoardWriter {
    file: AppendFile,
}

impl TensorBoardWriter {
    /// Starts a new event file in `folder`, which is created if necessary.
    ///
    /// Existing event files are never changed: a resumed run starts another one. `first_step` is
    /// the first step it will write; readers then discard all older data from that step on.
    /// `wall_time` is in seconds since 1970-01-01 UTC, here and below.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn create(folder: &Path, first_step: u64, wall_time: f64) -> Result<Self> {
        folder::create(folder)?;
        // Readers process the files in the order of their names.
        let older = std::fs::read_dir(folder).map_err(RunError::io("read", folder))?.count();
        let name = format!("events.out.tfevents.{:010}.mge.{older:04}", wall_time as u64);
        let mut writer = Self { file: AppendFile::open(&folder.join(name))? };
        writer.event(wall_time, 0, |event| event.bytes(3, b"brain.Event:2"))?;
        // SessionLog { status: START }
        writer.event(wall_time, first_step, |event| event.message(7, |log| log.varint(1, 1)))?;
        Ok(writer)
    }

    /// Waits until everything is on disk.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn sync(&self) -> Result<()> {
        self.file.sync()
    }

    /// Writes numbers under their tags, such as `loss/critic`. TensorBoard stores them as `f32` and
    /// shows non-finite ones as gaps.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn scalars(&mut self, step: u64, wall_time: f64, values: &[(&str, f64)]) -> Result<()> {
        self.event(wall_time, step, |event| {
            event.message(5, |summary| {
                for (tag, value) in values {
                    summary.message(1, |entry| {
                        entry.bytes(1, tag.as_bytes());
                        entry.float(2, *value as f32);
                    });
                }
            });
        })
    }

    /// Writes a text (Markdown) under a tag.
    ///
    /// # Errors
    /// [`RunError::Io`].
    pub fn text(&mut self, step: u64, wall_time: f64, tag: &str, text: &str) -> Result<()> {
        const DT_STRING: u64 = 7;
        self.event(wall_time, step, |event| {
            event.message(5, |summary| {
                summary.message(1, |entry| {
                    entry.bytes(1, tag.as_bytes());
                    entry.message(8, |tensor| {
                        tensor.varint(1, DT_STRING);
                        tensor.message(2, |shape| shape.message(2, |dim| dim.varint(1, 1)));
                        tensor.bytes(8, text.as_bytes());
                    });
                    entry.message(9, |metadata| {
                        metadata.message(1, |plugin| plugin.bytes(1, b"text"));
                    });
                });
            });
        })
    }

    /// Appends an `Event { wall_time = 1, step = 2, .. }` as one record.
    fn event(&mut self, wall_time: f64, step: u64, fill: impl FnOnce(&mut Message)) -> Result<()> {
        let mut event = Message::default();
        event.double(1, wall_time);
        event.varint(2, step);
        fill(&mut event);
        self.file.append(&record(&event.0))
    }
}

/// TFRecord framing.
fn record(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    [&length[..], &masked_crc(&length), data, &masked_crc(data)].concat()
}

fn masked_crc(bytes: &[u8]) -> [u8; 4] {
    crc32c::crc32c(bytes).rotate_right(15).wrapping_add(0xa282_ead8).to_le_bytes()
}

/// A protobuf message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, field: u64, value: u64) {
        self.raw_varint(field << 3);
        self.raw_varint(value);
    }

    fn double(&mut self, field: u64, value: f64) {
        self.raw_varint(field << 3 | 1);
        self.0.extend(value.to_le_bytes());
    }

    fn float(&mut self, field: u64, value: f32) {
        self.raw_varint(field << 3 | 5);
        self.0.extend(value.to_le_bytes());
    }

    fn bytes(&mut self, field: u64, value: &[u8]) {
        self.raw_varint(field << 3 | 2);
        self.raw_varint(value.len() as u64);
        self.0.extend(value);
    }

    fn message(&mut self, field: u64, fill: impl FnOnce(&mut Message)) {
        let mut inner = Message::default();
        fill(&mut inner);
        self.bytes(field, &inner.0);
    }

    fn raw_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }
}

/// The steps of the records with summaries in an event file, in order.
#[cfg(test)]
pub(super) fn scalar_steps(bytes: &[u8]) -> Vec<u64> {
    let step = |record: &[u8]| {
        // After the time (tag and eight bytes) follow the step's tag and varint, then the summary's tag.
        let varint = &record[10..];
        let length = varint.iter().position(|byte| byte & 0x80 == 0).unwrap() + 1;
        let digits = varint[..length].iter().rev();
        let value = digits.fold(0, |value, byte| value << 7 | u64::from(byte & 0x7f));
        (varint.get(length) == Some(&0x2a)).then_some(value)
    };
    tests::records(bytes).into_iter().filter_map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The messages in an event file, their framing verified.
    pub(super) fn records(bytes: &[u8]) -> Vec<&[u8]> {
        let mut rest = bytes;
        let mut records = Vec::new();
        while !rest.is_empty() {
            let (length, after) = rest.split_at(8);
            let (check, after) = after.split_at(4);
            assert_eq!(check, masked_crc(length));
            let (data, after) = after.split_at(u64::from_le_bytes(length.try_into().unwrap()) as usize);
            let (check, after) = after.split_at(4);
            assert_eq!(check, masked_crc(data));
            records.push(data);
            rest = after;
        }
        records
    }

    #[test]
    fn checksums_match_tensorflow() {
        // crc32c("123456789") = 0xe3069283 is the check value of the Castagnoli polynomial.
        assert_eq!(crc32c::crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(u32::from_le_bytes(masked_crc(b"123456789")), 0xc78a_b0e5);
    }

    #[test]
    fn numbers_use_the_shortest_varint() {
        let encoded = |value| {
            let mut message = Message::default();
            message.raw_varint(value);
            message.0
        };
        assert_eq!(encoded(0), [0]);
        assert_eq!(encoded(127), [127]);
        assert_eq!(encoded(300), [0xac, 0x02]);
        assert_eq!(encoded(u64::MAX).len(), 10);
    }

    #[test]
    fn scalar_event_has_the_expected_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = TensorBoardWriter::create(folder.path(), 1, 2.0).unwrap();
        writer.scalars(300, 2.0, &[("a/b", 1.0), ("c", f64::NAN)]).unwrap();
        let path = folder.path().join("events.out.tfevents.0000000002.mge.0000");
        let bytes = std::fs::read(path).unwrap();
        let [version, session, scalars] = records(&bytes)[..] else { panic!("three records") };
        let wall_time = [&[0x09][..], &2f64.to_le_bytes()].concat();
        assert_eq!(version, [&wall_time, &[0x10, 0, 0x1a, 13][..], b"brain.Event:2"].concat());
        assert_eq!(session, [&wall_time, &[0x10, 1, 0x3a, 2, 0x08, 1][..]].concat());
        let first = [&[0x0a, 10, 0x0a, 3][..], b"a/b", &[0x15], &1f32.to_le_bytes()].concat();
        let second = [&[0x0a, 8, 0x0a, 1][..], b"c", &[0x15], &f32::NAN.to_le_bytes()].concat();
        let head = [&wall_time, &[0x10, 0xac, 0x02, 0x2a, 22][..]].concat();
        assert_eq!(scalars, [head, first, second].concat());
    }

    #[test]
    fn a_resumed_run_starts_a_later_file() {
        let folder = tempfile::tempdir().unwrap();
        for first_step in [1, 11] {
            let mut writer = TensorBoardWriter::create(folder.path(), first_step, 5.0).unwrap();
            writer.text(0, 5.0, "config", "```json\n{}\n```").unwrap();
        }
        let mut names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["events.out.tfevents.0000000005.mge.0000", "events.out.tfevents.0000000005.mge.0001"]);
    }
}
