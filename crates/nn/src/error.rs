//! What can go wrong with networks, optimisers and their files.

use thiserror::Error;

/// A network or an optimiser cannot do what was asked.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum NnError {
    /// The sizes do not describe a stack of layers.
    #[error("network sizes {sizes:?} are not usable: give inputs, hidden sizes and outputs, all at least 1")]
    Shape {
        /// The sizes as given.
        sizes: Vec<usize>,
    },
    /// A gradient is infinite or not a number; no parameter was changed.
    #[error("the gradient is not finite (norm {norm}): the loss has diverged; use a smaller learning rate")]
    NotFinite {
        /// Euclidean norm over all gradients: infinite or NaN.
        norm: f64,
    },
    /// An optimiser was used with networks other than those it was created for.
    #[error("the optimiser holds state for {expected} parameters, the networks have {found}")]
    OptimiserMismatch {
        /// Parameters the optimiser was created for.
        expected: usize,
        /// Parameters of the networks given.
        found: usize,
    },
    /// Not enough memory for gradients.
    #[error("out of memory for gradients: use a smaller network or batch")]
    OutOfMemory,
}

impl From<dfdx::tensor::CpuError> for NnError {
    fn from(_: dfdx::tensor::CpuError) -> Self {
        // The only error of dfdx's CPU device when it allocates buffers of known shapes.
        Self::OutOfMemory
    }
}

/// A tensor file cannot be read or lacks something that is needed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TensorFileError {
    /// The bytes are not a safetensors file.
    #[error("not a safetensors file ({reason}): choose another file")]
    NotSafetensors {
        /// What the reader found.
        reason: String,
    },
    /// The file is shorter or longer than its header says.
    #[error("the tensor file is truncated or damaged: {reason}; restore it or train again")]
    Damaged {
        /// What the reader found.
        reason: String,
    },
    /// A tensor is missing, or does not have the expected shape, type or values.
    #[error("tensor `{name}` {problem}")]
    Tensor {
        /// Name of the tensor.
        name: String,
        /// The problem, as a predicate: "is missing".
        problem: String,
    },
    /// A metadata entry is missing or cannot be read.
    #[error("metadata entry `{key}` is missing or not valid: {reason}")]
    Metadata {
        /// Name of the entry.
        key: String,
        /// What the reader found.
        reason: String,
    },
}
