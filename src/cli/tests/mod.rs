//! Tests of the documentation and of the command line as a whole.

mod documentation;

use clap::Parser;

use crate::cli::arguments::Arguments;

#[test]
fn the_first_seed_leaves_room_for_those_that_follow() {
    for line in ["mge evaluate run", "mge reproduce", "mge dynamics ablate --out out"] {
        let parse = |seed: u64| Arguments::try_parse_from(line.split(' ').chain(["--seed", &seed.to_string()]));
        assert!(parse(7).is_ok() && parse(u64::MAX).is_err(), "{line}");
    }
}
