//! TensorBoard's event files: TFRecord framing around protobuf `Event` messages.
//!
//! A record is `length: u64 LE, masked crc32c(length): u32 LE, data, masked crc32c(data): u32 LE`,
//! where masked means rotated right by 15 bits plus 0xa282ead8. The messages use a few fields of
//! TensorFlow's `event.proto` and `summary.proto` and are encoded by hand.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::append::AppendFile;
use super::{Result, RunError, folder};
use mge_base::json::{self, leaf_values};

/// The part of a file's name that tells ours from those of other programs.
const OURS: &str = ".mge.";

/// The records with which a file begins: its version, a mark after which readers discard all that they have read of
/// earlier files, and the configuration as hyperparameters. `wall_time` is in seconds since 1970-01-01 UTC, here and
/// below.
pub(super) fn beginning(wall_time: f64, config: &[u8]) -> Vec<u8> {
    let version = event(wall_time, 0, |event| event.bytes(3, b"brain.Event:2"));
    // SessionLog { status: START }
    let start = event(wall_time, 0, |event| event.message(7, |log| log.varint(1, 1)));
    let settings = |entry: &mut Message| {
        entry.bytes(1, b"_hparams_/session_start_info");
        // The plugin reads its data alone, but expects a tensor: a DT_FLOAT of shape [1].
        entry.message(8, |tensor| {
            tensor.varint(1, 1);
            tensor.message(2, |shape| shape.message(2, |dim| dim.varint(1, 1)));
            tensor.bytes(5, &[0; 4]);
        });
        entry.message(9, |metadata| {
            metadata.message(1, |data| {
                data.bytes(1, b"hparams");
                data.message(2, |data| data.message(3, |start| add_hyperparameters(start, config)));
            });
        });
    };
    let settings = event(wall_time, 0, |event| event.message(5, |summary| summary.message(1, settings)));
    [version, start, settings].concat()
}

/// The settings in `config.json`; of the task only its name.
fn add_hyperparameters(start: &mut Message, config: &[u8]) {
    let file: Value = serde_json::from_slice(config).unwrap_or_default();
    let settings = leaf_values(&file["config"]).into_iter();
    for (path, value) in settings.filter(|(path, _)| path == "task.name" || !path.starts_with("task.")) {
        start.message(1, |entry| {
            entry.bytes(1, path.as_bytes());
            entry.message(2, |of_entry| match value {
                Value::Number(number) => of_entry.double(2, number.as_f64().unwrap_or(f64::NAN)),
                Value::Bool(truth) => of_entry.varint(4, u64::from(*truth)),
                other => of_entry.bytes(3, json::text(other).as_bytes()),
            });
        });
    }
}

/// The record of numbers under their tags, such as `loss/critic`. TensorBoard stores them as `f32` and shows non-finite
/// ones as gaps.
pub(super) fn scalars(step: u64, wall_time: f64, values: &[(&str, f64)]) -> Vec<u8> {
    event(wall_time, step, |event| {
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

/// Starts a file in `folder`, which is created if necessary, and removes our earlier ones, which it replaces. An
/// existing file is never changed: TensorBoard may be reading it, and goes on with the next one.
pub(super) fn new_file(folder: &Path, wall_time: f64, content: &[u8]) -> Result<AppendFile> {
    folder::create(folder)?;
    let failed = || RunError::io("read", folder);
    let names = fs::read_dir(folder).map_err(failed())?.map(|entry| Ok(entry?.file_name()));
    let names = names.collect::<std::io::Result<Vec<_>>>().map_err(failed())?;
    let number = |name: &str| name.strip_prefix("events.out.tfevents.")?.split_once(OURS)?.1.parse::<u64>().ok();
    let earlier: Vec<_> =
        names.iter().filter_map(|name| name.to_str()).filter_map(|name| Some((number(name)?, name))).collect();
    let next = earlier.iter().map(|(number, _)| number + 1).max().unwrap_or(0);
    // Readers process the files in the order of their names.
    let name = format!("events.out.tfevents.{:010}{OURS}{next:04}", wall_time as u64);
    let file = AppendFile::anew(&folder.join(name), content)?;
    for (_, name) in earlier {
        let path = folder.join(name);
        fs::remove_file(&path).map_err(RunError::io("remove", &path))?;
    }
    Ok(file)
}

/// An `Event { wall_time = 1, step = 2, .. }` as one record.
fn event(wall_time: f64, step: u64, fill: impl FnOnce(&mut Message)) -> Vec<u8> {
    let mut event = Message::default();
    event.double(1, wall_time);
    event.varint(2, step);
    fill(&mut event);
    record(&event.0)
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
    fn records_have_the_expected_bytes() {
        let config = b"{\"format\": 1, \"config\": {\"task\": {\"name\": \"t\", \"ball\": 1}, \"seed\": 2}}\n";
        let bytes = [beginning(2.0, config), scalars(300, 2.0, &[("a/b", 1.0), ("c", f64::NAN)])].concat();
        let [version, session, settings, scalars] = records(&bytes)[..] else { panic!("four records") };
        let wall_time = [&[0x09][..], &2f64.to_le_bytes()].concat();
        assert_eq!(version, [&wall_time, &[0x10, 0, 0x1a, 13][..], b"brain.Event:2"].concat());
        assert_eq!(session, [&wall_time, &[0x10, 0, 0x3a, 2, 0x08, 1][..]].concat());
        let has = |record: &[u8], part: &[u8]| record.windows(part.len()).any(|found| found == part);
        let seed = [&[0x0a, 17, 0x0a, 4][..], b"seed", &[0x12, 9, 0x11], &2f64.to_le_bytes()].concat();
        let task = [&[0x0a, 16, 0x0a, 9][..], b"task.name", &[0x12, 3, 0x1a, 1], b"t"].concat();
        assert!(has(settings, &seed) && has(settings, &task) && !has(settings, b"format"), "{settings:?}");
        let first = [&[0x0a, 10, 0x0a, 3][..], b"a/b", &[0x15], &1f32.to_le_bytes()].concat();
        let second = [&[0x0a, 8, 0x0a, 1][..], b"c", &[0x15], &f32::NAN.to_le_bytes()].concat();
        let head = [&wall_time, &[0x10, 0xac, 0x02, 0x2a, 22][..]].concat();
        assert_eq!(scalars, [head, first, second].concat());
    }

    #[test]
    fn a_new_file_has_a_later_name_and_replaces_ours_alone() {
        let folder = tempfile::tempdir().unwrap();
        let others = ["events.out.tfevents.0000000005.host.0", "events.out.tfevents.0000000005.mge.mine", "notes"];
        others.iter().for_each(|name| fs::write(folder.path().join(name), "mine").unwrap());
        for number in 0..12 {
            drop(new_file(folder.path(), 5.0, b"content").unwrap());
            let names =
                fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
            let ours: Vec<_> = names.filter(|name| !others.contains(&name.as_str())).collect();
            assert_eq!(ours, [format!("events.out.tfevents.0000000005.mge.{number:04}")]);
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1 + others.len());
    }
}
