//! Element-wise updates of parameters: optimiser steps and the soft update of target networks.

use super::dispatch::Kernel;
use super::simd::{Simd, mul_add};

/// How `N` states of a parameter change, given a read-only input.
pub(crate) trait Rule<const N: usize> {
    /// Implementations are `#[inline(always)]`.
    fn step<S: Simd>(&self, state: [f32; N], input: f32) -> [f32; N];
}

/// Applies `rule` to all elements of slices of equal, arbitrary length.
pub(crate) struct Update<'a, R, const N: usize> {
    pub rule: R,
    pub state: [&'a mut [f32]; N],
    pub input: &'a [f32],
}

impl<R: Rule<N>, const N: usize> Kernel for Update<'_, R, N> {
    type Output = ();

    #[inline(always)]
    unsafe fn run<S: Simd>(mut self) {
        let mut states = self.state.each_mut().map(|state| &mut state[..self.input.len()]);
        for (i, input) in self.input.iter().enumerate() {
            let changed = self.rule.step::<S>(states.each_ref().map(|state| state[i]), *input);
            for (state, changed) in states.iter_mut().zip(changed) {
                state[i] = changed;
            }
        }
    }
}

/// Adam (Kingma and Ba, 2015) on parameter, mean and mean square; the input is the gradient.
#[derive(Clone, Copy)]
pub(crate) struct Adam {
    pub beta1: f32,
    pub beta2: f32,
    pub epsilon: f32,
    /// Learning rate / (1 - β₁ᵗ)
    pub rate: f32,
    /// 1 / (1 - β₂ᵗ)
    pub square_correction: f32,
}

impl Rule<3> for Adam {
    #[inline(always)]
    fn step<S: Simd>(&self, [p, m, v]: [f32; 3], g: f32) -> [f32; 3] {
        let m = mul_add::<S>(self.beta1, m, (1.0 - self.beta1) * g);
        let v = mul_add::<S>(self.beta2, v, (1.0 - self.beta2) * (g * g));
        let root = (v * self.square_correction).sqrt();
        [p - self.rate * m / (root + self.epsilon), m, v]
    }
}

/// RMSprop (Tieleman and Hinton, 2012) on parameter and mean square.
#[derive(Clone, Copy)]
pub(crate) struct RmsProp {
    pub alpha: f32,
    pub epsilon: f32,
    pub rate: f32,
}

impl Rule<2> for RmsProp {
    #[inline(always)]
    fn step<S: Simd>(&self, [p, v]: [f32; 2], g: f32) -> [f32; 2] {
        let v = mul_add::<S>(self.alpha, v, (1.0 - self.alpha) * (g * g));
        [p - self.rate * g / (v.sqrt() + self.epsilon), v]
    }
}

/// Plain gradient descent.
#[derive(Clone, Copy)]
pub(crate) struct Sgd {
    pub rate: f32,
}

impl Rule<1> for Sgd {
    #[inline(always)]
    fn step<S: Simd>(&self, [p]: [f32; 1], g: f32) -> [f32; 1] {
        [mul_add::<S>(-self.rate, g, p)]
    }
}

/// `target = (1 - tau) * target + tau * online`.
#[derive(Clone, Copy)]
pub(crate) struct Blend {
    pub tau: f32,
}

impl Rule<1> for Blend {
    #[inline(always)]
    fn step<S: Simd>(&self, [target]: [f32; 1], online: f32) -> [f32; 1] {
        [mul_add::<S>(self.tau, online, (1.0 - self.tau) * target)]
    }
}
