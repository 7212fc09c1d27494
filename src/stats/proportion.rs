//! The uncertainty of a counted fraction.

use std::f64::consts::{PI, SQRT_2};

use super::bootstrap::{Estimate, check_confidence};
use super::{Result, StatsError};

/// Wilson's score interval of `hits` in `trials`. Unlike the textbook interval it has a width at 0
/// and at all, and never leaves [0, 1]: the right one for rare hits.
///
/// # Errors
/// [`StatsError::Empty`] for no trials, [`StatsError::Hits`] for more hits than trials,
/// [`StatsError::Confidence`].
pub fn wilson_interval(hits: u64, trials: u64, confidence: f64) -> Result<Estimate> {
    check_confidence(confidence)?;
    if trials == 0 {
        return Err(StatsError::Empty("trials"));
    }
    if hits > trials {
        return Err(StatsError::Hits { hits, trials });
    }
    let n = trials as f64;
    let p = hits as f64 / n;
    let z = normal_deviate(confidence);
    let scale = 1.0 + z * z / n;
    let centre = (p + z * z / (2.0 * n)) / scale;
    let half = z / scale * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    // At the two ends the interval touches p exactly; rounding must not move it.
    let lower = if hits == 0 { 0.0 } else { centre - half };
    let upper = if hits == trials { 1.0 } else { centre + half };
    Ok(Estimate { value: p, lower, upper })
}

/// The z with a probability of `confidence` between -z and z of the standard normal distribution.
fn normal_deviate(confidence: f64) -> f64 {
    let outside = 1.0 - confidence;
    // Newton's method from 0: erfc is convex there, so every step stays below the solution. It
    // takes about a step per unit of z in the far tail, where z is at most 8.3 for an f64.
    let mut z = 0.0f64;
    for _ in 0..100 {
        let density = (2.0 / PI).sqrt() * (-z * z / 2.0).exp();
        let step = (libm::erfc(z / SQRT_2) - outside) / density;
        z += step;
        if step.abs() < 1e-15 * z.max(1.0) {
            break;
        }
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(hits: u64, trials: u64, confidence: f64, lower: f64, upper: f64) {
        let found = wilson_interval(hits, trials, confidence).unwrap();
        assert!((found.lower - lower).abs() < 1e-12, "{found:?} {lower}");
        assert!((found.upper - upper).abs() < 1e-12, "{found:?} {upper}");
        assert!(found.lower <= found.value && found.value <= found.upper);
    }

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: stats.binomtest(hits, trials).proportion_ci(confidence, method="wilson")
        check(5, 10, 0.95, 0.236593090512564, 0.7634069094874361);
        check(0, 1000, 0.95, 0.0, 0.0038267584855551234);
        check(1000, 1000, 0.95, 0.9961732415144449, 1.0);
        check(1, 1000, 0.99, 0.00011741635361832165, 0.008460566219981695);
        check(372, 926, 0.9, 0.37555176495190234, 0.4284765395168154);
    }

    #[test]
    fn normal_deviates_agree_with_scipy() {
        // scipy 1.17.1: stats.norm.ppf of (1 + confidence) / 2
        let pairs = [
            (0.2, 0.2533471031357997),
            (0.8, 1.2815515655446004),
            (0.95, 1.959963984540054),
            (0.99, 2.5758293035489004),
            (0.999998, 4.753424308817087),
        ];
        for (confidence, z) in pairs {
            assert!((normal_deviate(confidence) - z).abs() < 1e-9, "{confidence}");
        }
    }

    #[test]
    fn wrong_counts_are_refused() {
        assert_eq!(wilson_interval(0, 0, 0.95), Err(StatsError::Empty("trials")));
        assert_eq!(wilson_interval(2, 1, 0.95), Err(StatsError::Hits { hits: 2, trials: 1 }));
        assert_eq!(wilson_interval(1, 1, 95.0), Err(StatsError::Confidence(95.0)));
    }
}
