//! The files that only show the event log: `metrics.csv`, `log.txt` and TensorBoard's.
//!
//! One rule holds for all of them. They grow with the log, and a process that begins to write a run first writes them
//! anew from the events that it keeps. So they are those of an uninterrupted run, whatever happened to them before.

use std::io::Write;

use super::append::AppendFile;
use super::event::{EpisodeRecord, Event, LoggedEvent};
use super::metric::Metric;
use super::writer::now;
use super::{Result, RunDirectory, file, tensorboard};

/// What events add to each of the files.
#[derive(Debug, Default)]
struct Additions {
    rows: Vec<u8>,
    lines: Vec<u8>,
    records: Vec<u8>,
}

/// Derives from events, in their order, what they add to the files.
#[derive(Debug, Default)]
struct Projector {
    /// When the process that trains the run began, in seconds since 1970-01-01 UTC, as all times here.
    started: Option<f64>,
    /// When the latest episode began.
    began: Option<f64>,
    has_header: bool,
}

impl Projector {
    /// Adds an event: an episode to the table, every other one to the text, its numbers to TensorBoard.
    fn add(&mut self, logged: &LoggedEvent, to: &mut Additions) {
        let LoggedEvent { time, event } = logged;
        match event {
            Event::Started { .. } => (self.started, self.began) = (Some(*time), Some(*time)),
            Event::Resumed { .. } => self.began = Some(*time),
            _ => {}
        }
        let seconds = time - *self.started.get_or_insert(*time);
        match event {
            Event::EpisodeFinished(record) => {
                to.rows.extend(row(!self.has_header, record));
                self.has_header = true;
            }
            // Writing to memory cannot fail.
            other => _ = writeln!(to.lines, "[{seconds:10.3} s] {other}"),
        }
        let scalars = self.scalars(logged, seconds);
        if !scalars.is_empty() {
            to.records.extend(tensorboard::scalars(event.episode(), *time, &scalars));
        }
    }

    /// Tags and values of an event, which happened `seconds` after the start; empty if it has none.
    fn scalars(&mut self, logged: &LoggedEvent, seconds: f64) -> Vec<(&'static str, f64)> {
        match &logged.event {
            Event::EpisodeFinished(record) => {
                let scalar = |metric: &Metric| Some((metric.info().tag?, (metric.info().value)(record)?));
                let mut values: Vec<_> = Metric::ALL.iter().filter_map(scalar).collect();
                values.push(("time/seconds", seconds));
                if let Some(began) = self.began.replace(logged.time).filter(|began| *began < logged.time) {
                    values.push(("time/steps_per_second", record.steps as f64 / (logged.time - began)));
                }
                values
            }
            Event::Evaluated { success, mean_return, .. } => {
                vec![("eval/success", *success), ("eval/mean_return", *mean_return)]
            }
            _ => Vec::new(),
        }
    }
}

/// The row of an episode in the table, after the header if it is asked for.
fn row(header: bool, record: &EpisodeRecord) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    writer.serialize(record).expect("plain data");
    writer.into_inner().expect("writing to memory cannot fail")
}

/// The files, open for the events to come.
#[derive(Debug)]
pub(super) struct Projections {
    projector: Projector,
    metrics: AppendFile,
    log: AppendFile,
    tensorboard: AppendFile,
}

impl Projections {
    /// Writes the files of a run anew from its events so far.
    ///
    /// # Errors
    /// [`RunError::Io`](super::RunError::Io).
    pub fn open(directory: &RunDirectory, events: &[LoggedEvent]) -> Result<Self> {
        let time = now();
        let config = file::read(&directory.config_path())?;
        let mut projector = Projector::default();
        let mut all = Additions { records: tensorboard::beginning(time, &config), ..Additions::default() };
        events.iter().for_each(|logged| projector.add(logged, &mut all));
        Ok(Self {
            projector,
            metrics: AppendFile::anew(&directory.metrics_path(), &all.rows)?,
            log: AppendFile::anew(&directory.log_path(), &all.lines)?,
            tensorboard: tensorboard::new_file(&directory.tensorboard_path(), time, &all.records)?,
        })
    }

    /// Adds an event that was just logged.
    ///
    /// # Errors
    /// [`RunError::Io`](super::RunError::Io).
    pub fn add(&mut self, logged: &LoggedEvent) -> Result<()> {
        let mut additions = Additions::default();
        self.projector.add(logged, &mut additions);
        let Additions { rows, lines, records } = additions;
        for (file, bytes) in [(&mut self.metrics, rows), (&mut self.log, lines), (&mut self.tensorboard, records)] {
            if !bytes.is_empty() {
                file.append(&bytes)?;
            }
        }
        Ok(())
    }

    /// Waits until everything is on disk.
    ///
    /// # Errors
    /// [`RunError::Io`](super::RunError::Io).
    pub fn sync(&self) -> Result<()> {
        [&self.metrics, &self.log, &self.tensorboard].into_iter().try_for_each(AppendFile::sync)
    }

    /// The same with a table on a device that is always full.
    #[cfg(test)]
    #[cfg(target_os = "linux")]
    pub fn with_full_disk(self) -> Self {
        Self { metrics: AppendFile::on_a_full_disk(), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn episodes_and_evaluations_have_numbers() {
        let mut projector = Projector { began: Some(10.0), ..Projector::default() };
        let mut scalars = |time, event| projector.scalars(&LoggedEvent { time, event }, time - 10.0);
        assert_eq!(scalars(10.0, Event::Paused { episode: 0 }), []);
        let record = EpisodeRecord { episode: 1, steps: 8, goal: true, critic_loss: Some(0.5), ..Default::default() };
        let values = scalars(12.0, Event::EpisodeFinished(record));
        let value = |tag: &str| values.iter().find(|(t, _)| *t == tag).map(|(_, value)| *value);
        assert_eq!(value("train/goal"), Some(1.0));
        assert_eq!(value("loss/critic"), Some(0.5));
        assert_eq!(value("loss/actor"), None);
        assert_eq!(value("time/seconds"), Some(2.0));
        assert_eq!(value("time/steps_per_second"), Some(4.0));

        let evaluated = Event::Evaluated { episode: 1, episodes: 4, success: 0.5, mean_return: 3.0 };
        assert_eq!(scalars(13.0, evaluated), [("eval/success", 0.5), ("eval/mean_return", 3.0)]);
    }

    fn record(episode: u64) -> EpisodeRecord {
        EpisodeRecord {
            episode,
            steps: 12,
            environment_steps: 12 * episode,
            return_: 0.1 * episode as f32,
            goal: episode.is_multiple_of(2),
            subgoals: 1,
            subgoals_total: 2,
            guided: true,
            epsilon: 0.8,
            noise_sigma: 0.2,
            critic_loss: (episode > 1).then_some(f32::NAN),
            mean_q: (episode > 1).then_some(1e-9),
            end: "left the screen, twice".into(),
            terminated: true,
            placed: 3,
            blocked: 9,
            charged_actions: Some(100 + 12 * episode),
            ..Default::default()
        }
    }

    const GOLDEN: &str = "\
episode,steps,environment_steps,return,goal,subgoals,subgoals_total,guided,epsilon,noise_sigma,\
critic_loss,mean_q,max_q,actor_loss,action_saturation,rolling_success,terminated,truncated,end,placed,blocked,charged_actions
1,12,12,0.1,false,1,2,true,0.8,0.2,,,,,,0.0,true,false,\"left the screen, twice\",3,9,112
2,12,24,0.2,true,1,2,true,0.8,0.2,NaN,1e-9,,,,0.0,true,false,\"left the screen, twice\",3,9,124
";

    #[test]
    fn the_table_keeps_its_format() {
        let table = [row(true, &record(1)), row(false, &record(2))].concat();
        assert_eq!(String::from_utf8(table).unwrap(), GOLDEN);
    }
}
