//! Nothing is removed or replaced except what the program wrote.
//!
//! The kind: a deletion that a crash or another process divides, or that takes a user's files along; a result written
//! over a user's file. Decided in `crates/run/src/trash.rs` (deletion is one rename into a trash), in `directory.rs` beside
//! it (where a run can be created), in `checkpoint.rs` (files in the folder of a checkpoint), and in `atomic::Target`, through
//! which everything goes that is written to a path named by the user.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use crate::program::{command, fail, mge, succeed, text};

/// A run of one episode.
fn train(folder: &Path, run: &str) {
    let options = "train task1 --method ddpg --episodes 1 --set ddpg.hidden=8 --quiet --out";
    succeed(mge(folder, options.split(' ').chain([run])));
}

/// Writes a script of these lines, and returns the arguments that run it.
fn script(folder: &Path, lines: &str) -> [&'static str; 3] {
    fs::write(folder.join("script.mge"), lines).unwrap();
    ["script", "script.mge", "--quiet"]
}

/// The paths of all files below a folder, relative to it, in order.
fn files(folder: &Path) -> Vec<String> {
    fn walk(folder: &Path, top: &Path, found: &mut Vec<String>) {
        for path in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            match path.is_dir() {
                true => walk(&path, top, found),
                false => found.push(path.strip_prefix(top).unwrap().display().to_string()),
            }
        }
    }
    let mut found = Vec::new();
    walk(folder, folder, &mut found);
    found.sort();
    found
}

#[test]
fn no_run_is_created_over_files_of_a_user() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (name, content) in [
        ("metrics.csv", "epoch,loss\n1,0.5\n"),
        ("checkpoint/last/weights.pt", "mine"),
        ("lock", "of my door"),
        ("model.safetensors", "mine"),
        ("config.json", "{\"mine\":1}"),
    ] {
        let file = here.join("mine").join(name);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(&file, content).unwrap();
        let arguments = "train task1 --method ddpg --episodes 1 --quiet --out mine".split(' ');
        fail(mge(here, arguments), "mine is not empty: choose another folder");
        fail(mge(here, script(here, "delete mine")), "script.mge:1: ");
        assert_eq!(
            (files(&here.join("mine")), fs::read_to_string(&file).unwrap()),
            (vec![name.to_owned()], content.to_owned())
        );
        fs::remove_dir_all(here.join("mine")).unwrap();
    }
}

#[test]
fn files_of_a_user_in_the_folder_of_a_checkpoint_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let options = "train task1 --method ddpg --episodes 4 --set ddpg.hidden=8 --set checkpoints.periodic_every=2";
    let options = format!("{options} --set checkpoints.periodic_kept=1 --quiet --out run");
    succeed(mge(here, options.split(' ')));
    for name in ["last", "episode-4"] {
        fs::write(here.join("run/checkpoint").join(name).join("thesis.tex"), "mine").unwrap();
    }
    succeed(mge(here, "resume run --episodes 8 --quiet".split(' ')));
    let kept = files(&here.join("run/checkpoint"));
    let thesis: Vec<_> = kept.iter().filter(|file| file.ends_with("thesis.tex")).collect();
    assert_eq!(thesis, ["kept-from-episode-4/thesis.tex", "kept-from-last/thesis.tex"]);
    assert!(!kept.iter().any(|file| file.starts_with("episode-4/")), "{kept:?}");
    succeed(mge(here, ["evaluate", "run"]));
}

#[test]
fn the_trash_is_emptied_on_request_alone_and_a_taken_place_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "runs/a");
    succeed(mge(here, script(here, "delete runs/a")));
    train(here, "runs/a");
    fail(mge(here, script(here, "restore runs/a")), "runs/a exists: move it elsewhere, then restore the run");
    succeed(mge(here, script(here, "delete runs/a\nempty-trash runs")));
    assert_eq!(files(&here.join("runs")), [] as [&str; 0]);
    fail(mge(here, script(here, "restore runs/a")), "runs/a is not in the trash");
    succeed(mge(here, script(here, "empty-trash")));
}

#[test]
fn only_a_whole_run_is_deleted_and_all_of_it_can_be_restored() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let refused = [
        ("{\"format\":1}", "missing field"),
        ("{\"format\":1,\"mge_version\":\"0.1.0\",\"config\":{}}", "missing field"),
        ("{\"format\":1,\"mge_version\":\"0.1.0\",\"config\":{\"tools\":[]}}", ""),
        ("{\"format\":1,\"mge_", "config.json"),
        ("{\"format\":99}", "format 99"),
        ("{\"name\":\"a web page\"}", "config.json"),
    ];
    for (config, reason) in refused {
        let _ = fs::remove_dir_all(here.join("p"));
        fs::create_dir(here.join("p")).unwrap();
        fs::write(here.join("p/config.json"), config).unwrap();
        fs::write(here.join("p/thesis.tex"), "mine").unwrap();
        fail(mge(here, script(here, "delete p")), reason);
        assert_eq!(files(&here.join("p")), ["config.json", "thesis.tex"], "{config}");
    }
    for lines in ["delete nowhere", "delete .", "delete p/thesis.tex", "delete /", "restore p", "restore"] {
        fail(mge(here, script(here, lines)), "script.mge:1: ");
    }
    // The configuration is damaged, but it has the log of a run.
    train(here, "damaged");
    fs::write(here.join("damaged/config.json"), "{").unwrap();
    succeed(mge(here, script(here, "delete damaged")));
    assert!(here.join(".trash/1/damaged/config.json").exists());

    train(here, "runs/a");
    fs::write(here.join("runs/a/thesis.tex"), "mine").unwrap();
    let before = files(&here.join("runs/a"));
    // From within, by another name.
    succeed(mge(here.join("runs/a"), script(&here.join("runs/a"), "delete .")));
    let gone = here.join("runs/.trash/1/a");
    assert!(!here.join("runs/a").exists() && gone.join("thesis.tex").exists());
    fail(mge(here, ["report", "runs"]), "holds no runs");
    fail(mge(here, ["resume", "runs/a", "--quiet"]), "does not exist");
    fs::remove_file(gone.join("script.mge")).unwrap();
    succeed(mge(here, script(here, "restore runs/a")));
    assert_eq!(files(&here.join("runs/a")), before);
    std::os::unix::fs::symlink("runs/a", here.join("link")).unwrap();
    fail(mge(here, script(here, "delete link")), "a link");
    succeed(mge(
        here,
        script(here, "open runs/a\ndelete ./runs/../runs/a\nrestore\nopen runs/a\ndelete runs/a\nrestore"),
    ));
    assert_eq!(files(&here.join("runs/a")), before);
}

#[test]
fn a_deletion_that_is_killed_or_races_with_others_leaves_a_whole_run_somewhere() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "r/x");
    let whole = files(&here.join("r/x"));
    script(here, "delete r/x");
    for trial in 0..8u64 {
        let start = |arguments: &[&str]| {
            let mut command = command(here, arguments);
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
        };
        let mut delete = start(&["script", "script.mge", "--quiet"]);
        let mut others = match trial % 2 {
            0 => vec![start(&["resume", "r/x", "--episodes", "3", "--quiet"]), start(&["script", "script.mge"])],
            _ => Vec::new(),
        };
        if trial % 2 == 1 {
            std::thread::sleep(Duration::from_millis(trial * 3));
            let _ = delete.kill();
        }
        delete.wait().unwrap();
        others.iter_mut().for_each(|other| _ = other.wait().unwrap());
        let trash = fs::read_dir(here.join("r/.trash")).into_iter().flatten().map(|entry| entry.unwrap().path());
        let mut found: Vec<PathBuf> = trash.map(|place| place.join("x")).filter(|place| place.exists()).collect();
        found.extend(Some(here.join("r/x")).filter(|place| place.exists()));
        assert_eq!(found.len(), 1, "trial {trial}: {found:?}");
        let now = files(&found[0]);
        // Whoever continues a run writes TensorBoard's file anew.
        let is_there = |file: &String| now.contains(file) || file.starts_with("tensorboard/");
        assert!(whole.iter().all(is_there), "trial {trial}: {now:?}");
        if found[0] != here.join("r/x") {
            fs::rename(&found[0], here.join("r/x")).unwrap();
        }
        let _ = fs::remove_dir_all(here.join("r/.trash"));
    }
    succeed(mge(here, ["resume", "r/x", "--quiet"]));
}

#[test]
fn files_that_look_temporary_are_the_users() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "run");
    let mine = [
        ".mge-notes-of-mine",
        ".mge-backup",
        "run/.mge-notes-of-mine",
        "run/.writing-mine/a",
        "run/checkpoint/.writing-mine/a",
        "run/checkpoint/.previous-mine/a",
    ];
    for file in mine {
        fs::create_dir_all(here.join(file).parent().unwrap()).unwrap();
        fs::write(here.join(file), "mine").unwrap();
    }
    fs::create_dir(here.join("run/checkpoint/empty")).unwrap();
    succeed(mge(here, ["resume", "run", "--episodes", "2", "--quiet"]));
    succeed(mge(here, ["export", "run", "--out", "actor.safetensors"]));
    for file in mine {
        assert_eq!(fs::read_to_string(here.join(file)).unwrap(), "mine", "{file}");
    }
}

#[test]
fn a_file_of_the_user_is_replaced_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    train(here, "runs/a");
    fs::write(here.join("s.json"), r#"{"task": "task1", "method": "ddpg", "episodes": 1, "ddpg.hidden": 8}"#).unwrap();
    // The arguments, the file in the way, and whether to try `--force` and a repetition as well, which takes longer.
    let commands = [
        ("report runs --out .", "report.md", true),
        ("report runs --out .", "report.json", false),
        ("report runs --out .", "figures/methods.png", false),
        ("figures runs/a --out .", "learning.png", true),
        ("figures runs/a --svg --out .", "learning.svg", true),
        ("figures runs/a --svg --out .", "learning.csv", true),
        ("sweep s.json --out . --quiet", "results.csv", true),
        ("sweep s.json --out . --quiet", "results.json", false),
        ("export runs/a --out a.safetensors", "a.safetensors", true),
        ("clusters task1 --out k.json", "k.json", false),
        ("tasks propose task1 --out t", "t", false),
        ("dynamics train --tools box --out n.safetensors", "n.safetensors", false),
        ("dynamics train --tools box,floor --layers 1 --observations 2 --epochs 1 --quiet --out m", "m", true),
        ("selection train create/Moving-random --episodes 2 --quiet --out p.safetensors", "p.safetensors", true),
        ("reproduce --quick --out .", "report.md", false),
    ];
    for (arguments, file, whole) in commands {
        let path = here.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        let words = || arguments.split(' ');
        // Neither an empty file nor one that begins like the format is taken for the program's own.
        for content in ["", "mine", "{\"version\": 1}", "<svg>mine</svg>", "run,note\n1,mine\n", "# Runs compared\n"] {
            fs::write(&path, content).unwrap();
            let message = fail(mge(here, words()), "--force");
            assert!(message.contains(file), "{message}");
            assert_eq!(fs::read_to_string(&path).unwrap(), content, "{arguments}");
        }
        if whole {
            succeed(mge(here, words().chain(["--force"])));
            assert_ne!(fs::read(&path).unwrap(), b"# Runs compared\n", "{arguments}");
            succeed(mge(here, words()));
        }
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn a_script_command_replaces_a_file_of_the_user_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for (line, file, whole) in [
        ("save s.json", "s.json", true),
        ("record r.tex", "r.tex", true),
        ("clusters k", "k", false),
        ("figure scene f.svg", "f.svg", true),
        ("figure scene f.png", "f.csv", true),
        ("model train box m.safetensors", "m.safetensors", false),
    ] {
        fs::write(here.join(file), "mine").unwrap();
        let message = fail(mge(here, script(here, &format!("seed 1\n{line}\n"))), "`force`");
        assert!(message.contains(file), "{message}");
        assert_eq!(fs::read_to_string(here.join(file)).unwrap(), "mine", "{line}");
        if whole {
            succeed(mge(here, script(here, &format!("{line} force\n"))));
            assert_ne!(fs::read(here.join(file)).unwrap(), b"mine", "{line}");
            succeed(mge(here, script(here, &format!("{line}\n"))));
        }
    }
    // The mistake is found before anything is done.
    fs::write(here.join("mine.tex"), "mine").unwrap();
    fail(mge(here, script(here, "save first.json\nrecord mine.tex\n")), "script.mge:2: ");
    assert!(!here.join("first.json").exists());
    // A task that was opened is saved to its own file.
    succeed(mge(here, script(here, "save own.json\ntask own.json\nsubgoal add 0 0\nsave\nsave own.json\n")));
}

#[test]
fn another_task_is_replaced_only_by_force() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    succeed(mge(here, script(here, "tool add ramp -0.5 0.5 10\nsave hand.json\n")));
    let mine = fs::read(here.join("hand.json")).unwrap();
    let propose = ["tasks", "propose", "task1", "--subgoals", "1", "--out", "hand.json"];
    for arguments in [propose.to_vec(), script(here, "save hand.json\n").to_vec()] {
        let refused = mge(here, &arguments);
        // A proposal is told first.
        let message = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(1), "{message}");
        assert!(message.contains("hand.json: it exists") && message.contains("--force"), "{message}");
        assert_eq!(fs::read(here.join("hand.json")).unwrap(), mine, "{arguments:?}");
    }
    succeed(mge(here, propose.iter().chain(&["--force"])));
    assert_ne!(fs::read(here.join("hand.json")).unwrap(), mine);
    succeed(mge(here, propose));
}

#[test]
fn puzzles_replace_no_file_of_the_user() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let index = r#"{"version": 2, "seed": 0, "split": "test", "start_noise": 0.01, "puzzles": []}"#;
    fs::create_dir(here.join("puzzles")).unwrap();
    fs::write(here.join("puzzles/index.json"), index).unwrap();
    train(here, "runs/a");
    for file in ["sweep.json", "report.md", "report.json"] {
        let mine = r#"{"task": ["task1"], "method": "ddpg", "seed": 0, "episodes": 9, "model": "true"}"#;
        fs::write(here.join(file), mine).unwrap();
        fail(mge(here, "puzzles bench puzzles --out . --quiet".split(' ')), "--force");
        assert_eq!(fs::read_to_string(here.join(file)).unwrap(), mine);
        fs::remove_file(here.join(file)).unwrap();
    }
    fs::write(here.join("index.json"), "{\"mine\": 1}").unwrap();
    fail(mge(here, "puzzles generate --count 1 --out . --quiet".split(' ')), "choose a folder that `mge puzzles");
    assert_eq!(fs::read_to_string(here.join("index.json")).unwrap(), "{\"mine\": 1}");
}

#[test]
fn the_trash_of_a_folder_that_does_not_exist_is_not_emptied() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.mge"), "empty-trash nowhere\n").unwrap();
    fail(mge(&folder, ["script", "s.mge"]), "nowhere");
}
