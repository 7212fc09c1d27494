//! The timed work of `mge bench` under divan: `cargo bench --bench work`, pinned to one core (`taskset -c 0`) for
//! comparable results.

use divan::Bencher;
use mge::{WORKS, Work};

fn main() {
    divan::main();
}

#[divan::bench(args = WORKS)]
fn work(bencher: Bencher, work: &Work) {
    let call = work.prepare();
    bencher.bench_local(call);
}
