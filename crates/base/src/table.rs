//! Tables as CSV. A spreadsheet shows a text as it is, instead of computing it as a formula.

use std::borrow::Cow;

/// The rows of a table as CSV; the first row holds the names of the columns. All rows must be equally long.
pub fn to_csv<'a, Row>(rows: impl IntoIterator<Item = Row>) -> Vec<u8>
where
    Row: IntoIterator<Item = &'a str>,
{
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.write_record(row.into_iter().map(|cell| shown(cell).into_owned())).expect("rows of one length");
    }
    writer.into_inner().expect("memory takes every byte")
}

/// A cell that no spreadsheet takes for a formula: an apostrophe precedes text that begins like one.
fn shown(cell: &str) -> Cow<'_, str> {
    let begins = cell.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠']);
    if begins && cell.parse::<f64>().is_err() { Cow::Owned(format!("'{cell}")) } else { Cow::Borrowed(cell) }
}

#[cfg(test)]
mod tests {
    use super::to_csv;

    #[test]
    fn formulas_become_text_and_numbers_stay() {
        let row =
            ["=HYPERLINK(\"x\")", "+1+1", "-2-2", "@SUM(1)", "\t=1", "＝1", "-0.5", "+3", "-inf", "a=b", "a,b", ""];
        let text = String::from_utf8(to_csv([row])).unwrap();
        let expected = "\"'=HYPERLINK(\"\"x\"\")\",'+1+1,'-2-2,'@SUM(1),'\t=1,'＝1,-0.5,+3,-inf,a=b,\"a,b\",\n";
        assert_eq!(text, expected);
    }
}
