//! Guidance of exploration: clusters, plans, models, needs.

use super::*;

#[test]
fn clusters_are_used_by_the_methods_that_have_them() {
    let folder = tempfile::tempdir().unwrap();
    for method in Method::ALL {
        let mut config = config(method, 6);
        config.epsilon = "1".parse().unwrap();
        let run = new_run(folder.path(), method.name(), &config);
        finish(&run);
        let records = RunHistory::read(&run).unwrap().records;
        let guided = method.has_clusters();
        // Open-loop replay repeats its first success.
        let first_goal = records.iter().position(|record| record.goal).filter(|_| method == Method::OpenLoop);
        let explored = first_goal.map_or(&records[..], |first| &records[..=first]);
        assert!(explored.iter().all(|record| record.guided == guided), "{method}");
        assert_eq!(run.path().join("prior.json").exists(), guided);
    }
}

#[test]
fn clusters_follow_the_agent_s_own_rewarding_actions() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 40);
    config.epsilon = "1".parse().unwrap();
    config.refinement = Refinement { every: 10, least: 3, most: 5 };
    let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap());
    let mut training = Training::new(config.clone(), Some(prior.clone())).unwrap();
    let mut reached = vec![0; 2];
    for _ in 0..40 {
        let (record, _) = training.run_episode().unwrap();
        reached[0] += record.subgoals;
        if let Some(refined) = training.refine().unwrap() {
            assert_eq!(training.episode() % 10, 0);
            assert_eq!(training.prior(), Some(&refined));
        }
    }
    assert!(reached[0] >= 3, "{reached:?}");
    let refined = training.prior().unwrap();
    assert_eq!(refined.stages[0].actions.len(), 5);
    assert_ne!(refined.stages[0].clusters, prior.stages[0].clusters);
    // The run records the change, and its file contains the current clusters.
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let saved = std::fs::read_to_string(run.path().join("prior.json")).unwrap();
    assert_eq!(saved, refined.to_json());
}

#[test]
fn clusters_are_refined_only_from_enough_actions() {
    let mut config = config(Method::DdpgMge, 20);
    config.epsilon = "1".parse().unwrap();
    let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap());
    for (least, expected) in [(4, true), (1000, false)] {
        config.refinement = Refinement { every: 1, least, most: least };
        let mut training = Training::new(config.clone(), Some(prior.clone())).unwrap();
        let mut refined = 0;
        for _ in 0..20 {
            training.run_episode().unwrap();
            if let Some(now) = training.refine().unwrap() {
                refined += 1;
                let changed = now.stages.iter().zip(&prior.stages).filter(|(now, built)| now.actions != built.actions);
                changed.for_each(|(stage, _)| assert_eq!(stage.actions.len(), least));
            }
        }
        assert_eq!(refined > 0, expected, "{least}");
    }
}

#[test]
fn guidance_is_drawn_at_the_configured_granularity() {
    // Changes between clusters and policy, directly after a subgoal and elsewhere.
    let changes = |granularity| {
        let mut config = config(Method::DdpgMge, 30);
        config.epsilon = "0.7".parse().unwrap();
        config.granularity = granularity;
        let prior = Some(Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap()));
        let mut training = Training::new(config, prior).unwrap();
        let mut changes = [0, 0];
        for _ in 0..30 {
            let (_, trace) = training.run_episode().unwrap();
            for pair in trace.steps.windows(2).filter(|pair| pair[0].source != pair[1].source) {
                changes[usize::from(pair[0].subgoals.is_empty())] += 1;
            }
        }
        changes
    };
    assert_eq!(changes(Granularity::Episode), [0, 0]);
    let [after_a_subgoal, elsewhere] = changes(Granularity::Stage);
    assert!(after_a_subgoal > 0 && elsewhere == 0, "{after_a_subgoal} {elsewhere}");
    assert!(changes(Granularity::Step)[1] > 0);
}

#[test]
fn plans_through_the_true_physics_reach_the_subgoal() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::Planning, 4);
    config.planner.rollouts = 100;
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let records = RunHistory::read(&run).unwrap().records;
    assert!(records.iter().map(|record| record.subgoals).sum::<u32>() >= 3, "{records:?}");
    assert!(records.iter().all(|record| record.critic_loss.is_none()), "nothing is learned");
}

#[test]
fn a_method_that_predicts_needs_a_model() {
    let mut config = config(Method::Planning, 3);
    config.prior = PriorSource::Uniform;
    let error = Training::new(config, None).unwrap_err().to_string();
    assert!(error.contains("predicts nothing"), "{error}");
}

#[test]
fn a_shipped_model_is_chosen_by_its_name() {
    let of = |name: &str| {
        let config = RunConfig { prior: PriorSource::from(name.to_owned()), ..config(Method::DdpgMge, 4) };
        rollout_model(&config.prior, &config, |_| (), &Stop::default()).unwrap().unwrap()
    };
    assert_eq!(of("bucket-box").sha256(), of("learned").sha256());
}

#[test]
fn a_model_is_trained_for_any_tools_with_the_seed_of_the_run() {
    let of = |seed: u64, kind: ToolKind| {
        let mut config = RunConfig { prior: PriorSource::default(), seed, ..config(Method::DdpgMge, 4) };
        config.model = TaskModelConfig { launches: 3, epochs: 2 };
        Arc::make_mut(&mut config.task).placeable.kind = kind;
        check_model(&config).unwrap();
        let mut epochs = 0;
        let count = |phase: Phase| epochs = if let Phase::TrainingModel { epochs, .. } = phase { epochs } else { 9 };
        let model = rollout_model(&config.prior, &config, count, &Stop::default()).unwrap().unwrap();
        // None if it came from the cache.
        assert!(epochs == 0 || epochs == 2, "{epochs}");
        model.sha256()
    };
    assert_eq!(of(1, ToolKind::Wall), of(1, ToolKind::Wall));
    assert_ne!(of(1, ToolKind::Wall), of(2, ToolKind::Wall));
    assert_ne!(of(1, ToolKind::Wall), of(1, ToolKind::Square));
}

#[test]
fn a_missing_model_fails_the_run_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMge, 4);
    config.prior = PriorSource::from("nowhere.safetensors".to_owned());
    let run = new_run(folder.path(), "run", &config);
    let (_sender, controls) = unbounded();
    let error = train(&run, &controls, &Watch::default()).unwrap_err().to_string();
    assert!(error.contains("nowhere.safetensors"), "{error}");
    assert_eq!(run.status().unwrap().state, RunState::Failed(error));
}

#[test]
fn the_log_has_the_needs_of_every_stage() {
    let folder = tempfile::tempdir().unwrap();
    let mut config = config(Method::DdpgMgeAdaptive, 20);
    config.epsilon = "need:0.5:0.25:20".parse().unwrap();
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let events = read_events(&run.events_path()).unwrap();
    let needs: Vec<(u64, Vec<f32>)> = events
        .into_iter()
        .filter_map(|logged| match logged.event {
            Event::NeedsChanged { episode, needs } => Some((episode, needs)),
            _ => None,
        })
        .collect();
    assert_eq!(needs[0], (0, vec![1.0, 1.0]));
    assert!(needs.windows(2).all(|pair| pair[0].1 != pair[1].1), "{needs:?}");
    let history = mge_run::RunHistory::read(&run).unwrap();
    assert_eq!(history.needs, needs.last().unwrap().1);
    // The recorded epsilon is half of the mean need before the episode.
    for record in history.records.iter() {
        let (_, before) = needs.iter().rev().find(|(episode, _)| *episode < record.episode).unwrap();
        assert!((record.epsilon - 0.25 * (before[0] + before[1])).abs() < 1e-6, "{record:?}, {before:?}");
    }
}

#[test]
fn the_first_success_is_repeated() {
    let mut config = config(Method::OpenLoop, 60);
    config.guidance.model_rollouts = 300;
    let prior = Some(Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap()));
    let mut training = Training::new(config, prior).unwrap();
    let episodes: Vec<(EpisodeRecord, Trace)> = (0..60).map(|_| training.run_episode().unwrap()).collect();
    let first = episodes.iter().position(|(record, _)| record.goal).unwrap();
    assert!(first < 50, "no success in time to repeat it");
    let actions = |trace: &Trace| trace.steps.iter().map(|step| step.action).collect::<Vec<_>>();
    for (record, trace) in &episodes[first + 1..] {
        assert!(record.goal && !record.guided && trace.steps.iter().all(|step| step.source == Source::Recorded));
        assert_eq!(actions(trace), actions(&episodes[first].1));
    }
}
