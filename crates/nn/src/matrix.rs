//! Batches as dfdx tensors.

use dfdx::tensor::{Cpu, NoneTape, Tensor, TensorFromVec};

/// A row-major matrix on the CPU, one sample per row.
pub type Matrix<T = NoneTape> = Tensor<(usize, usize), f32, Cpu, T>;

/// A matrix of `rows` × `columns` from its row-major `values`.
///
/// # Panics
/// If `values.len() != rows * columns`.
pub fn matrix(device: &Cpu, values: Vec<f32>, rows: usize, columns: usize) -> Matrix {
    assert_eq!(values.len(), rows * columns, "a {rows} x {columns} matrix");
    device.tensor_from_vec(values, (rows, columns))
}
