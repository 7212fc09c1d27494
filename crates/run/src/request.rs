//! Requests to the process that trains a run: `control.jsonl` in its folder, an append-only file. Every process
//! that may write to the folder can control the run, even from another machine over a shared file system. The
//! trainer, which knows what they are, reads the file between episodes.

use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::append::AppendFile;
use super::writer::now;
use super::{Result, RunDirectory, RunError, file};

/// The format of a line that this program writes, and the only one that it reads.
const FORMAT: u64 = 1;
/// Maximum number of bytes that are read at once; far more than users produce.
const MAX_READ_BYTES: u64 = 1 << 20;

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct RequestLine<R> {
    format: u64,
    /// Seconds since 1970-01-01 UTC.
    time: f64,
    /// Id of the requesting process.
    process: u32,
    #[serde(flatten)]
    request: R,
}

impl RunDirectory {
    /// Sends a request to the process that trains the run.
    ///
    /// # Errors
    /// [`RunError::Refused`] if there is none; [`RunError::Io`] if the folder cannot be written.
    pub fn request(&self, request: &impl Serialize) -> Result<()> {
        if !self.is_locked()? {
            let run = self.path().display();
            let what = format!("no process is training {run}: it can be continued if it is not finished");
            return Err(RunError::Refused(what));
        }
        let line = RequestLine { format: FORMAT, time: now(), process: std::process::id(), request };
        // A line feed first, because another process may have left its line incomplete. Readers skip empty lines.
        let line = [b"\n", &file::json_line(&line)[..]].concat();
        AppendFile::open(&self.requests_path())?.append(&line)
    }

    /// A reader of requests that are sent from now on.
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
    /// The requests since the last call, in order, and the errors of invalid lines.
    ///
    /// # Errors
    /// [`RunError::Io`] if the file cannot be read.
    pub fn poll<R: DeserializeOwned>(&mut self) -> Result<(Vec<R>, Vec<String>)> {
        // This runs between any two episodes; without a request, its only cost is this system call.
        let length = match std::fs::symlink_metadata(&self.path) {
            Ok(data) => data.len(),
            Err(error) if error.kind() == ErrorKind::NotFound => 0,
            Err(error) => return Err(RunError::io("read", &self.path)(error)),
        };
        if length <= self.offset {
            // A replaced file is treated as having no new requests.
            self.offset = length;
            return Ok(Default::default());
        }
        let failed = RunError::io("read", &self.path);
        let bytes = self.read_on().map_err(failed)?;
        let whole = file::whole_lines(&bytes);
        self.offset += whole.len() as u64;
        if whole.is_empty() && bytes.len() as u64 == MAX_READ_BYTES {
            self.offset = length;
        }
        let (mut requests, mut problems) = (Vec::new(), Vec::new());
        for line in whole.split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            match serde_json::from_slice::<RequestLine<R>>(line) {
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
        file.take(MAX_READ_BYTES).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(tag = "request", rename_all = "snake_case")]
    enum Request {
        Pause,
        Advance { episodes: u32 },
        Stop,
        Epsilon { schedule: String },
    }

    #[test]
    fn requests_are_read_in_order_from_where_a_training_began() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let error = run.request(&Request::Pause).unwrap_err();
        assert!(matches!(error, RunError::Refused(_)), "{error}");
        let mut first = run.requests();
        let _lock = run.lock().unwrap();
        assert_eq!(first.poll::<Request>().unwrap().0, []);
        let epsilon = Request::Epsilon { schedule: "linear:0.5:0:100".into() };
        run.request(&Request::Pause).unwrap();
        run.request(&epsilon).unwrap();
        let mut second = run.requests();
        assert_eq!(first.poll::<Request>().unwrap().0, [Request::Pause, epsilon]);
        assert_eq!(first.poll::<Request>().unwrap().0, []);
        run.request(&Request::Advance { episodes: 3 }).unwrap();
        assert_eq!(
            second.poll::<Request>().unwrap().0,
            [Request::Advance { episodes: 3 }],
            "earlier requests are not repeated"
        );
    }

    #[test]
    fn half_a_line_is_ignored_and_a_bad_one_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let mut reader = run.requests();
        let mut file = std::fs::File::create(run.requests_path()).unwrap();
        file.write_all(b"{\"format\":1,\"time\":0,\"process\":1,\"requ").unwrap();
        assert_eq!(reader.poll::<Request>().unwrap(), (vec![], vec![]));
        file.write_all(b"est\":\"stop\"}\nnonsense\n{\"format\":9,\"time\":0,\"process\":1,\"request\":\"stop\"}\n")
            .unwrap();
        let (requests, problems) = reader.poll::<Request>().unwrap();
        assert_eq!((requests, problems.len()), (vec![Request::Stop], 2));
        std::fs::write(run.requests_path(), "").unwrap();
        assert_eq!(reader.poll::<Request>().unwrap(), (vec![], vec![]));
    }

    #[test]
    fn half_a_line_that_is_never_finished_does_not_swallow_the_next_request() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &1).unwrap();
        let _lock = run.lock().unwrap();
        let mut reader = run.requests();
        std::fs::write(run.requests_path(), b"{\"format\":1,\"time\":0,\"proc").unwrap();
        assert_eq!(reader.poll::<Request>().unwrap(), (vec![], vec![]));
        run.request(&Request::Pause).unwrap();
        run.request(&Request::Stop).unwrap();
        let (requests, problems) = reader.poll::<Request>().unwrap();
        assert_eq!((requests, problems.len()), (vec![Request::Pause, Request::Stop], 1));
    }
}
