//! Many trainings: sweeps, the study of the paper, and generated puzzles.

#![deny(unsafe_code)]

pub mod puzzles;
pub mod study;
pub mod sweep;
