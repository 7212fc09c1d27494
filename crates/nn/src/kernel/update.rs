//! Element-wise updates of parameters: optimiser steps and the soft update of target networks.

use super::dispatch::{Kernel, LINE};
use super::simd::Simd;

/// How one vector of `N` states changes, given one vector of a read-only input.
pub(crate) trait Rule<const N: usize> {
    /// # Safety
    /// As for [`Kernel::run`]. Implementations are `#[inline(always)]`.
    unsafe fn step<S: Simd>(&self, state: [S::V; N], input: S::V) -> [S::V; N];
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
        let n = self.input.len();
        assert!(self.state.iter().all(|s| s.len() == n), "equal lengths");
        let whole = n / S::LANES * S::LANES;
        let state = self.state.each_mut().map(|s| s.as_mut_ptr());
        // SAFETY: all slices hold `n` floats, and `whole <= n` is whole vectors.
        unsafe {
            for i in (0..whole).step_by(S::LANES) {
                vector::<S, R, N>(&self.rule, state.map(|s| s.add(i)), self.input.as_ptr().add(i));
            }
        }
        if whole == n {
            return;
        }
        // The rest goes through padded copies.
        let mut input = [0.0; LINE];
        input[..n - whole].copy_from_slice(&self.input[whole..]);
        let mut rest = [[0.0; LINE]; N];
        for (rest, state) in rest.iter_mut().zip(&self.state) {
            rest[..n - whole].copy_from_slice(&state[whole..]);
        }
        // SAFETY: a line holds at least one vector.
        unsafe { vector::<S, R, N>(&self.rule, rest.each_mut().map(|r| r.as_mut_ptr()), input.as_ptr()) };
        for (rest, state) in rest.iter().zip(&mut self.state) {
            state[whole..].copy_from_slice(&rest[..n - whole]);
        }
    }
}

#[inline(always)]
unsafe fn vector<S: Simd, R: Rule<N>, const N: usize>(rule: &R, state: [*mut f32; N], input: *const f32) {
    // SAFETY: the caller's pointers are valid for one vector.
    unsafe {
        let mut values = [S::splat(0.0); N];
        for i in 0..N {
            values[i] = S::load(state[i]);
        }
        let values = rule.step::<S>(values, S::load(input));
        for i in 0..N {
            S::store(state[i], values[i]);
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
    unsafe fn step<S: Simd>(&self, [p, m, v]: [S::V; 3], g: S::V) -> [S::V; 3] {
        // SAFETY: by the contract of `Simd`.
        unsafe {
            let m = S::mul_add(S::splat(self.beta1), m, S::mul(S::splat(1.0 - self.beta1), g));
            let gg = S::mul(g, g);
            let v = S::mul_add(S::splat(self.beta2), v, S::mul(S::splat(1.0 - self.beta2), gg));
            let root = S::sqrt(S::mul(v, S::splat(self.square_correction)));
            let step = S::div(S::mul(S::splat(self.rate), m), S::add(root, S::splat(self.epsilon)));
            [S::sub(p, step), m, v]
        }
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
    unsafe fn step<S: Simd>(&self, [p, v]: [S::V; 2], g: S::V) -> [S::V; 2] {
        // SAFETY: by the contract of `Simd`.
        unsafe {
            let gg = S::mul(g, g);
            let v = S::mul_add(S::splat(self.alpha), v, S::mul(S::splat(1.0 - self.alpha), gg));
            let root = S::add(S::sqrt(v), S::splat(self.epsilon));
            [S::sub(p, S::div(S::mul(S::splat(self.rate), g), root)), v]
        }
    }
}

/// Plain gradient descent.
#[derive(Clone, Copy)]
pub(crate) struct Sgd {
    pub rate: f32,
}

impl Rule<1> for Sgd {
    #[inline(always)]
    unsafe fn step<S: Simd>(&self, [p]: [S::V; 1], g: S::V) -> [S::V; 1] {
        // SAFETY: by the contract of `Simd`.
        unsafe { [S::neg_mul_add(S::splat(self.rate), g, p)] }
    }
}

/// `target = (1 - tau) * target + tau * online`.
#[derive(Clone, Copy)]
pub(crate) struct Blend {
    pub tau: f32,
}

impl Rule<1> for Blend {
    #[inline(always)]
    unsafe fn step<S: Simd>(&self, [target]: [S::V; 1], online: S::V) -> [S::V; 1] {
        // SAFETY: by the contract of `Simd`.
        unsafe {
            let kept = S::mul(S::splat(1.0 - self.tau), target);
            [S::mul_add(S::splat(self.tau), online, kept)]
        }
    }
}
