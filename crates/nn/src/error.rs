//! Errors of networks, optimisers and tensor files. Their messages are for users.

use thiserror::Error;

/// Why a network or an optimiser could not be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum NnError {
    /// It cannot be made, or not be used with another, for the reason that the text gives.
    #[error("{0}")]
    Unusable(String),
    /// The gradient holds an infinity or NaN, so a step would destroy the network.
    #[error("the gradient is not finite (norm {norm}): the loss has diverged; use a smaller learning rate")]
    NotFinite {
        /// Norm of the gradient.
        norm: f64,
    },
}

impl From<dfdx::tensor::CpuError> for NnError {
    fn from(_: dfdx::tensor::CpuError) -> Self {
        // The only error of dfdx's CPU device when it allocates buffers of known shapes.
        Self::Unusable("out of memory for gradients: use a smaller network or batch".to_owned())
    }
}

/// Why a tensor file cannot be read, or does not hold what is expected.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{0}")]
pub struct TensorFileError(pub String);
