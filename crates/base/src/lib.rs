//! What every other crate needs: files, texts, checks and random streams.
//!
//! - [`atomic`], [`bounded`], [`paths`], [`sync`]: a file is replaced whole or not at all; a user's file is read up to a
//!   limit, and replaced only if it has the expected format; paths as people write them; locks.
//! - [`json`], [`validation`], [`spelling`]: errors that name file, line, value and the probable spelling.
//! - [`text`], [`markdown`], [`table`]: external text that is harmless on a terminal, in Markdown and in a spreadsheet.
//! - [`streams`]: one random stream for each purpose, so that a seed gives the same bytes everywhere.
//! - [`stop`]: the stop request polled by long computations. [`identity`]: what a result depends on.
//!
//! It depends on no other crate of the workspace.
//!
//! ```
//! use mge_base::{json, spelling, streams::Stream};
//! use rand::Rng;
//!
//! let error = json::parse::<Vec<f64>>(b"[1,\n \"two\"]", "sizes.json").unwrap_err();
//! assert!(error.to_string().starts_with("sizes.json:2:"));
//! assert_eq!(spelling::nearest(["bucket", "floor"], "bukcet"), Some("bucket"));
//! let draw = || Stream::Episode.of(7).r#gen::<f64>();
//! assert_eq!(draw(), draw());
//! ```

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
