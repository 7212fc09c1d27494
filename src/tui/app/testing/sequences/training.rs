//! Trainings and their settings, clusters, models and figures, by keys.

use super::*;
use crate::tui::view::{Curves, ModelSummary};
use mge_run::Metric;

#[test]
fn the_run_that_a_key_resumes_is_named() {
    let mut view = typical();
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    for screen in ["1", "4", "5"] {
        check(view.clone(), screen, &[], "paused: p resumes task1-ddpg-mge-seed0");
    }
}

#[test]
fn the_status_is_silent_about_clusters_and_models_that_the_method_does_not_use() {
    let status = |method: mge_trainer::Method| {
        let mut view = empty();
        view.settings = view.settings.with_method(method);
        let (mut app, _) = app(view);
        let screen = text(&shot(&mut app, 120, 40));
        ["clusters ", "model "].map(|label| screen.contains(&format!("│{label}")))
    };
    assert_eq!(status(mge_trainer::Method::DdpgMge), [true, true]);
    assert_eq!(status(mge_trainer::Method::DdpgUniform), [false, false]);
    assert_eq!(status(mge_trainer::Method::DdpgAdaptive), [false, false]);
}

#[test]
fn training_is_started_paused_resumed_and_stopped() {
    check(empty(), "t enter", &["train"], "");
    check(typical(), "p", &["pause"], "");
    let paused = || {
        let mut view = typical();
        change_run(&mut view, 1, |run| run.state = RunState::Paused);
        view
    };
    check(paused(), "p", &["resume"], "paused");
    check(paused(), "t enter", &["train"], "paused");
    check(typical(), "x", &[], "stop 1 run?");
    check(typical(), "x y", &["stop"], "running");
    check(typical(), "x esc", &[], "running");
}

#[test]
fn epsilon_is_changed_by_key_and_palette() {
    check(empty(), "e 0 . 3 enter", &["epsilon 0.3"], "");
    check(empty(), "e", &[], "step:0.8:0.5:500");
    check(empty(), "e 7 enter esc", &[], "status");
    check(empty(), ": e p s i l o n space 0 . 5 enter", &["epsilon 0.5"], "");
}

#[test]
fn clusters_are_computed_shown_and_passed_to_the_training() {
    check(empty(), "c", &["clusters"], "");
    check(typical(), ": g u i d e enter", &["guide"], "");
    check(empty(), "a", &[], "c computes them");
    check(empty(), "b", &[], "no agent acts here");
    let mut single = typical();
    Arc::make_mut(single.prior.as_mut().unwrap()).stages.truncate(1);
    check(single, "", &[], "clusters 2 in 1 stage ");
}

#[test]
fn stale_clusters_are_grey_and_say_so() {
    let mut view = typical();
    view.prior_state = mge_workbench::PriorState::Stale;
    let (mut app, _) = app(view);
    let at = cell(&mut app, [0.4, 0.5]);
    let screen = shot(&mut app, 120, 40);
    assert_eq!(screen[at].fg, app.theme.dim);
    assert!(text(&screen).contains("out of date; soon computed again"));
}

#[test]
fn tasks_and_models_are_picked() {
    check(empty(), "o right enter", &["task task2"], "");
    check(empty(), "o t k 3 enter", &["task task3"], "");
    check(empty(), "o p s h", &[], "1 of 1: CREATE's level Push");
    check(empty(), "6 down enter", &["model true"], "");
}

#[test]
fn the_run_dialog_explains_its_fields_and_changes_only_what_was_changed() {
    check(empty(), "t", &[], "train on task1");
    check(typical(), "t", &[], "train on the edited task1");
    let settings = empty().settings.with_setting("ddpg.gamma", "0.9").unwrap();
    check(ViewModel { settings, ..empty() }, "t", &[], "Also set: ddpg.gamma 0.9.");
    check(empty(), "t", &[], "DDPG-MGE. Left and right choose how");
    check(empty(), "t", &[], "The agent places: b");
    check(empty(), "t left enter", &["method ddpg", "train"], "");
    check(empty(), "t right enter", &["method ddpg-uniform", "set epsilon linear:0.5:0:1000", "train"], "");
    check(empty(), "t left right enter", &["train"], "");
    check(empty(), "t up up up up up ctrl-u enter", &["set epsilon linear:0.5:0:1000", "train"], "");
    check(empty(), "t down 5 0 down 2 up 6 0 enter", &["set episodes 60", "train seeds 2"], "");
    check(empty(), "t down ctrl-u enter", &[], "`episodes` is empty: write a value");
    let stops = empty().settings.with_setting("stop.success", "0.8").unwrap();
    let view = ViewModel { settings: stops, ..empty() };
    check(view, "t up up up ctrl-u enter", &["set stop.success none", "train"], "");
    check(grouped(), "t down down 2", &[], "! there are runs with these settings and seeds: guided-0, guided-1");
    // A model file is known by its content, wherever it is.
    let mut view = grouped();
    let source = mge_trainer::PriorSource::from("bucket-box".to_owned()).identified();
    view.models[1] = ModelSummary { source: source.clone(), name: "bucket-box".into(), ..view.models[1].clone() };
    change_run(&mut view, 0, |run| Arc::make_mut(&mut run.config).prior = source);
    check(view, "t up up up up right", &[], "! there are runs with these settings and seeds: guided-0");
    check(empty(), "t down ctrl-u 5 0 enter", &["set episodes 50", "train"], "");
    check(empty(), "t down down ctrl-u 3 enter", &["train seeds 3"], "");
    check(empty(), "t down down down ctrl-u 7 enter", &["seed 7", "train"], "");
    check(empty(), "t up up up up up ctrl-u 0 . 3 enter", &["set epsilon 0.3", "train"], "");
    check(empty(), "t up up up up right enter", &["model true", "train"], "");
    check(empty(), "t down down 3 enter", &["train seeds 3"], "");
    check(empty(), "t up up up 0 . 8 down 3 0 enter", &["set stop.success 0.8", "set stop.minutes 30", "train"], "");
    check(empty(), "t up up up n o n e enter", &["set stop.success none", "train"], "");
    check(empty(), "t up m i n e enter", &["train runs/mine"], "");
    check(empty(), "t up a / b enter", &[], "`a/b` is not a name");
    check(empty(), "t down down 0 enter", &[], "`0` is not a number of seeds from 1 to 1000");
    check(empty(), "t down down 0 enter down", &[], "It determines everything random.");
    check(empty(), "t left up up up up up", &[], "Not used by DDPG.");
    check(empty(), "t left up up up up", &[], "model      > not used");
    check(empty(), "t down 5 backspace enter", &[], "`episodes` is empty: write a value");
    check(empty(), "t down 5 backspace 6 enter", &["set episodes 6", "train"], "");
    check(empty(), "t down backspace backspace enter", &["set episodes 20", "train"], "");
    check(empty(), "t down down down 7 down left", &[], "name         task1-ddpg-mge-seed7");
    check(empty(), "t down 1 0 0", &[], "linear:0.8:0.05:1500 is longer than the run");
    check(empty(), "t esc", &[], "status");
}

#[test]
fn a_wrong_value_in_the_run_dialog_is_told_while_it_is_typed() {
    check(empty(), "t down 0", &[], "episodes: is 0, but must be a whole number from 1");
    check(empty(), "t down 0 down", &[], "episodes: is 0, but must be a whole number from 1");
    check(empty(), "t up up up up up l i n", &[], "`lin` is not a number");
    check(empty(), "t up up up 2", &[], "stop.success");
    check(empty(), "t up a / b", &[], "`a/b` is not a name");
    check(empty(), "t down 5 backspace", &[], "`episodes` is empty: write a value");
    let (mut app, _) = app(empty());
    press(&mut app, "t down 5 backspace");
    let screen = text(&shot(&mut app, 80, 24));
    assert!(screen.contains("usual one") && !screen.contains("x 2000 episodes"), "{screen}");
    press(&mut app, "esc");
    press(&mut app, "t down 0");
    let wrong = text(&shot(&mut app, 80, 24));
    press(&mut app, "backspace 5");
    let right = text(&shot(&mut app, 80, 24));
    assert!(wrong.contains("Episodes of each run.") && !right.contains("whole number"), "{wrong}\n{right}");
    assert_eq!(wrong.find("train on task1"), right.find("train on task1"), "the dialog stays where it is");
}

#[test]
fn the_number_of_seeds_is_kept_for_the_next_training() {
    check(empty(), "t down down ctrl-u 3 enter t enter", &["train seeds 3", "train seeds 3"], "");
}

#[test]
fn models_are_chosen_and_trained() {
    check(empty(), "6 end enter", &["model true"], "");
    check(empty(), "6 T enter", &["model train box,bucket models/box-bucket.safetensors"], "");
    check(empty(), "6 T ctrl-w ctrl-w x space y enter", &[], "unknown tool `x`: use one of bucket, square");
    let mut level = empty();
    level.task = Arc::new(mge_task::load("create/Belt").unwrap());
    check(level, "6 T enter", &["model train create models/create.safetensors"], "");
    let mut view = empty();
    view.model_work = Some(("training models/mine.safetensors".into(), Some(0.5)));
    check(view.clone(), "6", &[], "training models/mine.safetensors 50 %");
    check(view.clone(), "q", &[], "training models/mine.safetensors ends");
    check(view.clone(), "6 x", &[], "stop the training of the model?");
    check(view.clone(), "6 x y", &["model stop"], "");
    let run = ViewModel { runs: typical().runs, watched: typical().watched, ..view };
    check(run, "4 x y", &["stop"], "");
}

#[test]
fn a_model_that_does_not_fit_the_task_is_refused_however_it_is_chosen() {
    let mut view = empty();
    let about = "wrong tools: lacks box; 50 launches".to_owned();
    view.models.push(ModelSummary { name: "wall".into(), about, ..ModelSummary::default() });
    check(view.clone(), "6 end enter", &[], "wall: wrong tools: lacks box");
    check(view, ": m o d e l space w a l l enter", &[], "wall: wrong tools: lacks box");
}

#[test]
fn figures_are_previewed_and_exported() {
    check(empty(), "7 down", &[], "there is nothing for the clusters figure in tests");
    check(empty(), "7 enter", &["figure scene figures/task1-scene.png"], "");
    check(empty(), "7 v", &[], "figures/task1-scene.png does not exist yet: enter exports it");
    check(empty(), "7 s", &["figure scene figures/task1-scene.svg"], "");
    let offered = |keys: &str| {
        let (mut app, _) = app(empty());
        press(&mut app, keys);
        text(&shot(&mut app, 120, 40)).lines().last().unwrap_or_default().to_owned()
    };
    assert!(offered("7").starts_with("enter as PNG  s as SVG  v view  tab compose"), "{}", offered("7"));
}

#[test]
fn a_part_that_is_missing_says_why() {
    check(typical(), "g", &[], "no agent acts here: critic, actor and prediction");
    check(typical(), "pageup b", &[], "no critic or actor: the checkpoint is being read");
    let (mut app, _) = app(typical());
    press(&mut app, "pageup b");
    shot(&mut app, 120, 40);
    bring(&mut app, typical());
    shot(&mut app, 120, 40);
    app.tick(std::time::Duration::ZERO);
    assert!(!app.is_changed(), "the same reason is not drawn again");
    let mut damaged = typical();
    damaged.watched.as_mut().unwrap().agent = Some(Err("the checkpoint is damaged".to_owned()));
    bring(&mut app, damaged);
    let screen = text(&shot(&mut app, 120, 40));
    assert!(screen.contains("no critic or actor: the checkpoint is damaged"), "{screen}");
    let mut view = typical();
    view.watched = None;
    check(view, "pageup", &[], "no run with episodes is being watched");
}

#[test]
fn a_run_without_episodes_says_what_it_waits_for() {
    let without = |queued: bool, active: bool| {
        let mut view = typical();
        change_run(&mut view, 1, |run| {
            (run.queued, run.active, run.done, run.curves) = (queued, active, 0, Arc::default());
        });
        view
    };
    check(without(true, false), "4", &[], "no episodes yet: queued");
    check(without(false, true), "4", &[], "no episodes yet: running");
    let mut ended = without(false, false);
    change_run(&mut ended, 1, |run| run.state = RunState::Stopped("on request".into()));
    check(ended, "4", &[], "no episodes yet: stopped");
}

#[test]
fn ends_of_trainings_are_announced() {
    let (mut app, _) = app(typical());
    let mut view = typical();
    bring(&mut app, view.clone());
    assert_eq!(app.request.take(), None);
    change_run(&mut view, 1, |run| (run.state, run.active) = (RunState::Finished, false));
    bring(&mut app, view.clone());
    assert!(matches!(app.request.take(), Some(TerminalRequest::Notify(_))));
    bring(&mut app, view.clone());
    assert_eq!(app.request.take(), None, "only once");
    change_run(&mut view, 1, |run| (run.state, run.active) = (RunState::Running, true));
    bring(&mut app, view.clone());
    change_run(&mut view, 1, |run| (run.state, run.active) = (RunState::Failed("no space".into()), false));
    bring(&mut app, view);
    let failed = "task1-ddpg-mge-seed0 has failed: no space".to_owned();
    assert_eq!(app.request.take(), Some(TerminalRequest::Notify(failed)));
}

#[test]
fn a_paused_run_is_stopped_after_a_question() {
    let mut view = typical();
    change_run(&mut view, 1, |run| run.state = RunState::Paused);
    check(view, "x", &[], "stop 1 run?");
}

#[test]
fn a_queued_run_leaves_the_queue_after_a_question() {
    let mut view = typical();
    change_run(&mut view, 1, |run| (run.queued, run.active, run.state) = (true, false, RunState::NotStarted));
    check(view.clone(), "x", &[], "in the queue");
    check(view, "x y", &["stop"], "");
}

#[test]
fn the_state_of_the_clusters_is_shown() {
    let mut view = typical();
    view.prior_state = mge_workbench::PriorState::Building(mge_trainer::Phase::BuildingPrior { stage: 0, stages: 2 });
    check(view, "", &[], "computing stage 1 of 2");
    let mut of_run = typical();
    let prior = of_run.prior.take();
    of_run.watched.as_mut().unwrap().prior = prior;
    check(of_run, "", &[], "used by the run");
}

#[test]
fn clusters_and_the_actions_behind_them_are_switched() {
    let colours = |keys: &str| {
        let (mut app, _) = app(typical());
        press(&mut app, keys);
        let (x, y) = cell(&mut app, [0.4, 0.5]);
        let screen = shot(&mut app, 120, 40);
        // A dot may be in the cell beside.
        let around = (y - 1..=y + 1).flat_map(|y| (x - 1..=x + 1).map(move |x| (x, y)));
        around.map(|cell| screen[cell].symbol()).collect::<String>()
    };
    assert!(["", "a a"].iter().all(|keys| colours(keys).contains('+')));
    assert!(!colours("a").contains('+'));
    assert_ne!(colours("a"), colours("a z"), "an action is a dot");
}

#[test]
fn curves_that_are_constant_are_one_line() {
    let mut curves = Curves::default();
    (1..=9).for_each(|episode| {
        curves.push(
            episode,
            1.0,
            Metric::KEPT.map(|metric| if metric == Metric::Epsilon { 0.25 } else { episode as f32 }),
        )
    });
    let mut view = typical();
    change_run(&mut view, 1, |run| run.curves = Arc::new(curves));
    check(view, "4", &[], "epsilon 0.25  ");
}

#[test]
fn the_run_dialog_estimates_the_cost_from_the_latest_runs() {
    check(empty(), "t", &[], "1 x 2000 episodes: no run has got far enough");
    let known = |done: u64| {
        let mut curves = Curves::default();
        // Each episode takes half a second and five actions.
        for episode in 1..=done {
            curves.push(episode, 0.5 * episode as f32, [5.0 * episode as f32; Metric::KEPT.len()]);
        }
        let mut view = typical();
        view.runs.truncate(1);
        view.watched = None;
        change_run(&mut view, 0, |run| (run.done, run.curves) = (done, Arc::new(curves)));
        view
    };
    check(known(2000), "t", &[], "1 x 2000 episodes: about 10000 charged actions, 16:40 of training");
    check(known(1000), "t down ctrl-u 1 0 0", &[], "1 x 100 episodes: about 500 charged actions, 50 s of");
    check(known(900), "t", &[], "no run has got far enough");
    check(known(2000), "t down down ctrl-u 2", &[], "2 x 2000 episodes: about 20000 charged actions, 33:20");
    check(known(2000), "t right", &[], "run of other methods)");
    // Their model and clusters take time and actions, which other methods do not need.
    check(known(2000), "t left", &[], "no run has got far enough to tell");
    let view = grouped();
    let train = [": t r a i n space s e e d s space 2 enter"].concat();
    check(view, &train, &["train seeds 2"], "there are runs with these settings and seeds: guided-0, guided-1");
}
