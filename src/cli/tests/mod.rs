//! Tests of the documentation and of the command line as a whole.

mod documentation;

use clap::{CommandFactory, Parser};

use crate::cli::adjusted;
use crate::cli::arguments::Arguments;

#[test]
fn the_first_seed_leaves_room_for_those_that_follow() {
    for line in ["mge evaluate run", "mge reproduce"] {
        let parse = |seed: u64| Arguments::try_parse_from(line.split(' ').chain(["--seed", &seed.to_string()]));
        assert!(parse(7).is_ok() && parse(u64::MAX).is_err(), "{line}");
    }
}

#[test]
fn a_negative_number_is_a_value_out_of_range() {
    let line = ["mge", "train", "task1", "--episodes", "-3"];
    let error = adjusted(Arguments::command()).try_get_matches_from(line).unwrap_err().to_string();
    assert!(error.contains("invalid value '-3' for '--episodes"), "{error}");
}
