//! What others ask of whoever trains a run: `control.jsonl` in its folder, a file that only grows. Who may
//! write the folder may ask; the trainer reads it between two episodes. So a run is steered from any
//! process, also over a file system that several machines share.

use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::append::AppendFile;
use super::{Result, RunDirectory, RunError, file};

/// Format of a line that this program writes, and the newest that it reads.
const FORMAT: u64 = 1;
/// Bytes of requests that are read at once; more of them are no person's.
const MOST: u64 = 1 << 20;

/// Something asked of a running training. Each takes effect between two episodes, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case")]
pub enum Request {
    /// Wait until a [`Request::Resume`].
    Pause,
    /// Continue after a pause.
    Resume,
    /// Train so many more episodes, then pause.
    Advance {
        /// How many.
        episodes: u32,
    },
    /// Save a checkpoint and end; the run can be continued.
    Stop,
    /// Another epsilon schedule.
    Epsilon {
        /// The schedule as a person writes it.
        schedule: String,
    },
}

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct RequestLine {
    format: u64,
    /// Seconds since 1970-01-01 UTC.
    time: f64,
    /// The process that asks.
    process: u32,
    #[serde(flatten)]
    request: Request,
}

impl RunDirectory {
    /// Asks something of whoever trains the run.
    ///
    /// # Errors
    /// [`RunError::NotTrained`] if nobody does; [`RunError::Io`] if the folder cannot be written.
    pub fn request(&self, request: &Request) -> Result<()> {
        if !self.is_locked()? {
            return Err(RunError::NotTrained(self.path().to_owned()));
        }
        let time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64());
        let line = RequestLine { format: FORMAT, time, process: std::process::id(), request: request.clone() };
        let mut file = AppendFile::open(&self.requests_path())?;
        file.end_line()?;
        file.append_json(&line)
    }

    /// A reader of what is asked from now on.
    pub fn requests(&self) -> RequestReader {
        let path = self.requests_path();
        let offset = std::fs::symlink_metadata(&path).map_or(0, |data| data.len());
        RequestReader { path, offset }
    }
}

/// Follows the requests of a run.
#[derive(Debug)]
pub struct RequestReader {
    path: PathBuf,
    offset: u64,
}

impl RequestReader {
    /// What was asked since the last call, in order, and why lines cannot be read, if any cannot.
    ///
    /// # Errors
    /// [`RunError::Io`] if the file cannot be read.
    pub fn poll(&mut self) -> Result<(Vec<Request>, Vec<String>)> {
        // Looked at between any two episodes: without a request, this is all it costs.
        let length = match std::fs::symlink_metadata(&self.path) {
            Ok(data) => data.len(),
            Err(error) if error.kind() == ErrorKind::NotFound => 0,
            Err(error) => return Err(RunError::io("read", &self.path)(error)),
        };
        if length <= self.offset {
            // A file that was replaced holds nothing that is new.
            self.offset = length;
            return Ok(Default::default());
        }
        let failed = RunError::io("read", &self.path);
        let bytes = self.read_on().map_err(failed)?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        self.offset += whole as u64;
        if whole == 0 && bytes.len() as u64 == MOST {
            self.offset = length;
        }
        let (mut requests, mut problems) = (Vec::new(), Vec::new());
        for line in bytes[..whole].split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            match serde_json::from_slice::<RequestLine>(line) {
                Ok(line) if line.format == FORMAT => requests.push(line.request),
                Ok(line) => problems.push(format!("format {} is not known to this program", line.format)),
                Err(error) => problems.push(error.to_string()),
            }
        }
        Ok((requests, problems))
    }

    fn read_on(&self) -> std::io::Result<Vec<u8>> {
        let mut file = file::open(&self.path)?;
        file.seek(SeekFrom::Start(self.offset))?;
        let mut bytes = Vec::new();
        file.take(MOST).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn requests_are_read_in_order_from_where_a_training_began() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let error = run.request(&Request::Pause).unwrap_err();
        assert!(matches!(error, RunError::NotTrained(_)), "{error}");
        let mut first = run.requests();
        let _lock = run.lock().unwrap();
        assert_eq!(first.poll().unwrap().0, []);
        let epsilon = Request::Epsilon { schedule: "linear:0.5:0:100".into() };
        run.request(&Request::Pause).unwrap();
        run.request(&epsilon).unwrap();
        let mut second = run.requests();
        assert_eq!(first.poll().unwrap().0, [Request::Pause, epsilon]);
        assert_eq!(first.poll().unwrap().0, []);
        run.request(&Request::Advance { episodes: 3 }).unwrap();
        assert_eq!(second.poll().unwrap().0, [Request::Advance { episodes: 3 }], "what was asked before is past");
    }

    #[test]
    fn half_a_line_is_not_yet_one_and_a_bad_one_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let mut reader = run.requests();
        let mut file = std::fs::File::create(run.requests_path()).unwrap();
        file.write_all(b"{\"format\":1,\"time\":0,\"process\":1,\"requ").unwrap();
        assert_eq!(reader.poll().unwrap(), (vec![], vec![]));
        file.write_all(b"est\":\"stop\"}\nnonsense\n{\"format\":9,\"time\":0,\"process\":1,\"request\":\"stop\"}\n")
            .unwrap();
        let (requests, problems) = reader.poll().unwrap();
        assert_eq!((requests, problems.len()), (vec![Request::Stop], 2));
        std::fs::write(run.requests_path(), "").unwrap();
        assert_eq!(reader.poll().unwrap(), (vec![], vec![]));
    }

    #[test]
    fn half_a_line_that_is_never_finished_does_not_swallow_the_next_request() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let _lock = run.lock().unwrap();
        let mut reader = run.requests();
        std::fs::write(run.requests_path(), b"{\"format\":1,\"time\":0,\"proc").unwrap();
        assert_eq!(reader.poll().unwrap(), (vec![], vec![]));
        run.request(&Request::Pause).unwrap();
        run.request(&Request::Stop).unwrap();
        let (requests, problems) = reader.poll().unwrap();
        assert_eq!((requests, problems.len()), (vec![Request::Pause, Request::Stop], 1));
    }
}
