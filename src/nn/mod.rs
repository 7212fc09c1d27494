//! Networks on dfdx: fused multilayer perceptrons, resumable optimisers, weights on disk.
//!
//! - [`Mlp`]: a stack of dense layers whose parameters are one dfdx tensor on the
//!   [`dfdx::tensor::Cpu`]. A whole stack joins dfdx's tape as *one* operation.
//! - [`sum_of_branches`]: several such stacks side by side, their outputs summed by row.
//! - [`rows`]: the few differentiable row operations that graphs and critics need.
//! - [`Optimiser`]: Adam, SGD or RMSprop with a state that can be saved and restored.
//! - [`TensorFile`]: named tensors and text metadata as safetensors bytes.
//!
//! The module knows vectors only: a batch is a matrix with one sample a row. Nothing here draws
//! from dfdx's device generator, whose state cannot be saved.

mod branch;
mod error;
mod init;
mod kernel;
mod layer;
mod matrix;
mod mlp;
mod optimiser;
mod predict;
pub mod rows;
mod shape;
mod stack;
mod tensor_file;
#[cfg(test)]
mod tests;

pub use branch::{Branch, sum_of_branches};
pub use error::{NnError, TensorFileError};
pub use init::{Init, InitScheme};
pub use matrix::{Matrix, matrix};
pub use mlp::Mlp;
pub use optimiser::{Optimiser, OptimiserKind};
pub use shape::{Activation, MlpShape};
pub use tensor_file::TensorFile;
