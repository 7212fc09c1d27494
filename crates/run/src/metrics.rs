//! `metrics.csv`: one row per episode, with the fields of [`EpisodeRecord`] as columns.

use std::path::Path;

use super::event::EpisodeRecord;
use super::{Result, RunError, file};

/// Checks that the table begins with the rows of these episodes, which are those of the event log.
///
/// # Errors
/// [`RunError::Malformed`] if it ends before, or a row is invalid or differs.
pub(super) fn check(path: &Path, records: &[&EpisodeRecord]) -> Result<()> {
    let bytes = file::read_optional(path)?.unwrap_or_default();
    let (found, damage) = parse(path, file::whole_lines(&bytes));
    for (row, record) in found.iter().zip(records) {
        // Rows with NaN differ from themselves, but not as text.
        if row != *record && row_text(false, row)? != row_text(false, record)? {
            let reason = "it differs from events.jsonl: `mge resume` writes the table anew";
            return Err(RunError::malformed(path, Some(record.episode + 1), reason));
        }
    }
    let (found, wanted) = (found.len(), records.len());
    let reason = || format!("it ends at episode {found} of {wanted}: `mge resume` writes it anew");
    let short = || RunError::malformed(path, None, reason());
    if found < wanted { Err(damage.unwrap_or_else(short)) } else { Ok(()) }
}

/// The number of the last episode in the table; 0 if there is none.
pub(super) fn last_episode(path: &Path) -> Result<u64> {
    /// Far more than the bytes of a row.
    const ROW: u64 = 1 << 12;
    let (end, _) = file::read_end(path, ROW)?;
    let last = file::whole_lines(&end).rsplit(|byte| *byte == b'\n').nth(1);
    Ok(last.and_then(|row| file::leading_number(row, b"")).unwrap_or(0))
}

/// The row of an episode as text, after the header if wanted.
pub(super) fn row_text(header: bool, record: &EpisodeRecord) -> Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    let written = writer.serialize(record).map_err(|error| error.to_string());
    let text = written.and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    text.map_err(|reason| RunError::malformed(Path::new("metrics.csv"), None, reason))
}

/// Whether a file begins with the header of a table.
pub(super) fn is_table(bytes: &[u8]) -> bool {
    let header = row_text(true, &EpisodeRecord::default()).unwrap_or_default();
    header.split_inclusive(|byte| *byte == b'\n').next().is_some_and(|header| bytes.starts_with(header))
}

/// All rows of a `metrics.csv`, which another process may still be writing.
///
/// # Errors
/// [`RunError::Io`] if there is no such file, [`RunError::Malformed`] with the number of the first
/// line that is not a row. A half-written last row is left out and is not an error.
pub fn read_metrics(path: &Path) -> Result<Vec<EpisodeRecord>> {
    let bytes = file::read(path)?;
    let (rows, damage) = parse(path, file::whole_lines(&bytes));
    damage.map_or(Ok(rows), Err)
}

/// The rows up to the first invalid one, and the error of that.
fn parse(path: &Path, bytes: &[u8]) -> (Vec<EpisodeRecord>, Option<RunError>) {
    let malformed = |line, reason: String| RunError::malformed(path, line, reason);
    let mut reader = csv::Reader::from_reader(bytes);
    let mut rows: Vec<EpisodeRecord> = Vec::new();
    let header = match reader.headers() {
        Ok(header) => header.clone(),
        Err(error) => return (rows, Some(malformed(Some(1), error.to_string()))),
    };
    let mut row = csv::StringRecord::new();
    loop {
        let line = reader.position().line();
        match reader.read_record(&mut row) {
            Ok(false) => return (rows, None),
            Ok(true) => {}
            Err(error) => return (rows, Some(malformed(Some(line), error.to_string()))),
        }
        match row.deserialize(Some(&header)) {
            Ok(record) => rows.push(record),
            Err(error) => return (rows, Some(malformed(Some(line), format!("not an episode: {error}")))),
        }
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
    fn a_table_without_the_rows_of_the_log_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let records = [1, 2, 3].map(record);
        let damage = |table: &str, needed: usize| {
            std::fs::write(&path, table).unwrap();
            check(&path, &Vec::from_iter(&records[..needed])).err()
        };
        assert!(damage(GOLDEN, 2).is_none());
        assert_eq!(last_episode(&path).unwrap(), 2);
        let damaged = GOLDEN.replace("\n2,12,24", "\ntwo,12,24");
        assert!(damage(&damaged, 1).is_none(), "the damage is in rows that are not needed");
        assert!(matches!(damage(&damaged, 2), Some(RunError::Malformed { line: Some(3), .. })));
        assert!(matches!(damage(GOLDEN, 3), Some(RunError::Malformed { line: None, .. })));
        assert!(matches!(damage("", 2), Some(RunError::Malformed { line: None, .. })));
        let other = GOLDEN.replace("\n1,12,12,0.1", "\n1,12,12,0.9");
        assert!(matches!(damage(&other, 2), Some(RunError::Malformed { line: Some(2), .. })));
        let missing = GOLDEN.replace("\n1,", "\n2,");
        assert!(matches!(damage(&missing, 2), Some(RunError::Malformed { line: Some(2), .. })));
    }

    #[test]
    fn table_keeps_its_format_and_round_trips() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let table = [row_text(true, &record(1)).unwrap(), row_text(false, &record(2)).unwrap()].concat();
        assert!(is_table(&table) && !is_table(b"episode,return\n1,2\n") && !is_table(b""));
        assert_eq!(String::from_utf8(table).unwrap(), GOLDEN);
        // A row is being written.
        std::fs::write(&path, GOLDEN.to_owned() + "3,12,3").unwrap();
        let rows = read_metrics(&path).unwrap();
        assert_eq!((rows.len(), &rows[0]), (2, &record(1)));
        assert!(rows[1].critic_loss.unwrap().is_nan());
        assert_eq!(rows[1].mean_q, Some(1e-9));
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
