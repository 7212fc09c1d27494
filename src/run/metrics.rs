//! `metrics.csv`: one row per episode, with the fields of [`EpisodeRecord`] as columns.

use std::path::Path;

use super::append::AppendFile;
use super::event::EpisodeRecord;
use super::{Result, RunError, file};

/// Opens the table for writing; removes the rows after `episode` and a half-written last row.
pub(super) fn open(path: &Path, episode: u64) -> Result<AppendFile> {
    let mut file = AppendFile::open(path)?;
    file.truncate(end_of(path, episode)?)?;
    Ok(file)
}

/// The offset at which the row of `episode` ends.
///
/// # Errors
/// [`RunError::LogTooShort`] if there is no such row, [`RunError::Malformed`] if a row before it is invalid.
pub(super) fn end_of(path: &Path, episode: u64) -> Result<u64> {
    let bytes = file::read_optional(path)?.unwrap_or_default();
    let (rows, ends, damage) = parse(path, file::whole_lines(&bytes));
    let kept = rows.iter().take_while(|row| row.episode <= episode).count();
    let found = kept.checked_sub(1).map_or(0, |last| rows[last].episode);
    if found < episode {
        let short = RunError::LogTooShort { path: path.to_path_buf(), found, wanted: episode };
        return Err(damage.unwrap_or(short));
    }
    Ok(kept.checked_sub(1).map_or(0, |last| ends[last]))
}

/// Appends one row, preceded by the header if it is the first.
pub(super) fn append(table: &mut AppendFile, record: &EpisodeRecord) -> Result<()> {
    let mut writer = csv::WriterBuilder::new().has_headers(table.is_empty()?).from_writer(Vec::new());
    let row = writer.serialize(record).map_err(|error| error.to_string());
    let row = row.and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    let malformed = |reason| RunError::Malformed { path: table.path().to_path_buf(), line: None, reason };
    let row = row.map_err(malformed)?;
    table.append(&row)
}

/// All rows of a `metrics.csv`, which another process may still be writing.
///
/// # Errors
/// [`RunError::Io`] if there is no such file, [`RunError::Malformed`] with the number of the first
/// line that is not a row. A half-written last row is left out and is not an error.
pub fn read_metrics(path: &Path) -> Result<Vec<EpisodeRecord>> {
    let bytes = file::read(path)?;
    let (rows, _, damage) = parse(path, file::whole_lines(&bytes));
    damage.map_or(Ok(rows), Err)
}

/// The rows up to the first invalid one, the end offset of each in `bytes`, and the error of the
/// invalid row.
fn parse(path: &Path, bytes: &[u8]) -> (Vec<EpisodeRecord>, Vec<u64>, Option<RunError>) {
    let malformed = |line: Option<u64>, reason: String| RunError::Malformed { path: path.to_path_buf(), line, reason };
    let mut reader = csv::Reader::from_reader(bytes);
    let (mut rows, mut ends) = (Vec::new(), Vec::new());
    let header = match reader.headers() {
        Ok(header) => header.clone(),
        Err(error) => return (rows, ends, Some(malformed(Some(1), error.to_string()))),
    };
    let mut row = csv::StringRecord::new();
    loop {
        let line = reader.position().line();
        match reader.read_record(&mut row) {
            Ok(false) => return (rows, ends, None),
            Ok(true) => {}
            Err(error) => return (rows, ends, Some(malformed(Some(line), error.to_string()))),
        }
        match row.deserialize(Some(&header)) {
            Ok(record) => rows.push(record),
            Err(error) => return (rows, ends, Some(malformed(Some(line), format!("not an episode: {error}")))),
        }
        ends.push(reader.position().byte());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            ..Default::default()
        }
    }

    const GOLDEN: &str = "\
episode,steps,environment_steps,return,goal,subgoals,subgoals_total,guided,epsilon,noise_sigma,\
critic_loss,mean_q,max_q,actor_loss,action_saturation,rolling_success,terminated,truncated,end,placed,blocked
1,12,12,0.1,false,1,2,true,0.8,0.2,,,,,,0.0,true,false,\"left the screen, twice\",3,9
2,12,24,0.2,true,1,2,true,0.8,0.2,NaN,1e-9,,,,0.0,true,false,\"left the screen, twice\",3,9
";

    #[test]
    fn a_damaged_row_is_an_error_only_if_it_is_needed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let damaged = GOLDEN.replace("\n2,12,24", "\ntwo,12,24");
        let reopen = |episode| {
            std::fs::write(&path, &damaged).unwrap();
            open(&path, episode).map(drop)
        };
        reopen(1).unwrap();
        assert_eq!(read_metrics(&path).unwrap(), [record(1)]);
        assert!(matches!(reopen(2), Err(RunError::Malformed { line: Some(3), .. })), "{:?}", reopen(2));
        std::fs::write(&path, GOLDEN).unwrap();
        let short = open(&path, 3).map(drop);
        assert!(matches!(short, Err(RunError::LogTooShort { found: 2, wanted: 3, .. })), "{short:?}");
    }

    #[test]
    fn table_keeps_its_format_and_round_trips() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let mut log = open(&path, 0).unwrap();
        append(&mut log, &record(1)).unwrap();
        append(&mut log, &record(2)).unwrap();
        log.sync().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), GOLDEN);

        let rows = read_metrics(&path).unwrap();
        assert_eq!(rows[0], record(1));
        assert!(rows[1].critic_loss.unwrap().is_nan());
        assert_eq!(rows[1].mean_q, Some(1e-9));
    }

    #[test]
    fn resumed_table_equals_an_uninterrupted_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let mut log = open(&path, 0).unwrap();
        (1..=3).for_each(|episode| append(&mut log, &record(episode)).unwrap());
        let whole = std::fs::read(&path).unwrap();
        drop(log);

        std::fs::write(&path, [&whole[..], b"4,12,4"].concat()).unwrap();
        assert_eq!(read_metrics(&path).unwrap().len(), 3);
        let mut log = open(&path, 1).unwrap();
        (2..=3).for_each(|episode| append(&mut log, &record(episode)).unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), whole);

        let mut log = open(&path, 0).unwrap();
        (1..=3).for_each(|episode| append(&mut log, &record(episode)).unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let error = open(&path, 7).unwrap_err();
        assert!(matches!(error, RunError::LogTooShort { found: 3, wanted: 7, .. }), "{error}");
    }

    fn check_refused(text: &str, line: u64, reason: &str) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        std::fs::write(&path, text).unwrap();
        let error = read_metrics(&path).unwrap_err().to_string();
        assert!(error.contains(&format!("metrics.csv, line {line}: ")), "{error}");
        assert!(error.contains(reason), "{error}");
    }

    #[test]
    fn errors_name_the_line() {
        check_refused(&GOLDEN.replacen("\n2,", "\ntwo,", 1), 3, "not an episode");
        check_refused(&GOLDEN.replacen("0.2,NaN", "0.2", 1), 3, "fields");
        check_refused(&GOLDEN.replacen("blocked\n", "banned\n", 1), 2, "blocked");
    }
}
