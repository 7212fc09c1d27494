//! Sweeps as a user runs them: in one process, through GNU parallel, as a Slurm array; and the report.

use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output};

use crate::program::{MGE, fail, mge, succeed, text};

const SWEEP: &str = r#"{
  "task": ["task1", "task3"], "method": ["ddpg", "ddpg-mge"], "threshold": [0.2], "model": "true", "seed": [0, 1],
  "episodes": 10, "ddpg.hidden": 8, "ddpg.warmup_steps": 30, "evaluation.every": 5,
  "guidance.model_rollouts": 50, "guidance.environment_rollouts": 10
}"#;

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Runs a script in a shell, as the Slurm array task `task`.
fn shell(folder: &Path, script: &str, task: &str) -> Output {
    Command::new("bash")
        .args(["-c", script])
        .env("SLURM_ARRAY_TASK_ID", task)
        .current_dir(folder)
        .output()
        .expect("bash starts")
}

#[test]
fn a_plan_gives_the_same_results_as_the_sweep_itself() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("s.json"), SWEEP).unwrap();
    let table = succeed(mge(here, ["sweep", "s.json", "--quiet"]));
    assert_eq!(table.trim(), "sweeps/s/results.csv");
    let expected = read(&here.join("sweeps/s/results.csv"));
    assert_eq!(expected.lines().count(), 9, "{expected}");
    assert_eq!(expected.matches(",finished,").count(), 8, "{expected}");

    // The folder's name needs quoting in a shell, and the plan must not need the sweep file.
    let out = "it's a \"folder\" $HOME";
    let plan = succeed(mge(here, ["sweep", "s.json", "--plan", "--out", out]));
    let array = succeed(mge(here, ["sweep", "s.json", "--slurm", "--out", out]));
    assert_eq!(plan.lines().count(), 8);
    assert!(!here.join(out).exists(), "planning created files");
    std::fs::rename(here.join("s.json"), here.join("kept.json")).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let lines: Vec<&str> = plan.lines().collect();
    for line in &lines[..2] {
        succeed(shell(elsewhere.path(), line, ""));
        let again = succeed(shell(elsewhere.path(), line, ""));
        assert!(Path::new(again.trim()).join("metrics.csv").exists(), "{again}");
    }
    assert!(array.contains("#SBATCH --array=0-7\n"), "{array}");
    succeed(shell(elsewhere.path(), &array, "2"));
    assert_eq!(std::fs::read_dir(here.join(out).join("runs")).unwrap().count(), 3);
    let told = mge(here, ["sweep", "kept.json", "--dry-run", "--out", out]);
    assert_eq!((text(&told.stderr), text(&told.stdout)), ("8 jobs\n".into(), plan.clone()));
    through_parallel(elsewhere.path(), &plan);
    std::fs::rename(here.join("kept.json"), here.join("s.json")).unwrap();
    succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", out]));
    assert_eq!(read(&here.join(out).join("results.csv")), expected);
}

/// Runs the plan with the real GNU parallel; every line must run exactly once.
fn through_parallel(folder: &Path, plan: &str) {
    let file = folder.join("plan.txt");
    std::fs::write(&file, plan).unwrap();
    let parallel = Command::new("parallel").args(["--jobs", "2", "--arg-file"]).arg(&file).current_dir(folder).output();
    match parallel {
        Ok(output) => assert_eq!(succeed(output).lines().count(), plan.lines().count()),
        Err(error) => eprintln!("skipped: GNU parallel cannot be started: {error}"),
    }
}

#[test]
fn errors_are_one_line_and_change_nothing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.json"), SWEEP.replace("ddpg.hidden", "ddpg.hiden")).unwrap();
    assert_eq!(
        fail(mge(&folder, ["sweep", "bad.json"]), "bad.json"),
        "error: bad.json:3: at ddpg.hiden: there is no setting `ddpg.hiden`: did you mean `ddpg.hidden`?\n"
    );
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
    std::fs::write(folder.path().join("good.json"), SWEEP).unwrap();
    for kind in ["--plan", "--slurm"] {
        let output = mge(&folder, ["sweep", "good.json", kind, "--out", "a\nb"]);
        assert_eq!(text(&output.stdout), "");
        fail(output, "has a line break or is not UTF-8");
    }
    std::fs::remove_file(folder.path().join("good.json")).unwrap();
    assert_eq!(mge(&folder, ["sweep"]).status.code(), Some(2));
    assert_eq!(mge(&folder, ["report"]).status.code(), Some(2));
    fail(mge(&folder, ["report", "."]), "holds no runs");
}

#[test]
fn a_sweep_finishes_a_run_whose_creation_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let one = SWEEP.replace(r#""method": ["ddpg", "ddpg-mge"]"#, r#""method": ["ddpg"]"#);
    std::fs::write(here.join("s.json"), one.replace("[0, 1]", "[0]")).unwrap();
    // The state after a kill at the first rename: the lock of an ended process, and the beginning of
    // the configuration under a temporary name.
    let run = here.join("sweep/runs/task1-ddpg-seed0");
    std::fs::create_dir_all(&run).unwrap();
    std::fs::write(run.join("lock"), "1").unwrap();
    std::fs::write(run.join(".mge-aB3xY9aB3x.tmp"), "{\n  \"format\": 1,").unwrap();
    succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", "sweep"]));
    assert_eq!(read(&here.join("sweep/results.csv")).matches(",finished,").count(), 2);
}

/// Runs the program as a user with a limit on processes and threads. `None` if the test does not run as root or that
/// user cannot run the program.
fn with_threads(most: u32, folder: &Path, arguments: &[&str]) -> Option<Output> {
    const NOBODY_ELSE: u32 = 54_321;
    let limit = |most: u32, arguments: &[&str]| {
        let mut command = Command::new("prlimit");
        command.arg(format!("--nproc={most}")).arg(MGE).args(arguments).current_dir(folder).uid(NOBODY_ELSE);
        command.output().ok()
    };
    limit(100, &["tasks"]).filter(|output| output.status.success())?;
    limit(most, arguments)
}

#[test]
fn too_few_threads_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::set_permissions(here, std::fs::Permissions::from_mode(0o777)).unwrap();
    std::fs::write(here.join("s.json"), SWEEP).unwrap();
    let clusters = ["clusters", "task1", "--model", "true", "--seed", "1"];
    let Some(alone) = with_threads(1, here, &clusters) else {
        eprintln!("skipped: needs root, prlimit, and a program that other users can run");
        return;
    };
    fail(alone, "cannot start a thread");
    let output = with_threads(1, here, &["sweep", "s.json", "--threads", "2"]).unwrap();
    fail(output, "cannot start a thread");
}

#[test]
fn a_report_has_the_training_results() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::write(here.join("s.json"), SWEEP).unwrap();
    succeed(mge(here, ["sweep", "s.json", "--quiet", "--out", "sweep"]));
    for out in ["first", "second"] {
        let arguments = ["report", "sweep", "--resamples", "200", "--seed", "5", "--out", out];
        assert_eq!(succeed(mge(here, arguments)).trim(), format!("{out}/report.md"));
    }
    let files = ["report.md", "report.json", "figures/learning.png", "figures/learning-greedy.csv"];
    for file in files {
        let bytes = |out: &str| std::fs::read(here.join(out).join(file)).unwrap();
        assert!(bytes("first") == bytes("second"), "{file} differs between two reports of the same runs");
    }
    let report = read(&here.join("first/report.md"));
    for expected in [
        "from 8 finished runs with the seeds 0, 1",
        "(200 resamples, seed 5)",
        "| task3 | DDPG-MGE, epsilon 0.2 | 2 |",
        "| final success | DDPG | 4 |",
        "| DDPG-MGE, epsilon 0.2 | DDPG | ",
        "figures/learning-charged.png",
    ] {
        assert!(report.contains(expected), "{expected} is not in\n{report}");
    }
    let json: serde_json::Value = serde_json::from_str(&read(&here.join("first/report.json"))).unwrap();
    assert_eq!(json["learning"].as_array().unwrap().len(), 8);
    assert_eq!(json["bootstrap"]["resamples"], 200);
    assert_eq!(json["common_tasks"], serde_json::json!(["task1", "task3"]));
}
