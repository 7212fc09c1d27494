//! Scalars for TensorBoard: events as tagged numbers over the episode.

use super::event::{Event, LoggedEvent};
use super::metric::Metric;

/// Converts the events of one process to scalars. Its only state is the clock for the `time/` tags.
#[derive(Debug, Default)]
pub(super) struct Scalars {
    started: Option<f64>,
    previous: Option<f64>,
}

impl Scalars {
    /// Tags and values of an event; empty if it has none. The step is `event.episode()`.
    pub fn of(&mut self, logged: &LoggedEvent) -> Vec<(&'static str, f64)> {
        let started = *self.started.get_or_insert(logged.time);
        match &logged.event {
            Event::EpisodeFinished(record) => {
                let scalar = |metric: &Metric| Some((metric.info().tag?, (metric.info().value)(record)?));
                let mut values: Vec<_> = Metric::ALL.iter().filter_map(scalar).collect();
                values.push(("time/seconds", logged.time - started));
                if let Some(previous) = self.previous.filter(|&previous| previous < logged.time) {
                    let rate = record.steps as f64 / (logged.time - previous);
                    values.push(("time/steps_per_second", rate));
                }
                self.previous = Some(logged.time);
                values
            }
            Event::Evaluated { success, mean_return, .. } => {
                vec![("eval/success", *success), ("eval/mean_return", *mean_return)]
            }
            Event::Started { .. } | Event::Resumed { .. } => {
                self.previous = Some(logged.time);
                Vec::new()
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::EpisodeRecord;

    #[test]
    fn episodes_and_evaluations_have_numbers() {
        let mut scalars = Scalars::default();
        let mut at = |time, event| scalars.of(&LoggedEvent { time, event });
        assert_eq!(at(10.0, Event::Resumed { episode: 0 }), []);
        let record = EpisodeRecord { episode: 1, steps: 8, goal: true, critic_loss: Some(0.5), ..Default::default() };
        let values = at(12.0, Event::EpisodeFinished(record));
        let value = |tag: &str| values.iter().find(|(t, _)| *t == tag).map(|(_, value)| *value);
        assert_eq!(value("train/goal"), Some(1.0));
        assert_eq!(value("loss/critic"), Some(0.5));
        assert_eq!(value("loss/actor"), None);
        assert_eq!(value("time/seconds"), Some(2.0));
        assert_eq!(value("time/steps_per_second"), Some(4.0));

        let evaluated = Event::Evaluated { episode: 1, episodes: 4, success: 0.5, mean_return: 3.0 };
        assert_eq!(at(13.0, evaluated), [("eval/success", 0.5), ("eval/mean_return", 3.0)]);
    }
}
