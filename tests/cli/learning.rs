//! Agents learn, and guidance makes the difference.

use crate::program::{mge, succeed};

/// The number of episodes of a training on task 1 that reached the goal, among its last 50.
fn goals_at_the_end(method: &str, seed: &str) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let options = ["--method", method, "--seed", seed, "--episodes", "200", "--quiet", "--out", "run"];
    succeed(mge(&folder, ["train", "task1"].into_iter().chain(options)));
    let mut metrics = csv::Reader::from_path(folder.path().join("run/metrics.csv")).unwrap();
    let goal = metrics.headers().unwrap().iter().position(|name| name == "goal").unwrap();
    let reached: Vec<bool> = metrics.records().map(|row| &row.unwrap()[goal] == "true").collect();
    assert_eq!(reached.len(), 200);
    reached[150..].iter().filter(|reached| **reached).count()
}

#[test]
fn guided_exploration_learns_task_1_where_plain_ddpg_does_not() {
    for seed in ["0", "1"] {
        let [plain, guided] = ["ddpg", "ddpg-mge-adaptive"].map(|method| goals_at_the_end(method, seed));
        assert!(guided >= 30, "seed {seed}: {guided} of 50 with guidance");
        assert!(guided >= plain + 20, "seed {seed}: {guided} of 50 with guidance, {plain} without");
    }
}
