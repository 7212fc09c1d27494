//! Tests of the documentation and of the command line as a whole.

mod documentation;

use clap::{CommandFactory, Parser};

use crate::cli::arguments::Arguments;
use crate::cli::{adjusted, usage};

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
    let error = adjusted(Arguments::command()).try_get_matches_from(line).unwrap_err();
    assert_eq!(usage::refused(&error).unwrap(), "--episodes -3: write a whole number from 0 to 4294967295");
}

#[test]
fn a_refused_value_is_told_in_one_line_with_what_to_write() {
    for (line, expected) in [
        ("train task1 --episodes x", "--episodes x: write a whole number, not less than 0"),
        ("train task1 --seed -1", "--seed -1: write a whole number, not less than 0"),
        ("train task1 --seed 99999999999999999999", "--seed 99999999999999999999: the number is too large"),
        ("sweep a.json --threads 0", "--threads 0: write a whole number from 1 to 1024"),
        ("train task1 --epsilon x", "--epsilon x: epsilon `x`: `x` is not a number; write 0.1, "),
    ] {
        let words = std::iter::once("mge").chain(line.split(' '));
        let error = adjusted(Arguments::command()).try_get_matches_from(words).unwrap_err();
        let told = usage::refused(&error).unwrap();
        assert!(told.starts_with(expected) && told.lines().count() == 1, "{told}");
    }
}

#[test]
fn a_setting_in_the_place_of_a_name_is_told_how_to_set_it() {
    let command = adjusted(Arguments::command());
    let told = |line: &str| usage::misplaced(&command, &line.split(' ').map(str::to_owned).collect::<Vec<_>>());
    for (line, remedy) in [
        ("train task1 episodes=5", "write `--episodes 5`"),
        ("train ddpg.gamma=0.9", "write `--set ddpg.gamma=0.9`"),
        ("fork runs/a --at 3 epsilon=0.1", "write `--set epsilon=0.1`"),
        ("resume runs/a episodes=5", "write `--episodes 5`"),
        ("figures runs/a against=charged", "write `--set against=charged`"),
        ("dynamics train epochs=5", "write `--epochs 5`"),
        ("config epsilo=3", "write it into a file, or `mge train TASK --set epsilo=3`"),
    ] {
        let text = told(line).unwrap_or_default();
        assert!(text.contains(remedy), "{line}: {text}");
    }
    for line in ["train task1 --quiet --set epsilon=0.1", "train task1 --set=epsilon=0.1", "rename runs/a x=1", "runs"]
    {
        assert_eq!(told(line), None, "{line}");
    }
}
