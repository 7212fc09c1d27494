//! The runs of a session by number, their queue for cores and their folders.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use crate::SessionError;
use crate::run::{QUEUED, RunView};
use mge_base::paths::fitting;
use mge_run::RunState;

/// The runs of a session.
#[derive(Debug, Default)]
pub(crate) struct Runs {
    /// In the order in which they were started or opened, that of their numbers.
    pub all: Vec<RunView>,
    /// Number of the current run, on which commands act.
    pub current: Option<usize>,
    /// Number of runs so far, including deleted ones.
    created: usize,
    /// The folders of the session's runs that were deleted, with their numbers; restored ones too.
    former: Vec<(usize, PathBuf)>,
    /// The folders of deleted runs that were not restored, in the order of their deletion; of each, those deleted together.
    pub deleted: Vec<Vec<PathBuf>>,
    /// Number of runs queued so far.
    pub turns: u64,
    /// Maximum number of runs trained at the same time, by default one on each core; further runs are queued.
    pub cores: Option<NonZeroUsize>,
}

impl Runs {
    /// The number of the run in a folder, if it is in the session.
    pub fn number_of(&self, folder: &Path) -> Option<usize> {
        // A folder may have several names, such as `.`.
        let place = folder.canonicalize().ok();
        let is_there = |path: &Path| path == folder || (place.is_some() && path.canonicalize().ok() == place);
        self.all.iter().find(|run| is_there(run.directory().path())).map(|run| run.number)
    }

    /// The number that the run in a folder has or, if it was deleted, had in the session.
    pub fn number_ever_of(&self, folder: &Path) -> Option<usize> {
        let former = || self.former.iter().rev().find(|(_, path)| path == folder).map(|(number, _)| *number);
        self.number_of(folder).or_else(former)
    }

    /// The folder of the run that has or had a number.
    pub fn folder_of(&self, number: usize) -> Option<&Path> {
        let run = self.all.iter().find(|run| run.number == number).map(|run| run.directory().path());
        let former = || self.former.iter().find(|(other, _)| *other == number).map(|(_, path)| &**path);
        run.or_else(former)
    }

    /// Adds a run to the session, or replaces the one with the same folder, and returns its number. One that was
    /// `restored` has the number that it had.
    pub fn add(&mut self, mut run: RunView, restored: bool) -> usize {
        let path = run.directory().path();
        if let Some(known) = self.all.iter_mut().find(|known| known.directory().path() == path) {
            run.number = known.number;
            *known = run;
            return known.number;
        }
        let former = restored.then(|| self.number_ever_of(path)).flatten();
        run.number = former.unwrap_or(self.created);
        self.created += usize::from(former.is_none());
        let number = run.number;
        self.all.push(run);
        self.all.sort_by_key(|run| run.number);
        number
    }

    /// Removes the run with a number, whose files were moved to the trash together with those of the last deletion.
    pub fn forget_deleted(&mut self, number: Option<usize>, folder: PathBuf) {
        self.former.extend(number.map(|number| (number, folder.clone())));
        if let Some(together) = self.deleted.last_mut() {
            together.push(folder);
        }
        self.remove(number);
    }

    /// Forgets deleted runs that are no longer in the trash.
    pub fn forget_trashed(&mut self, is_gone: impl Fn(&Path) -> bool) {
        self.deleted.iter_mut().for_each(|together| together.retain(|folder| !is_gone(folder)));
        self.deleted.retain(|together| !together.is_empty());
    }

    /// Removes the run with a number from the session.
    pub fn remove(&mut self, number: Option<usize>) {
        self.all.retain(|run| Some(run.number) != number);
        self.current = self.current.filter(|current| Some(*current) != number);
    }

    /// Starts queued runs while cores are free; true if any was started.
    pub fn start_queued(&mut self) -> bool {
        let cores = self.cores.or(std::thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
        let mut began = false;
        loop {
            let working = self.all.iter().filter(|run| run.is_working()).count();
            let next = self.all.iter_mut().filter(|run| run.turn().is_some()).min_by_key(|run| run.turn());
            let Some(run) = next.filter(|_| working < cores) else { return began };
            // The run keeps the error, where it is shown.
            began |= run.start();
        }
    }

    /// Fails if the run in a folder is queued, trained or paused by this session.
    ///
    /// # Errors
    /// Which of these.
    pub fn refuse_if_busy(&self, path: &Path) -> Result<(), SessionError> {
        let Some(run) = self.all.iter().find(|run| run.directory().path() == path) else { return Ok(()) };
        let problem = match run.is_active() {
            _ if run.is_queued() => QUEUED,
            true if run.state() == RunState::Paused => "is paused: `stop` it first, or `resume` it",
            true => "is being trained: `stop` it, or wait for its end, first",
            false => return Ok(()),
        };
        Err(format!("{} {problem}", run.name).into())
    }
}

/// How a further run is told from the first of its name: a number alone would look like a part of the name.
pub const OF_RUN: [&str; 2] = ["-run", ""];

/// This name with a suffix or, if it is taken in `folder`, with what tells further ones and a number before it.
pub fn free_name(folder: &Path, base: &str, [further, suffix]: [&str; 2]) -> String {
    let ends = std::iter::once(suffix.to_owned()).chain((2..).map(|n| format!("{further}{n}{suffix}")));
    let mut names = ends.map(|end| fitting(base, &end));
    // The fallback is unreachable: the candidates do not end.
    names.find(|name| !folder.join(name).exists()).unwrap_or_else(|| base.to_owned())
}
