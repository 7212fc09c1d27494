//! Effects and reports of commands, state by state.

mod opened;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use super::*;
use mge_run::{Event, RunState};
use mge_task::Region;
use mge_trainer::Phase;

/// A session with small runs and clusters that are quick to compute.
fn session(folder: &Path) -> Session {
    let mut session = Session::new(mge_task::load("task1").unwrap(), folder.to_owned());
    session.runs.cores = NonZeroUsize::new(1);
    let settings = "method ddpg\nepisodes 3\nset ddpg.hidden 8\nmodel true\nset guidance.model_rollouts 50\n\
                    set guidance.environment_rollouts 5";
    run(&mut session, settings);
    session
}

/// A text in the header of a PNG.
pub fn text_of_png(path: &Path, keyword: &str) -> String {
    let reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let mut texts = reader.info().uncompressed_latin1_text.iter();
    texts.find(|chunk| chunk.keyword == keyword).unwrap().text.clone()
}

fn try_run(session: &mut Session, lines: &str) -> Result<(), String> {
    Script::parse(lines, "s", &[]).unwrap().run(session, |_| {}).map_err(|error| error.to_string())
}

fn run(session: &mut Session, lines: &str) {
    try_run(session, lines).unwrap_or_else(|error| panic!("{lines}: {error}"));
}

fn apply(session: &mut Session, line: &str) -> Result<String, String> {
    session.apply(Command::parse(line).unwrap().unwrap()).map_err(|error| error.to_string())
}

fn quoted(path: &Path) -> String {
    shell_words::quote(&path.display().to_string()).into_owned()
}

#[test]
fn clusters_are_absent_built_fresh_and_stale() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let gate = session.gate.clone();
    assert_eq!((session.prior_state(), session.clusters_are_outdated()), (PriorState::Absent, false));
    let held = gate.lock().unwrap();
    apply(&mut session, "clusters").unwrap();
    assert_eq!(session.prior_state(), PriorState::Building(Phase::Waiting));
    assert!(!session.clusters_are_outdated());
    apply(&mut session, "clusters").unwrap();
    assert_eq!(
        apply(&mut session, "wait").unwrap(),
        "runs running or queued: 0; computations: 1",
        "the first is cancelled"
    );
    drop(held);
    run(&mut session, "wait");
    assert_eq!((session.prior_state(), session.clusters_are_outdated()), (PriorState::Fresh, false));
    assert_eq!(session.prior().unwrap().seed, 0);
    run(&mut session, "seed 1");
    assert_eq!((session.prior_state(), session.clusters_are_outdated()), (PriorState::Stale, true));
    // Clusters being computed count as well, and earlier results are not failures.
    let held = gate.lock().unwrap();
    apply(&mut session, "clusters").unwrap();
    assert!(!session.clusters_are_outdated());
    run(&mut session, "seed 0");
    assert!(session.clusters_are_outdated());
    drop(held);
    run(&mut session, "wait");
    assert_eq!(session.prior_state(), PriorState::Stale);
}

#[test]
fn saving_keeps_the_name_and_what_another_program_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let [file, copy] = ["mine.json", "copy.json"].map(|name| folder.path().join(name));
    let write = |name: &str| {
        let text = std::fs::read_to_string(&file).unwrap();
        let mut task: serde_json::Value = serde_json::from_str(&text).unwrap();
        task["name"] = name.into();
        std::fs::write(&file, task.to_string()).unwrap();
    };
    let name = |file: &Path| mge_task::load(&file.display().to_string()).unwrap().name;
    run(&mut session, &format!("save {}", quoted(&file)));
    write("other");
    run(&mut session, &format!("task {}\nsubgoal add 0 0\nsave\nsubgoal add 0.1 0.1", quoted(&file)));
    assert_eq!(name(&file), "other");
    write("changed");
    assert!(apply(&mut session, "save").unwrap_err().contains("was changed by another program"));
    assert_eq!(name(&file), "changed");
    run(&mut session, &format!("save {}\nsave {} force\nsubgoal delete 1\nsave", quoted(&copy), quoted(&file)));
    assert_eq!((name(&copy), name(&file)), ("copy".to_owned(), "mine".to_owned()));
}

#[test]
fn a_level_of_create_is_edited_saved_loaded_played_by_hand_and_trained() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let file = folder.path().join("push.json");
    let saved = quoted(&file);
    run(&mut session, "task create/Push\ntool add cannon 0.5 0.9 angle=100 force=80\ntool set 3 angle=135");
    assert_eq!(
        apply(&mut session, "save").unwrap_err(),
        "Push has no file: name one to save to, such as `save my-task.json`"
    );
    run(
        &mut session,
        &format!("part move marker -0.6 0.7\ngoal move 0.5 0.5\nplaceable ramp 14\nundo\nredo\nsave {saved}"),
    );
    let edited = session.task().clone();
    let script = session.to_script();
    run(&mut session, &format!("task task1\ntask {saved}"));
    assert_eq!((session.task(), session.is_dirty()), (&edited, false));
    let cannon = edited.tools[2].tool();
    assert_eq!(
        (cannon.kind.name(), cannon.angle, cannon.force),
        ("cannon", 135.0 * std::f64::consts::PI / 180.0, 80.0)
    );
    assert_eq!(edited.marker.as_ref().unwrap().ball.position, [-0.6, 0.7]);
    assert_eq!((edited.name.as_str(), edited.placeable.kind.name()), ("push", "ramp"));
    run(&mut session, "place 0.9 0.9");
    let trace = &session.hand_play.trace;
    assert_eq!(trace.steps.len(), 1);
    assert!(trace.steps.iter().all(|step| step.placement == mge_env::Placement::Placed), "{trace:?}");
    assert!(apply(&mut session, "place 0.9 0.9").unwrap().contains("not placed"));
    run(&mut session, "train\nwait");
    assert_eq!(session.run().unwrap().state(), RunState::Finished);
    assert_eq!(session.run().unwrap().episodes(), 3);
    // The recorded script repeats the session.
    std::fs::remove_file(&file).unwrap();
    let mut again = self::session(folder.path());
    run(&mut again, &script);
    assert_eq!(*again.task(), edited);
    let refused = apply(&mut again, "tool set 1 force=7").unwrap_err();
    assert_eq!(refused, "force: a floor has none: it has size, angle, radius, elasticity, friction");
    assert_eq!(
        apply(&mut again, "tool set 9 angle=7").unwrap_err(),
        "tool 9: there are only 3: choose one from 1 to 3"
    );
}

#[test]
fn failed_clusters_are_not_worth_another_try() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "clusters\nwait\nset prior nowhere.safetensors");
    assert!(session.clusters_are_outdated());
    let error = try_run(&mut session, "clusters\nwait").unwrap_err();
    assert!(error.contains("nowhere.safetensors"), "{error}");
    assert_eq!((session.prior_state(), session.clusters_are_outdated()), (PriorState::Stale, false));
}

#[test]
fn clusters_are_given_to_a_training_with_the_same_number_of_subgoals() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    assert!(apply(&mut session, "guide").is_err(), "there are none");
    run(&mut session, "clusters\nwait\ntrain until 1\nwait");
    assert_eq!(apply(&mut session, "guide").unwrap(), "the training takes the clusters at its next episode");
    run(&mut session, "resume\nwait");
    let saved = session.run().unwrap().prior();
    assert_eq!(saved.as_deref(), session.prior().map(|prior| &**prior));
    assert!(session.to_script().contains("\nguide\n"), "{}", session.to_script());
    run(&mut session, "train until 1\nwait\nsubgoal add 0.1 0.1 4\nclusters\nwait");
    let error = apply(&mut session, "guide").unwrap_err();
    assert_eq!(error, "the clusters are for 2 subgoals, but the run's task has 1");
}

#[test]
fn hand_play_reports_each_placement_and_can_be_reset() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    assert_eq!(apply(&mut session, "place -0.9 0.9").unwrap(), "placed; reward 0.01");
    assert_eq!(
        apply(&mut session, "place -0.9 0.9").unwrap(),
        "not placed, but the action is used: box would be too near an earlier tool; reward 0.00"
    );
    assert_eq!(session.hand_play.trace.steps.len(), 2);
    assert_eq!(session.hand_play.env.snapshot().placed.len(), 1);
    assert_eq!(apply(&mut session, "reset").unwrap(), "a new episode");
    assert!(session.hand_play.trace.steps.is_empty());
    run(&mut session, "place -0.9 0.9\ngoal move 0.5 0.5");
    assert!(session.hand_play.trace.steps.is_empty(), "the task has changed");
    let path = folder.path().join("mine.json");
    run(&mut session, &format!("place -0.9 0.9\nsave {}\ngoal move 0.5 0.5", quoted(&path)));
    assert_eq!(session.hand_play.trace.steps.len(), 1, "the task is the same");
}

#[test]
fn a_task_is_saved_under_the_name_of_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    assert!(apply(&mut session, "save").is_err(), "a shipped task has no file");
    run(&mut session, "goal move 0.5 0.5");
    assert!(session.is_dirty() && session.file().is_none());
    let path = folder.path().join("mine.json");
    let report = apply(&mut session, &format!("save {}", quoted(&path))).unwrap();
    assert_eq!(report, format!("saved to {}", path.display()));
    assert_eq!((session.file(), session.is_dirty(), session.task().name.as_str()), (Some(&*path), false, "mine"));
    run(&mut session, "goal move 0.4 0.4\nsave");
    assert_eq!(&mge_task::load(&path.display().to_string()).unwrap(), session.task());
    run(&mut session, "undo");
    assert_eq!((session.task().goal.position, session.task().name.as_str()), ([0.5, 0.5], "mine"));
}

#[test]
fn an_undone_edit_is_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "goal size 7");
    assert_eq!(apply(&mut session, "undo").unwrap(), "the edit is undone");
    assert_ne!(session.task().goal.radius, 7.0);
    assert_eq!(apply(&mut session, "redo").unwrap(), "the edit is redone");
    assert_eq!((session.task().goal.radius, session.config().task.goal.radius), (7.0, 7.0));
    assert_eq!(
        apply(&mut session, "redo").unwrap_err(),
        "there is nothing to redo: only edits of the task are done again"
    );
}

#[test]
fn new_runs_go_to_the_folder_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let chosen = folder.path().join("elsewhere");
    let report = apply(&mut session, &format!("out {}", quoted(&chosen))).unwrap();
    assert_eq!(report, format!("runs go to {}", chosen.display()));
    run(&mut session, "train\nwait");
    assert_eq!(session.run().unwrap().directory().path().parent(), Some(&*chosen));
}

#[test]
fn answers_to_proposals_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let regions = [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]].map(|position| Region { position, radius: 4.0 });
    session.setup.editor.propose(regions.to_vec(), 0);
    assert_eq!(session.proposed(), regions);
    assert_eq!(apply(&mut session, "proposal accept 1").unwrap(), "subgoal 2 was proposed");
    assert_eq!(apply(&mut session, "proposal delete 1").unwrap(), "rejected: `undo` reverts it");
    let report = apply(&mut session, "proposal accept").unwrap();
    assert_eq!(report, "1 proposed in place of 2 before: `undo` reverts it");
    assert_eq!(session.task().subgoals, regions[2..]);
}

#[test]
fn a_run_has_a_phase_evaluations_and_past_episodes() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "set evaluation.every 1\nset evaluation.episodes 1\ntrain until 1\nwait");
    let paused = session.run().unwrap();
    assert_eq!((paused.phase(), paused.state()), (Some(Phase::Paused), RunState::Paused));
    assert!(paused.live.is_none() && paused.prior().is_none());
    assert_eq!(paused.history().evaluations.iter().map(|evaluation| evaluation.episode).collect::<Vec<_>>(), [1]);
    paused.request_live();
    run(&mut session, "resume\nwait");
    let finished = session.run().unwrap();
    assert_eq!((finished.phase(), finished.state()), (None, RunState::Finished));
    assert_eq!(finished.live.as_ref().unwrap().trace.episode, 2);
    let first = finished.saved.past_episode(1).unwrap();
    assert_eq!((first.episode, first.steps.len() as u64), (1, finished.history().records[0].steps));
    assert_eq!(session.run_numbered(0).map(|run| &run.name), Some(&finished.name));
    assert!(session.run_numbered(1).is_none());
}

#[test]
fn the_policy_of_a_run_starts_with_the_noise_of_its_training() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "set start_noise 0.01\ntrain\nwait");
    let saved = session.run().unwrap().saved.clone();
    let [first, second] = [1, 2].map(|seed| saved.player(None).unwrap().episode(seed).start.shift);
    assert_ne!(first, second);
    assert!(first.iter().chain(&second).all(|shift| shift.abs() <= 0.01), "{first:?}, {second:?}");
}

#[test]
fn a_stopped_run_keeps_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "train until 1\nwait\nstop\nwait");
    assert_eq!(session.run().unwrap().state(), RunState::Stopped("on request".to_owned()));
}

#[test]
fn expectations_compare_and_a_script_is_recorded_without_quit() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    for (line, holds) in [
        ("expect subgoals = 1", true),
        ("expect subgoals >= 1", true),
        ("expect subgoals <= 1", true),
        ("expect subgoals >= 2", false),
        ("expect subgoals <= 0", false),
        ("expect subgoals <= 2", true),
        ("expect proposals = 0", true),
    ] {
        assert_eq!(apply(&mut session, line).is_ok(), holds, "{line}");
    }
    let path = folder.path().join("session.mge");
    let report = apply(&mut session, &format!("record {}", quoted(&path))).unwrap();
    assert_eq!(report, format!("saved the session to {}", path.display()));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), session.to_script());
    assert!(!session.quit);
    apply(&mut session, "quit").unwrap();
    assert!(session.quit && !session.to_script().contains("quit"));
}

#[test]
fn one_model_is_trained_at_a_time() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let path = folder.path().join("first.safetensors");
    let training = format!("training {}", path.display());
    let gate = session.gate.clone();
    let held = gate.lock().unwrap();
    assert_eq!(apply(&mut session, &format!("model train box {} 1", quoted(&path))).unwrap(), training);
    let error = apply(&mut session, "model train box mine.safetensors 1").unwrap_err();
    assert!(error.starts_with(&format!("{training}: wait for its end")), "{error}");
    assert_eq!(session.model_work().map(|(name, _)| name), Some(training.clone()));
    assert_eq!(apply(&mut session, "model stop").unwrap(), format!("ended: {training}"));
    drop(held);
    assert!(session.model_work().is_none());
    // Other jobs do not count as model work.
    let held = gate.lock().unwrap();
    apply(&mut session, "clusters").unwrap();
    assert!(session.model_work().is_none() && apply(&mut session, "model stop").is_err());
    drop(held);
    run(&mut session, "wait");
}

#[test]
fn progress_and_results_of_computations_are_notices() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    let (mut progress, mut finished) = (Vec::new(), Vec::new());
    apply(&mut session, "clusters").unwrap();
    session
        .wait(|notice| match notice {
            Notice::Progress { progress: now, .. } => progress.push(*now),
            Notice::Finished { outcome, .. } => finished.push(outcome.clone()),
            _ => {}
        })
        .unwrap();
    assert_eq!(finished, [Ok("the action clusters are ready".to_owned())]);
    assert_eq!(Progress { done: 0, total: 0 }.share(), None);
    assert_eq!(Progress { done: 1, total: 2 }.share(), Some(0.5));
    let begins = progress.iter().zip(progress.iter().skip(1)).all(|(before, after)| before != after);
    assert!(begins && progress.iter().all(|now| now.total == 2), "{progress:?}");
}

#[test]
fn a_new_prior_in_a_training_is_an_event_of_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "clusters\nwait\ntrain until 1\nwait\nguide");
    let mut changes = Vec::new();
    apply(&mut session, "resume").unwrap();
    session
        .wait(|notice| {
            if let Notice::Run { run, event: Event::ClustersChanged { episode, .. } } = notice {
                changes.push((*run, *episode));
            }
        })
        .unwrap();
    assert_eq!(changes, [(0, 1)]);
}

#[test]
fn properties_of_commands_in_scripts() {
    use super::command::{DependsOn, WaitFor};
    for (line, begins_work, acts_on_run) in [
        ("clusters", true, false),
        ("clusters a.json", false, false),
        ("guide", false, false),
        ("model train box a.safetensors 1", true, false),
        ("expect episodes = 1", false, true),
        ("expect subgoals = 1", false, false),
        ("pause", false, false),
        ("resume", false, false),
        ("continue", false, true),
        ("continue runs/a", false, false),
        ("evaluate", false, true),
        ("propose 2", true, false),
        ("record a.mge", false, false),
    ] {
        let command = Command::parse(line).unwrap().unwrap();
        assert_eq!(command.to_string(), line);
        let script_role = command.as_execute().script_role();
        let found = (
            script_role.awaits == WaitFor::Work,
            [DependsOn::Run, DependsOn::Checkpoint].contains(&script_role.depends_on),
        );
        assert_eq!(found, (begins_work, acts_on_run), "{line}");
    }
}

#[test]
fn a_command_names_the_file_that_it_would_replace() {
    let folder = tempfile::tempdir().unwrap();
    for (before, name, after) in
        [("clusters", "a.json", ""), ("model train box", "a.safetensors", " 1"), ("figure scene", "a.png", "")]
    {
        let file = folder.path().join(name);
        let command = Command::parse(&format!("{before} {}{after}", file.display())).unwrap().unwrap();
        assert_eq!(command.overwrites(), Vec::<PathBuf>::new(), "{name}: there is no such file");
        std::fs::write(&file, "mine").unwrap();
        assert_eq!(command.overwrites(), [file], "{name}");
        assert_eq!(command.forced().overwrites(), Vec::<PathBuf>::new(), "{name}: the user has agreed");
    }
}

#[test]
fn a_folder_is_no_file_to_save_to() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    for line in [format!("save {}", quoted(folder.path())), format!("save {} force", quoted(folder.path()))] {
        assert!(Command::parse(&line).unwrap().unwrap().overwrites().is_empty(), "nothing is asked");
        let error = apply(&mut session, &line).unwrap_err();
        assert!(error.contains("a folder"), "{error}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn endless_files_are_refused_as_tasks_and_models() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    // No process writes to it.
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [&pipe, Path::new("/dev/zero")] {
        for line in ["task", "model", "model train box"] {
            let line = format!("{line} {}", quoted(path));
            let outcome = apply(&mut session, &line)
                .and_then(|_| try_run(&mut session, "clusters\nwait").map(|()| String::new()));
            let error = outcome.unwrap_err();
            assert!(error.contains("not a regular file"), "{line}: {error}");
            assert_eq!(error.matches(&*path.to_string_lossy()).count(), 1, "{line}: {error}");
        }
    }
}

#[test]
fn errors_of_edits_name_places_as_the_screens_do() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session(folder.path());
    run(&mut session, "subgoal add 0.5 0\ntool add box 0.5 0.9");
    for (line, place) in [
        ("tool size 1 -4", "tool 1 size: "),
        ("subgoal size 1 -1", "subgoal 1 radius: "),
        ("ball move 3 0", "ball x: "),
        ("subgoal move 1 0 3", "subgoal 1 y: "),
        ("tool set 1 friction=-1", "tool 1 friction: "),
    ] {
        let error = apply(&mut session, line).unwrap_err();
        assert!(error.starts_with(place), "{line}: {error}");
    }
}
