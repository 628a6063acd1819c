//! Whether records belong together.

use afmid_pipeline::{Record, StageError};

use crate::artifacts::{deflection, piezo};

/// What records have in common.
#[derive(Debug, Clone, PartialEq)]
pub struct Consistency {
    /// Samples per second of all.
    pub sample_rate_hz: f64,
    /// Unit of all deflections.
    pub unit: String,
    /// Samples of all deflections together.
    pub samples: usize,
    /// Of the shortest deflection.
    pub shortest_samples: usize,
    /// Of the longest.
    pub longest_samples: usize,
    /// What differs but may: for warnings.
    pub remarks: Vec<String>,
}

/// Checks records against the first one.
///
/// # Method
/// Sample rates must agree to 1e-6, units of each channel exactly; lengths, scale factors and the presence of a piezo
/// channel may differ and are remarked on. Channels of one record must be of one length.
/// # Errors
/// No record; rates that differ, with the files of each; a unit that differs, with both files; an empty record; channels of different lengths.
pub fn check_consistency(records: &[Record]) -> Result<Consistency, StageError> {
    let first = records.first().ok_or_else(|| StageError::new("there is no record"))?;
    let known = deflection(first)?;
    if records.iter().any(|record| !same_rate(record, first)) {
        return Err(rates_differ(records));
    }
    let (mut samples, mut shortest, mut longest) = (0, first, first);
    for record in records {
        samples += checked_length(record)?;
        for channel in &record.channels {
            if let Ok(same) = first.channel(&channel.role)
                && same.unit != channel.unit
            {
                let what = format!("as unit of the {}", channel.role);
                return Err(differs(first, record, &what, &same.unit, &channel.unit));
            }
        }
        let length = deflection(record)?.samples;
        shortest = if length < deflection(shortest)?.samples { record } else { shortest };
        longest = if length > deflection(longest)?.samples { record } else { longest };
    }
    let lengths = [deflection(shortest)?.samples, deflection(longest)?.samples];
    let mut remarks = Vec::new();
    if lengths[0] != lengths[1] {
        remarks.push(format!(
            "the records differ in length: from {} samples ({}) to {} ({})",
            lengths[0], shortest.name, lengths[1], longest.name
        ));
    }
    if let Some(other) =
        records.iter().find(|record| deflection(record).is_ok_and(|channel| channel.scale_factor != known.scale_factor))
    {
        remarks.push(format!(
            "the scale factor changes within the archive: {} {} per code in {}, {} in {}",
            known.scale_factor,
            known.unit,
            first.name,
            deflection(other)?.scale_factor,
            other.name
        ));
    }
    let without = records.iter().filter(|record| piezo(record).is_none()).count();
    if without > 0 && without < records.len() {
        remarks.push(format!("{without} of {} records have no piezo channel", records.len()));
    }
    Ok(Consistency {
        sample_rate_hz: first.sample_rate_hz,
        unit: known.unit.clone(),
        samples,
        shortest_samples: lengths[0],
        longest_samples: lengths[1],
        remarks,
    })
}

fn same_rate(a: &Record, b: &Record) -> bool {
    (a.sample_rate_hz / b.sample_rate_hz - 1.0).abs() <= 1e-6
}

/// Sample rates, and names of each, that an error lists.
const MOST_LISTED: [usize; 2] = [10, 3];

/// All records by their sample rate, the rate of most records first.
fn rates_differ(records: &[Record]) -> StageError {
    let mut rates: Vec<(&Record, Vec<&str>)> = Vec::new();
    for record in records {
        match rates.iter_mut().find(|(first, _)| same_rate(record, first)) {
            Some((_, names)) => names.push(&record.name),
            None => rates.push((record, vec![record.name.as_str()])),
        }
    }
    rates.sort_by_key(|(_, names)| std::cmp::Reverse(names.len()));
    let [most_rates, most_names] = MOST_LISTED;
    let listed = |(first, names): &(&Record, Vec<&str>)| {
        let rate = seven_digits(first.sample_rate_hz);
        let shown: Vec<&str> = names.iter().copied().take(most_names).collect();
        let more = if names.len() > most_names { ", ..." } else { "" };
        format!("{} at {rate} Hz ({}{more})", names.len(), shown.join(", "))
    };
    let mut list: Vec<String> = rates.iter().take(most_rates).map(listed).collect();
    list.extend((rates.len() > most_rates).then(|| format!("{} more rates", rates.len() - most_rates)));
    StageError::new(format!("the {} records have {} sample rates: {}", records.len(), rates.len(), list.join("; "))).help(
        "records of one analysis share a rate: `afmid new pipeline FILES... -o NAME.toml` takes the files of the rate \
         that most have, and says the commands for the others; or run each file by itself, a line of a manifest each \
         (`afmid batch CONFIG --manifest M.jsonl`); correct the attribute if a file states a wrong one",
    )
}

/// A rate to the digits that must agree.
fn seven_digits(rate_hz: f64) -> String {
    let decimals = (6.0 - rate_hz.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{rate_hz:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn checked_length(record: &Record) -> Result<usize, StageError> {
    let length = deflection(record)?.samples;
    if length == 0 {
        return Err(StageError::new("the record holds no sample")
            .at(&record.path)
            .help("remove the file from `files`"));
    }
    match record.channels.iter().find(|channel| channel.samples != length) {
        Some(other) => Err(StageError::new(format!(
            "the deflection has {length} samples, {} has {}: one record wants one length",
            other.location, other.samples
        ))
        .at(&record.path)),
        None => Ok(length),
    }
}

fn differs(
    first: &Record,
    other: &Record,
    what: &str,
    a: &dyn std::fmt::Display,
    b: &dyn std::fmt::Display,
) -> StageError {
    StageError::new(format!("{} has {a} {what}, {} has {b}", first.name, other.name))
        .at(&other.path)
        .help("records of one analysis must agree: analyse them apart, or correct the attribute that is wrong")
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::recording::Raw;

    use super::*;
    use crate::io::{memory_channel, memory_record};

    fn record(name: &str, rate: f64, samples: usize) -> Record {
        memory_record(name, rate, vec![memory_channel("deflection", Raw::Int16(vec![0; samples]), 1e-3)])
    }

    #[test]
    fn equal_records_pass_without_a_remark() {
        let found = check_consistency(&[record("a", 5e6, 100), record("b", 5e6, 100)]).unwrap();
        assert_eq!((found.samples, found.sample_rate_hz, found.remarks.len()), (200, 5e6, 0));
    }

    #[test]
    fn other_rates_are_an_error_that_lists_the_files_of_each() {
        let of = |records: &[(&str, f64)]| {
            let records: Vec<Record> = records.iter().map(|(name, rate)| record(name, *rate, 9)).collect();
            check_consistency(&records).unwrap_err().to_string()
        };
        let text =
            of(&[("a", 1e6 / 3.3), ("b", 5e5), ("c", 5e5 * (1.0 + 5e-7)), ("d", 5e5), ("e", 5e5), ("f", 0.0125)]);
        let expected = "the 6 records have 3 sample rates: 4 at 500000 Hz (b, c, d, ...); 1 at 303030.3 Hz (a); 1 at 0.0125 Hz (f)";
        assert!(text.contains(expected), "{text}");
        let many: Vec<(&str, f64)> = (1..=12).map(|k| ("a", f64::from(k))).collect();
        assert!(
            of(&many).contains("12 sample rates: 1 at 1 Hz (a); ") && of(&many).contains("10 Hz (a); 2 more rates")
        );
    }

    #[test]
    fn another_unit_is_an_error_that_names_both_files() {
        let mut other = record("b.h5", 5e6, 9);
        other.channels[0].unit = "nm".to_owned();
        let text = check_consistency(&[record("a.h5", 5e6, 9), other]).unwrap_err().to_string();
        assert!(text.contains("a.h5 has V as unit of the deflection, b.h5 has nm"), "{text}");
    }

    #[test]
    fn other_lengths_scales_and_missing_piezo_are_remarks() {
        let mut other = record("b.h5", 5e6, 50);
        other.channels[0].scale_factor = 2e-3;
        other.channels.push(memory_channel("piezo", Raw::Int16(vec![0; 50]), 1.0));
        let remarks = check_consistency(&[record("a.h5", 5e6, 100), other]).unwrap().remarks;
        assert!(remarks[0].contains("from 50 samples (b.h5) to 100 (a.h5)"), "{remarks:?}");
        assert!(remarks[1].contains("0.001 V per code in a.h5, 0.002 in b.h5"), "{remarks:?}");
        assert!(remarks[2].contains("1 of 2"), "{remarks:?}");
    }

    #[test]
    fn empty_records_unequal_channels_and_no_record_are_errors() {
        assert!(check_consistency(&[]).is_err());
        assert!(check_consistency(&[record("a", 5e6, 0)]).is_err());
        let mut odd = record("a", 5e6, 10);
        odd.channels.push(memory_channel("piezo", Raw::Int16(vec![0; 9]), 1.0));
        assert!(check_consistency(&[odd]).unwrap_err().to_string().contains("10 samples, /piezo has 9"));
    }
}
