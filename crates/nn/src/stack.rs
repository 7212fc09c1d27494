//! Forward and backward passes through a whole stack of layers, on reused memory.
//!
//! Independent stacks run in parallel: the rows of all their batches are concatenated and cut into
//! one equal share of work per thread, so a batch consists of one or more [`Span`]s. A pass through
//! the layers touches one span only; weight gradients are summed over the spans in order. Kernels
//! sum every element in the order of the rows however these are cut, so all results are identical
//! to the bit for any number of threads.

use std::{
    mem,
    sync::{Arc, Mutex},
};

use rayon::prelude::*;

use super::{
    active::{ActiveColumns, Rows},
    kernel::{
        Buffer, ColumnSums, Derivative, Epilogue, Kernel, Normalise, NormaliseGradient, Product, Start, Transpose,
        padded,
    },
    layer::{Layer, LoadedParameters, pad_rows, unpad_rows},
};
use mge_base::sync::lock;

/// Workspaces of finished passes, for reuse. A pass of the paper's 17 layers over 128 rows needs
/// more than a megabyte, which the operating system would otherwise have to clear for each pass.
pub(super) type Pool = Arc<Mutex<Vec<Workspace>>>;

/// One network's pass over a batch: fill the input and run [`forward`]; then, if gradients are
/// wanted, set the gradient of the output and run [`backward`].
#[derive(Debug)]
pub(super) struct Pass {
    layers: Arc<[Layer]>,
    parameters: Arc<LoadedParameters>,
    workspace: Workspace,
    pool: Pool,
}

/// Working memory of a pass.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    rows: usize,
    /// Dense.
    input: Buffer,
    /// The first `cuts` are in use; the others only keep their memory for later.
    spans: Vec<Span>,
    cuts: usize,
    /// Padded gradients of the layers whose outputs are not whole lines.
    padded_sums: Vec<Buffer>,
    /// The input for the first layer.
    active: ActiveColumns,
    /// Gradients of the weights of active columns.
    active_sums: Buffer,
}

/// Working memory for some rows of a batch.
#[derive(Debug, Default)]
struct Span {
    start: usize,
    rows: usize,
    /// Outputs of every layer, rows padded.
    outputs: Vec<Buffer>,
    /// Normalisation factors of the rows of every layer; empty for layers without normalisation.
    factors: Vec<Vec<f32>>,
    /// dL/dz of every layer, rows padded; `z` is the input of the activation.
    dz: Vec<Buffer>,
    /// dL/dx, rows padded.
    dx: Buffer,
    transposed: Buffer,
}

/// Multiplications below which a second thread costs more than it saves.
const MULTIPLICATIONS_PER_THREAD: usize = 5 << 19;

/// Rows below which a separate span costs more than uneven shares.
const MIN_SPAN_ROWS: usize = 8;

/// Runs all layers of the passes and stores what [`backward`] needs.
pub(super) fn forward(passes: &mut [Pass]) {
    let threads = cut(passes);
    let mut work = Vec::new();
    for Pass { layers, parameters, workspace, .. } in passes {
        let Workspace { rows, input, active, spans, cuts, .. } = workspace;
        active.find(input, *rows, parameters.weight(&layers[0]), padded(layers[0].outputs));
        let (input, active) = (&**input, &*active);
        work.extend(spans[..*cuts].iter_mut().map(|span| (&**layers, &**parameters, input, active, span)));
    }
    for_each(work, threads, |(layers, parameters, input, active, span)| {
        span.forward(layers, parameters, input, active);
    });
}

/// Propagates the gradients of the outputs back through the layers of the passes; through the first
/// layer only if `inputs`, when the gradients of the inputs are wanted.
pub(super) fn backward(passes: &mut [Pass], inputs: bool) {
    let threads = threads_for(passes.iter().map(Pass::multiplications).sum());
    let mut work = Vec::new();
    for Pass { layers, parameters, workspace, .. } in passes {
        let spans = &mut workspace.spans[..workspace.cuts];
        work.extend(spans.iter_mut().map(|span| (&**layers, &**parameters, span)));
    }
    let first = usize::from(!inputs);
    for_each(work, threads, |(layers, parameters, span)| {
        span.start_backward(layers);
        (first..layers.len()).rev().for_each(|i| span.backward(i, layers, parameters));
    });
}

/// Cuts the batches of all passes into spans, such that every worthwhile thread gets the same share
/// of multiplications. Returns the number of threads.
fn cut(passes: &mut [Pass]) -> usize {
    let total = passes.iter().map(Pass::multiplications).sum();
    let threads = threads_for(total);
    let mut before = 0;
    for pass in passes {
        let all = pass.multiplications();
        let (rows, each) = (pass.workspace.rows, multiplications(&pass.layers));
        // The row at which a share ends.
        let end = |share: usize| match ((total * (share + 1) / threads).saturating_sub(before) / each).min(rows) {
            row if row < MIN_SPAN_ROWS => 0,
            row if row + MIN_SPAN_ROWS > rows => rows,
            row => row,
        };
        let spans = &mut pass.workspace.spans;
        let (mut start, mut cuts) = (0, 0);
        for share in 0..threads {
            let end = if share + 1 == threads { rows } else { end(share) };
            if end > start {
                if spans.len() == cuts {
                    spans.push(Span::default());
                }
                let span = &mut spans[cuts];
                (span.start, span.rows) = (start, end - start);
                (start, cuts) = (end, cuts + 1);
            }
        }
        pass.workspace.cuts = cuts;
        before += all;
    }
    threads
}

/// Multiplications per row.
pub(super) fn multiplications(layers: &[Layer]) -> usize {
    layers.iter().map(Layer::multiplications).sum()
}

/// The number of threads that is worthwhile for this many multiplications.
pub(super) fn threads_for(multiplications: usize) -> usize {
    rayon::current_num_threads().min(multiplications / MULTIPLICATIONS_PER_THREAD).max(1)
}

/// Does the work for every item, on several threads if these are worthwhile.
fn for_each<T: Send>(items: Vec<T>, threads: usize, work: impl Fn(T) + Send + Sync) {
    match threads {
        1 => items.into_iter().for_each(work),
        _ => items.into_par_iter().for_each(work),
    }
}

impl Pass {
    /// A pass of `rows` rows with a workspace from `pool`.
    pub fn new(layers: Arc<[Layer]>, parameters: Arc<LoadedParameters>, pool: &Pool, rows: usize) -> Self {
        // A poisoned lock is harmless: a panic cannot leave a workspace in an inconsistent state.
        let mut workspace = lock(pool).pop().unwrap_or_default();
        workspace.rows = rows;
        workspace.input.resize(rows * layers[0].inputs);
        Self { layers, parameters, workspace, pool: pool.clone() }
    }

    fn multiplications(&self) -> usize {
        self.workspace.rows * multiplications(&self.layers)
    }

    /// The input to fill before the forward pass: rows × inputs, dense.
    pub fn input(&mut self) -> &mut [f32] {
        &mut self.workspace.input
    }

    /// Copies the outputs to `y`: rows × outputs, dense.
    pub fn output(&self, y: &mut [f32]) {
        let last = self.layers.len() - 1;
        let columns = self.layers[last].outputs;
        for span in self.workspace.spans() {
            let y = &mut y[span.start * columns..][..span.rows * columns];
            unpad_rows(&span.outputs[last], columns, y);
        }
    }

    /// Sets dL/dy before the backward pass; `row(i)` is its row `i`.
    pub fn set_output_gradient<'a>(&mut self, row: impl Fn(usize) -> &'a [f32]) {
        let last = self.layers.len() - 1;
        let columns = self.layers[last].outputs;
        for span in &mut self.workspace.spans[..self.workspace.cuts] {
            span.dz.resize_with(self.layers.len(), Buffer::default);
            let dz = &mut span.dz[last];
            dz.resize(span.rows * padded(columns));
            for (i, to) in dz.chunks_exact_mut(padded(columns)).enumerate() {
                to[..columns].copy_from_slice(row(span.start + i));
                to[columns..].fill(0.0);
            }
        }
    }

    /// Adds dL/dx to `dx` (dense), after a backward pass that computed it.
    pub fn add_input_gradient(&self, dx: &mut [f32]) {
        let columns = self.layers[0].inputs;
        for span in self.workspace.spans() {
            let dx = &mut dx[span.start * columns..][..span.rows * columns];
            let rows = span.dx.chunks_exact(padded(columns));
            for (to, from) in dx.chunks_exact_mut(columns).zip(rows) {
                to.iter_mut().zip(from).for_each(|(d, g)| *d += g);
            }
        }
    }

    /// Adds the gradients of the parameters, after a backward pass.
    pub fn add_parameter_gradients(&mut self, gradients: &mut [f32]) {
        let threads = threads_for(self.multiplications());
        let Workspace { input, spans, cuts, padded_sums, active, active_sums, .. } = &mut self.workspace;
        let mut active_sums = Some(active_sums);
        padded_sums.resize_with(self.layers.len(), Buffer::default);
        let (layers, input, spans, mut rest) = (&*self.layers, &**input, &spans[..*cuts], gradients);
        let mut sums = Vec::with_capacity(layers.len());
        for (i, space) in padded_sums.iter_mut().enumerate() {
            let (sum, others) = mem::take(&mut rest).split_at_mut(layers[i].parameters());
            rest = others;
            let active = active_sums.take().map(|space| (&*active, space));
            sums.push(ParameterSum { i, layers, input, active, spans, space, sum });
        }
        for_each(sums, threads, ParameterSum::run);
    }
}

impl Drop for Pass {
    fn drop(&mut self) {
        lock(&self.pool).push(mem::take(&mut self.workspace));
    }
}

impl Workspace {
    fn spans(&self) -> &[Span] {
        &self.spans[..self.cuts]
    }
}

impl Span {
    fn forward(&mut self, layers: &[Layer], parameters: &LoadedParameters, input: &[f32], active: &ActiveColumns) {
        self.outputs.resize_with(layers.len(), Buffer::default);
        self.factors.resize_with(layers.len(), Vec::new);
        for (i, layer) in layers.iter().enumerate() {
            let (before, after) = self.outputs.split_at_mut(i);
            let x = input_of(i, layers, input, self.start, before);
            after[0].resize(self.rows * padded(layer.outputs));
            let active = active.get(self.start).filter(|_| i == 0);
            let (x, depth, weight) = active.unwrap_or((x, layer.inputs, parameters.weight(layer)));
            let (y, columns) = (&mut *after[0], padded(layer.outputs));
            Product {
                rows: self.rows,
                depth,
                columns,
                a: x.values,
                a_row: x.row,
                a_depth: 1,
                b: weight,
                b_row: columns,
                start: Start::Row(parameters.bias(layer)),
                c: y,
                c_row: columns,
                epilogue: Epilogue::Activate(layer.activation),
            }
            .execute();
            if layer.is_normalised() {
                let factors = &mut self.factors[i];
                factors.resize(self.rows, 0.0);
                Normalise { y, columns: layer.outputs, factors }.execute();
            }
        }
    }

    /// dL/dz of the last layer from dL/dy.
    fn start_backward(&mut self, layers: &[Layer]) {
        let last = layers.len() - 1;
        let (output, gradient) = (&self.outputs[last], &mut self.dz[last]);
        Derivative { activation: layers[last].activation, output, gradient }.execute();
        self.normalise_gradient(last, layers);
    }

    /// dL/dz of layer `i - 1` from that of layer `i`; for layer 0, dL/dx.
    fn backward(&mut self, i: usize, layers: &[Layer], parameters: &LoadedParameters) {
        let layer = &layers[i];
        let (rows, columns) = (padded(layer.inputs), padded(layer.outputs));
        self.transposed.resize(rows * columns);
        Transpose { from: parameters.weight(layer), rows, columns, to: &mut self.transposed }.execute();
        let (before, after) = self.dz.split_at_mut(i);
        let (c, epilogue) = match before.last_mut() {
            Some(dz) => {
                let previous = &self.outputs[i - 1];
                (dz, Epilogue::Derivative(layers[i - 1].activation, previous))
            }
            None => (&mut self.dx, Epilogue::None),
        };
        c.resize(self.rows * rows);
        Product {
            rows: self.rows,
            depth: layer.outputs,
            columns: rows,
            a: &after[0],
            a_row: columns,
            a_depth: 1,
            b: &self.transposed,
            b_row: rows,
            start: Start::Zero,
            c,
            c_row: rows,
            epilogue,
        }
        .execute();
        if i > 0 {
            self.normalise_gradient(i - 1, layers);
        }
    }

    /// Turns dL/du of layer `i`, where `u` is divided by its root mean square, into dL/dz; a no-op for
    /// other layers. Where the rectifier blocks the gradient, the output is 0 and contributes nothing.
    fn normalise_gradient(&mut self, i: usize, layers: &[Layer]) {
        if layers[i].is_normalised() {
            let (y, gradient, factors) = (&*self.outputs[i], &mut *self.dz[i], &*self.factors[i]);
            NormaliseGradient { y, gradient, columns: layers[i].outputs, factors }.execute();
        }
    }
}

/// The input of layer `i` for the rows of a span that begins at row `start`.
fn input_of<'a>(i: usize, layers: &[Layer], input: &'a [f32], start: usize, outputs: &'a [Buffer]) -> Rows<'a> {
    let columns = layers[i].inputs;
    match i {
        0 => Rows { values: &input[start * columns..], row: columns },
        _ => Rows { values: &outputs[i - 1], row: padded(columns) },
    }
}

/// Sums the parameter gradients of layer `i` over the rows of all spans, in order.
struct ParameterSum<'a> {
    i: usize,
    layers: &'a [Layer],
    input: &'a [f32],
    /// For the first layer only.
    active: Option<(&'a ActiveColumns, &'a mut Buffer)>,
    spans: &'a [Span],
    space: &'a mut Buffer,
    /// The gradients that the sums are added to: weight, then bias.
    sum: &'a mut [f32],
}

impl ParameterSum<'_> {
    fn run(self) {
        let Self { i, layers, input, active, spans, space, sum } = self;
        let layer = &layers[i];
        let columns = padded(layer.outputs);
        if layer.is_padded() {
            space.resize((layer.inputs + 1) * columns);
            pad_rows(sum, layer.outputs, space);
        }
        let padded_sum = if layer.is_padded() { &mut space[..] } else { &mut *sum };
        let (dw, db) = padded_sum.split_at_mut(layer.inputs * columns);
        match active.filter(|(active, _)| active.get(0).is_some()) {
            Some((active, space)) => {
                active.gather(dw, columns, space);
                for span in spans {
                    if let Some((x, inputs, _)) = active.get(span.start) {
                        add_weight_gradient(x, inputs, span.rows, &span.dz[i], columns, space);
                    }
                }
                active.scatter(space, columns, dw);
            }
            None => {
                for span in spans {
                    let x = input_of(i, layers, input, span.start, &span.outputs);
                    add_weight_gradient(x, layer.inputs, span.rows, &span.dz[i], columns, dw);
                }
            }
        }
        for span in spans {
            ColumnSums { x: &span.dz[i], sums: db }.execute();
        }
        if layer.is_padded() {
            unpad_rows(space, layer.outputs, sum);
        }
    }
}

/// Adds `xᵀ dz`, over `rows` rows, to `dw` of `inputs` × `columns`.
fn add_weight_gradient(x: Rows<'_>, inputs: usize, rows: usize, dz: &[f32], columns: usize, dw: &mut [f32]) {
    Product {
        rows: inputs,
        depth: rows,
        columns,
        a: x.values,
        a_row: 1,
        a_depth: x.row,
        b: dz,
        b_row: columns,
        start: Start::Accumulate,
        c: dw,
        c_row: columns,
        epilogue: Epilogue::None,
    }
    .execute();
}
