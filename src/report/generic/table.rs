//! Tables as HTML tables, truncated with a count.

use afmid_pipeline::Table;
use afmid_pipeline::artifact::ColumnValues;

use crate::report::figure::pretty_unit;
use crate::report::number::{integer, number};
use crate::report::view::{Head, TableView};

/// Rows that a page shows of a table.
pub(crate) const ROWS: usize = 40;

/// A table with at most `rows` rows.
pub(crate) fn table_view(caption: &str, table: &Table, rows: usize) -> TableView {
    let heads = table.columns.iter().map(|column| Head {
        name: column.name.clone(),
        unit: pretty_unit(&column.unit),
        about: column.long_name.clone(),
        numeric: !matches!(column.values, ColumnValues::Text(_)),
    });
    let mut view = TableView::new(caption, heads.collect());
    for row in 0..table.rows().min(rows) {
        view.rows.push(table.columns.iter().map(|column| column_text(&column.values, row)).collect());
    }
    view.truncated(rows, table.rows())
}

/// The value of a column in a row; empty if there is none.
fn column_text(values: &ColumnValues, row: usize) -> String {
    match values {
        ColumnValues::Real(values) => values.get(row).map(|value| number(*value)),
        ColumnValues::Integer(values) => values.get(row).map(|value| integer(*value)),
        ColumnValues::Flag(values) => values.get(row).map(|value| if *value { "yes" } else { "no" }.to_owned()),
        ColumnValues::Text(values) => values.get(row).cloned(),
    }
    .unwrap_or_default()
}
