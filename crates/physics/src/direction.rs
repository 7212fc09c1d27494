//! Unit vectors of angles.

use std::sync::LazyLock;

use rapier2d::prelude::{Rotation, Vector};

/// Angles at which CREATE builds its tools, in ascending order, with their cosines and sines as NumPy computes them:
/// measured by `python/benchmarks/directions.py`.
static MEASURED: LazyLock<Vec<[f64; 3]>> = LazyLock::new(|| {
    let row = |line: &str| {
        let mut numbers = line.split(',').map(|number| number.parse().expect("the table has only numbers"));
        std::array::from_fn(|_| numbers.next().expect("a row has three numbers"))
    };
    include_str!("../directions.csv").lines().skip(1).map(row).collect()
});

/// Unit vector of an angle: the numbers nearest to its cosine and sine, the same on every machine.
pub(super) fn direction(angle: f64) -> Vector {
    let (sin, cos) = pxfm::f_sincos(angle);
    Vector::new(cos, sin)
}

/// The rotation by an angle, as exact as its [`direction`].
pub(super) fn rotation(angle: f64) -> Rotation {
    let along = direction(angle);
    Rotation::from_cos_sin_unchecked(along.x, along.y)
}

/// Unit vector of a tool's angle. At the angles of CREATE's tools it is CREATE's, which is up to two units in the last
/// place away from [`direction`]: enough to change where the ball is some hundred steps later.
pub(super) fn tool_direction(angle: f64) -> Vector {
    match MEASURED.binary_search_by(|[measured, ..]| measured.total_cmp(&angle)) {
        Ok(row) => Vector::new(MEASURED[row][1], MEASURED[row][2]),
        Err(_) => direction(angle),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{NO_OP, ToolKind, catalogue_tool};

    #[test]
    fn directions_of_all_ramps_are_measured() {
        for tool in (0..NO_OP).filter_map(catalogue_tool).filter(|tool| tool.kind == ToolKind::Ramp) {
            assert!(MEASURED.iter().any(|row| row[0] == tool.angle), "{}", tool.angle);
        }
    }

    #[test]
    fn measured_directions_are_sorted_and_near_the_exact_ones() {
        assert!(MEASURED.is_sorted_by(|a, b| a[0] < b[0]));
        for &[angle, cos, sin] in MEASURED.iter() {
            assert!((direction(angle) - Vector::new(cos, sin)).length() <= 4e-16, "{angle}");
        }
    }
}
