//! `metrics.csv`: one row per episode, with the fields of [`EpisodeRecord`] as columns.

use std::path::Path;

use super::append::AppendFile;
use super::event::EpisodeRecord;
use super::{Result, RunError, file};
use mge_base::atomic;

/// Opens the table for writing, with the rows of these episodes; removes those after them. A table that does not have
/// them is written anew. Then also returns what was wrong with it.
pub(super) fn open(path: &Path, records: &[EpisodeRecord]) -> Result<(AppendFile, Option<RunError>)> {
    let mut file = AppendFile::open(path)?;
    let mut bytes = file::read(path)?;
    let damage = check(path, records).err();
    if damage.is_some() {
        bytes = encoded(path, true, records)?;
        atomic::write(path, &bytes).map_err(RunError::io("write", path))?;
        file = AppendFile::open(path)?;
    }
    // With the header.
    let lines = if records.is_empty() { 0 } else { 1 + records.len() };
    let kept = bytes.split_inclusive(|byte| *byte == b'\n').take(lines).map(<[u8]>::len).sum();
    file.cut(&bytes[..kept])?;
    Ok((file, damage))
}

/// Checks that the table begins with the rows of these episodes, which are those of the event log.
///
/// # Errors
/// [`RunError::Malformed`] if it ends before, or a row is invalid or differs.
pub(super) fn check(path: &Path, records: &[EpisodeRecord]) -> Result<()> {
    let bytes = file::read_optional(path)?.unwrap_or_default();
    let (rows, damage) = parse(path, file::whole_lines(&bytes));
    for (row, record) in rows.iter().zip(records) {
        // Rows with NaN differ from themselves, but not as text.
        if row != record && encoded(path, false, [row])? != encoded(path, false, [record])? {
            let reason = "it differs from events.jsonl: `mge resume` writes the table anew";
            return Err(RunError::malformed(path, Some(record.episode + 1), reason));
        }
    }
    let (found, wanted) = (rows.len(), records.len());
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

/// Appends one row, preceded by the header if it is the first.
pub(super) fn append(table: &mut AppendFile, record: &EpisodeRecord) -> Result<()> {
    let row = encoded(table.path(), table.is_empty()?, [record])?;
    table.append(&row)
}

/// Rows as text.
fn encoded<'a>(path: &Path, header: bool, records: impl IntoIterator<Item = &'a EpisodeRecord>) -> Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    let rows = records.into_iter().try_for_each(|record| writer.serialize(record)).map_err(|error| error.to_string());
    let rows = rows.and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    rows.map_err(|reason| RunError::malformed(path, None, reason))
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
    fn a_table_without_its_rows_is_written_anew() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let records = [1, 2, 3].map(record);
        let reopen = |table: &str, kept: usize| {
            std::fs::write(&path, table).unwrap();
            let damage = open(&path, &records[..kept]).unwrap().1;
            assert_eq!(last_episode(&path).unwrap(), kept as u64);
            assert_eq!(check(&path, &records[..kept]).map_err(|error| error.to_string()), Ok(()));
            damage
        };
        let damaged = GOLDEN.replace("\n2,12,24", "\ntwo,12,24");
        assert!(reopen(&damaged, 1).is_none(), "the damage is in rows that go");
        assert!(matches!(reopen(&damaged, 2), Some(RunError::Malformed { line: Some(3), .. })));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), GOLDEN);
        assert!(reopen(GOLDEN, 2).is_none());
        assert!(matches!(reopen(GOLDEN, 3), Some(RunError::Malformed { line: None, .. })));
        assert!(matches!(reopen("", 2), Some(RunError::Malformed { line: None, .. })));
        let other = GOLDEN.replace("\n1,12,12,0.1", "\n1,12,12,0.9");
        assert!(matches!(reopen(&other, 2), Some(RunError::Malformed { line: Some(2), .. })));
        let missing =
            GOLDEN.lines().enumerate().filter(|(number, _)| *number != 1).map(|(_, line)| line.to_owned() + "\n");
        assert!(matches!(reopen(&missing.collect::<String>(), 2), Some(RunError::Malformed { line: Some(2), .. })));
    }

    #[test]
    fn table_keeps_its_format_and_round_trips() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let (mut log, _) = open(&path, &[]).unwrap();
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
        let records = [1, 2, 3].map(record);
        let (mut log, _) = open(&path, &[]).unwrap();
        records.iter().for_each(|record| append(&mut log, record).unwrap());
        let whole = std::fs::read(&path).unwrap();
        drop(log);

        std::fs::write(&path, [&whole[..], b"4,12,4"].concat()).unwrap();
        assert_eq!(read_metrics(&path).unwrap().len(), 3);
        for kept in [1, 0] {
            let (mut log, damage) = open(&path, &records[..kept]).unwrap();
            assert!(damage.is_none());
            records[kept..].iter().for_each(|record| append(&mut log, record).unwrap());
            assert_eq!(std::fs::read(&path).unwrap(), whole);
        }
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
