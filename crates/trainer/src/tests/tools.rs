//! Agents that choose among tools, from their settings to the files of their runs.

use super::*;
use mge_env::tool_embedding;
use mge_physics::{NO_OP, ToolSplit};

/// A short training on a level whose parts are shifted at every reset.
fn choosing(method: Method, episodes: u32) -> RunConfig {
    let task = Arc::new(task::load("create/Push-random").unwrap());
    let mut config = RunConfig::default_with(task, method, Some(ToolSplit::Train));
    (config.episodes, config.seed) = (episodes, 3);
    config.ddpg.hidden = 8;
    config.ddpg.batch_size = 8;
    config.ddpg.warmup_steps = 20;
    config.ddpg.replay_capacity = 60;
    config.guidance.model_rollouts = 300;
    config.evaluation = Evaluation { every: 4, episodes: 1, tools: Some(ToolSplit::Test) };
    config.checkpoints.last_every = 3;
    config
}

fn with_tools() -> impl Iterator<Item = Method> {
    Method::ALL.into_iter().filter(|method| method.learns_from_play())
}

#[test]
fn a_resumed_run_with_tools_equals_an_uninterrupted_one() {
    for method in with_tools() {
        check_resumed(&choosing(method, 8), 5);
    }
}

#[test]
fn an_episode_with_tools_is_replayed_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let config = choosing(Method::DdpgUniform, 4).with_setting("epsilon", "0.5").unwrap();
    let run = new_run(folder.path(), "run", &config);
    finish(&run);
    let train = ToolSplit::Train.tools();
    let mut sets = Vec::new();
    for record in RunHistory::read(&run).unwrap().records.iter() {
        let played = mge_run::read_episode(&run.episodes_path(), record.episode).unwrap();
        let trace = Trace::replay(&config.task, &played);
        assert_eq!((trace.total_reward(), trace.steps.len() as u64), (record.return_, record.steps));
        assert!(trace.start.tools[1..].iter().all(|number| train.contains(number)));
        assert!(trace.steps.iter().all(|step| step.tool.is_some_and(|index| index < trace.start.tools.len())));
        sets.push(trace.start.tools);
    }
    assert!(sets.windows(2).all(|pair| pair[0] != pair[1]), "every episode has a different set");
}

#[test]
fn clusters_over_tools_follow_the_agent_s_own_rewarding_actions() {
    let mut config =
        RunConfig { task: Arc::new(task::load("create/GoalTest").unwrap()), ..choosing(Method::DdpgMge, 20) };
    config.epsilon = "1".parse().unwrap();
    config.refinement = Refinement { every: 5, least: 2, most: 6 };
    check_resumed(&config, 7);
    let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap());
    let mut training = Training::new(config, Some(prior.clone())).unwrap();
    let mut placed = Vec::new();
    for _ in 0..20 {
        let (_, trace) = training.run_episode().unwrap();
        placed.extend(trace.steps.iter().map(|step| step.action));
        training.refine().unwrap();
    }
    let refined = &training.prior().unwrap().stages[0];
    assert_ne!(refined.clusters, prior.stages[0].clusters);
    assert_eq!(refined.tools.len(), refined.clusters.len());
    assert!((2..=6).contains(&refined.actions.len()) && refined.actions.iter().all(|action| placed.contains(action)));
    // A cluster of a single action draws tools like its own.
    let alone = refined.clusters.iter().position(|cluster| cluster.count == 1).expect("few actions, ten clusters");
    let tool = &refined.tools[alone];
    assert!(tool.std.iter().all(|std| *std == prior.config.std_floor));
    assert!(
        (0..NO_OP).any(|number| tool_embedding(number).unwrap()[..] == tool.mean[..]),
        "it is one of the catalogue"
    );
}

#[test]
fn a_policy_is_evaluated_with_held_out_tools() {
    let training = Training::new(choosing(Method::Ddpg, 1), None).unwrap();
    let mut rng = mge_base::streams::Stream::Episode.of(1);
    let RunConfig { task, observation, .. } = training.config();
    let trace = greedy_episode(task, *observation, Some(ToolSplit::Test), training.ddpg(), &mut rng);
    let test = ToolSplit::Test.tools();
    assert!(!trace.steps.is_empty() && trace.start.tools[1..].iter().all(|number| test.contains(number)));
}

#[test]
fn settings_that_conflict_with_tools_are_refused_in_one_line() {
    for (key, value, expected) in [
        ("method", "open-loop", "with `tools` use ddpg, ddpg-mge, ddpg-uniform, ddpg-mge-true, ddpg-mge-adaptive"),
        ("method", "planning", "is `planning`, which knows only the task's own tool"),
        ("tools", "some", "use one of all, train, validation, test"),
        ("tools", "null", "evaluation.tools: is set, but the run has no `tools`"),
        ("tool_candidates", "41", "a whole number from 1 to 40"),
    ] {
        let error = choosing(Method::Ddpg, 1).with_setting(key, value).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{key}: {error}");
    }
    let guided = choosing(Method::DdpgMge, 1).with_setting("prior", "learned").unwrap();
    let error = check_model(&guided).unwrap_err().to_string();
    assert!(error.contains("use `true`, or train a model"), "{error}");
    for (model, expected) in [("bucket-box", "never trained on"), ("nowhere.safetensors", "nowhere.safetensors")] {
        let guided = guided.with_setting("prior", model).unwrap();
        let error = check_model(&guided).unwrap_err().to_string();
        assert!(error.contains(expected) && !error.contains('\n'), "{error}");
    }
    assert!(Method::usual(Some(ToolSplit::Train)).learns_from_play());
}

#[test]
fn default_settings_change_with_the_tools_and_chosen_ones_stay() {
    let plain = RunConfig::default_for(Arc::new(task::load("create/Push").unwrap()), Method::DdpgAdaptive);
    let plain = plain.with_setting("ddpg.gamma", "0.9").unwrap();
    let tools = plain.with_setting("tools", "train").unwrap();
    assert_eq!((tools.ddpg.gamma, tools.tools), (0.9, Some(ToolSplit::Train)));
    assert_eq!(tools.ddpg.action_origin, Some(mge_env::TARGET_POSITION));
    let unusual = non_default_settings(&tools);
    let names: Vec<&str> = unusual.iter().map(|(key, _)| key.as_str()).collect();
    assert_eq!(names, ["method", "tools", "ddpg.gamma"]);
    let set = |config: RunConfig, (key, value): &(String, String)| config.with_setting(key, value).unwrap();
    assert_eq!(unusual.iter().fold(RunConfig::new(plain.task.clone()), set), tools);
    assert_eq!(tools.with_setting("tools", "null").unwrap(), plain);
}
