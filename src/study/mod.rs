//! Many runs: exploration counts, audits, the reproduction of the paper, reports.

pub mod audit;
pub mod hits;
