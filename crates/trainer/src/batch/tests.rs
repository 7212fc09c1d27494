//! Tests of the batch contract.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use super::*;
use mge_base::stop::Stop;
use mge_base::sync::lock;

#[derive(Debug, thiserror::Error)]
enum Trouble {
    #[error("no luck")]
    Failed,
    #[error("somebody else has it")]
    InUse,
}

impl JobError for Trouble {
    fn is_in_use(&self) -> bool {
        matches!(self, Self::InUse)
    }
}

/// Runs jobs that call a function with their number, their attempt (from 0) and their handle. Returns the outcomes as
/// text, and every progress report as (done, ended, failed).
fn run<F>(threads: usize, count: usize, interrupt: &Stop, work: F) -> (Vec<String>, Vec<(u64, usize, usize)>)
where
    F: Fn(usize, usize, &JobHandle) -> Result<Option<usize>, Trouble> + Sync,
{
    let job = |number: usize| {
        let (tries, work) = (AtomicUsize::new(0), &work);
        Job::new(format!("job {number}"), 10 * number as u64, move |handle| {
            work(number, tries.fetch_add(1, Ordering::AcqRel), handle)
        })
    };
    let jobs: Vec<_> = (0..count).map(job).collect();
    let mut reports = Vec::new();
    let on_progress = &mut |now: &BatchProgress<'_>| {
        assert_eq!((now.total, now.jobs), ((0..count as u64).map(|size| 10 * size).sum(), count));
        reports.push((now.done, now.ended, now.failed));
    };
    let outcomes = Batch { threads, interrupt, on_progress }.run(&jobs).unwrap();
    let text = |outcome: Result<usize, JobFailure<Trouble>>| match outcome {
        Ok(output) => output.to_string(),
        Err(failure) => failure.to_string(),
    };
    (outcomes.into_iter().map(text).collect(), reports)
}

#[test]
fn outcomes_are_in_job_order_on_any_number_of_threads() {
    for threads in [1, 2, 5, 40] {
        let never = Stop::default();
        let (outcomes, reports) = run(threads, 12, &never, |number, _, _| {
            // The first jobs end last.
            std::thread::sleep(Duration::from_millis(12 - number as u64));
            Ok(Some(number * number))
        });
        assert_eq!(outcomes, (0..12).map(|number| (number * number).to_string()).collect::<Vec<_>>());
        assert_eq!(reports.last(), Some(&(660, 12, 0)), "{threads} threads");
    }
}

#[test]
fn jobs_start_in_order_and_each_has_its_share_of_the_threads() {
    let started = Mutex::new(Vec::new());
    let threads_of_jobs = Mutex::new(Vec::new());
    run(1, 5, &Stop::default(), |number, _, _| {
        started.lock().unwrap().push(number);
        Ok(Some(number))
    });
    assert_eq!(started.into_inner().unwrap(), [0, 1, 2, 3, 4]);
    run(5, 2, &Stop::default(), |number, _, _| {
        threads_of_jobs.lock().unwrap().push(rayon::current_num_threads());
        Ok(Some(number))
    });
    assert_eq!(threads_of_jobs.into_inner().unwrap(), [2, 2]);
}

#[test]
fn failures_and_panics_are_outcomes_and_stop_nothing() {
    let never = Stop::default();
    let (outcomes, reports) = run(2, 4, &never, |number, _, _| match number {
        1 => Err(Trouble::Failed),
        2 => panic!("on purpose"),
        _ => Ok(Some(number)),
    });
    assert_eq!(outcomes, ["0", "no luck", "it panicked: on purpose", "3"]);
    assert_eq!(reports.last(), Some(&(60, 4, 2)), "failed jobs count as done");
}

#[test]
fn a_job_of_another_process_is_tried_again_after_all_others() {
    let order = Mutex::new(Vec::new());
    let (outcomes, _) = run(1, 3, &Stop::default(), |number, tries, _| {
        lock(&order).push(number);
        if number == 0 && tries < 2 { Err(Trouble::InUse) } else { Ok(Some(tries)) }
    });
    assert_eq!(outcomes, ["2", "0", "0"]);
    assert_eq!(order.into_inner().unwrap(), [0, 1, 2, 0, 0]);
}

#[test]
fn an_interruption_stops_running_jobs_and_starts_no_others() {
    let interrupt = Stop::default();
    let (outcomes, reports) = run(2, 6, &interrupt, |number, _, handle| {
        if number == 0 {
            return Ok(Some(0));
        }
        handle.set_done(7);
        interrupt.request();
        while !handle.is_stopped() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(None)
    });
    assert_eq!(outcomes[0], "0");
    assert!(outcomes[1..].iter().all(|outcome| outcome == "it was interrupted"), "{outcomes:?}");
    let (done, _, failed) = reports.last().unwrap();
    assert!(*done <= 14 && *failed == 0, "{reports:?}");
}
