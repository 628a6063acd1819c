//! Tables for spreadsheets and scripts.

use afmid_pipeline::Table;
use afmid_pipeline::artifact::ColumnValues;

use crate::printable::printable;

/// Comma-separated, a header line, unknown numbers empty, numbers to the last bit. Text that a spreadsheet would take
/// for a formula gets an apostrophe before it.
/// Errors: what is written is no text.
pub fn csv_text(table: &Table) -> std::io::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut line = |fields: Vec<String>| writer.write_record(fields).map_err(std::io::Error::other);
    line(table.columns.iter().map(|column| cell(&column.name)).collect())?;
    for row in 0..table.rows() {
        line(table.columns.iter().map(|column| field(&column.values, row)).collect())?;
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    String::from_utf8(bytes).map_err(std::io::Error::other)
}

fn field(values: &ColumnValues, row: usize) -> String {
    match values {
        ColumnValues::Real(values) => values.get(row).filter(|value| value.is_finite()).map(f64::to_string),
        ColumnValues::Integer(values) => values.get(row).map(i64::to_string),
        ColumnValues::Flag(values) => values.get(row).map(bool::to_string),
        ColumnValues::Text(values) => values.get(row).map(|text| cell(text)),
    }
    .unwrap_or_default()
}

/// Text that is no formula to a spreadsheet: one that begins as a formula, and is no number, gets an apostrophe. What
/// acts or is not seen is an escape, as on a terminal: tables are printed, too.
fn cell(text: &str) -> String {
    let text = &*printable(text);
    let formula = text.starts_with(['=', '+', '-', '@', '\t']) && text.parse::<f64>().is_err();
    if formula { format!("'{text}") } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn a_spreadsheet_finds_no_formula() {
        for text in ["=1+1", "+SUM(A1)", "-2+3", "@x", "\t=1", "-"] {
            assert_eq!(cell(text), format!("'{text}"));
        }
        assert_eq!((cell("\r=1"), cell("a\u{202e}b\u{200b}")), ("\\x0d=1".into(), "a\\u{202e}b\\u{200b}".into()));
        for text in ["", "a=b", "-2.5", "+3e4", "'=1", "lever-1"] {
            assert_eq!(cell(text), text);
        }
    }
}
