//! Compares every kernel, on every instruction set of this processor, with plain `f64` arithmetic.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::dispatch::Level;
use super::*;
use crate::Activation;

fn levels() -> impl Iterator<Item = Level> {
    Level::ALL.into_iter().filter(|level| level.is_available())
}

fn random(n: usize, seed: u64) -> Vec<f32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| rng.gen_range(-1.0..1.0)).collect()
}

fn close(found: f32, expected: f64, tolerance: f64, what: &str) {
    let scale = expected.abs().max(1.0);
    let error = (f64::from(found) - expected).abs();
    assert!(error <= tolerance * scale, "{what}: {found}, expected {expected}");
}

#[test]
fn products_agree_with_plain_sums() {
    // Sizes that need every tile height and width, and depths of one to three blocks.
    for (rows, depth, columns) in [(1, 1, 16), (23, 5, 112), (6, 96, 64), (13, 97, 32), (9, 250, 48)] {
        for transposed in [false, true] {
            for start in 0..3 {
                for level in levels() {
                    check_product((rows, depth, columns), transposed, start, level);
                }
            }
        }
    }
}

fn check_product((rows, depth, columns): (usize, usize, usize), transposed: bool, start: usize, level: Level) {
    let (a, b) = (random(rows * depth, 1), random(depth * columns, 2));
    let (row, before) = (random(columns, 3), random(rows * columns, 4));
    let (a_row, a_depth) = if transposed { (1, rows) } else { (depth, 1) };
    let mut c = before.clone();
    Product {
        rows,
        depth,
        columns,
        a: &a,
        a_row,
        a_depth,
        b: &b,
        b_row: columns,
        start: [Start::Zero, Start::Row(&row), Start::Accumulate][start],
        c: &mut c,
        c_row: columns,
        epilogue: Epilogue::Activate(Activation::Relu),
    }
    .execute_at(level);
    for i in 0..rows {
        for j in 0..columns {
            let mut sum = f64::from([0.0, row[j], before[i * columns + j]][start]);
            for p in 0..depth {
                sum += f64::from(a[i * a_row + p * a_depth]) * f64::from(b[p * columns + j]);
            }
            close(c[i * columns + j], sum.max(0.0), 1e-5, &format!("{level:?} ({i}, {j})"));
        }
    }
}

#[test]
fn slices_that_are_too_short_are_rejected_before_any_access() {
    let product = |a: usize, b: usize, start: usize, c: usize, y: usize| {
        let (a, b, start, y, mut c) = (vec![0.0; a], vec![0.0; b], vec![0.0; start], vec![0.0; y], vec![0.0; c]);
        let epilogue = Epilogue::Derivative(Activation::Tanh, &y);
        let product = Product {
            rows: 3,
            depth: 5,
            columns: 32,
            a: &a,
            a_row: 5,
            a_depth: 1,
            b: &b,
            b_row: 32,
            start: Start::Row(&start),
            c: &mut c,
            c_row: 32,
            epilogue,
        };
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| product.execute())).is_ok()
    };
    assert!(product(15, 160, 32, 96, 96));
    for short in 0..5 {
        let mut sizes = [15, 160, 32, 96, 96];
        sizes[short] -= 1;
        let [a, b, start, c, y] = sizes;
        assert!(!product(a, b, start, c, y), "{sizes:?}");
    }
    let refused = |work: &mut dyn FnMut()| std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).is_err();
    let (long, mut short) = (vec![0.0; 256], vec![0.0; 240]);
    assert!(refused(&mut || Transpose { from: &long, rows: 16, columns: 16, to: &mut short }.execute()));
    assert!(refused(&mut || ColumnSums { x: &long[..250], sums: &mut short[..16] }.execute()));
    let activation = Activation::Relu;
    assert!(refused(&mut || Derivative { activation, output: &long, gradient: &mut short }.execute()));
    assert!(refused(&mut || Update { rule: Sgd { rate: 0.1 }, state: [&mut short], input: &long }.execute()));
}

/// `f` of every element of `x`, as the epilogue of a product of depth 0 that starts from `x`.
fn activated(f: Activation, x: &[f32], level: Level) -> Vec<f32> {
    let mut y = vec![0.0; x.len()];
    Product {
        rows: 1,
        depth: 0,
        columns: x.len(),
        a: &[],
        a_row: 0,
        a_depth: 0,
        b: &[],
        b_row: 0,
        start: Start::Row(x),
        c: &mut y,
        c_row: x.len(),
        epilogue: Epilogue::Activate(f),
    }
    .execute_at(level);
    y
}

#[test]
fn tanh_is_accurate_bounded_and_odd() {
    let x: Vec<f32> = (-160_000..160_000).map(|i| i as f32 * 1e-4).collect();
    for level in levels() {
        for (x, y) in x.iter().zip(activated(Activation::Tanh, &x, level)) {
            close(y, f64::from(*x).tanh(), 5e-7, &format!("{level:?} tanh({x})"));
            assert!(y.abs() <= 1.0);
        }
        let mut extreme = [0.0; LINE];
        extreme[..7].copy_from_slice(&[-0.0, 1e-30, 1e30, -1e30, f32::INFINITY, f32::NAN, -1e-6]);
        let y = activated(Activation::Tanh, &extreme, level);
        assert!(y[0] == 0.0 && (y[1] - 1e-30).abs() < 1e-36 && (y[6] + 1e-6).abs() < 1e-12);
        assert!(y[2] > 0.999_999 && y[3] < -0.999_999 && y[4] > 0.999_999);
        assert!(y[5].is_nan(), "a diverged network must show");
        assert!(activated(Activation::Relu, &extreme, level)[5].is_nan());
    }
}

#[test]
fn derivatives_follow_from_the_outputs() {
    let (z, d) = (random(64, 5), random(64, 6));
    for level in levels() {
        for f in [Activation::Identity, Activation::Relu, Activation::Tanh] {
            let output = activated(f, &z, level);
            let mut gradient = d.clone();
            Derivative { activation: f, output: &output, gradient: &mut gradient }.execute_at(level);
            for i in 0..64 {
                let slope = match f {
                    Activation::Identity => 1.0,
                    Activation::Relu | Activation::RmsRelu => f64::from(u8::from(z[i] > 0.0)),
                    Activation::Tanh => 1.0 - f64::from(z[i]).tanh().powi(2),
                };
                close(gradient[i], slope * f64::from(d[i]), 2e-6, &format!("{level:?} {f:?}"));
            }
        }
    }
}

#[test]
fn normalised_rows_and_their_gradients_follow_the_formula() {
    let (rows, row, columns) = (3, 32, 19);
    let padding = |values: Vec<f32>| -> Vec<f32> {
        values.into_iter().enumerate().map(|(i, x)| if i % row < columns { x } else { 0.0 }).collect()
    };
    let (mut u, d) = (padding(random(rows * row, 8)), padding(random(rows * row, 9)));
    u[row..2 * row].fill(0.0);
    for level in levels() {
        let (mut y, mut factors, mut gradient) = (u.clone(), vec![0.0; rows], d.clone());
        Normalise { y: &mut y, columns, factors: &mut factors }.execute_at(level);
        NormaliseGradient { y: &y, gradient: &mut gradient, columns, factors: &factors }.execute_at(level);
        for r in 0..rows {
            let at = |x: &[f32], c: usize| f64::from(x[r * row + c]);
            let mean = |f: &dyn Fn(usize) -> f64| (0..columns).map(f).sum::<f64>() / columns as f64;
            let rms = (mean(&|c| at(&u, c).powi(2)) + 1e-6).sqrt();
            let along = mean(&|c| at(&d, c) * at(&u, c) / rms);
            for c in 0..row {
                let expected = at(&u, c) / rms;
                let what = format!("{level:?} ({r}, {c})");
                close(y[r * row + c], expected, 2e-6, &what);
                close(gradient[r * row + c], (at(&d, c) - expected * along) / rms, 1e-5, &what);
            }
        }
    }
}

#[test]
fn sums_and_transposes_are_exact_rearrangements() {
    let x = random(48 * 32, 7);
    for level in levels() {
        let mut t = vec![0.0; x.len()];
        Transpose { from: &x, rows: 48, columns: 32, to: &mut t }.execute_at(level);
        for r in 0..48 {
            for c in 0..32 {
                assert_eq!(t[c * 48 + r], x[r * 32 + c], "{level:?} ({r}, {c})");
            }
        }
        let mut sums = vec![0.5; 32];
        ColumnSums { x: &x, sums: &mut sums }.execute_at(level);
        for (c, sum) in sums.into_iter().enumerate() {
            let expected: f64 = (0..48).map(|r| f64::from(x[r * 32 + c])).sum();
            close(sum, 0.5 + expected, 1e-5, "column sum");
        }
        for n in [0, 3, 16, 50] {
            let expected: f64 = x[..n].iter().map(|x| f64::from(*x).powi(2)).sum();
            close(SumOfSquares(&x[..n]).execute_at(level), expected, 1e-6, "sum of squares");
        }
    }
}

#[test]
fn updates_follow_their_formulas_at_any_length() {
    let rate = 0.01;
    let adam = Adam { beta1: 0.9, beta2: 0.999, epsilon: 1e-8, rate, square_correction: 1.5 };
    for level in levels() {
        for n in [1, 7, 16, 37] {
            let (p, g, m) = (random(n, 1), random(n, 2), random(n, 3));
            let v: Vec<f32> = random(n, 4).iter().map(|v| v.abs()).collect();
            let (mut p1, mut m1, mut v1) = (p.clone(), m.clone(), v.clone());
            Update { rule: adam, state: [&mut p1, &mut m1, &mut v1], input: &g }.execute_at(level);
            let (mut p2, mut v2) = (p.clone(), v.clone());
            let rms_prop = RmsProp { alpha: 0.99, epsilon: 1e-8, rate };
            Update { rule: rms_prop, state: [&mut p2, &mut v2], input: &g }.execute_at(level);
            let mut p3 = p.clone();
            Update { rule: Sgd { rate }, state: [&mut p3], input: &g }.execute_at(level);
            let mut p4 = p.clone();
            Update { rule: Blend { tau: 0.25 }, state: [&mut p4], input: &g }.execute_at(level);
            for i in 0..n {
                let [p, g, m, v] = [p[i], g[i], m[i], v[i]].map(f64::from);
                let rate = f64::from(rate);
                let (m_new, v_new) = (0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g);
                close(m1[i], m_new, 1e-6, "Adam's mean");
                close(v1[i], v_new, 1e-6, "Adam's mean square");
                close(p1[i], p - rate * m_new / ((1.5 * v_new).sqrt() + 1e-8), 1e-6, "Adam");
                let v_new = 0.99 * v + 0.01 * g * g;
                close(v2[i], v_new, 1e-6, "RMSprop's mean square");
                close(p2[i], p - rate * g / (v_new.sqrt() + 1e-8), 1e-6, "RMSprop");
                close(p3[i], p - rate * g, 1e-6, "SGD");
                close(p4[i], 0.75 * p + 0.25 * g, 1e-6, "soft update");
            }
        }
    }
}
