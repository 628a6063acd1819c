//! The channels of a table.

use super::What;
use super::arrow_schema::Unit;
use super::column::{Column, Groups};
use crate::axes::settle;
use crate::calendar::date_of;
use crate::rate::{Clue, agreed_rate};
use crate::{Contents, FormatError, FoundChannel, Number};
use std::collections::HashMap;
use std::sync::Arc;

/// More remarks are only counted.
const MOST_REMARKS: usize = 200;

/// What pandas calls an index without a name.
const INDEX: &str = "__index_level_0__";

/// A column as a file describes it.
#[derive(Debug)]
pub(crate) struct Described {
    /// Names of the groups that it is in, and its own, with points between them.
    pub(crate) name: String,
    /// Type and meaning of its numbers. Error: what it holds instead.
    pub(crate) kind: Result<(Number, What), String>,
    /// Why it cannot be unpacked, if it cannot.
    pub(crate) left_out: Option<String>,
    /// Whether any value may be missing.
    pub(crate) may_miss: bool,
    pub(crate) unit: Option<Unit>,
    /// Rows of each group.
    pub(crate) rows: Vec<u64>,
}

/// What is found of a table.
#[derive(Debug)]
pub(crate) struct Table {
    /// Bytes that the samples may still come to.
    bytes_left: u64,
    /// How often each location is wanted.
    locations: HashMap<String, usize>,
    channels: Vec<FoundChannel>,
    started_at: String,
    remarks: Vec<String>,
    unsaid: usize,
}

impl Table {
    /// A table without columns, whose samples may come to so many bytes.
    pub(crate) fn new(most_bytes: u64) -> Self {
        Self {
            bytes_left: most_bytes,
            locations: HashMap::new(),
            channels: Vec::new(),
            started_at: String::new(),
            remarks: Vec::new(),
            unsaid: 0,
        }
    }

    /// Says something to the user.
    pub(crate) fn remark(&mut self, text: String) {
        if self.remarks.len() < MOST_REMARKS {
            self.remarks.push(text);
        } else {
            self.unsaid += 1;
        }
    }

    /// Lists a column; `groups` are its values, by the column's location. Errors: its first moments are damaged.
    pub(crate) fn column<G: Groups + 'static>(
        &mut self,
        about: Described,
        groups: impl FnOnce(&str) -> G,
    ) -> Result<(), FormatError> {
        let called = if about.name == INDEX { "index" } else { about.name.as_str() };
        let location = self.unique(&format!("/{}", called.escape_debug()));
        let (number, what) = match about.kind {
            Ok(kind) => kind,
            Err(what) => {
                self.remark(format!("{location} holds {what}, no channel"));
                return Ok(());
            }
        };
        if let Some(why) = about.left_out {
            self.remark(format!("{location} is left out: {why}"));
            return Ok(());
        }
        let rows = about.rows.iter().fold(0, |all: u64, rows| all.saturating_add(*rows));
        // what is read has up to 8 bytes a number
        let (Some(left), Ok(samples)) =
            (rows.checked_mul(8).and_then(|bytes| self.bytes_left.checked_sub(bytes)), usize::try_from(rows))
        else {
            self.remark(format!("{location} is left out: its {rows} rows are more than a file of this size may have"));
            return Ok(());
        };
        self.bytes_left = left;
        if number.may_be_rounded() && matches!(what, What::Plain | What::Scaled(_)) {
            self.remark(format!("{location}: 64-bit integers beyond 2^53 are rounded to float64"));
        }
        let of_duration = number == Number::I64 && about.unit.as_ref().is_some_and(|unit| unit.of_duration);
        let unit = about.unit.map(|unit| unit.unit).unwrap_or_default();
        let mut column = Column::new(groups(&location), number, what, about.may_miss, &about.rows);
        let (scale_factor, unit) = match what {
            What::Plain => (1.0, unit),
            What::Scaled(factor) => (factor, unit),
            What::TimeOfDay(seconds) => (seconds, "s".to_owned()),
            What::Moments { per_second, utc } => {
                let first = column.begin()?;
                if self.started_at.is_empty() {
                    self.started_at = first.and_then(|first| moment(first, per_second, utc)).unwrap_or_default();
                }
                (1.0 / per_second as f64, "s".to_owned())
            }
        };
        self.channels.push(FoundChannel {
            unit,
            scale_factor,
            is_axis: of_duration || matches!(what, What::Moments { .. }),
            ..FoundChannel::new(location, samples, number.name(), Arc::new(column))
        });
        Ok(())
    }

    /// The location itself, or with a number if it is taken.
    fn unique(&mut self, asked: &str) -> String {
        let mut location = asked.to_owned();
        loop {
            let wanted = self.locations.entry(location.clone()).or_default();
            *wanted += 1;
            if *wanted == 1 {
                return location;
            }
            location = format!("{asked}#{wanted}");
        }
    }

    /// The rate that texts of the file state.
    pub(crate) fn rate(&mut self, texts: &[(String, String)]) {
        let clue = |(name, text): &(String, String)| Clue::of_text(name, name, text);
        let clues: Vec<Clue> = texts.iter().filter_map(clue).collect();
        if clues.is_empty() {
            return;
        }
        let (rate, remark) = agreed_rate(&clues);
        remark.into_iter().for_each(|remark| self.remark(remark));
        for channel in &mut self.channels {
            channel.sample_rate_hz = rate.filter(|_| !channel.is_axis);
        }
    }

    /// Everything, with the rates that follow from columns of times.
    pub(crate) fn finish(mut self, format: &str) -> Contents {
        if self.channels.is_empty() {
            self.remark("the table has no column of numbers".to_owned());
        }
        if self.unsaid > 0 {
            self.remarks.push(format!("{} more remarks of this kind", self.unsaid));
        }
        let mut contents = Contents {
            format: format.to_owned(),
            started_at: self.started_at,
            channels: self.channels,
            responses: Vec::new(),
            remarks: self.remarks,
        };
        settle(&mut contents);
        contents
    }
}

/// A moment in ISO 8601; none outside the years 1 to 9999.
fn moment(parts: i64, per_second: i64, utc: bool) -> Option<String> {
    let (seconds, part) = (parts.div_euclid(per_second), parts.rem_euclid(per_second));
    let (year, month, day) = date_of(seconds.div_euclid(86_400))?;
    let s = seconds.rem_euclid(86_400);
    let digits = per_second.ilog10() as usize;
    let fraction = if part == 0 { String::new() } else { format!(".{part:0digits$}") };
    let zone = if utc { "Z" } else { "" };
    Some(format!("{year:04}-{month:02}-{day:02}T{:02}:{:02}:{:02}{fraction}{zone}", s / 3600, s / 60 % 60, s % 60))
}
