//! Prediction: a forward pass that stores nothing for a backward pass.

use rayon::prelude::*;

use super::{
    active::{ActiveColumns, Rows},
    kernel::{Buffer, padded},
    layer::{Layer, LoadedParameters, unpad_rows},
    stack::{dense, multiplications, threads_for},
};

/// Working memory of a prediction, one space per thread.
#[derive(Debug, Default)]
pub(super) struct PredictWorkspace {
    threads: Vec<PredictSpace>,
}

/// Working memory of one thread.
#[derive(Debug, Default)]
struct PredictSpace {
    /// Outputs of the previous and of the current layer.
    outputs: [Buffer; 2],
    active: ActiveColumns,
    factors: Vec<f32>,
}

/// Rows that pass through all layers together, so that their values stay in the second-level cache.
const CHUNK: usize = 192;

impl PredictWorkspace {
    /// `y` = outputs for `rows` rows of `x`; both dense.
    pub fn predict(&mut self, layers: &[Layer], parameters: &LoadedParameters, x: &[f32], rows: usize, y: &mut [f32]) {
        let (Some(first), Some(last)) = (layers.first(), layers.last()) else { return };
        if rows == 0 {
            return;
        }
        let count = threads_for(rows * multiplications(layers)).min(rows);
        self.threads.resize_with(count, Default::default);
        let share = rows.div_ceil(count);
        let (x_share, y_share) = (share * first.inputs, share * last.outputs);
        if count == 1 {
            self.threads[0].predict(layers, parameters, x, y);
        } else {
            let parts = x.par_chunks(x_share).zip(y.par_chunks_mut(y_share));
            self.threads.par_iter_mut().zip(parts).for_each(|(space, (x, y))| space.predict(layers, parameters, x, y));
        }
    }
}

impl PredictSpace {
    fn predict(&mut self, layers: &[Layer], parameters: &LoadedParameters, x: &[f32], y: &mut [f32]) {
        let (inputs, outputs) = (layers[0].inputs, layers[layers.len() - 1].outputs);
        for (x, y) in x.chunks(CHUNK * inputs).zip(y.chunks_mut(CHUNK * outputs)) {
            let rows = x.len() / inputs;
            self.active.find(x, rows, parameters.weight(&layers[0]), padded(layers[0].outputs));
            for (i, layer) in layers.iter().enumerate() {
                let [from, to] = &mut self.outputs;
                to.resize(rows * padded(layer.outputs));
                let depth = layer.inputs;
                let all = |values, row| (Rows { values, row }, depth, parameters.weight(layer));
                let (x, depth, weight) = match i {
                    0 => self.active.get(0).unwrap_or_else(|| all(x, depth)),
                    _ => all(&from[..], padded(depth)),
                };
                dense(layer, parameters, rows, x, depth, weight, to, &mut self.factors);
                self.outputs.swap(0, 1);
            }
            unpad_rows(&self.outputs[0], outputs, y);
        }
    }
}
