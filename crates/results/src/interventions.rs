//! Interventions in a run: where somebody changed it from outside.

use mge_run::Event;
use mge_trainer::RunConfig;

/// Where a run was forked, and its interventions, in order: the episodes finished by then, and a short description.
pub fn interventions(config: &RunConfig, events: &[Event]) -> Vec<(u64, String)> {
    let forked = config.fork.as_ref().map(|fork| (u64::from(fork.episode), fork.to_string()));
    let begins = forked.as_ref().map_or(0, |(episode, _)| *episode);
    let of_event = |event: &Event| {
        let text = match event {
            Event::ScheduleChanged { schedule, .. } => format!("epsilon {schedule}"),
            // Scheduled refinements are not interventions; a log of an earlier version does not say who gave clusters.
            Event::ClustersChanged { episode, given: false, .. } if config.is_refined_after(*episode) => return None,
            Event::ClustersChanged { .. } => "other clusters".to_owned(),
            Event::Paused { .. } => "paused".to_owned(),
            Event::Started { episode, .. } if *episode == begins => return None,
            // Of the run that it comes from, which may be a fork itself.
            Event::Started { episode, .. } if *episode < begins => "continued or forked".to_owned(),
            Event::Started { .. } => "continued".to_owned(),
            _ => return None,
        };
        Some((event.episode(), text))
    };
    let mut all: Vec<(u64, String)> = forked.into_iter().chain(events.iter().filter_map(of_event)).collect();
    // A fork also has the interventions before it, which come first.
    all.sort_by_key(|(episode, _)| *episode);
    all
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_trainer::Fork;

    #[test]
    fn what_somebody_changed_is_told_but_not_scheduled_events() {
        let mut config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        config.refinement.every = 50;
        let clusters = |episode| Event::ClustersChanged { episode, clusters: vec![1], given: false };
        let events = [
            Event::ScheduleChanged { episode: 20, schedule: "0.1".into() },
            clusters(50),
            Event::Paused { episode: 60 },
            clusters(70),
        ];
        let texts = |config: &RunConfig| {
            let all = interventions(config, &events).into_iter();
            all.map(|(episode, text)| format!("{episode} {text}")).collect::<Vec<_>>()
        };
        assert_eq!(texts(&config), ["20 epsilon 0.1", "60 paused", "70 other clusters"]);
        let started = |episode| Event::Started {
            origin: Default::default(),
            task: "task1".into(),
            method: "ddpg".into(),
            seed: 0,
            episodes: 100,
            episode,
            problems: Vec::new(),
            changes: Vec::new(),
        };
        let continued = |config: &RunConfig| {
            let found = interventions(config, &[started(0), started(30), started(55)]).into_iter();
            found.filter(|(_, text)| text.starts_with("continued")).map(|(episode, _)| episode).collect::<Vec<_>>()
        };
        assert_eq!(continued(&config), [30, 55]);
        let mut unscheduled = config.clone();
        unscheduled.refinement.every = 0;
        assert_eq!(interventions(&unscheduled, &[clusters(0)])[0].1, "other clusters");
        config.fork = Some(Fork { run: "a".into(), episode: 55, changes: vec!["seed=1".into()], tasks: Vec::new() });
        assert_eq!(texts(&config)[1], "55 forked from a at episode 55 with seed=1");
        assert_eq!(continued(&config), [0, 30], "the fork begins at episode 55");
        assert_eq!(interventions(&config, &[started(30)])[0].1, "continued or forked");
    }
}
