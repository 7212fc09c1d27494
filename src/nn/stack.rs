//! Forward and backward pass through a whole stack of layers, on memory that is used again.
//!
//! The rows of a batch are cut into one contiguous [`Span`] a thread. Passes through the layers
//! touch one span only; weight gradients are summed over the spans in order. Kernels sum every
//! element in the order of the rows however they are cut, so all results are the same to the bit
//! for any number of threads.

use dfdx::prelude::*;
use rayon::prelude::*;

use super::{
    Matrix,
    kernel::{Buffer, ColumnSums, Derivative, Epilogue, Kernel, Product, Start, Transpose, padded},
    layer::{Layer, LoadedLayer, pad_rows, unpad_rows},
};

/// Memory of one forward pass and, if it is kept, the backward pass that follows.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    input: Input,
    spans: Vec<Span>,
    /// Padded gradients of a layer whose outputs are no whole lines, a buffer a layer.
    padded_gradients: Vec<[Buffer; 2]>,
}

/// The input of the first layer: columns of data on the left, then those that may want a
/// gradient. Both dense.
#[derive(Debug, Default)]
struct Input {
    data: Buffer,
    data_columns: usize,
    x: Buffer,
}

/// Some columns of a layer's input.
#[derive(Clone, Copy)]
struct Operand<'a> {
    values: &'a [f32],
    /// Distance of the rows.
    row: usize,
    /// The columns are `first..first + columns` of the layer's inputs.
    first: usize,
    columns: usize,
}

/// Memory for some rows of a batch.
#[derive(Debug, Default)]
struct Span {
    start: usize,
    rows: usize,
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

impl Workspace {
    /// The two parts of the input, to be filled before a pass: `rows` × `data_columns` dense
    /// values of data, and `rows` × the remaining inputs.
    pub fn input(&mut self, rows: usize, data_columns: usize, layers: &[Layer]) -> (&mut [f32], &mut [f32]) {
        let Input { data, data_columns: left, x } = &mut self.input;
        *left = data_columns;
        data.resize(rows * data_columns);
        x.resize(rows * (layers[0].inputs() - data_columns));
        let count = threads_for(rows, layers);
        self.spans.resize_with(count, Span::default);
        for (i, span) in self.spans.iter_mut().enumerate() {
            span.start = rows * i / count;
            span.rows = rows * (i + 1) / count - span.start;
        }
        (data, x)
    }

    /// Runs all layers and keeps what [`backward`](Self::backward) needs.
    pub fn forward(&mut self, layers: &[Layer]) {
        let input = &self.input;
        each(&mut self.spans, |span| span.forward(layers, input));
    }

    /// Copies the outputs, dense.
    pub fn output(&self, layers: &[Layer], y: &mut [f32]) {
        let Some(columns) = layers.last().map(Layer::outputs) else { return };
        for span in &self.spans {
            let y = &mut y[span.start * columns..][..span.rows * columns];
            unpad_rows(&span.outputs[layers.len() - 1], columns, y);
        }
    }

    /// Propagates `dy` = dL/dy (dense) back. Adds to `parameters` (a pair a layer) if given;
    /// computes dL/dx, of the inputs that are not data, if `input`.
    pub fn backward(&mut self, layers: &[Layer], dy: &[f32], parameters: Option<&mut [LayerGradients]>, input: bool) {
        each(&mut self.spans, |span| span.start_backward(layers, dy));
        let first_wanted = if input { 0 } else { 1 };
        let data_columns = self.input.data_columns;
        match parameters {
            Some(gradients) if self.spans.len() == 1 => {
                self.padded_gradients.resize_with(layers.len(), Default::default);
                for i in (0..layers.len()).rev() {
                    let space = &mut self.padded_gradients[i];
                    parameter_gradients(i, layers, &self.input, &self.spans, space, &mut gradients[i]);
                    if i >= first_wanted {
                        self.spans[0].backward(i, layers, data_columns);
                    }
                }
            }
            parameters => {
                each(&mut self.spans, |span| {
                    (first_wanted..layers.len()).rev().for_each(|i| span.backward(i, layers, data_columns));
                });
                if let Some(gradients) = parameters {
                    self.padded_gradients.resize_with(layers.len(), Default::default);
                    let (input, spans) = (&self.input, &self.spans);
                    let spaces = self.padded_gradients.par_iter_mut();
                    gradients.par_iter_mut().zip(spaces).enumerate().for_each(|(i, (g, space))| {
                        parameter_gradients(i, layers, input, spans, space, g);
                    });
                }
            }
        }
    }

    /// Adds dL/dx to `dx` (dense), after a backward pass that computed it.
    pub fn add_input_gradient(&self, columns: usize, dx: &mut [f32]) {
        for span in &self.spans {
            let dx = &mut dx[span.start * columns..][..span.rows * columns];
            let rows = span.dx.chunks_exact(padded(columns));
            for (to, from) in dx.chunks_exact_mut(columns).zip(rows) {
                to.iter_mut().zip(from).for_each(|(d, g)| *d += g);
            }
        }
    }
}

/// Threads that a pass of this size is worth.
fn threads_for(rows: usize, layers: &[Layer]) -> usize {
    let work = rows * layers.iter().map(|l| l.inputs() * l.outputs()).sum::<usize>();
    rayon::current_num_threads().min(work / WORTH_A_THREAD).clamp(1, rows.max(1))
}

/// Calls `work` for every span, on several threads if there are several.
fn each(spans: &mut [Span], work: impl Fn(&mut Span) + Send + Sync) {
    match spans {
        [span] => work(span),
        [a, b] => {
            rayon::join(|| work(a), || work(b));
        }
        spans => spans.par_iter_mut().for_each(work),
    }
}

impl Span {
    fn forward(&mut self, layers: &[Layer], input: &Input) {
        self.outputs.resize_with(layers.len(), Buffer::default);
        for (i, layer) in layers.iter().enumerate() {
            let (before, after) = self.outputs.split_at_mut(i);
            let operands = operands(i, layers, input, self.start, before);
            after[0].resize(self.rows * padded(layer.outputs()));
            self.layer.load(layer);
            dense(layer, &self.layer, self.rows, operands, &mut after[0]);
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

    /// dL/dz of layer `i - 1` from that of layer `i`; for layer 0, dL/dx of the inputs after
    /// `data_columns`.
    fn backward(&mut self, i: usize, layers: &[Layer], data_columns: usize) {
        let layer = &layers[i];
        let first = if i == 0 { data_columns } else { 0 };
        let (inputs, outputs) = (layer.inputs() - first, layer.outputs());
        let (rows, columns) = (padded(inputs), padded(outputs));
        self.layer.load(layer);
        self.transposed.resize(rows * columns);
        let from = &self.layer.weight[first * columns..];
        Transpose { from, rows, columns, to: &mut self.transposed }.go();
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

/// The input of layer `i` for the rows of a span: one operand, or two if there is data beside the
/// first layer's input.
fn operands<'a>(
    i: usize,
    layers: &[Layer],
    input: &'a Input,
    start: usize,
    outputs: &'a [Buffer],
) -> impl Iterator<Item = Operand<'a>> + Clone {
    let columns = layers[i].inputs();
    let left = if i == 0 { input.data_columns } else { 0 };
    let right = columns - left;
    let (values, row) = match i {
        0 => (&input.x[start * right..], right),
        _ => (&outputs[i - 1][..], padded(columns)),
    };
    let data = (left > 0).then(|| Operand { values: &input.data[start * left..], row: left, first: 0, columns: left });
    data.into_iter().chain((right > 0).then_some(Operand { values, row, first: left, columns: right }))
}

/// `y = f(a w + b)` for `rows` rows of the operands `a` side by side.
fn dense<'a>(
    layer: &Layer,
    loaded: &LoadedLayer,
    rows: usize,
    operands: impl Iterator<Item = Operand<'a>>,
    y: &mut [f32],
) {
    let columns = padded(layer.outputs());
    let mut start = Start::Row(&loaded.bias);
    for Operand { values, row, first, columns: depth } in operands {
        let is_last = first + depth == layer.inputs();
        Product {
            rows,
            depth,
            columns,
            a: values,
            a_row: row,
            a_depth: 1,
            b: &loaded.weight[first * columns..],
            b_row: columns,
            start,
            c: y,
            c_row: columns,
            epilogue: if is_last { Epilogue::Activate(layer.activation) } else { Epilogue::None },
        }
        .go();
        start = Start::Accumulate;
    }
}

/// Adds the gradients of layer `i`, summed over the rows of all spans in order.
fn parameter_gradients(
    i: usize,
    layers: &[Layer],
    input: &Input,
    spans: &[Span],
    [padded_weight, padded_bias]: &mut [Buffer; 2],
    (weight, bias): &mut LayerGradients,
) {
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
        for operand in operands(i, layers, input, span.start, &span.outputs) {
            Product {
                rows: operand.columns,
                depth: span.rows,
                columns,
                a: operand.values,
                a_row: 1,
                a_depth: operand.row,
                b: &span.slopes[i],
                b_row: columns,
                start: Start::Accumulate,
                c: &mut dw[operand.first * columns..],
                c_row: columns,
                epilogue: Epilogue::None,
            }
            .go();
        }
        ColumnSums { x: &span.slopes[i], sums: db }.go();
    }
    if is_padded {
        unpad_rows(padded_weight, outputs, weight);
        unpad_rows(padded_bias, outputs, bias);
    }
}

/// Memory of a prediction that keeps nothing for a backward pass.
#[derive(Debug, Default)]
pub(super) struct PredictWorkspace {
    x: Buffer,
    part: Buffer,
    threads: Vec<PredictSpace>,
}

#[derive(Debug, Default)]
struct PredictSpace {
    layer: LoadedLayer,
    outputs: [Buffer; 2],
}

/// Rows that pass through all layers together: their values stay in the second-level cache.
const CHUNK: usize = 192;

impl PredictWorkspace {
    /// `y` = outputs for the rows of `data` and `x` side by side; their memory is dense.
    pub fn predict_tensors(&mut self, layers: &[Layer], data: Option<&Matrix>, x: &Matrix, y: &mut [f32]) {
        let (rows, columns) = *x.shape();
        let mut values = std::mem::take(&mut self.x);
        match data {
            None => {
                values.resize(rows * columns);
                x.copy_into(&mut values);
            }
            Some(data) => {
                let left = data.shape().1;
                values.resize(rows * (left + columns));
                for (part, first, width) in [(data, 0, left), (x, left, columns)] {
                    self.part.resize(rows * width);
                    part.copy_into(&mut self.part);
                    let to = values.chunks_exact_mut(left + columns);
                    for (to, from) in to.zip(self.part.chunks_exact(width)) {
                        to[first..first + width].copy_from_slice(from);
                    }
                }
            }
        }
        self.predict(layers, &values, rows, y);
        self.x = values;
    }

    /// `y` = outputs for `rows` rows of `x`; both dense.
    pub fn predict(&mut self, layers: &[Layer], x: &[f32], rows: usize, y: &mut [f32]) {
        let (Some(first), Some(last)) = (layers.first(), layers.last()) else { return };
        if rows == 0 {
            return;
        }
        let count = threads_for(rows, layers);
        self.threads.resize_with(count, Default::default);
        let share = rows.div_ceil(count);
        let (x_share, y_share) = (share * first.inputs(), share * last.outputs());
        if count == 1 {
            self.threads[0].predict(layers, x, y);
        } else {
            let parts = x.par_chunks(x_share).zip(y.par_chunks_mut(y_share));
            self.threads.par_iter_mut().zip(parts).for_each(|(space, (x, y))| space.predict(layers, x, y));
        }
    }
}

impl PredictSpace {
    fn predict(&mut self, layers: &[Layer], x: &[f32], y: &mut [f32]) {
        let (inputs, outputs) = (layers[0].inputs(), layers[layers.len() - 1].outputs());
        for (x, y) in x.chunks(CHUNK * inputs).zip(y.chunks_mut(CHUNK * outputs)) {
            let rows = x.len() / inputs;
            for (i, layer) in layers.iter().enumerate() {
                self.layer.load(layer);
                let [from, to] = &mut self.outputs;
                to.resize(rows * padded(layer.outputs()));
                let columns = layer.inputs();
                let (values, row) = match i {
                    0 => (x, columns),
                    _ => (&from[..], padded(columns)),
                };
                let operand = Operand { values, row, first: 0, columns };
                dense(layer, &self.layer, rows, std::iter::once(operand), to);
                self.outputs.swap(0, 1);
            }
            unpad_rows(&self.outputs[0], outputs, y);
        }
    }
}
