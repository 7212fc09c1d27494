//! `mge dynamics`: train and evaluate dynamics models.
use super::Outcome;
use super::arguments::Dynamics;

pub fn run(command: Dynamics) -> Outcome {
    match command {
        Dynamics::Train(_) => Err("x".into()),
        Dynamics::Evaluate(_) => Err("x".into()),
    }
}
