//! Graphs: which edges are active, and which edge function they belong to; normalisation and its inverse.

use super::*;

fn graphs(config: &ModelConfig, tools: &[Tool]) -> Graphs {
    let builder = GraphBuilder::new(config.clone(), TOOLS.to_vec());
    let mut graphs = builder.empty();
    builder.push(&mut graphs, &ball(), tools).unwrap();
    graphs
}

/// Active edges of each edge function.
fn active(graphs: &Graphs) -> Vec<usize> {
    graphs.edges.iter().map(|edges| edges.receivers.len()).collect()
}

#[test]
fn edges_belong_to_the_function_of_their_pair_of_types() {
    // Two boxes and a floor are near the ball.
    assert_eq!(active(&graphs(&small(), &tools())), [2, 1]);
    assert_eq!(active(&graphs(&ModelConfig { edge_functions: EdgeFunctions::Shared, ..small() }, &tools())), [3]);
    let graphs = graphs(&small(), &tools());
    let layout = GraphBuilder::new(small(), TOOLS.to_vec()).layout();
    for (edges, kind) in graphs.edges.iter().zip(TOOLS) {
        for edge in edges.inputs.chunks_exact(layout.edge) {
            let (receiver, sender) = edge[..2 * layout.node].split_at(layout.node);
            let one_hot = |node: &[f32]| node[4..][..OBJECT_TYPES].iter().position(|value| *value == 1.0);
            assert_eq!((one_hot(receiver), one_hot(sender)), (Some(0), Some(1 + kind.index())), "{kind}");
        }
    }
}

#[test]
fn each_pair_of_types_has_its_own_edge_function() {
    // Changing the first edge function changes the effect of a box, but not that of a floor.
    let training = training(small(), quick());
    let model = &training.model;
    let mut file = model.to_file();
    let (name, shape) = ("edge.0.0.bias", [16]);
    let moved = file.get(name, &shape).unwrap().iter().map(|value| value + 0.5).collect();
    file.insert(name.to_owned(), shape.to_vec(), moved);
    let other = Model::from_file(&file, "changed").unwrap();
    let [first, second, _] = tools()[..] else { unreachable!() };
    assert_ne!(predict(&other, ball(), &[first]), predict(model, ball(), &[first]));
    assert_eq!(predict(&other, ball(), &[second]), predict(model, ball(), &[second]));
}

#[test]
fn edges_are_active_up_to_the_cutoff_from_the_surface() {
    let config = ModelConfig { cutoff: 5.0, ..small() };
    let above = |gap: f32| {
        let tool = Tool::new(ToolKind::Box, [0.0; 2]);
        let [x, y] = ball().position;
        tool.at([x, y - tool.half_extents()[1] - gap].map(f64::from))
    };
    for (gap, expected) in [(4.9, [1, 0]), (5.1, [0, 0])] {
        assert_eq!(active(&graphs(&config, &[above(gap)])), expected, "{gap}");
    }
    let connected = ModelConfig { edges: EdgeActivation::FullyConnected, ..config };
    assert_eq!(active(&graphs(&connected, &[above(40.0)])), [1, 0]);
}

#[test]
fn normalised_columns_have_mean_0_and_scale_1_and_are_restored() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let original: Vec<f32> = (0..600).map(|i| [5.0, -2.0, 0.3][i % 3] * (1.0 + rng.gen_range(-0.5..0.5))).collect();
    let columns = ColumnStatistics::of(&original, 3);
    let mut values = original.clone();
    columns.normalise(&mut values);
    for column in 0..3 {
        let of_column = || values.iter().skip(column).step_by(3).map(|value| f64::from(*value));
        let mean = of_column().sum::<f64>() / 200.0;
        let variance = of_column().map(|value| (value - mean).powi(2)).sum::<f64>() / 200.0;
        assert!(mean.abs() < 1e-5 && (variance - 1.0).abs() < 1e-4, "{mean} {variance}");
    }
    columns.denormalise(&mut values);
    assert!(values.iter().zip(&original).all(|(value, original)| (value - original).abs() < 1e-5));
    // A constant column is shifted, but not scaled.
    let mut constant = [7.0, 7.0];
    ColumnStatistics::of(&constant, 1).normalise(&mut constant);
    assert_eq!(constant, [0.0, 0.0]);
}
