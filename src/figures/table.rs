//! The numbers of a figure as CSV.

/// Named columns of text cells; what lies beside every figure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    columns: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<const N: usize>(columns: [&'static str; N]) -> Self {
        Self { columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; missing cells at its end are empty.
    pub fn push<const N: usize>(&mut self, cells: [String; N]) {
        let mut row = cells.to_vec();
        row.resize(self.columns.len(), String::new());
        self.rows.push(row);
    }

    /// Column names.
    pub fn columns(&self) -> &[&'static str] {
        &self.columns
    }

    /// Rows, each as long as [`Self::columns`].
    pub fn rows(&self) -> &[Vec<String>] {
        &self.rows
    }

    /// The table as CSV.
    pub fn to_csv(&self) -> Vec<u8> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let records = std::iter::once(self.columns.iter().map(|name| (*name).to_owned()).collect())
            .chain(self.rows.iter().cloned());
        for record in records {
            // Rows are of one length, and memory takes every byte.
            writer.write_record(&record).expect("rows of one length");
        }
        writer.into_inner().expect("memory takes every byte")
    }
}

/// A number so that reading it back gives the same number; empty when it is not finite.
pub fn cell(value: f64) -> String {
    if value.is_finite() { value.to_string() } else { String::new() }
}

/// As [`cell`], with the digits of single precision.
pub fn cell32(value: f32) -> String {
    if value.is_finite() { value.to_string() } else { String::new() }
}
