use std::path::Path;

use super::*;
use crate::error::{ExperimentError, Result};
use crate::sweep::Sweep;
use mge_base::stop::Stop;
use mge_task as task;
use mge_trainer::batch::Batch;
use mge_trainer::{Method, PriorSource};

/// Criteria that are cheap to check but still reject most layouts.
const CRITERIA: Criteria = Criteria { episodes: 3000, least: 3, most: 300, random_actions: 500 };

fn generate_into(folder: &Path, index: &Index, count: u64, threads: usize) -> Result<Index> {
    let interrupt = Stop::default();
    generate(index, count, &CRITERIA, folder, &mut Batch { threads, interrupt: &interrupt, on_progress: &mut |_| {} })
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn puzzles_depend_only_on_their_number_and_existing_ones_are_kept() {
    let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let index = Index::new(7, Split::Validation, 0.01);
    let first = generate_into(one.path(), &index, 1, 1).unwrap();
    let name = format!("{}.json", first.puzzles[0].name);
    assert_eq!(name, "validation-7-0000.json");
    let edited = read(one.path(), &name) + "\n";
    std::fs::write(one.path().join(&name), &edited).unwrap();
    let both = generate_into(one.path(), &index, 2, 2).unwrap();
    assert_eq!(both.puzzles[0], first.puzzles[0]);
    assert_eq!(read(one.path(), &name), edited);

    let again = generate_into(other.path(), &index, 2, 2).unwrap();
    assert_eq!(again, both);
    let second = format!("{}.json", both.puzzles[1].name);
    assert_eq!(read(one.path(), &second), read(other.path(), &second));
    std::fs::remove_file(other.path().join(&second)).unwrap();
    assert_eq!(generate_into(other.path(), &index, 2, 1).unwrap(), both);
    assert_eq!(read(one.path(), &second), read(other.path(), &second), "a file that is gone is written again");
    let test = Index::new(7, Split::Test, 0.01);
    assert!(generate_into(other.path(), &test, 1, 1).unwrap_err().to_string().contains("another seed, split"));
}

#[test]
fn puzzles_are_not_generated_over_other_files() {
    let folder = tempfile::tempdir().unwrap();
    let index = Index::new(7, Split::Validation, 0.01);
    let generate = || generate_into(folder.path(), &index, 1, 1);
    let first = generate().unwrap();
    let file = first.puzzles[0].path(folder.path());
    let puzzle = std::fs::read_to_string(&file).unwrap();
    let indexed = read(folder.path(), "index.json");
    let another = puzzle.replacen("\"start_noise\": 0.01", "\"start_noise\": 0.02", 1);
    assert_ne!(another, puzzle);
    // With the index, a changed puzzle is the user's own.
    std::fs::remove_file(folder.path().join("index.json")).unwrap();
    for foreign in ["", "{}", &another] {
        std::fs::write(&file, foreign).unwrap();
        let error = generate().unwrap_err().to_string();
        assert!(error.contains("validation-7-0000.json: it exists and is not the same task"), "{error}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), foreign);
    }
    std::fs::write(&file, &puzzle).unwrap();
    assert_eq!(generate().unwrap(), first, "as left by a killed process");
    assert_eq!((std::fs::read_to_string(&file).unwrap(), read(folder.path(), "index.json")), (puzzle, indexed));
}

#[test]
fn of_two_generations_into_one_folder_neither_loses_its_puzzles() {
    let folder = tempfile::tempdir().unwrap();
    let index = Index::new(7, Split::Validation, 0.01);
    let (path, index) = (folder.path(), &index);
    std::thread::scope(|scope| {
        for count in [1, 2] {
            scope.spawn(move || generate_into(path, index, count, 1).unwrap());
        }
    });
    assert_eq!(Index::load(path).unwrap().unwrap().puzzles.len(), 2);
}

#[test]
fn a_puzzle_is_a_task_without_subgoals_and_the_bench_gives_it_subgoals_that_are_charged() {
    let folder = tempfile::tempdir().unwrap();
    let index = generate_into(folder.path(), &Index::new(3, Split::Train, 0.01), 1, 1).unwrap();
    let puzzle = &index.puzzles[0];
    assert!(puzzle.random_episodes > 0);
    let file = folder.path().join(format!("{}.json", puzzle.name));
    let task = task::load(&file.display().to_string()).unwrap();
    assert_eq!((task.subgoals.len(), task.rules.start_noise), (0, 0.01));

    let out = folder.path().join("bench");
    let bench = Bench {
        puzzles: folder.path().to_owned(),
        model: PriorSource::TruePhysics,
        subgoals: 2,
        methods: vec![Method::default()],
        episodes: 30,
        seeds: 2,
        settings: vec![("ddpg.gamma".to_owned(), "0.9".to_owned())],
    };
    let interrupt = Stop::default();
    let batch = &mut Batch { threads: 1, interrupt: &interrupt, on_progress: &mut |_| {} };
    let wrong = Bench { settings: vec![("prior".to_owned(), "true".to_owned())], ..bench.clone() };
    assert!(wrong.sweep(&[]).unwrap_err().to_string().contains("--set prior=..."));
    let (file, text) = bench.prepare(&index, &(&*out).into(), batch).unwrap();
    let sweep = Sweep::load(&file).unwrap();
    assert_eq!(Sweep::parse(text.as_bytes(), "").unwrap(), sweep);
    assert_eq!(sweep.jobs.len(), 2);
    let staged = task::load(&out.join("tasks").join(format!("{}.json", puzzle.name)).display().to_string()).unwrap();
    assert!(staged.subgoals.len() <= 2 && staged.search_actions > 0, "{staged:?}");
}

#[test]
fn an_interrupted_search_reports_and_keeps_finished_puzzles() {
    let folder = tempfile::tempdir().unwrap();
    let interrupt = Stop::default();
    interrupt.request();
    let index = Index::new(1, Split::Test, 0.0);
    let batch = &mut Batch { threads: 1, interrupt: &interrupt, on_progress: &mut |_| {} };
    let outcome = generate(&index, 3, &CRITERIA, folder.path(), batch);
    assert!(matches!(outcome, Err(ExperimentError::Interrupted { done: 0, jobs: 3 })));
    assert_eq!(Index::load(folder.path()).unwrap(), Some(index));
}
