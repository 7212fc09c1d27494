//! CREATE's catalogue: 2,365 tool variants and the no-op, generated from ranges, with the split into training,
//! validation and test tools.

use std::f64::consts::PI;
use std::sync::LazyLock;

use rand::Rng;
use rand::seq::index;
use serde::{Deserialize, Serialize};

use super::tool::Tool;
use super::tool_kind::ToolKind;
use mge_base::by_name;

/// Number of the no-op: the last entry of the catalogue, which places nothing.
pub const NO_OP: usize = 2365;
/// Tools in an action set, the no-op included.
pub const ACTION_SET: usize = 40;

/// CREATE's split `full_clean`: a letter for each tool of the catalogue, `t` training, `v` validation, `e` test, `.` none.
const SPLITS: &str = include_str!("../splits.txt");

/// Which tools of the catalogue may be in an action set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToolSplit {
    /// Every tool.
    All,
    /// Tools to train with.
    Train,
    /// Tools for tuning settings.
    Validation,
    /// Tools to test with.
    Test,
}

impl ToolSplit {
    /// Numbers of its tools, without the no-op.
    pub fn tools(self) -> Vec<usize> {
        let marks = match self {
            Self::All => "tve.",
            Self::Train => "t",
            Self::Validation => "v",
            Self::Test => "e",
        };
        let tools = SPLITS.chars().filter(|mark| !mark.is_whitespace()).enumerate();
        tools.filter(|(_, mark)| marks.contains(*mark)).map(|(number, _)| number).collect()
    }

    /// Draws an action set as CREATE does at every reset: the no-op, then distinct tools, all equally likely.
    pub fn draw(self, rng: &mut impl Rng) -> Vec<usize> {
        // Reading the split takes longer than drawing from it.
        static TOOLS: LazyLock<[Vec<usize>; 4]> = LazyLock::new(|| ToolSplit::ALL.map(ToolSplit::tools));
        let tools = &TOOLS[self as usize];
        let drawn = index::sample(rng, tools.len(), ACTION_SET - 1);
        [NO_OP].into_iter().chain(drawn.into_iter().map(|index| tools[index])).collect()
    }
}

by_name!(ToolSplit, "split of tools", { All = "all", Train = "train", Validation = "validation", Test = "test" });

/// A tool of the catalogue, at the origin. None for the no-op and for numbers beyond the catalogue.
pub fn catalogue_tool(number: usize) -> Option<&'static Tool> {
    static TOOLS: LazyLock<Vec<Tool>> = LazyLock::new(generate);
    TOOLS.get(number)
}

/// Evenly spaced numbers.
fn range(first: f64, step: f64, count: usize) -> Vec<f64> {
    // As in numpy, the step is the rounded difference of the first two numbers.
    let step = (first + step) - first;
    (0..count).map(|index| first + index as f64 * step).collect()
}

/// Angles in steps of 15 degrees, in radians.
fn angles(count: usize) -> Vec<f64> {
    (0..count).map(|index| 15.0 * index as f64 * PI / 180.0).collect()
}

/// Every variant, in CREATE's order.
fn generate() -> Vec<Tool> {
    use ToolKind::*;
    let mut tools = Vec::with_capacity(NO_OP);
    let new = |kind| Tool::new(kind, [0.0; 2]);
    let fixed = [0.1, 0.3, 0.5];
    let bouncy = [0.8, 1.0, 1.2];
    for (kind, elasticities) in [(Ramp, fixed), (Trampoline, bouncy)] {
        for elasticity in elasticities {
            for angle in angles(12) {
                tools.extend(range(6.0, 4.0, 5).into_iter().map(|size| Tool { elasticity, angle, size, ..new(kind) }));
            }
        }
    }
    for (kind, sizes) in [(Circle, range(3.0, 2.0, 4)), (Box, range(5.0, 3.0, 4))] {
        for elasticity in [0.1, 0.2, 0.3, 0.4, 0.5, 0.8, 0.9, 1.0, 1.1, 1.2] {
            tools.extend(sizes.iter().map(|&size| Tool { elasticity, size, ..new(kind) }));
        }
    }
    for (kind, mut turns) in [(Triangle, angles(8)), (Square, angles(6)), (Pentagon, angles(5)), (Hexagon, angles(4))] {
        if kind == Square {
            // At 45 degrees a square is a box.
            turns.remove(3);
        }
        for elasticities in [fixed, bouncy] {
            for &angle in &turns {
                for elasticity in elasticities {
                    let sizes = range(3.0, 1.0, 7).into_iter();
                    tools.extend(sizes.map(|size| Tool { elasticity, angle, size, ..new(kind) }));
                }
            }
        }
    }
    for size in range(6.0, 6.0, 5) {
        tools.extend(range(1.0, 0.01, 11).into_iter().map(|roll_friction| Tool { size, roll_friction, ..new(Hinge) }));
    }
    let limits = |count| range(5.0, 15.0, count).into_iter().map(|degrees| degrees * PI / 180.0);
    for size in range(12.0, 2.0, 5) {
        for max_angle in limits(6) {
            let frictions = range(1.0, 0.05, 3).into_iter();
            tools.extend(frictions.map(|roll_friction| Tool {
                size,
                max_angle,
                roll_friction,
                ..new(HingeConstrained)
            }));
        }
    }
    for size in range(12.0, 2.0, 5) {
        for max_angle in limits(4) {
            for on_left in [true, false] {
                let weights = range(2.0, 4.0, 4).into_iter();
                tools.extend(weights.map(|weight| Tool { size, max_angle, on_left, weight, ..new(SeeSaw) }));
            }
        }
    }
    for (kind, forces) in [(Cannon, range(60.0, 10.0, 7)), (Fan, range(30.0, 15.0, 7))] {
        for angle in angles(24) {
            tools.extend(forces.iter().map(|&force| Tool { angle, force, ..new(kind) }));
        }
    }
    for size in range(6.0, 2.0, 10) {
        for sign in [1.0, -1.0] {
            let speeds = range(1.0, 1.0, 6).into_iter();
            tools.extend(speeds.map(|speed| Tool { size, velocity: sign * speed, ..new(Belt) }));
        }
    }
    for kind in [Funnel, Bucket] {
        for angle in angles(24) {
            tools.extend(range(3.0, 2.0, 5).into_iter().map(|size| Tool { angle, size, ..new(kind) }));
        }
    }
    tools
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn an_action_set_is_the_no_op_and_distinct_tools_of_the_split() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for split in ToolSplit::ALL {
            let tools = split.tools();
            for _ in 0..20 {
                let set = split.draw(&mut rng);
                assert_eq!((set.len(), set[0]), (ACTION_SET, NO_OP));
                assert!(set[1..].iter().all(|tool| tools.contains(tool)));
                let mut unique = set.clone();
                unique.sort_unstable();
                unique.dedup();
                assert_eq!(unique.len(), set.len());
            }
        }
        assert_eq!(ToolSplit::ALL.map(|split| split.tools().len()), [2365, 938, 400, 399]);
    }

    #[test]
    fn every_tool_of_the_catalogue_is_valid_and_no_two_are_the_same() {
        let tools: Vec<_> = (0..NO_OP).map(|number| *catalogue_tool(number).unwrap()).collect();
        assert!(catalogue_tool(NO_OP).is_none());
        for (number, tool) in tools.iter().enumerate() {
            tool.check().unwrap_or_else(|problem| panic!("{number}: {problem}"));
            assert!(!tools[..number].contains(tool), "{number}");
        }
    }
}
