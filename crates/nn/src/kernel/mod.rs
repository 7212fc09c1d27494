//! The networks' arithmetic on slices, vectorised for the processor detected at run time.
//!
//! Matrices are row-major with rows padded to whole [`LINE`]s, so that matrix kernels need no
//! remainder loops. The instruction set (AVX-512, AVX2 with FMA, or plain Rust) is chosen once;
//! results depend on it in the last bits, but never on the number of threads or on how rows are
//! grouped.

#![allow(unsafe_code, reason = "vector instructions, and memory aligned for them")]
#![deny(clippy::undocumented_unsafe_blocks)]

mod buffer;
mod dispatch;
mod elementwise;
mod normalise;
mod product;
mod simd;
#[cfg(test)]
mod tests;
mod update;

pub(super) use buffer::Buffer;
pub(super) use dispatch::{Kernel, LINE, Level, padded};
pub(super) use elementwise::{ColumnSums, Derivative, SumOfSquares, Transpose};
pub(super) use normalise::{Normalise, NormaliseGradient};
pub(super) use product::{Epilogue, Product, Start};
pub(super) use update::{Adam, Blend, RmsProp, Rule, Sgd, Update};
