//! Processor time and memory of the process, where the system reports them.

use std::time::{Duration, Instant};

/// Minimum time between two measurements.
const MEASURE_INTERVAL: Duration = Duration::from_secs(2);
/// Clock ticks per second in `/proc`: the same on every architecture that Linux supports.
const TICKS: f64 = 100.0;

/// Processor and memory use of the process.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct System {
    /// Cores kept busy, on average, since the previous measurement.
    pub cores: Option<f64>,
    /// Resident memory in bytes.
    pub memory: Option<u64>,
}

/// Measures the process now and then.
#[derive(Debug, Default)]
pub struct Meter {
    known: System,
    /// Time of the previous measurement, and the processor time then, in seconds.
    before: Option<(Instant, Option<f64>)>,
}

impl Meter {
    /// The latest measurement.
    pub fn known(&self) -> System {
        self.known
    }

    /// Measures if it is time to. True if the text to show has changed.
    pub fn look(&mut self) -> bool {
        if self.before.is_some_and(|(at, _)| at.elapsed() < MEASURE_INTERVAL) {
            return false;
        }
        let now = Instant::now();
        let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let time = processor_time(&read("/proc/self/stat"));
        let cores = self
            .before
            .zip(time)
            .and_then(|((at, before), time)| Some((time - before?) / now.duration_since(at).as_secs_f64()));
        let found = System { cores, memory: memory(&read("/proc/self/status")) };
        self.before = Some((now, time));
        let shown = |system: &System| (system.cores.map(tenths), system.memory.map(megabytes));
        let is_news = shown(&found) != shown(&self.known);
        self.known = found;
        is_news
    }
}

impl System {
    /// Processor and memory as text, as far as they are known.
    pub fn words(&self) -> Vec<String> {
        let cores = self.cores.map(|cores| format!("cpu {} %", 10 * tenths(cores)));
        let memory = self.memory.map(|bytes| format!("{} MB", megabytes(bytes)));
        cores.into_iter().chain(memory).collect()
    }
}

fn tenths(cores: f64) -> u64 {
    (10.0 * cores.max(0.0)).round() as u64
}

fn megabytes(bytes: u64) -> u64 {
    bytes / 1_000_000
}

/// Seconds of processor time of all threads, from `/proc/self/stat`.
fn processor_time(stat: &str) -> Option<f64> {
    // The name of the program, in parentheses, may contain spaces and parentheses.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<f64>().ok();
    Some((ticks()? + ticks()?) / TICKS)
}

/// Resident memory in bytes, from `/proc/self/status`.
fn memory(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_of_linux_is_parsed_and_anything_else_is_unknown() {
        let stat = "12 (a) b) S 1 2 3 4 5 6 7 8 9 10 250 50 0 0 20 0 4 0";
        assert_eq!(processor_time(stat), Some(3.0));
        assert_eq!(memory("VmPeak:\t 9 kB\nVmRSS:\t  2000 kB\n"), Some(2_048_000));
        assert_eq!((processor_time(""), memory("")), (None, None));
        let system = System { cores: Some(1.26), memory: Some(62_900_000) };
        assert_eq!(system.words(), ["cpu 130 %", "62 MB"]);
        assert!(System::default().words().is_empty());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_process_measures_itself() {
        let mut meter = Meter::default();
        assert!(meter.look() && !meter.look(), "not twice in quick succession");
        assert!(meter.known().memory.unwrap() > 1_000_000 && meter.known().cores.is_none());
        let time = processor_time(&std::fs::read_to_string("/proc/self/stat").unwrap()).unwrap();
        meter.before = Some((Instant::now() - Duration::from_secs(100), Some(time - 1000.0)));
        assert!(meter.look());
        let cores = meter.known().cores.unwrap();
        assert!((cores - 10.0).abs() < 0.5, "{cores}");
    }
}
