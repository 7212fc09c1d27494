//! Runs every corpus, and inputs made from it.

use std::panic::catch_unwind;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

/// The inputs of a target's corpus: examples, and what fuzzing has found.
fn corpus(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    std::fs::read_dir(folder).unwrap().map(|entry| std::fs::read(entry.unwrap().path()).unwrap()).collect()
}

/// An input with a few parts replaced, removed, repeated, or taken from another input.
fn mutated(inputs: &[Vec<u8>], rng: &mut ChaCha8Rng) -> Vec<u8> {
    let pick = |rng: &mut ChaCha8Rng| &inputs[rng.gen_range(0..inputs.len())];
    let part = |input: &[u8], rng: &mut ChaCha8Rng| {
        let start = rng.gen_range(0..=input.len());
        start..rng.gen_range(start..=input.len().min(start + 40))
    };
    let mut input = pick(rng).clone();
    for _ in 0..rng.gen_range(1..6) {
        let (range, other) = (part(&input, rng), pick(rng));
        let new = match rng.gen_range(0..5) {
            0 => (0..rng.gen_range(1..4)).map(|_| rng.r#gen()).collect(),
            1 => Vec::new(),
            2 => input[range.clone()].repeat(2),
            3 => other[part(other, rng)].to_vec(),
            _ => NUMBERS[rng.gen_range(0..NUMBERS.len())].as_bytes().to_vec(),
        };
        input.splice(range, new);
    }
    input
}

/// Numbers that are hard to parse.
const NUMBERS: [&str; 8] = ["-1", "0", "1e38", "1e999", "18446744073709551615", "4294967296", "NaN", "null"];

/// `MGE_FUZZ_INPUTS=1000000 cargo test fuzz` tries that many inputs per target.
#[test]
fn mutated_inputs_pass() {
    let count = std::env::var("MGE_FUZZ_INPUTS").ok().and_then(|count| count.parse().ok()).unwrap_or(100);
    let seed = std::env::var("MGE_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(0);
    let only = std::env::var("MGE_FUZZ_TARGET").ok();
    for (target, parse) in TARGETS.into_iter().filter(|(target, _)| only.as_ref().is_none_or(|only| only == target)) {
        let inputs = corpus(target);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // A whole workbench takes longer than a parser.
        let count = if target == "interface" { count / 10 } else { count };
        for number in 0..count {
            let input = mutated(&inputs, &mut rng);
            let outcome = catch_unwind(|| parse(&input));
            assert!(outcome.is_ok(), "{target}, input {number}: {:?}", String::from_utf8_lossy(&input));
        }
    }
}

#[test]
fn every_corpus_passes() {
    for (target, parse) in TARGETS {
        let inputs = corpus(target);
        assert!(inputs.len() >= 3, "{target} has {} inputs", inputs.len());
        inputs.iter().for_each(|input| parse(input));
    }
}
