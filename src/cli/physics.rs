//! `mge simulate`: physics without tasks.

use std::io;

use super::Outcome;

pub fn simulate() -> Outcome {
    Ok(crate::physics::simulate(io::stdin().lock(), io::BufWriter::new(io::stdout().lock()))?)
}
