//! Named tensors and text metadata as safetensors bytes.

use std::{
    borrow::Cow,
    collections::{BTreeMap, HashMap},
};

use safetensors::{Dtype, SafeTensorError, SafeTensors, View, serialize};
use serde::de::DeserializeOwned;

use super::TensorFileError;

/// Named 32-bit floating-point tensors with text metadata: the content of a safetensors file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TensorFile {
    /// Text by key: what the tensors are and how they were made.
    pub metadata: BTreeMap<String, String>,
    tensors: BTreeMap<String, Entry>,
}

#[derive(Clone, Debug, PartialEq)]
struct Entry {
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl TensorFile {
    /// Adds or replaces a tensor with row-major `values`.
    ///
    /// # Panics
    /// If the number of values does not match the shape.
    pub fn insert(&mut self, name: String, shape: Vec<usize>, values: Vec<f32>) {
        assert_eq!(shape.iter().product::<usize>(), values.len(), "values of `{name}`");
        self.tensors.insert(name, Entry { shape, values });
    }

    /// Values of the tensor `name`, which must have this shape.
    ///
    /// # Errors
    /// When it is missing, has another shape, or contains an infinity or NaN.
    pub fn get(&self, name: &str, shape: &[usize]) -> Result<&[f32], TensorFileError> {
        let wrong = |problem: String| Err(TensorFileError(format!("tensor `{name}` {problem}")));
        let Some(entry) = self.tensors.get(name) else {
            return wrong("is missing: the file belongs to another network".to_owned());
        };
        if entry.shape != shape {
            let found = &entry.shape;
            return wrong(format!("has shape {found:?}, expected {shape:?}: the file belongs to another network"));
        }
        if entry.values.iter().any(|v| !v.is_finite()) {
            return wrong("holds a value that is not finite: the file cannot be used".to_owned());
        }
        Ok(&entry.values)
    }

    /// The metadata `key`, parsed from JSON.
    ///
    /// # Errors
    /// When it is missing or is not a `T`.
    pub fn json<T: DeserializeOwned>(&self, key: &str) -> Result<T, TensorFileError> {
        let invalid = |reason: String| invalid_metadata(key, &reason);
        let text = self.metadata.get(key).ok_or_else(|| invalid("it is missing".to_owned()))?;
        serde_json::from_str(text).map_err(|error| invalid(error.to_string()))
    }

    /// The safetensors bytes; equal content gives equal bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        // One entry at most: the format's own metadata map has no order, so the bytes would vary.
        let metadata = (!self.metadata.is_empty()).then(|| {
            let mut metadata = self.metadata.clone();
            metadata.insert(CHECKSUM_KEY.to_owned(), self.checksum());
            let text = serde_json::json!(metadata).to_string();
            HashMap::from([(METADATA_KEY.to_owned(), text)])
        });
        // Fails only if the header cannot be written as JSON or sizes do not match: names are
        // strings, and `insert` has checked the sizes.
        serialize(self.tensors.iter(), &metadata).expect("checked tensors")
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// When the bytes are foreign, truncated or damaged, or a tensor is not of 32-bit floats.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TensorFileError> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(read_error)?;
        let metadata = match header.metadata().as_ref().and_then(|m| m.get(METADATA_KEY)) {
            None => BTreeMap::new(),
            Some(text) => serde_json::from_str(text).map_err(|error| invalid_metadata(METADATA_KEY, &error))?,
        };
        let mut file = Self { metadata, tensors: BTreeMap::new() };
        let content = SafeTensors::deserialize(bytes).map_err(read_error)?;
        for (name, view) in content.tensors() {
            if view.dtype() != Dtype::F32 {
                let found = view.dtype();
                return Err(TensorFileError(format!("tensor `{name}` has element type {found:?}, expected F32")));
            }
            let values = view.data().chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            file.tensors.insert(name, Entry { shape: view.shape().to_vec(), values });
        }
        // Files of other programs may have none.
        let [of_all, of_values] = [CHECKSUM_KEY, VALUES_KEY].map(|key| file.metadata.remove(key));
        let differs = of_all.is_some_and(|checksum| checksum != file.checksum())
            || of_values.is_some_and(|checksum| checksum != file.checksum_from(0));
        if differs {
            return Err(damaged("its checksum differs"));
        }
        Ok(file)
    }

    /// CRC-32C of the whole content, in hexadecimal: the metadata, the names and shapes of the tensors, and all values.
    fn checksum(&self) -> String {
        let shapes: BTreeMap<&String, &Vec<usize>> =
            self.tensors.iter().map(|(name, entry)| (name, &entry.shape)).collect();
        self.checksum_from(crc32c::crc32c(serde_json::json!([self.metadata, shapes]).to_string().as_bytes()))
    }

    /// The checksum `before` continued over all values, in the order of the tensors' names.
    fn checksum_from(&self, before: u32) -> String {
        let append = |checksum, entry: &Entry| crc32c::crc32c_append(checksum, &entry.data());
        format!("{:08x}", self.tensors.values().fold(before, append))
    }
}

const METADATA_KEY: &str = "mge";
const CHECKSUM_KEY: &str = "crc32c";
/// In files of earlier versions: the checksum of the values only.
const VALUES_KEY: &str = "checksum";

fn read_error(error: SafeTensorError) -> TensorFileError {
    match error {
        SafeTensorError::MetadataIncompleteBuffer
        | SafeTensorError::InvalidHeaderLength
        | SafeTensorError::HeaderTooSmall => damaged("its length does not fit its header"),
        SafeTensorError::InvalidOffset(name) => damaged(&format!("tensor `{name}` lies outside the file")),
        other => TensorFileError(format!("not a safetensors file ({other:?}): choose another file")),
    }
}

fn damaged(reason: &str) -> TensorFileError {
    TensorFileError(format!("the tensor file is truncated or damaged: {reason}; restore it or train again"))
}

/// A metadata entry is missing or not valid.
pub(super) fn invalid_metadata(key: &str, reason: &dyn std::fmt::Display) -> TensorFileError {
    TensorFileError(format!("metadata entry `{key}` is missing or not valid: {reason}"))
}

impl View for &Entry {
    fn dtype(&self) -> Dtype {
        Dtype::F32
    }

    fn shape(&self) -> &[usize] {
        &self.shape
    }

    fn data(&self) -> Cow<'_, [u8]> {
        if cfg!(target_endian = "little") {
            // Without a copy: copying large networks takes a while and would delay the end of a training.
            return bytemuck::cast_slice(&self.values).into();
        }
        self.values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>().into()
    }

    fn data_len(&self) -> usize {
        self.values.len() * 4
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> TensorFile {
        let mut file = TensorFile::default();
        file.metadata.insert("kind".into(), "test \"quoted\"".into());
        file.metadata.insert("version".into(), "1".into());
        file.insert("b".into(), vec![2, 3], vec![1.0, -2.5, 3e-20, 4.0, 5.0, f32::MIN]);
        file.insert("a".into(), vec![1], vec![0.1]);
        file
    }

    #[test]
    fn bytes_round_trip() {
        let bytes = file().to_bytes();
        assert_eq!(TensorFile::from_bytes(&bytes).unwrap(), file());
        assert_eq!(file().to_bytes(), bytes, "equal content, equal bytes");
        assert_eq!(file().tensors.keys().collect::<Vec<_>>(), ["a", "b"]);
        let empty = TensorFile::default();
        assert_eq!(TensorFile::from_bytes(&empty.to_bytes()).unwrap(), empty);
    }

    #[test]
    fn every_truncation_is_refused() {
        let bytes = file().to_bytes();
        for n in 0..bytes.len() {
            let error = TensorFile::from_bytes(&bytes[..n]).unwrap_err();
            assert!(error.to_string().contains("truncated or damaged"), "{n}: {error}");
        }
        let mut flipped = bytes.clone();
        *flipped.last_mut().unwrap() ^= 1;
        let error = TensorFile::from_bytes(&flipped).unwrap_err();
        assert!(error.to_string().contains("checksum"), "{error}");
        let mut longer = bytes;
        longer.push(0);
        let error = TensorFile::from_bytes(&longer).unwrap_err();
        assert!(error.to_string().contains("truncated or damaged"), "{error}");
    }

    #[test]
    fn changed_metadata_is_refused() {
        let bytes = file().to_bytes();
        let changed = |from: &str, to: &str| {
            let place = bytes.windows(from.len()).position(|bytes| bytes == from.as_bytes()).unwrap();
            TensorFile::from_bytes(&[&bytes[..place], to.as_bytes(), &bytes[place + from.len()..]].concat())
        };
        for (from, to) in [("quoted", "quated"), ("version", "fersion"), (r#""a":"#, r#""c":"#), ("[2,3]", "[3,2]")] {
            assert_eq!(changed(from, to), Err(damaged("its checksum differs")), "{from}");
        }
    }

    #[test]
    fn files_of_earlier_versions_have_a_checksum_of_the_values_only() {
        let with = |checksum: String| {
            let file = file();
            let mut metadata = file.metadata.clone();
            metadata.insert("checksum".to_owned(), checksum);
            let metadata = HashMap::from([(METADATA_KEY.to_owned(), serde_json::json!(metadata).to_string())]);
            TensorFile::from_bytes(&serialize(file.tensors.iter(), &Some(metadata)).unwrap())
        };
        assert_eq!(with(file().checksum_from(0)).unwrap(), file());
        assert_eq!(with(file().checksum()), Err(damaged("its checksum differs")));
    }

    #[test]
    fn foreign_bytes_are_refused() {
        for bytes in [&b"{\"version\": 1, \"name\": \"a task\"}"[..], &[0xff; 64], &[0; 64]] {
            let error = TensorFile::from_bytes(bytes).unwrap_err();
            assert!(error.to_string().contains("not a safetensors file"), "{error}");
        }
    }

    #[test]
    fn tensors_that_do_not_fit_are_refused() {
        let mut file = file();
        file.insert("nan".into(), vec![2], vec![0.0, f32::NAN]);
        let file = TensorFile::from_bytes(&file.to_bytes()).unwrap();
        assert_eq!(file.get("a", &[1]).unwrap(), [0.1]);
        for (name, shape, message) in [
            ("c", &[1][..], "tensor `c` is missing"),
            ("b", &[3, 2], "tensor `b` has shape [2, 3], expected [3, 2]"),
            ("nan", &[2], "tensor `nan` holds a value that is not finite"),
        ] {
            let error = file.get(name, shape).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }

    #[test]
    fn other_number_types_are_refused() {
        let text = r#"{"x":{"dtype":"I32","shape":[1],"data_offsets":[0,4]}}"#;
        let mut bytes = (text.len() as u64).to_le_bytes().to_vec();
        bytes.extend(text.bytes());
        bytes.extend([0; 4]);
        let error = TensorFile::from_bytes(&bytes).unwrap_err();
        assert!(error.to_string().contains("has element type I32"), "{error}");
    }
}
