//! The tools that launches are made at.

use std::sync::LazyLock;

use rand::Rng;

use super::config::ModelConfig;
use mge_base::streams::index;
use mge_physics::{NO_OP, Tool, ToolKind, ToolSplit, catalogue_tool};

/// The tools of each type that launches are made at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variety {
    /// Tools in CREATE's default form and material, with sizes around those used in tasks.
    Sizes,
    /// Tools of CREATE's catalogue without its test tools. Walls, floors and ladders, which are not in the
    /// catalogue, have random sizes and speeds as in levels.
    Catalogue,
}

impl Variety {
    /// The tools that a model of this configuration learns from.
    pub fn of(config: &ModelConfig) -> Self {
        if config.properties { Self::Catalogue } else { Self::Sizes }
    }

    /// A random tool of this type, at the origin.
    pub(super) fn draw(self, kind: ToolKind, rng: &mut impl Rng) -> Tool {
        let listed = self.catalogue(kind);
        if !listed.is_empty() {
            return listed[index(rng, listed.len())];
        }
        let tool = Tool::new(kind, [0.0; 2]);
        if self == Self::Sizes {
            return tool.with_size(size(kind, rng).into());
        }
        let (lengths, speed) =
            if kind == ToolKind::Ladder { (10.0..30.0, rng.gen_range(2.0..6.0)) } else { (4.0..90.0, 5.0) };
        let down = kind == ToolKind::Ladder && rng.gen_bool(0.25);
        Tool { velocity: if down { -speed } else { speed }, ..tool.with_size(rng.gen_range(lengths)) }
    }

    /// The listed tools of this type; empty if there is no list.
    fn catalogue(self, kind: ToolKind) -> &'static [Tool] {
        static LISTS: LazyLock<[Vec<Tool>; ToolKind::ALL.len()]> = LazyLock::new(|| {
            let test = ToolSplit::Test.tools();
            let numbers = || (0..NO_OP).filter(|number| test.binary_search(number).is_err());
            let of = |kind| numbers().filter_map(catalogue_tool).filter(|tool| tool.kind == kind).copied().collect();
            ToolKind::ALL.map(of)
        });
        if self == Self::Catalogue { &LISTS[kind.index()] } else { &[] }
    }
}

/// A random size around those used in tasks, so that models generalise.
fn size(kind: ToolKind, rng: &mut impl Rng) -> f32 {
    let range = match kind {
        ToolKind::Bucket => 4.0..8.0,
        ToolKind::Square | ToolKind::Box => 6.0..10.0,
        ToolKind::Wall | ToolKind::Floor => 10.0..45.0,
        // Not one of the paper's types.
        other => return other.default_size() as f32,
    };
    rng.gen_range(range)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn test_tools_are_never_used_for_training() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let test: Vec<&Tool> = ToolSplit::Test.tools().into_iter().filter_map(catalogue_tool).collect();
        for kind in ToolKind::ALL {
            for _ in 0..50 {
                let tool = Variety::Catalogue.draw(kind, &mut rng);
                assert!(tool.kind == kind && tool.check().is_ok() && !test.contains(&&tool), "{tool:?}");
            }
        }
    }
}
