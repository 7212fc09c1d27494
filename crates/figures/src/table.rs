//! The numbers of a figure as CSV.

/// Named columns of text cells, written beside every figure as CSV.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    columns: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(columns: impl IntoIterator<Item = &'static str>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; missing cells at its end are empty.
    pub fn push(&mut self, cells: &[&dyn Cell]) {
        let mut row: Vec<String> = cells.iter().map(|cell| cell.text()).collect();
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
        let rows = self.rows.iter().map(|row| row.iter().map(String::as_str).collect());
        mge_base::table::to_csv(std::iter::once(self.columns.clone()).chain(rows))
    }
}

/// A value that can be written to a cell.
pub trait Cell {
    /// Its text. Finite numbers round-trip exactly; non-finite numbers are empty.
    fn text(&self) -> String;
}

macro_rules! floats {
    ($($float:ty),+) => {$(impl Cell for $float {
        fn text(&self) -> String {
            if self.is_finite() { self.to_string() } else { String::new() }
        }
    })+};
}
floats!(f32, f64);

macro_rules! plain {
    ($($plain:ty),+) => {$(impl Cell for $plain {
        fn text(&self) -> String {
            self.to_string()
        }
    })+};
}
plain!(&str, String, usize, bool);

impl<T: Cell> Cell for Option<T> {
    fn text(&self) -> String {
        self.as_ref().map(Cell::text).unwrap_or_default()
    }
}
