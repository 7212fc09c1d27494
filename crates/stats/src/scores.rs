//! Scores of several runs on several tasks.

use rand_chacha::ChaCha8Rng;

use super::{Result, StatsError};
use mge_base::streams::index;

/// One score per run, by task. Every task has at least one run and every score is finite; tasks may have different
/// numbers of runs.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskScores {
    tasks: Vec<Vec<f64>>,
}

impl TaskScores {
    /// Scores as `tasks[task][run]`.
    ///
    /// # Errors
    /// [`StatsError::Empty`], [`StatsError::EmptyTask`] or [`StatsError::NotFinite`].
    pub fn new(tasks: Vec<Vec<f64>>) -> Result<Self> {
        if tasks.is_empty() {
            return Err(StatsError::Empty("tasks"));
        }
        for (task, runs) in tasks.iter().enumerate() {
            if runs.is_empty() {
                return Err(StatsError::EmptyTask(task));
            }
            if let Some(run) = runs.iter().position(|score| !score.is_finite()) {
                return Err(StatsError::NotFinite { task, run, value: runs[run] });
            }
        }
        Ok(Self { tasks })
    }

    /// Scores of runs on a single task.
    ///
    /// # Errors
    /// As [`TaskScores::new`].
    pub fn of_one_task(runs: &[f64]) -> Result<Self> {
        Self::new(vec![runs.to_vec()])
    }

    /// The runs of each task.
    pub fn tasks(&self) -> &[Vec<f64>] {
        &self.tasks
    }

    /// All scores, task by task.
    pub fn all(&self) -> impl Iterator<Item = f64> {
        self.tasks.iter().flatten().copied()
    }

    /// Fills `target`, of the same shape, with the runs of these tasks, each of which has one run.
    pub(super) fn choose_into(&self, target: &mut Self, tasks: &[usize]) {
        for (task, drawn) in tasks.iter().zip(&mut target.tasks) {
            drawn[0] = self.tasks[*task][0];
        }
    }

    /// Fills `target`, of the same shape, with runs drawn with replacement within each task.
    pub(super) fn resample_into(&self, target: &mut Self, stream: &mut ChaCha8Rng) {
        for (runs, drawn) in self.tasks.iter().zip(&mut target.tasks) {
            drawn.fill_with(|| runs[index(stream, runs.len())]);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn wrong_scores_are_refused_with_their_place() {
        assert_eq!(TaskScores::new(vec![]).unwrap_err(), StatsError::Empty("tasks"));
        let error = TaskScores::new(vec![vec![1.0], vec![]]).unwrap_err();
        assert_eq!(error, StatsError::EmptyTask(1));
        let error = TaskScores::new(vec![vec![1.0], vec![2.0, f64::NAN]]).unwrap_err();
        assert_eq!(error.to_string(), "the score of run 1 of task 1 is NaN, not a finite number");
        assert!(TaskScores::of_one_task(&[f64::INFINITY]).is_err());
    }

    #[test]
    fn resampling_stays_within_the_task() {
        let scores = TaskScores::new(vec![vec![1.0, 2.0, 3.0], vec![10.0, 20.0]]).unwrap();
        let mut drawn = scores.clone();
        let mut stream = ChaCha8Rng::seed_from_u64(1);
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..200 {
            scores.resample_into(&mut drawn, &mut stream);
            for (task, runs) in drawn.tasks().iter().enumerate() {
                assert_eq!(runs.len(), scores.tasks()[task].len());
                assert!(runs.iter().all(|score| scores.tasks()[task].contains(score)));
                seen.extend(runs.iter().map(|score| *score as u64));
            }
        }
        assert_eq!(Vec::from_iter(seen), [1, 2, 3, 10, 20]);
    }
}
