//! Forward and backward pass through a whole stack of layers, on memory that is used again.
//!
//! Stacks that do not depend on each other pass side by side: the rows of all their batches, one
//! after the other, are cut into an equal share of work a thread, so that a batch is one [`Span`]
//! or several. Passes through the layers touch one span only; weight gradients are summed over
//! the spans in order. Kernels sum every element in the order of the rows however they are cut,
//! so all results are the same to the bit for any number of threads.

use rayon::prelude::*;

use super::{
    kernel::{Buffer, ColumnSums, Derivative, Epilogue, Kernel, Product, Start, Transpose, padded},
    layer::{Layer, LoadedLayer, pad_rows, unpad_rows},
};

/// Memory of one forward pass and, if it is kept, the backward pass that follows.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    rows: usize,
    /// Dense.
    input: Buffer,
    /// The first `cuts` are in use, the others keep their memory.
    spans: Vec<Span>,
    cuts: usize,
    /// Padded gradients of a layer whose outputs are no whole lines, a buffer a layer.
    padded_gradients: Vec<[Buffer; 2]>,
}

/// The input of a layer.
#[derive(Clone, Copy)]
pub(super) struct Rows<'a> {
    pub values: &'a [f32],
    /// Distance of the rows.
    pub row: usize,
}

/// Memory for some rows of a batch.
#[derive(Debug, Default)]
struct Span {
    start: usize,
    rows: usize,
    /// The thread's share of work it belongs to.
    share: usize,
    /// Outputs of every layer, rows padded.
    outputs: Vec<Buffer>,
    /// dL/dz of every layer, rows padded; `z` is what the activation is applied to.
    slopes: Vec<Buffer>,
    /// dL/dx, rows padded.
    dx: Buffer,
    layer: LoadedLayer,
    transposed: Buffer,
}

/// Gradients of one layer's weight and bias, dense.
pub(super) type LayerGradients = (Vec<f32>, Vec<f32>);

/// Multiplications below which a second thread costs more than it brings.
const WORTH_A_THREAD: usize = 1 << 20;

/// Rows below which a span of its own costs more than uneven shares.
const WORTH_A_SPAN: usize = 8;

/// One stack in a forward pass.
pub(super) struct Forward<'a> {
    pub layers: &'a [Layer],
    pub workspace: &'a mut Workspace,
}

/// Runs all layers of the stacks and keeps what [`backward`] needs.
pub(super) fn forward(stacks: &mut [Forward<'_>]) {
    let mut shares = shares(cut(stacks));
    for Forward { layers, workspace } in stacks {
        let layers = *layers;
        let (input, spans) = (&workspace.input, &mut workspace.spans[..workspace.cuts]);
        spans.iter_mut().for_each(|span| shares[span.share].push((layers, input, span)));
    }
    each(shares, |(layers, input, span)| span.forward(layers, input));
}

/// One stack in a backward pass, after the forward pass with the same workspace.
pub(super) struct Backward<'a> {
    pub layers: &'a [Layer],
    pub workspace: &'a mut Workspace,
    /// dL/dy, dense.
    pub dy: &'a [f32],
    /// A pair a layer, to be added to, if wanted.
    pub gradients: Option<&'a mut [LayerGradients]>,
    /// Whether dL/dx is wanted.
    pub input: bool,
}

/// Propagates every `dy` back through its stack.
pub(super) fn backward(stacks: &mut [Backward<'_>]) {
    enum Work<'s, 'a> {
        /// A batch that is not cut: gradients are summed layer by layer on the way.
        Batch(&'s mut Backward<'a>),
        Span {
            span: &'s mut Span,
            layers: &'a [Layer],
            dy: &'a [f32],
            first: usize,
        },
    }
    let last_share = stacks.iter().flat_map(|stack| stack.workspace.spans()).map(|span| span.share).max();
    let mut passes = shares(last_share.map_or(0, |share| share + 1));
    for stack in &mut *stacks {
        if let [span] = stack.workspace.spans() {
            passes[span.share].push(Work::Batch(stack));
            continue;
        }
        let (layers, dy, first) = (stack.layers, stack.dy, stack.first());
        let Workspace { spans, cuts, .. } = &mut *stack.workspace;
        for span in &mut spans[..*cuts] {
            passes[span.share].push(Work::Span { span, layers, dy, first });
        }
    }
    each(passes, |work| match work {
        Work::Batch(stack) => stack.run(),
        Work::Span { span, layers, dy, first } => {
            span.start_backward(layers, dy);
            (first..layers.len()).rev().for_each(|i| span.backward(i, layers));
        }
    });
    let cut = stacks.iter_mut().filter(|stack| stack.workspace.cuts > 1);
    let sums: Vec<_> = cut.flat_map(Backward::sums).collect();
    sums.into_par_iter().for_each(ParameterSum::run);
}

impl Backward<'_> {
    /// The first layer whose input gradient is wanted.
    fn first(&self) -> usize {
        usize::from(!self.input)
    }

    /// The whole pass of a batch that is not cut.
    fn run(&mut self) {
        let (layers, first) = (self.layers, self.first());
        let Workspace { input, spans, padded_gradients, .. } = &mut *self.workspace;
        padded_gradients.resize_with(layers.len(), Default::default);
        spans[0].start_backward(layers, self.dy);
        for i in (0..layers.len()).rev() {
            if let Some(gradients) = &mut self.gradients {
                let (spans, space, sum) = (&spans[..1], &mut padded_gradients[i], &mut gradients[i]);
                ParameterSum { i, layers, input: &*input, spans, space, sum }.run();
            }
            if i >= first {
                spans[0].backward(i, layers);
            }
        }
    }

    /// The sums over a batch that is cut, one a layer.
    fn sums(&mut self) -> impl Iterator<Item = ParameterSum<'_>> {
        let layers = self.layers;
        let Workspace { input, spans, cuts, padded_gradients, .. } = &mut *self.workspace;
        padded_gradients.resize_with(layers.len(), Default::default);
        let (input, spans) = (&*input, &spans[..*cuts]);
        let sums = self.gradients.iter_mut().flat_map(|gradients| gradients.iter_mut()).zip(padded_gradients);
        sums.enumerate().map(move |(i, (sum, space))| ParameterSum { i, layers, input, spans, space, sum })
    }
}

/// Cuts the batches of all stacks into spans, the same share of multiplications for each thread
/// that is worth it. Returns the number of shares.
fn cut(stacks: &mut [Forward<'_>]) -> usize {
    let total = stacks.iter().map(|stack| stack.workspace.rows * multiplications(stack.layers)).sum();
    let threads = threads_for(total);
    let mut before = 0;
    for Forward { layers, workspace } in stacks {
        let (rows, each) = (workspace.rows, multiplications(layers));
        // The row at which a share ends.
        let end = |share: usize| match ((total * (share + 1) / threads).saturating_sub(before) / each).min(rows) {
            row if row < WORTH_A_SPAN => 0,
            row if row + WORTH_A_SPAN > rows => rows,
            row => row,
        };
        let (mut start, mut cuts) = (0, 0);
        for share in 0..threads {
            let end = if share + 1 == threads { rows } else { end(share) };
            if end > start {
                if workspace.spans.len() == cuts {
                    workspace.spans.push(Span::default());
                }
                let span = &mut workspace.spans[cuts];
                (span.start, span.rows, span.share) = (start, end - start, share);
                (start, cuts) = (end, cuts + 1);
            }
        }
        workspace.cuts = cuts;
        before += rows * each;
    }
    threads
}

/// Multiplications for a row.
pub(super) fn multiplications(layers: &[Layer]) -> usize {
    layers.iter().map(|layer| layer.inputs() * layer.outputs()).sum()
}

/// Threads that this many multiplications are worth.
pub(super) fn threads_for(multiplications: usize) -> usize {
    rayon::current_num_threads().min(multiplications / WORTH_A_THREAD).max(1)
}

fn shares<T>(count: usize) -> Vec<Vec<T>> {
    (0..count).map(|_| Vec::new()).collect()
}

/// Does the work of every share, each on a thread of its own.
fn each<T: Send>(shares: Vec<Vec<T>>, work: impl Fn(T) + Send + Sync) {
    match <[_; 1]>::try_from(shares) {
        Ok([alone]) => alone.into_iter().for_each(work),
        Err(shares) => shares.into_par_iter().for_each(|share| share.into_iter().for_each(&work)),
    }
}

impl Workspace {
    /// The input, to be filled before a pass: `rows` × inputs, dense.
    pub fn input(&mut self, rows: usize, layers: &[Layer]) -> &mut [f32] {
        self.rows = rows;
        self.input.resize(rows * layers[0].inputs());
        &mut self.input
    }

    fn spans(&self) -> &[Span] {
        &self.spans[..self.cuts]
    }

    /// Copies the outputs, dense.
    pub fn output(&self, layers: &[Layer], y: &mut [f32]) {
        let Some(columns) = layers.last().map(Layer::outputs) else { return };
        for span in self.spans() {
            let y = &mut y[span.start * columns..][..span.rows * columns];
            unpad_rows(&span.outputs[layers.len() - 1], columns, y);
        }
    }

    /// Adds dL/dx to `dx` (dense), after a backward pass that computed it.
    pub fn add_input_gradient(&self, columns: usize, dx: &mut [f32]) {
        for span in self.spans() {
            let dx = &mut dx[span.start * columns..][..span.rows * columns];
            let rows = span.dx.chunks_exact(padded(columns));
            for (to, from) in dx.chunks_exact_mut(columns).zip(rows) {
                to.iter_mut().zip(from).for_each(|(d, g)| *d += g);
            }
        }
    }
}

impl Span {
    fn forward(&mut self, layers: &[Layer], input: &[f32]) {
        self.outputs.resize_with(layers.len(), Buffer::default);
        for (i, layer) in layers.iter().enumerate() {
            let (before, after) = self.outputs.split_at_mut(i);
            let x = input_of(i, layers, input, self.start, before);
            after[0].resize(self.rows * padded(layer.outputs()));
            self.layer.load(layer);
            dense(layer, &self.layer, self.rows, x, &mut after[0]);
        }
    }

    /// dL/dz of the last layer from the dense `dy`.
    fn start_backward(&mut self, layers: &[Layer], dy: &[f32]) {
        self.slopes.resize_with(layers.len(), Buffer::default);
        let last = layers.len() - 1;
        let columns = layers[last].outputs();
        let slopes = &mut self.slopes[last];
        slopes.resize(self.rows * padded(columns));
        pad_rows(&dy[self.start * columns..][..self.rows * columns], columns, slopes);
        Derivative { activation: layers[last].activation, output: &self.outputs[last], gradient: slopes }.go();
    }

    /// dL/dz of layer `i - 1` from that of layer `i`; for layer 0, dL/dx.
    fn backward(&mut self, i: usize, layers: &[Layer]) {
        let layer = &layers[i];
        let (inputs, outputs) = (layer.inputs(), layer.outputs());
        let (rows, columns) = (padded(inputs), padded(outputs));
        self.layer.load(layer);
        self.transposed.resize(rows * columns);
        Transpose { from: &self.layer.weight, rows, columns, to: &mut self.transposed }.go();
        let (before, after) = self.slopes.split_at_mut(i);
        let (c, epilogue) = match before.last_mut() {
            Some(slopes) => {
                let previous = &self.outputs[i - 1];
                (slopes, Epilogue::Derivative(layers[i - 1].activation, previous))
            }
            None => (&mut self.dx, Epilogue::None),
        };
        c.resize(self.rows * rows);
        Product {
            rows: self.rows,
            depth: outputs,
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
        .go();
    }
}

/// The input of layer `i` for the rows of a span from `start` on.
fn input_of<'a>(i: usize, layers: &[Layer], input: &'a [f32], start: usize, outputs: &'a [Buffer]) -> Rows<'a> {
    let columns = layers[i].inputs();
    match i {
        0 => Rows { values: &input[start * columns..], row: columns },
        _ => Rows { values: &outputs[i - 1], row: padded(columns) },
    }
}

/// `y = f(x w + b)` for `rows` rows of `x`.
pub(super) fn dense(layer: &Layer, loaded: &LoadedLayer, rows: usize, x: Rows<'_>, y: &mut [f32]) {
    let columns = padded(layer.outputs());
    Product {
        rows,
        depth: layer.inputs(),
        columns,
        a: x.values,
        a_row: x.row,
        a_depth: 1,
        b: &loaded.weight,
        b_row: columns,
        start: Start::Row(&loaded.bias),
        c: y,
        c_row: columns,
        epilogue: Epilogue::Activate(layer.activation),
    }
    .go();
}

/// The gradients of layer `i`, summed over the rows of all spans in order.
struct ParameterSum<'a> {
    i: usize,
    layers: &'a [Layer],
    input: &'a [f32],
    spans: &'a [Span],
    space: &'a mut [Buffer; 2],
    /// What they are added to.
    sum: &'a mut LayerGradients,
}

impl ParameterSum<'_> {
    fn run(self) {
        let Self { i, layers, input, spans, space: [padded_weight, padded_bias], sum: (weight, bias) } = self;
        let (inputs, outputs) = (layers[i].inputs(), layers[i].outputs());
        let columns = padded(outputs);
        let is_padded = columns != outputs;
        if is_padded {
            padded_weight.resize(inputs * columns);
            padded_bias.resize(columns);
            pad_rows(weight, outputs, padded_weight);
            pad_rows(bias, outputs, padded_bias);
        }
        let (dw, db): (&mut [f32], &mut [f32]) =
            if is_padded { (padded_weight, padded_bias) } else { (&mut weight[..], &mut bias[..]) };
        for span in spans {
            let x = input_of(i, layers, input, span.start, &span.outputs);
            Product {
                rows: inputs,
                depth: span.rows,
                columns,
                a: x.values,
                a_row: 1,
                a_depth: x.row,
                b: &span.slopes[i],
                b_row: columns,
                start: Start::Accumulate,
                c: &mut *dw,
                c_row: columns,
                epilogue: Epilogue::None,
            }
            .go();
            ColumnSums { x: &span.slopes[i], sums: db }.go();
        }
        if is_padded {
            unpad_rows(padded_weight, outputs, weight);
            unpad_rows(padded_bias, outputs, bias);
        }
    }
}
