//! What every other crate needs: atomic file writes, bounded reads, JSON with locations, validation, text, random streams.

#![deny(unsafe_code)]

pub mod atomic;
pub mod bounded;
pub mod identity;
pub mod json;
pub mod markdown;
pub mod paths;
pub mod spelling;
pub mod stop;
pub mod streams;
pub mod sync;
pub mod table;
pub mod text;
pub mod validation;
