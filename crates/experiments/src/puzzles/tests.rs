use std::path::Path;

use super::*;
use crate::error::ExperimentError;
use crate::sweep::Sweep;
use mge_base::stop::Stop;
use mge_results::LearningRow;
use mge_stats::Bootstrap;
use mge_stats::efficiency::Efficiency;
use mge_task as task;
use mge_trainer::batch::Batch;
use mge_trainer::{Method, PriorSource};

/// Criteria that are cheap to check but still reject most layouts.
const CRITERIA: Criteria = Criteria { episodes: 3000, least: 3, most: 300, random_actions: 500 };

fn generate_into(folder: &Path, index: &Index, count: u64, threads: usize) -> Result<Index, ExperimentError> {
    let interrupt = Stop::default();
    generate(index, count, &CRITERIA, folder, &Batch { threads, interrupt: &interrupt }, &mut |_| {})
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
    assert!(matches!(generate_into(other.path(), &test, 1, 1), Err(ExperimentError::OtherPuzzles(_))));
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
    for (keep_index, foreign) in [(true, ""), (true, "my notes"), (false, ""), (false, "{}"), (false, &another)] {
        if !keep_index {
            let _ = std::fs::remove_file(folder.path().join("index.json"));
        }
        std::fs::write(&file, foreign).unwrap();
        let error = generate().unwrap_err().to_string();
        assert!(error.contains("validation-7-0000.json: is not the puzzle of this name"), "{error}");
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
    let plan = BenchPlan {
        search: SubgoalSearch { puzzles: folder.path().to_owned(), model: PriorSource::TruePhysics, subgoals: 2 },
        methods: vec![Method::default()],
        episodes: 30,
        seeds: 2,
        settings: vec![("ddpg.gamma".to_owned(), "0.9".to_owned())],
    };
    let interrupt = Stop::default();
    let batch = Batch { threads: 1, interrupt: &interrupt };
    let wrong = BenchPlan { settings: vec![("prior".to_owned(), "true".to_owned())], ..plan.clone() };
    assert!(matches!(wrong.sweep(&[]), Err(ExperimentError::SettingOfOption(key)) if key == "prior"));
    let (file, text) = prepare(&plan, &index, &out, &batch, &mut |_| {}).unwrap();
    let sweep = Sweep::load(&file).unwrap();
    assert_eq!(Sweep::parse(text.as_bytes(), "").unwrap(), sweep);
    assert_eq!(sweep.jobs.len(), 2);
    let staged = task::load(&out.join("tasks").join(format!("{}.json", puzzle.name)).display().to_string()).unwrap();
    assert!(staged.subgoals.len() <= 2 && staged.search_actions > 0, "{staged:?}");
}

/// A row of an index.
fn puzzle(number: u64, random_goals: u64) -> Puzzle {
    Puzzle {
        number,
        name: format!("test-0-000{number}"),
        tools: Vec::new(),
        placeable: mge_physics::ToolKind::Box,
        too_easy: 5,
        too_hard: 2,
        random_episodes: 100_000,
        random_goals,
    }
}

#[test]
fn an_interrupted_search_reports_and_keeps_finished_puzzles() {
    let folder = tempfile::tempdir().unwrap();
    let interrupt = Stop::default();
    interrupt.request();
    let index = Index::new(1, Split::Test, 0.0);
    let batch = Batch { threads: 1, interrupt: &interrupt };
    let outcome = generate(&index, 3, &CRITERIA, folder.path(), &batch, &mut |_| {});
    assert!(matches!(outcome, Err(ExperimentError::Interrupted { done: 0, jobs: 3 })));
    assert_eq!(Index::load(folder.path()).unwrap(), Some(index));
}

#[test]
fn a_report_counts_solved_and_held_puzzles_by_method_and_difficulty() {
    let mut index = Index::new(0, Split::Test, 0.01);
    for (number, goals) in [(0, 50), (1, 1)] {
        index.puzzles.push(puzzle(number, goals));
    }
    let row = |task: &str, episodes_to_80, held: f64| LearningRow {
        task: task.to_owned(),
        method: "ddpg".to_owned(),
        epsilon: "0".to_owned(),
        episodes: 400,
        efficiency: Efficiency {
            episodes_to_80,
            auc: Some(0.5),
            final_success: Some(if held > 0.8 { held } else { 0.25 }),
            held_success: Some(held),
            ..Efficiency::default()
        },
        charged_to_80: episodes_to_80.map(|episodes: u64| episodes + 1000),
        charged_area: Some(0.4),
        ..LearningRow::default()
    };
    let rows = [row("test-0-0000", Some(150), 0.9), row("test-0-0001", Some(400), 0.7), row("task1", Some(1), 1.0)];
    let results = BenchResults::new("mge puzzles bench", index, rows.into());
    assert_eq!(results.runs.len(), 2, "other tasks are left out");
    let text = results.to_markdown();
    assert!(text.contains("| method | trainings | within 100 | within 200 | within 400 | held | charged to 80 % | charged area | area |"), "{text}");
    assert!(text.contains("| DDPG | 2 | 0.00 | 0.50 | 1.00 | 0.50 | 1275 (2/2) | 0.40 | 0.50 |"), "{text}");
    let curves = results.solved_curves(&Bootstrap::default()).unwrap();
    let panels: Vec<&str> = curves.panels.iter().map(|panel| panel.task.as_str()).collect();
    assert_eq!(panels, ["all (2 puzzles)", "1 of 3,000 or more (1 puzzle)", "fewer than 1 of 30,000 (1 puzzle)"]);
    let at = |panel: usize, episodes: f64| {
        let curve = &curves.panels[panel].curves[0];
        curve.y[curve.x.iter().position(|x| *x == episodes).unwrap()]
    };
    assert_eq!([at(0, 144.0), at(0, 152.0), at(0, 392.0), at(0, 400.0)], [0.0, 0.5, 0.5, 1.0]);
    assert_eq!([at(1, 152.0), at(2, 392.0), at(2, 400.0)], [1.0, 0.0, 1.0]);
    let profile = results.profile(&Bootstrap::default()).unwrap();
    let above = |threshold: f64| profile.curves[0].y[profile.curves[0].x.iter().position(|x| *x == threshold).unwrap()];
    assert_eq!([above(0.0), above(0.5), above(0.75), above(1.0)], [1.0, 0.5, 0.5, 0.0]);
    let folder = tempfile::tempdir().unwrap();
    results.write(&mge_results::ReportFolder::new(folder.path()).unwrap(), "hash", 72).unwrap();
    for file in ["solved.png", "solved.csv", "profile.svg", "profile.pdf"] {
        assert!(folder.path().join("figures").join(file).exists(), "{file}");
    }
    let groups = "| 1 of 3,000 or more, DDPG | 1 | 0.00 | 1.00 | 1.00 | 1.00 | 1150 (1/1) | 0.40 | 0.50 |\n\
                  | fewer than 1 of 30,000, DDPG | 1 | 0.00 | 0.00 | 1.00 | 0.00 | 1400 (1/1) | 0.40 | 0.50 |\n";
    assert!(text.contains(groups), "{text}");
    assert!(text.contains("Of 16 layouts, 10 were too easy and 4 too hard for uniform play: 2 are puzzles."), "{text}");
}
