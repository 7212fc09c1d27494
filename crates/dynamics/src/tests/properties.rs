//! Models of all of CREATE's tools, with edges that carry the tools' properties.

use super::*;
use mge_env::TOOL_FEATURES;
use mge_physics::Ball;

fn create() -> ToolSet {
    "create".parse().unwrap()
}

fn tiny() -> Model {
    let config = create().apply(ModelConfig { layers: 1, width: 8, embedding: 4, ..ModelConfig::default() });
    let training = TrainConfig { observations: 2, validation: 1, epochs: 1, ..quick() };
    let recipe = Recipe { tools: create().kinds().to_vec(), config, training };
    let mut training = Training::new(&recipe, "test", &Stop::default()).unwrap();
    training.run(&Stop::default(), |_| ()).unwrap();
    assert_eq!(training.diverged, None);
    training.model.clone()
}

/// The inputs of the only active edge between the ball and a tool.
fn inputs(properties: bool, tool: Tool) -> Vec<f32> {
    let builder = GraphBuilder::new(ModelConfig { properties, ..small() }, vec![tool.kind]);
    let mut graphs = builder.empty();
    builder.push(&mut graphs, &ball(), [&tool]).unwrap();
    assert_eq!(graphs.edges[0].inputs.len(), builder.layout().edge, "one edge");
    graphs.edges.swap_remove(0).inputs
}

#[test]
fn a_model_of_all_tools_is_saved_loaded_and_predicts_each_of_them() {
    let model = tiny();
    assert_eq!((model.name().as_str(), model.tools()), ("create", &ToolKind::ALL[..]));
    let read = Model::from_bytes(&model.to_file().to_bytes(), "create").unwrap();
    assert_eq!((read.name(), read.config()), (model.name(), model.config()));
    for kind in ToolKind::ALL {
        let tool = Tool { size: 9.0, ..Tool::new(kind, [41.0, 42.0]) };
        let predicted = predict(&model, ball(), &[tool]);
        assert!(predicted.position.iter().chain(&predicted.velocity).all(|number| number.is_finite()));
        assert!(predicted != predict(&model, ball(), &[]), "{kind} has an effect");
        assert_eq!(predict(&read, ball(), &[tool]), predicted);
    }
    // The same weights with different metadata are not a valid model.
    let mut file = model.to_file();
    let config = serde_json::json!(ModelConfig { properties: false, ..model.config().clone() });
    file.metadata.insert("config".to_owned(), config.to_string());
    assert!(matches!(Model::from_file(&file, "a").unwrap_err(), DynamicsError::File { .. }));
    file.metadata.insert("config".to_owned(), r#"{"properties": 3}"#.to_owned());
    assert!(Model::from_file(&file, "a").unwrap_err().to_string().contains("config"));
}

#[test]
fn edges_carry_the_properties_of_tools_only_if_configured() {
    let changed = |tool: Tool, change: fn(&mut Tool)| {
        let mut other = tool;
        change(&mut other);
        [true, false].map(|properties| inputs(properties, tool) != inputs(properties, other))
    };
    let near = |kind| Tool::new(kind, [41.0, 43.0]);
    assert_eq!(changed(near(ToolKind::Fan), |fan| fan.force = 30.0), [true, false]);
    assert_eq!(changed(near(ToolKind::Cannon), |cannon| cannon.angle = 0.0), [true, false]);
    assert_eq!(changed(near(ToolKind::Belt), |belt| belt.velocity = -5.0), [true, false]);
    assert_eq!(changed(near(ToolKind::Ramp), |ramp| ramp.elasticity = 0.1), [true, false]);
    assert_eq!(changed(near(ToolKind::SeeSaw), |plank| plank.weight = 9.0), [true, false]);
    assert_eq!(changed(near(ToolKind::Ramp), |ramp| ramp.angle = std::f64::consts::PI), [false, false], "half a turn");
    let length = |properties| inputs(properties, near(ToolKind::Fan)).len();
    assert_eq!(length(true), length(false) + TOOL_FEATURES);
}

#[test]
fn a_ball_of_another_size_has_the_same_gap_to_a_surface() {
    let model = tiny();
    let level = task::load("create/Buckets").unwrap();
    let smaller = model.for_task(&level).unwrap();
    let radius = Ball::default().radius;
    assert!(level.ball.radius < radius, "the level has another ball");
    let ball = BallState { velocity: [2.0, -3.0], ..BallState::at_rest([40.0, 48.5]) };
    let floor = |y: f32| Tool::new(ToolKind::Floor, [40.0, y].map(f64::from));
    let predicted = predict(&smaller, ball, &[floor(42.0)]);
    let usual = predict(&model, ball, &[floor(42.0 + level.ball.radius - radius)]);
    assert_close(&predicted, &BallState { angular_velocity: predicted.angular_velocity, ..usual }, 1e-4);
    assert!((predicted.angular_velocity * level.ball.radius - usual.angular_velocity * radius).abs() < 1e-4);
}

#[test]
fn levels_with_other_moving_objects_are_refused() {
    let model = tiny();
    for (level, what) in
        [("Push", "a marker ball moves here"), ("Moving", "the goal moves here"), ("Seesaw", "another ball moves here")]
    {
        let error = model.check_task(&task::load(&format!("create/{level}")).unwrap()).unwrap_err();
        assert!(matches!(error, DynamicsError::OtherMovers { .. }) && error.to_string().contains(what), "{error}");
    }
    let fitting = |level: &str| model.check_task(&task::load(level).unwrap()).is_ok();
    let levels = ["Basket", "Belt", "Buckets", "Funnel", "GoalTest"];
    assert!(levels.iter().all(|level| fitting(&format!("create/{level}"))) && fitting("task1"));
    let mut huge = task::load("create/Belt").unwrap();
    huge.ball.radius = 9.0;
    assert!(model.check_task(&huge).unwrap_err().to_string().contains("the ball differs"));
}

#[test]
fn an_evaluation_includes_all_tools_of_the_model() {
    let settings = EvaluationConfig { launches: 6, ..EvaluationConfig::default() };
    let found = evaluate(&tiny(), &[], &settings, &Stop::default(), &mut |_, _, _| ()).unwrap();
    let kinds = |errors: &[LaunchErrors]| errors.iter().map(|errors| errors.tool).collect::<Vec<_>>();
    assert_eq!(kinds(&found.launches), ToolKind::ALL);
    assert!(found.launches.iter().all(|tool| tool.errors.constant_velocity.one_step.mean > 0.0));
}

#[test]
fn tool_sets_are_named() {
    assert_eq!((create().to_string(), create().kinds()), ("create".to_owned(), &ToolKind::ALL[..]));
    let two: ToolSet = "floor,box".parse().unwrap();
    assert_eq!((two.to_string(), two.kinds()), ("floor,box".to_owned(), &[ToolKind::Floor, ToolKind::Box][..]));
    assert!(!two.apply(ModelConfig::default()).properties && create().apply(ModelConfig::default()).properties);
    let error = "box,creat".parse::<ToolSet>().unwrap_err();
    assert!(error.starts_with("unknown tool `creat`") && error.contains("`create`"), "{error}");
}
