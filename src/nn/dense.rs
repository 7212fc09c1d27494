//! Arithmetic of one dense layer on row-major slices: `y = f(x W + b)`.

use gemm::{Parallelism, gemm};

use super::Activation;

/// `c (m × n) = [c +] a (m × k) · b (k × n)`; strides are (row, column).
#[allow(clippy::too_many_arguments)]
fn multiply(
    (m, k, n): (usize, usize, usize),
    a: &[f32],
    a_strides: (isize, isize),
    b: &[f32],
    b_strides: (isize, isize),
    c: &mut [f32],
    accumulate: bool,
) {
    assert!(a.len() >= m * k && b.len() >= k * n && c.len() >= m * n);
    // SAFETY: the slices hold all elements that the strides reach: both operands are dense
    // matrices, transposed or not, of the sizes just asserted.
    unsafe {
        gemm(
            m,
            n,
            k,
            c.as_mut_ptr(),
            1,
            n as isize,
            accumulate,
            a.as_ptr(),
            a_strides.1,
            a_strides.0,
            b.as_ptr(),
            b_strides.1,
            b_strides.0,
            1.0,
            1.0,
            false,
            false,
            false,
            Parallelism::None,
        );
    }
}

/// `y = f(x w + b)`.
pub(super) fn forward(
    (rows, inputs, outputs): (usize, usize, usize),
    x: &[f32],
    weight: &[f32],
    bias: &[f32],
    activation: Activation,
    y: &mut [f32],
) {
    for row in y.chunks_exact_mut(outputs) {
        row.copy_from_slice(bias);
    }
    multiply((rows, inputs, outputs), x, (inputs as isize, 1), weight, (outputs as isize, 1), y, true);
    match activation {
        Activation::Identity => {}
        // `z.max(0.0)` would turn NaN into 0 and hide a diverged network.
        Activation::Relu => y.iter_mut().for_each(|z| {
            if *z < 0.0 {
                *z = 0.0
            }
        }),
        Activation::Tanh => y.iter_mut().for_each(|z| *z = z.tanh()),
    }
}

/// Turns dL/dy into dL/dz, given `y = f(z)`.
pub(super) fn activation_backward(activation: Activation, y: &[f32], dy: &mut [f32]) {
    match activation {
        Activation::Identity => {}
        Activation::Relu => dy.iter_mut().zip(y).for_each(|(d, y)| {
            if *y <= 0.0 {
                *d = 0.0
            }
        }),
        Activation::Tanh => dy.iter_mut().zip(y).for_each(|(d, y)| *d *= 1.0 - y * y),
    }
}

/// `dw += xᵀ dz`.
pub(super) fn weight_gradient((rows, inputs, outputs): (usize, usize, usize), x: &[f32], dz: &[f32], dw: &mut [f32]) {
    multiply((inputs, rows, outputs), x, (1, inputs as isize), dz, (outputs as isize, 1), dw, true);
}

/// `db += column sums of dz`.
pub(super) fn bias_gradient(outputs: usize, dz: &[f32], db: &mut [f32]) {
    for row in dz.chunks_exact(outputs) {
        db.iter_mut().zip(row).for_each(|(d, z)| *d += z);
    }
}

/// `dx = dz wᵀ`.
pub(super) fn input_gradient(
    (rows, inputs, outputs): (usize, usize, usize),
    dz: &[f32],
    weight: &[f32],
    dx: &mut [f32],
) {
    multiply((rows, outputs, inputs), dz, (outputs as isize, 1), weight, (1, outputs as isize), dx, false);
}
