//! `roots`: poles and zeros, by row.

use afmid_kernels::modes::{Interval, Pole, PoleClass, Root};
use afmid_pipeline::{StageError, Table};

const POLE: &str = "pole";
const ZERO: &str = "zero";

/// Zeros that come in pairs.
const PAIR: &str = "pair";

/// What stages read of a row.
pub(crate) struct RootRow {
    /// Whether it is a pole of a mode.
    pub is_mode: bool,
    /// Whether it is a zero of a pair.
    pub is_zero_pair: bool,
    pub frequency_hz: f64,
    pub frequency_std_hz: f64,
    pub quality_factor: f64,
}

/// The rows of a table. Errors: a column that is missing.
pub(crate) fn roots(table: &Table) -> Result<Vec<RootRow>, StageError> {
    let (kinds, classes) = (table.text("kind")?, table.text("class")?);
    let (f, std, q) = (table.real("frequency_hz")?, table.real("frequency_std_hz")?, table.real("quality_factor")?);
    let row = |i: usize| RootRow {
        is_mode: kinds[i] == POLE && classes[i] == PoleClass::Mechanical.name(),
        is_zero_pair: kinds[i] == ZERO && classes[i] == PAIR,
        frequency_hz: f[i],
        frequency_std_hz: std[i],
        quality_factor: q[i],
    };
    Ok((0..table.rows()).map(row).collect())
}

/// Poles, then zeros.
pub(crate) fn root_table(poles: &[Pole], zeros: &[Root]) -> Table {
    let roots: Vec<Root> = poles.iter().map(|pole| pole.root).chain(zeros.iter().copied()).collect();
    let frequency = |r: &Root| Interval::normal(r.frequency_hz, r.frequency_std_hz);
    let quality = |r: &Root| Interval::normal(r.quality_factor, r.quality_factor_std);
    let zero_kind = |root: &Root| if root.is_complex() { PAIR } else { "real" };
    let kinds = poles.iter().map(|_| POLE).chain(zeros.iter().map(|_| ZERO));
    let classes = poles.iter().map(|pole| pole.kind.name()).chain(zeros.iter().map(zero_kind));
    let class = "what a pole belongs to; whether a zero is one of a pair";
    let mut table = Table::new().with("kind", "", "pole or zero", kinds.collect::<Vec<&str>>()).with(
        "class",
        "",
        class,
        classes.collect::<Vec<&str>>(),
    );
    let numbers = Table::of(&roots)
        .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "magnitude of s over 2 pi", |r| {
            (r.frequency_hz, r.frequency_std_hz)
        })
        .with_std(["quality_factor", "quality_factor_std"], "1", "magnitude of s over minus twice its real part", |r| {
            (r.quality_factor, r.quality_factor_std)
        })
        .with("frequency_low_hz", "Hz", "lower end of its 95 % interval", |r| frequency(r).low)
        .with("frequency_high_hz", "Hz", "upper end", |r| frequency(r).high)
        .with("quality_factor_low", "1", "lower end of its 95 % interval", |r| quality(r).low)
        .with("quality_factor_high", "1", "upper end", |r| quality(r).high)
        .with("z_re", "1", "real part in the z plane", |r| r.z.re)
        .with("z_im", "1", "imaginary part in the z plane, upper one of a pair", |r| r.z.im)
        .with("s_re", "rad/s", "real part in the s plane", |r| r.s.re)
        .with("s_im", "rad/s", "imaginary part in the s plane", |r| r.s.im)
        .table();
    table.columns.extend(numbers.columns);
    table
}
