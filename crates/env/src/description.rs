//! The observation of an agent with an action set: the objects of the scene with their properties, the progress of
//! the episode, and the action set.

use super::action_set::{ActionSet, TOOL_FEATURES, tool_features};
use super::episode::{MARKER, Snapshot, TARGET, goal_object};
use super::observation::{ObservationPart, VELOCITY_SCALE, bounds, kept_tools};
use mge_physics::{ACTION_SET, Motion, ObjectId, ToolKind, exact, to_normalised, to_units};
use mge_task::{GoalShape, Task};

/// Object slots. If there are more objects, the earliest placed tools are dropped.
pub const SCENE_SLOTS: usize = 48;
/// Features of one object: one-hot of its role, in the order of [`ROLES`]; velocity x, y; position x, y; angular
/// velocity; cosine and sine of its rotation; then its properties as in [`tool_features`]. The one-hot of the tool
/// type is all zeros for balls, boxes and regions.
pub const SCENE_FEATURES: usize = ROLES.len() + MOTION_FEATURES + TOOL_FEATURES;
/// The roles of objects.
pub const ROLES: [&str; 8] = ["target", "marker", "ball", "box", "goal", "subgoal", "marker_subgoal", "tool"];
const MOTION_FEATURES: usize = 7;

/// Length of the progress part: flags for each subgoal reached by the target and by the marker, for whether the
/// target counts as moved and whether the goal has been reached; then the fraction of actions used.
fn progress_len(task: &Task) -> usize {
    task.subgoals.len() + task.marker.as_ref().map_or(0, |marker| marker.subgoals.len()) + 3
}

/// The parts of a description.
pub(super) fn description_parts(task: &Task) -> Vec<ObservationPart> {
    vec![
        ObservationPart { name: "objects", shape: vec![SCENE_SLOTS, SCENE_FEATURES] },
        ObservationPart { name: "progress", shape: vec![progress_len(task)] },
        ObservationPart { name: "tools", shape: vec![ACTION_SET, TOOL_FEATURES] },
    ]
}

/// Describes an episode and the first [`ACTION_SET`] tools of an action set.
pub(super) fn describe(now: &Snapshot, set: &ActionSet) -> Vec<f32> {
    let (task, objects) = (&now.task, SCENE_SLOTS * SCENE_FEATURES);
    let length = objects + progress_len(task) + ACTION_SET * TOOL_FEATURES;
    let mut numbers = Vec::with_capacity(length);
    let mut writer = ObjectWriter { numbers: &mut numbers, free: SCENE_SLOTS };
    writer.push_movers(now);
    writer.push_regions(now);
    writer.push_tools(now);
    numbers.resize(objects, 0.0);
    let flags = now.reached.iter().chain(&now.reached_by_marker).copied();
    let flags = flags.chain([now.target_moved, now.goal_reached]);
    numbers.extend(flags.map(|flag| f32::from(u8::from(flag))));
    numbers.push(now.actions as f32 / task.rules.max_actions as f32);
    let tools = set.features();
    numbers.extend_from_slice(&tools[..tools.len().min(ACTION_SET * TOOL_FEATURES)]);
    numbers.resize(length, 0.0);
    numbers
}

/// Writes objects until the slots are full.
struct ObjectWriter<'a> {
    numbers: &'a mut Vec<f32>,
    free: usize,
}

impl ObjectWriter<'_> {
    fn push(&mut self, role: &str, motion: &Motion, properties: [f32; TOOL_FEATURES]) {
        if self.free == 0 {
            return;
        }
        self.free -= 1;
        self.numbers.extend(ROLES.iter().map(|other| f32::from(u8::from(*other == role))));
        let [vx, vy] = motion.velocity.map(|v| v as f32 / VELOCITY_SCALE);
        let [x, y] = to_normalised(motion.position).map(|p| p as f32);
        let (sin, cos) = pxfm::f_sincos(motion.angle);
        self.numbers.extend([vx, vy, x, y, motion.angular_velocity as f32, cos as f32, sin as f32]);
        self.numbers.extend(properties);
    }

    /// Balls and boxes, in the order of their index in the world.
    fn push_movers(&mut self, now: &Snapshot) {
        let (task, world) = (&now.task, &now.world);
        let goal = goal_object(task);
        for index in 0..world.ball_count() {
            let material = world.ball_material(index);
            let role = match index {
                TARGET => "target",
                MARKER if task.marker.is_some() => "marker",
                index if goal == ObjectId::Ball(index) => "goal",
                index if world.is_box(index) => "box",
                _ => "ball",
            };
            let properties =
                properties(material.radius, Some([material.elasticity, material.friction, material.mass / 10.0]));
            self.push(role, &world.motion(index), properties);
        }
    }

    /// The goal, unless it is a ball, and the subgoals not yet reached.
    fn push_regions(&mut self, now: &Snapshot) {
        let task = &now.task;
        let rest = |position: [f32; 2]| Motion::at_rest(to_units(position.map(exact)));
        if task.goal.shape != GoalShape::Ball {
            self.push("goal", &rest(task.goal.position), properties(task.goal.radius, None));
        }
        let marker = task.marker.iter().flat_map(|marker| &marker.subgoals);
        let target = task.subgoals.iter().zip(&now.reached).map(|pair| ("subgoal", pair));
        let marker = marker.zip(&now.reached_by_marker).map(|pair| ("marker_subgoal", pair));
        for (role, (region, _)) in target.chain(marker).filter(|(_, (_, reached))| !**reached) {
            self.push(role, &rest(region.position), properties(region.radius, None));
        }
    }

    fn push_tools(&mut self, now: &Snapshot) {
        for (index, tool) in kept_tools(now, self.free) {
            let motion = now.world.plank(index).0.unwrap_or(Motion::at_rest(tool.position));
            self.push("tool", &motion, tool_features(Some(tool)));
        }
    }
}

/// Properties of an object that is not a tool: radius or half side; elasticity, friction and mass.
fn properties(radius: f32, material: Option<[f32; 3]>) -> [f32; TOOL_FEATURES] {
    let mut features = [0.0; TOOL_FEATURES];
    let properties = &mut features[ToolKind::ALL.len()..];
    properties[0] = radius / 20.0;
    if let Some([elasticity, friction, weight]) = material {
        (properties[4], properties[5], properties[10]) = (elasticity, friction, weight);
    }
    features
}

/// Lower and upper bounds of every number: 0 and 1 for flags, infinite for the others.
pub(super) fn description_bounds(task: &Task) -> [Vec<f32>; 2] {
    const PROPERTIES: usize = ROLES.len() + MOTION_FEATURES;
    let is_kind = |column: usize| column < ToolKind::ALL.len();
    let object = |column: usize| column < ROLES.len() || (column >= PROPERTIES && is_kind(column - PROPERTIES));
    let flags = (0..SCENE_SLOTS * SCENE_FEATURES)
        .map(|index| object(index % SCENE_FEATURES))
        .chain((0..progress_len(task)).map(|_| true))
        .chain((0..ACTION_SET * TOOL_FEATURES).map(|index| is_kind(index % TOOL_FEATURES)));
    bounds(flags)
}
