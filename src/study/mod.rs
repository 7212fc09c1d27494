//! Many runs: exploration counts, sweeps, the reproduction of the paper, reports.

pub mod hits;
