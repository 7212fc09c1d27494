//! `mge reproduce` and `mge bench`.
use super::Outcome;
use super::arguments::{Bench, Reproduce};

pub fn reproduce(_: &Reproduce) -> Outcome {
    Err("x".into())
}

pub fn bench(_: &Bench) -> Outcome {
    Err("x".into())
}
