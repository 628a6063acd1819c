//! `modes`: frequencies and quality factors with their standard errors.

use afmid_kernels::ringdown::{Estimate, ModeEstimate};
use afmid_pipeline::{StageError, Table};

const FREQUENCY_HZ: &str = "frequency_hz";
const FREQUENCY_STD_HZ: &str = "frequency_std_hz";
const QUALITY_FACTOR: &str = "quality_factor";
const QUALITY_FACTOR_STD: &str = "quality_factor_std";

/// The modes of a table. Errors: a column that is missing.
pub(crate) fn modes(table: &Table) -> Result<Vec<ModeEstimate>, StageError> {
    let frequency = estimates(table, FREQUENCY_HZ, FREQUENCY_STD_HZ)?;
    let quality = estimates(table, QUALITY_FACTOR, QUALITY_FACTOR_STD)?;
    let mode = |(frequency_hz, quality_factor)| ModeEstimate { frequency_hz, quality_factor };
    Ok(frequency.into_iter().zip(quality).map(mode).collect())
}

/// A table of modes by row; what else is known of them is added to it.
pub(crate) fn mode_table(modes: &[ModeEstimate]) -> Table {
    Table::of(modes)
        .with_std([FREQUENCY_HZ, FREQUENCY_STD_HZ], "Hz", "resonance frequency", |m| m.frequency_hz)
        .with_std([QUALITY_FACTOR, QUALITY_FACTOR_STD], "1", "quality factor", |m| m.quality_factor)
        .table()
}

/// The same with damping ratios.
pub(crate) fn damped_mode_table(modes: &[ModeEstimate]) -> Table {
    let damping = Table::of(modes)
        .with_std(["damping_ratio", "damping_ratio_std"], "1", "share of critical damping", ModeEstimate::damping_ratio)
        .table();
    let mut table = mode_table(modes);
    table.columns.extend(damping.columns);
    table
}

fn estimates(table: &Table, value: &str, std: &str) -> Result<Vec<Estimate>, StageError> {
    let (values, stds) = (table.real(value)?, table.real(std)?);
    Ok(values.iter().zip(stds).map(|(&value, &std)| Estimate { value, std }).collect())
}
