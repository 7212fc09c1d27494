//! Memory of training and prediction is constant after the first steps.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use dfdx::prelude::*;
use mge::nn::{Activation, InitScheme, Mlp, MlpShape, Optimiser, OptimiserKind, matrix};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

// Counted per thread, because the test harness allocates on its own thread at any time.
thread_local! {
    static LIVE: Cell<isize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: forwards every call to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.set(LIVE.get() + layout.size() as isize);
        // SAFETY: the caller's contract is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        LIVE.set(LIVE.get() - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn memory_is_steady() {
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one_thread.install(|| {
        let before = LIVE.get();
        train_and_predict();
        let left = LIVE.get() - before;
        assert!(left < 4096, "dropped networks leave {left} bytes");
    });
}

fn train_and_predict() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let shape = MlpShape::uniform(3, 16, 2, 3, Activation::Tanh);
    let mut net = Mlp::new(shape, InitScheme::FanIn, &mut rng).unwrap();
    let mut target = net.clone();
    let mut optimiser = Optimiser::new(OptimiserKind::Adam, &[&net]);
    let x = matrix(&Cpu::default(), vec![0.5; 12], 4, 3);
    let mut step = || {
        let mut grads = net.forward(x.leaky_trace()).square().mean().backward();
        optimiser.update(&mut [&mut net], &mut grads, 1e-4).unwrap();
        drop(grads);
        target.soft_update(&net, 0.01);
    };
    (0..100).for_each(|_| step());
    let live = LIVE.get();
    (0..100_000).for_each(|_| step());
    assert_eq!(LIVE.get() - live, 0, "bytes more after 100000 steps");

    let (input, mut out) = (vec![0.5; 3 * 1000], Vec::new());
    net.predict_into(&input, 1000, &mut out);
    let live = LIVE.get();
    (0..1000).for_each(|_| net.predict_into(&input, 1000, &mut out));
    assert_eq!(LIVE.get() - live, 0, "bytes more after 1000 predictions");
}
