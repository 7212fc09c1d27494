use mge::{guidance::*, run::*, task, trainer::*};
use std::sync::Arc;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut c = RunConfig::new(Arc::new(task::load(&a[1]).unwrap()));
    c.method = a[2].parse().unwrap();
    c.seed = a[3].parse().unwrap();
    c.episodes = a[4].parse().unwrap();
    c.epsilon = a[5].parse().unwrap();
    c.prior = PriorSource::TruePhysics;
    let dir = std::path::PathBuf::from(&a[6]);
    let _ = std::fs::remove_dir_all(&dir);
    let d = RunDirectory::create(&dir, &c).unwrap();
    let (_s, r) = crossbeam_channel::unbounded();
    let t = std::time::Instant::now();
    let e = conduct(&d, &r, &Watch::default());
    println!("{e:?} {:?}", t.elapsed());
    for r in read_metrics(&d.metrics_path()).unwrap().iter().filter(|r| r.episode % 100 == 0) {
        println!(
            "{} success {:.2} return {:.2} q {:?} sat {:?}",
            r.episode, r.rolling_success, r.return_, r.max_q, r.action_saturation
        );
    }
}
