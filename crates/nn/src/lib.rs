//! Networks on dfdx: fused multilayer perceptrons, resumable optimisers, weights on disk.
//!
//! - [`Mlp`]: a stack of dense layers whose parameters are one dfdx tensor on the
//!   [`dfdx::tensor::Cpu`]. A whole stack is *one* operation on dfdx's tape.
//! - [`sum_of_branches`]: several such stacks in parallel, their outputs summed by row.
//! - [`concat_columns`]: two matrices side by side, as graphs and critics need them.
//! - [`Optimiser`]: Adam, SGD or RMSprop with a state that can be saved and restored.
//! - [`TensorFile`]: named tensors and text metadata as safetensors bytes.
//!
//! The module handles plain vectors: a batch is a matrix with one sample per row. Nothing here
//! draws from dfdx's device generator, whose state cannot be saved.
//!
//! ```
//! use mge_nn::{Activation, InitScheme, Mlp, MlpShape, TensorFile};
//! use rand::SeedableRng;
//!
//! let shape = MlpShape::uniform(3, 64, 2, 4, Activation::Tanh);
//! let network = Mlp::new(shape.clone(), InitScheme::Orthogonal, &mut rand_chacha::ChaCha8Rng::seed_from_u64(0))?;
//! let mut file = TensorFile::default();
//! network.save(&mut file, "actor");
//! let loaded = Mlp::load(shape, &TensorFile::from_bytes(&file.to_bytes())?, "actor")?;
//!
//! let (x, mut before, mut after) = ([0.1; 6], Vec::new(), Vec::new());
//! network.predict_into(&x, 2, &mut before);
//! loaded.predict_into(&x, 2, &mut after);
//! assert_eq!(before, after);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Division of work with dfdx
//! dfdx provides tensors, tape, gradients, losses and element-wise operations. This module adds what
//! dfdx lacks and what is measurably faster here (on one core, AVX2 or AVX-512;
//! `cargo bench --bench work` times complete training steps):
//!
//! - **Fused stacks.** A training step of 17 layers of 64 on 128 rows takes 2.6 ms with dfdx's own
//!   operations, of which 1.9 ms are a scalar `tanh` and the rest mostly copies between layers; as
//!   one operation with vectorised kernels it takes a quarter of that.
//! - **Instruction set chosen at run time.** Without FMA the same kernels take twice as long, and a
//!   portable program cannot assume it.
//! - **Optimisers.** dfdx's optimisers keep their moments private, so training could not be resumed
//!   bit for bit.
//! - **Zero columns skipped in the first layer.** Much of an observation is padding; skipping it
//!   makes training a quarter faster with identical results.
//! - **Reused workspaces, and parameters in the kernels' layout.** See their types.

#![deny(unsafe_code)]

mod active;
mod branch;
mod concat;
mod error;
mod init;
mod kernel;
mod layer;
mod matrix;
mod mlp;
mod optimiser;
mod shape;
mod stack;
mod tensor_file;
#[cfg(test)]
mod tests;

pub use branch::{Branch, sum_of_branches};
pub use concat::{concat_columns, join_rows};
pub use error::{NnError, TensorFileError};
pub use init::{Init, InitScheme};
pub use matrix::{Matrix, matrix};
pub use mlp::Mlp;
pub use optimiser::{Optimiser, OptimiserKind};
pub use shape::{Activation, MlpShape};
pub use tensor_file::TensorFile;

/// The kind of this processor: results of networks on another kind differ in the last bits.
pub fn processor() -> String {
    format!("{} {}", std::env::consts::ARCH, kernel::Level::best().name())
}
