//! Scenes as graphs: nodes, typed edges, the distance cutoff (paper, section 4.1).
//!
//! A scene has one moving ball, which is the receiver of all edges and the reference object, and
//! static tools, which are the senders. Positions in features are normalised lengths (42 units are
//! 1); velocities are divided by [`VELOCITY_SCALE`].

use super::config::{Coordinates, EdgeActivation, EdgeFunctions, Geometry, ModelConfig};
use super::error::{DynamicsError, Result};
use super::tool_set::model_name;
use mge_env::{TOOL_FEATURES, VELOCITY_SCALE, tool_features};
use mge_physics::{Ball, BallState, SCREEN, Tool, ToolKind};

/// Types of objects in the one-hot encoding: the ball, then [`ToolKind::PAPER`].
pub(super) const OBJECT_TYPES: usize = 1 + ToolKind::PAPER.len();
/// Features of a node without the ball's spin: velocity x, y; position x, y; one-hot type, all 0 for a tool outside
/// [`ToolKind::PAPER`].
const NODE_FEATURES: usize = 4 + OBJECT_TYPES;

/// Graphs of many scenes, ready for the network: one receiver node per scene and the
/// active edges, grouped by edge function.
#[derive(Debug, Clone, PartialEq)]
pub struct Graphs {
    /// Number of scenes.
    pub scenes: usize,
    /// Features of the receivers, row-major: scenes × [`Layout::node`].
    pub nodes: Vec<f32>,
    /// Active edges of each edge function.
    pub edges: Vec<Edges>,
}

/// The active edges of one edge function.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edges {
    /// Receiver features, sender features and edge features, row-major: edges ×
    /// [`Layout::edge`].
    pub inputs: Vec<f32>,
    /// The scene each edge belongs to, ascending.
    pub receivers: Vec<usize>,
}

/// Sizes of feature vectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Features of a node.
    pub node: usize,
    /// Receiver, sender and edge features together.
    pub edge: usize,
    /// Number of edge functions: one for each tool type, or a shared one.
    pub functions: usize,
}

/// Builds graphs for a model's configuration and tool set.
#[derive(Debug, Clone)]
pub struct GraphBuilder {
    config: ModelConfig,
    tools: Vec<ToolKind>,
    /// Radius of the ball in units.
    pub(super) radius: f32,
}

impl GraphBuilder {
    /// A builder for edges between the ball and each of `tools`, which are in canonical order.
    pub fn new(config: ModelConfig, tools: Vec<ToolKind>) -> Self {
        Self { config, tools, radius: Ball::default().radius }
    }

    /// Sizes of the feature vectors. With default settings a node has velocity (2), position
    /// (2), type (6) and the ball's spin (1); an edge has both nodes, the distance (1), the
    /// nearest surface point (2) and half extents (2). With properties it also has those of the
    /// tool ([`tool_features`]).
    pub fn layout(&self) -> Layout {
        let node = NODE_FEATURES + usize::from(self.config.spin);
        let geometry = match self.config.geometry {
            Geometry::Centre => 1,
            Geometry::Surface => 5,
        };
        let properties = if self.config.properties { TOOL_FEATURES } else { 0 };
        let functions = match self.config.edge_functions {
            EdgeFunctions::Distinct => self.tools.len(),
            EdgeFunctions::Shared => 1,
        };
        Layout { node, edge: 2 * node + geometry + properties, functions }
    }

    /// No scenes yet.
    pub fn empty(&self) -> Graphs {
        Graphs { scenes: 0, nodes: Vec::new(), edges: vec![Edges::default(); self.layout().functions] }
    }

    /// Adds the graph of one scene.
    ///
    /// # Errors
    /// [`DynamicsError::UnseenEdge`] for a tool type outside the tool set, whether or not
    /// it is near; [`DynamicsError::NotFinite`] for a state or size that is not finite.
    /// In both cases nothing is added.
    pub fn push<'a>(
        &self,
        graphs: &mut Graphs,
        ball: &BallState,
        tools: impl IntoIterator<Item = &'a Tool, IntoIter: Clone>,
    ) -> Result<()> {
        let tools = tools.into_iter();
        self.check(ball, tools.clone())?;
        let scene = graphs.scenes;
        self.push_node(&mut graphs.nodes, None, ball, ball.position);
        for tool in tools.map(|tool| self.seen(ball, tool)) {
            let Some(edge) = self.active_edge(ball, &tool) else { continue };
            let edges = &mut graphs.edges[self.function(tool.kind)];
            self.push_node(&mut edges.inputs, None, ball, ball.position);
            self.push_node(&mut edges.inputs, Some(tool.kind), &BallState::at_rest(tool.centre()), ball.position);
            match self.config.geometry {
                Geometry::Centre => edges.inputs.push(edge[0]),
                Geometry::Surface => edges.inputs.extend(edge),
            }
            if self.config.properties {
                edges.inputs.extend(tool_features(Some(&tool.with_least_angle())));
            }
            edges.receivers.push(scene);
        }
        graphs.scenes += 1;
        Ok(())
    }

    fn check<'a>(&self, ball: &BallState, tools: impl Iterator<Item = &'a Tool>) -> Result<()> {
        let mut numbers = vec![ball.angular_velocity];
        numbers.extend(ball.position.iter().chain(&ball.velocity));
        for tool in tools {
            if !self.tools.contains(&tool.kind) {
                let known = model_name(&self.config, &self.tools);
                return Err(DynamicsError::UnseenEdge { sender: tool.kind, known });
            }
            numbers.extend(tool.centre());
            numbers.push(tool.size as f32);
            if self.config.properties {
                numbers.extend(tool_features(Some(tool)));
            }
        }
        if numbers.iter().all(|number| number.is_finite()) { Ok(()) } else { Err(DynamicsError::NotFinite) }
    }

    fn function(&self, kind: ToolKind) -> usize {
        match self.config.edge_functions {
            EdgeFunctions::Shared => 0,
            // `check` has rejected all other kinds.
            EdgeFunctions::Distinct => self.tools.iter().position(|known| *known == kind).unwrap_or(0),
        }
    }

    /// Appends the features of the ball (no `kind`) or of a tool.
    fn push_node(&self, features: &mut Vec<f32>, kind: Option<ToolKind>, state: &BallState, reference: [f32; 2]) {
        let number = kind.map_or(0, |kind| 1 + kind.index());
        features.extend(state.velocity.map(|v| v / VELOCITY_SCALE));
        features.extend(self.coordinates(state.position, reference));
        features.extend((0..OBJECT_TYPES).map(|slot| f32::from(u8::from(slot == number))));
        if self.config.spin {
            // The speed of the ball's surface.
            features.push(state.angular_velocity * self.radius / VELOCITY_SCALE);
        }
    }

    /// The tool, moved along the surface normal by the difference between the radii, so that a ball of
    /// the launches' radius has the same gap to it.
    fn seen(&self, ball: &BallState, tool: &Tool) -> Tool {
        let thinner = Ball::default().radius - self.radius;
        if thinner == 0.0 || tool.is_beyond(ball.position, self.config.cutoff + thinner.abs()) {
            return *tool;
        }
        let (_, normal) = tool.surface(ball.position);
        tool.at([0, 1].map(|axis| tool.position[axis] - f64::from(thinner * normal[axis])))
    }

    /// A position in units, converted to the configured coordinates.
    fn coordinates(&self, position: [f32; 2], reference: [f32; 2]) -> [f32; 2] {
        let origin = match self.config.coordinates {
            Coordinates::Relative => reference,
            Coordinates::Absolute => [SCREEN / 2.0; 2],
        };
        std::array::from_fn(|axis| normalised_length(position[axis] - origin[axis]))
    }

    /// Edge features; none if the edge is not active.
    fn active_edge(&self, ball: &BallState, tool: &Tool) -> Option<[f32; 5]> {
        let is_limited = self.config.edges != EdgeActivation::FullyConnected;
        let (distance, features) = match self.config.geometry {
            Geometry::Surface if is_limited && tool.is_beyond(ball.position, self.config.cutoff) => return None,
            Geometry::Centre => {
                let [x, y] = tool.centre();
                let distance = (x - ball.position[0]).hypot(y - ball.position[1]);
                (distance, [0.0; 4])
            }
            Geometry::Surface => {
                let (distance, normal) = tool.surface(ball.position);
                let nearest = std::array::from_fn(|axis| ball.position[axis] - distance * normal[axis]);
                let [x, y] = self.coordinates(nearest, ball.position);
                let [width, height] = tool.half_extents().map(normalised_length);
                (distance, [x, y, width, height])
            }
        };
        let active = !is_limited || distance <= self.config.cutoff;
        let [a, b, c, d] = features;
        active.then_some([normalised_length(distance), a, b, c, d])
    }
}

impl Graphs {
    /// Adds scene `row` of `other`, which must come from the same builder.
    pub fn push_from(&mut self, other: &Graphs, row: usize) {
        let node = other.nodes.len() / other.scenes;
        self.nodes.extend_from_slice(&other.nodes[row * node..(row + 1) * node]);
        for (mine, theirs) in self.edges.iter_mut().zip(&other.edges) {
            let columns = theirs.inputs.len() / theirs.receivers.len().max(1);
            let from = theirs.receivers.partition_point(|receiver| *receiver < row);
            let to = from + theirs.receivers[from..].partition_point(|receiver| *receiver == row);
            mine.inputs.extend_from_slice(&theirs.inputs[from * columns..to * columns]);
            mine.receivers.extend(std::iter::repeat_n(self.scenes, to - from));
        }
        self.scenes += 1;
    }

    /// Removes all scenes and keeps the memory.
    pub fn clear(&mut self) {
        self.scenes = 0;
        self.nodes.clear();
        for edges in &mut self.edges {
            edges.inputs.clear();
            edges.receivers.clear();
        }
    }
}

/// A length in units, normalised.
pub(super) fn normalised_length(units: f32) -> f32 {
    units * 2.0 / SCREEN
}
