//! `metrics.csv`: one row per episode, with the fields of [`EpisodeRecord`] as columns.

use std::path::Path;

use super::event::EpisodeRecord;
use super::{Result, RunError, file};

/// The last column, which tables of earlier versions do not have.
const NEWEST_COLUMN: &str = ",charged_actions";

/// Checks that the table begins with the rows of these episodes, which are those of the event log.
///
/// # Errors
/// [`RunError::Malformed`] if it ends before, or a row differs.
pub(super) fn check(path: &Path, records: &[&EpisodeRecord]) -> Result<()> {
    let bytes = file::read_optional(path)?.unwrap_or_default();
    let (table, expected) = (file::whole_lines(&bytes), rows(true, records.iter().copied())?);
    let [table, expected] = [table, &expected].map(String::from_utf8_lossy);
    let is_older = table.lines().next().is_some_and(|header| !header.ends_with(NEWEST_COLUMN));
    let mut table = table.lines();
    for (number, row) in (1..).zip(expected.lines()) {
        let row = if is_older { row.rsplit_once(',').map_or(row, |(row, _)| row) } else { row };
        let (line, damage) = match table.next() {
            Some(line) if is_same(line, row) => continue,
            Some(_) => (Some(number), "it differs from events.jsonl".to_owned()),
            None => (None, format!("it ends at episode {} of {}", number.max(2) - 2, records.len())),
        };
        return Err(RunError::malformed(path, line, damage + ": `mge resume` without --episodes writes it anew"));
    }
    Ok(())
}

/// Whether two rows have the same values. Earlier versions wrote more digits.
fn is_same(row: &str, other: &str) -> bool {
    let number = |text: &str| text.parse::<f32>().ok().filter(|_| text.parse::<i64>().is_err());
    let is_same = |(a, b): (&str, &str)| a == b || number(a).is_some_and(|value| number(b) == Some(value));
    let columns = |text: &str| text.matches(',').count();
    row == other || (columns(row) == columns(other) && row.split(',').zip(other.split(',')).all(is_same))
}

/// The number of the last episode in the table; 0 if there is none.
pub(super) fn last_episode(path: &Path) -> Result<u64> {
    /// Far more than the bytes of a row.
    const ROW: u64 = 1 << 12;
    let (end, _) = file::read_end(path, ROW)?;
    let last = file::whole_lines(&end).rsplit(|byte| *byte == b'\n').nth(1);
    Ok(last.and_then(|row| file::leading_number(row, b"")).unwrap_or(0))
}

/// The rows of these episodes as text, after the header if there are any and it is asked for.
pub(super) fn rows<'a>(header: bool, records: impl IntoIterator<Item = &'a EpisodeRecord>) -> Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().has_headers(header).from_writer(Vec::new());
    let written =
        records.into_iter().try_for_each(|record| writer.serialize(record)).map_err(|error| error.to_string());
    let text = written.and_then(|()| writer.into_inner().map_err(|error| error.to_string()));
    text.map_err(|reason| RunError::malformed(Path::new("metrics.csv"), None, reason))
}

/// Whether a file begins with the header of a table, of this or an earlier version.
pub(super) fn is_table(bytes: &[u8]) -> bool {
    let text = rows(true, [&EpisodeRecord::default()]).unwrap_or_default();
    let [header, found] = [&*text, bytes].map(|text| text.split(|byte| *byte == b'\n').next().unwrap_or_default());
    found == header || Some(found) == header.strip_suffix(NEWEST_COLUMN.as_bytes())
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
    fn table_keeps_its_format() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("metrics.csv");
        let table = [rows(true, [&record(1)]).unwrap(), rows(false, [&record(2)]).unwrap()].concat();
        assert!(is_table(&table) && !is_table(b"episode,return\n1,2\n") && !is_table(b""));
        assert_eq!(String::from_utf8(table).unwrap(), GOLDEN);
        // A row is being written.
        std::fs::write(&path, GOLDEN.to_owned() + "3,12,3").unwrap();
        check(&path, &[&record(1), &record(2)]).unwrap();
        // As earlier versions wrote them.
        std::fs::write(&path, GOLDEN.replace(",0.8,0.2,", ",0.800000011920929,0.20000000298023224,")).unwrap();
        check(&path, &[&record(1), &record(2)]).unwrap();
        let older: String = GOLDEN.lines().map(|row| row.rsplit_once(',').unwrap().0.to_owned() + "\n").collect();
        std::fs::write(&path, &older).unwrap();
        check(&path, &[&record(1), &record(2)]).unwrap();
        assert!(is_table(older.as_bytes()));
        for other in [
            older.replace(",12,24,", ",12,25,"),
            GOLDEN.replace(",12,24,", ",12,24.0,"),
            GOLDEN.replace("charged_actions\n", "charges\n"),
            GOLDEN.replace(",112\n", "\n"),
        ] {
            std::fs::write(&path, other).unwrap();
            assert!(check(&path, &[&record(1), &record(2)]).is_err());
        }
    }
}
