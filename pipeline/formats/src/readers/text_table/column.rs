//! A column while it is parsed.

use super::lines::Line;
use super::number;
use super::stamps::Stamps;
use crate::FormatError;
use crate::evenness::Times;
use crate::fail;
use crate::printed::Printed;

/// Values of a column and what is not one.
#[derive(Debug, Clone, Default)]
pub(super) struct Column {
    pub(super) values: Vec<f64>,
    pub(super) printed: Printed,
    /// Fields that are text.
    pub(super) no_numbers: usize,
    /// Line of the first of them.
    pub(super) first_no_number: usize,
    /// NaN put in for fields that hold nothing or no number.
    pub(super) missing: usize,
    /// Numbers right of a text: values of a header that stands beside the rows.
    pub(super) labelled: usize,
    /// Times of day, of a column that has such instead of numbers.
    pub(super) stamps: Stamps,
}

/// How many numbers, gaps included, may still be kept: as many as the file has bytes. Rows that lack most of their
/// fields need more; those are no table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Budget(pub(super) u64);

impl Column {
    /// Takes the field of row `row` (from 0).
    pub(super) fn take(
        &mut self,
        row: usize,
        field: &str,
        decimal: char,
        line: &Line,
        budget: &mut Budget,
    ) -> Result<(), FormatError> {
        let Some(value) = number::parse(field, decimal) else {
            if !number::bare(field).is_empty() {
                self.stamps.take(field);
                self.no_numbers += 1;
                self.first_no_number = if self.no_numbers == 1 { line.number } else { self.first_no_number };
            }
            return Ok(());
        };
        let missing = row.saturating_sub(self.values.len());
        budget.0 = budget.0.checked_sub(missing as u64 + 1).ok_or_else(|| {
            let problem = format!("up to line {} the table has more empty fields than the file has bytes", line.number);
            fail::at(line.at, problem, "is this a table with a separator between all fields?")
        })?;
        self.values.resize(row, f64::NAN);
        self.missing += missing;
        self.values.push(value);
        self.printed.see(field);
        Ok(())
    }

    /// Its numbers as times.
    pub(super) fn times(&self) -> Times<'_> {
        Times { values: &self.values, printed: Some(&self.printed), row: 0, epsilon: f64::EPSILON }
    }

    /// How many numbers it holds.
    pub(super) fn numbers(&self) -> usize {
        self.values.len().saturating_sub(self.missing)
    }

    /// What to say of its missing values.
    pub(super) fn remark(&self, title: &str) -> Option<String> {
        let text = match self.no_numbers {
            0 => String::new(),
            count => format!(", {count} fields are text (the first in line {})", self.first_no_number),
        };
        let count = self.missing;
        (count > 0 || self.no_numbers > 0)
            .then(|| format!("{title}: {count} samples are missing and given as NaN{text}"))
    }
}
