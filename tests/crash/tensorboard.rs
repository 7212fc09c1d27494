//! The numbers that TensorBoard shows of a run, without times.

use std::collections::BTreeMap;
use std::path::Path;

/// The numbers by step and tag. A file that starts again at a step replaces the numbers of earlier files from there on;
/// an incomplete record ends its file.
pub fn numbers(folder: &Path) -> BTreeMap<(u64, String), u32> {
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let mut numbers = BTreeMap::new();
    for file in files {
        for record in records(&std::fs::read(file).unwrap()) {
            let (mut step, mut summary, mut begins) = (0, &[][..], false);
            for (field, value) in fields(record) {
                match (field, value) {
                    (2, Value::Number(number)) => step = number,
                    (5, Value::Bytes(bytes)) => summary = bytes,
                    (7, _) => begins = true,
                    _ => {}
                }
            }
            if begins {
                numbers.retain(|(earlier, _), _| *earlier < step);
            }
            for (_, entry) in fields(summary) {
                let Value::Bytes(entry) = entry else { continue };
                let (mut tag, mut value) = (String::new(), None);
                for (field, part) in fields(entry) {
                    match (field, part) {
                        (1, Value::Bytes(text)) => tag = String::from_utf8(text.to_vec()).unwrap(),
                        (2, Value::Number(bits)) => value = Some(bits as u32),
                        _ => {}
                    }
                }
                if let Some(bits) = value.filter(|_| !tag.starts_with("time/")) {
                    numbers.insert((step, tag), bits);
                }
            }
        }
    }
    numbers
}

/// The complete records of a file.
fn records(mut bytes: &[u8]) -> Vec<&[u8]> {
    let mut records = Vec::new();
    while let Some(length) = bytes.first_chunk::<8>() {
        let length = u64::from_le_bytes(*length) as usize;
        let Some(data) = bytes.get(12..12 + length).filter(|_| bytes.len() >= 16 + length) else { break };
        records.push(data);
        bytes = &bytes[16 + length..];
    }
    records
}

enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
}

/// The fields of a protobuf message.
fn fields(mut bytes: &[u8]) -> Vec<(u64, Value<'_>)> {
    let mut fields = Vec::new();
    while !bytes.is_empty() {
        let key = varint(&mut bytes);
        let value = match key & 7 {
            0 => Value::Number(varint(&mut bytes)),
            1 => Value::Number(fixed(&mut bytes, 8)),
            5 => Value::Number(fixed(&mut bytes, 4)),
            2 => {
                let length = varint(&mut bytes) as usize;
                let (value, rest) = bytes.split_at(length);
                bytes = rest;
                Value::Bytes(value)
            }
            kind => panic!("wire type {kind}"),
        };
        fields.push((key >> 3, value));
    }
    fields
}

fn varint(bytes: &mut &[u8]) -> u64 {
    let mut value = 0;
    for shift in (0..).step_by(7) {
        let byte = bytes[0];
        *bytes = &bytes[1..];
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            break;
        }
    }
    value
}

fn fixed(bytes: &mut &[u8], count: usize) -> u64 {
    let (value, rest) = bytes.split_at(count);
    *bytes = rest;
    value.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}
