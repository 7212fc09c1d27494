//! Runs on the command line: `mge runs`, `mge show`, `mge compare`, `mge delete` and `mge rename`.

use std::path::Path;

use serde_json::{Value, json};

use crate::program::{fail, mge, succeed, text};

fn train(here: &Path, run: &str, settings: &[&str]) {
    let quick = ["--method", "ddpg", "--episodes", "4", "--quiet", "--set", "ddpg.hidden=8", "--out", run];
    succeed(mge(here, [&["train", "task1"], &quick[..], settings].concat()));
}

fn json_of(here: &Path, command: &[&str]) -> Value {
    serde_json::from_str(&succeed(mge(here, command))).unwrap()
}

#[test]
fn runs_are_listed_with_their_states_and_damaged_ones_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "runs/a", &["--seed", "3"]);
    train(here, "runs/b", &[]);
    let mut task = mge::task::load("task1").unwrap();
    task.goal.position[0] += 0.1;
    mge::task::save(&task, &*here.join("mine.json")).unwrap();
    succeed(mge(here, ["train", "mine.json", "--method", "ddpg", "--episodes", "1", "--quiet", "--out", "other/a"]));
    assert!(succeed(mge(here, ["runs", "other"])).ends_with(" task1 (edited)\n"));
    assert_eq!(json_of(here, &["show", "other/a", "--json"])["task_edited"], json!(true));
    let listed = succeed(mge(here, ["runs"]));
    let lines: Vec<&str> = listed.lines().collect();
    assert!(lines.len() == 3 && lines[0].starts_with("run ") && lines[1].starts_with("runs/a"), "{listed}");
    assert!(lines[1].contains("finished") && lines[1].contains("4/4") && lines[1].ends_with("task1"), "{listed}");
    let rows = json_of(here, &["runs", "runs", "--json"]);
    assert_eq!(
        [&rows[0]["seed"], &rows[1]["episodes_done"], &rows[1]["state"]],
        [&json!(3), &json!(4), &json!("finished")]
    );
    std::fs::write(here.join("runs/b/config.json"), "{").unwrap();
    let output = mge(here, ["runs", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("runs/b/config.json"), "{}", text(&output.stderr));
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap().as_array().unwrap().len(), 1);
    fail(mge(here, ["runs", "nowhere"]), "nowhere");
}

#[test]
fn a_run_is_shown_and_two_are_compared() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "a", &[]);
    train(here, "b", &["--set", "ddpg.gamma=0.5"]);
    let shown = json_of(here, &["show", "b", "--json"]);
    assert_eq!([&shown["settings"]["ddpg.gamma"], &shown["results"]["episodes"]], [&json!("0.5"), &json!(4)]);
    let [charged, others] = ["charged_actions", "charged_outside"].map(|key| shown["results"][key].as_u64());
    assert!(charged > Some(4) && others == Some(0), "{shown}");
    let lines = succeed(mge(here, ["show", "b"]));
    let has = |name: &str, value: &str| lines.lines().any(|line| line.starts_with(name) && line.ends_with(value));
    assert!(has("settings.ddpg.gamma ", " 0.5") && has("episodes done ", " 4") && has("method ", " ddpg"), "{lines}");
    assert!(!lines.contains("settings.method") && !lines.contains("charged area"), "a run alone has none: {lines}");
    let mut task = mge::task::load("task1").unwrap();
    task.goal.position[0] += 0.1;
    mge::task::save(&task, &*here.join("mine.json")).unwrap();
    let set = ["--set", "episodes=5", "--task", "mine.json"];
    succeed(mge(here, [&["fork", "b", "--at", "4", "--quiet", "--out", "c"][..], &set].concat()));
    for told in [succeed(mge(here, ["show", "c"])), succeed(mge(here, ["compare", "b", "c"]))] {
        assert!(told.contains("forked from b at episode 4") && !told.contains("fork.tasks"), "{told}");
    }
    let compared = json_of(here, &["compare", "a", "b", "--json"]);
    assert_eq!(compared["settings"], json!({"ddpg.gamma": ["0.95", "0.5"]}));
    let lines = succeed(mge(here, ["compare", "a", "b"]));
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    assert!(lines.lines().any(|line| words(line) == ["ddpg.gamma", "0.95", "0.5"]), "{lines}");
    succeed(mge(here, ["rename", "b", "other"]));
    let renamed = succeed(mge(here, ["compare", "a", "b"]));
    let rows = |text: &str| text.lines().map(words).skip_while(|row| row[0] != "ddpg.gamma").collect::<Vec<_>>();
    assert_eq!(rows(&renamed), rows(&lines));
}

#[test]
fn runs_are_deleted_and_brought_back() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "runs/a", &[]);
    let config = std::fs::read(here.join("runs/a/config.json")).unwrap();
    assert!(succeed(mge(here, ["delete", "runs/a"])).contains("`mge delete --restore runs/a` brings it"));
    assert!(!here.join("runs/a").exists());
    fail(mge(here, ["delete", "runs/a"]), "runs/a");
    succeed(mge(here, ["delete", "--restore", "runs/a"]));
    assert!(std::fs::read(here.join("runs/a/config.json")).unwrap() == config);
}

#[test]
fn a_run_is_renamed_and_gets_the_name_of_its_folder_back() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "runs/a", &[]);
    assert_eq!(succeed(mge(here, ["rename", "runs/a", "the best"])), "a is the best now\n");
    assert_eq!(json_of(here, &["show", "runs/a", "--json"])["name"], json!("the best"));
    assert_eq!(json_of(here, &["runs", "--json"])[0]["name"], json!("the best"));
    let listed = succeed(mge(here, ["runs"]));
    assert!(listed.contains("the best: DDPG, seed 0"), "{listed}");
    train(here, "runs/b", &["--set", "ddpg.gamma=0.5"]);
    let commands =
        [["show", "the best"], ["evaluate", "runs/the best"], ["figures", "the best"], ["report", "the best"]];
    for command in commands {
        fail(mge(here, command), "the best does not exist: the run in runs/a has that name");
    }
    fail(mge(here, ["the best"]), "neither a command nor the folder of a run: the run in runs/a has that name");
    let compared = succeed(mge(here, ["compare", "runs/a", "runs/b"]));
    assert!(compared.lines().nth(1).is_some_and(|line| line.starts_with("name ") && line.contains("the best")));
    succeed(mge(here, ["report", "runs/a", "runs/b", "--out", "report"]));
    let report = std::fs::read_to_string(here.join("report/report.md")).unwrap();
    assert!(report.contains("- the best: DDPG, seed 0, on task1"), "{report}");
    succeed(mge(here, ["figures", "runs/a", "runs/b", "--svg", "--out", "figures"]));
    for figure in ["figures/learning.svg", "report/figures/learning.svg"] {
        assert!(std::fs::read_to_string(here.join(figure)).unwrap().contains("the best"), "{figure}");
    }
    let rows = report.lines().filter(|line| line.starts_with("| task1 |")).collect::<Vec<_>>();
    assert!(rows[0].contains("| the best |") && rows[1].contains("| DDPG, ddpg.gamma 0.5 |"), "{report}");
    let curve = |name: &str| mge(here, ["figures", "runs/a", "runs/b", "--svg", "--out", "one", "--set", name]);
    succeed(curve("curve=the best"));
    let drawn = std::fs::read_to_string(here.join("one/learning.svg")).unwrap();
    assert!(drawn.contains("the best") && !drawn.contains("gamma 0.5"), "by the name in the legend");
    fail(curve("reference=the bets"), "no runs are called `the bets`: did you mean `the best`?");
    succeed(mge(here, ["report", "runs", "--reference", "the best", "--out", "report", "--resamples", "10"]));
    fail(mge(here, ["rename", "runs/a", "b/c"]), "a name has at most");
    fail(mge(here, ["rename", "runs/c", "d"]), "runs/c");
    assert_eq!(mge(here, ["rename", "runs/a"]).status.code(), Some(2));
    assert_eq!(succeed(mge(here, ["rename", "runs/a", ""])), "the best is a now\n");
    assert!(here.join("runs/a").exists());
}
