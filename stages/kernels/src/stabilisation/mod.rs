//! Stabilisation diagram: which poles stay where they are as the order grows.
//!
//! ```
//! use afmid_kernels::stabilisation::{StabilisationCriteria, stabilisation};
//! use afmid_kernels::subspace::Subspace;
//! // a resonance at 50 kHz with Q = 40, sampled at 1 MS/s; the input ends, the output rings, with noise
//! let (w, a) = (std::f64::consts::TAU * 50e3 * 1e-6, std::f64::consts::PI * 50e3 / 40.0 * 1e-6);
//! let (a1, a2) = (-2.0 * (-a).exp() * w.cos(), (-2.0 * a).exp());
//! let u: Vec<f64> = (0..4096).map(|k| if k < 200 { 1.0 } else { 0.0 }).collect();
//! let mut y = vec![0.0; u.len()];
//! for k in 2..u.len() {
//!     y[k] = -a1 * y[k - 1] - a2 * y[k - 2] + 0.1 * u[k - 1];
//! }
//! y.iter_mut().enumerate().for_each(|(k, y)| *y += 1e-4 * ((k * k) as f64).sin());
//! let subspace = Subspace::new(&u, &y, 40)?;
//! let candidates = (2..=10).map(|order| Ok((order, subspace.poles(order)?)));
//! let candidates = candidates.collect::<Result<Vec<_>, afmid_kernels::model::ModelError>>()?;
//! let found = stabilisation(&candidates, 1e-6, &StabilisationCriteria::default())?;
//! // one mode stays at all orders; a tenth of a per cent is what start values reach
//! let mode = found.modes[0];
//! assert!((mode.frequency_hz / 50e3 - 1.0).abs() < 1e-3 && mode.count >= 8);
//! println!("{:.1} Hz, between orders +- {:.1} Hz", mode.frequency_hz, mode.frequency_spread_hz);
//! # Ok::<(), afmid_kernels::model::ModelError>(())
//! ```

mod cluster;
mod established;
#[cfg(test)]
mod tests;

use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::cluster::clustered;
use crate::model::ModelError;

pub use self::cluster::PhysicalMode;

/// When a pole counts as stable, and stable poles as a mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StabilisationCriteria {
    /// Largest relative change of a stable pole's frequency from one order to the next. Why: as is usual.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0.0))]
    pub frequency: f64,
    /// Largest relative change of a stable pole's damping. Why: as is usual; a mode's damping may spread twice as much.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub damping: f64,
    /// Least quality factor of a mode. Why: as in `model.modes`.
    #[schemars(extend("exclusiveMinimum" = 0.5))]
    pub min_quality_factor: f64,
    /// Least number of orders at which a mode is stable.
    #[schemars(range(min = 1))]
    pub min_count: usize,
    /// Least share of the orders from a mode's first on at which it is stable.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub min_share: f64,
}

impl Default for StabilisationCriteria {
    fn default() -> Self {
        Self { frequency: 0.01, damping: 0.05, min_quality_factor: 5.0, min_count: 4, min_share: 0.5 }
    }
}

/// A pole of one order; of a pair the upper one. Real poles are not listed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderedPole {
    /// Order of the model that it belongs to.
    pub order: usize,
    /// `|s| / 2 pi`.
    pub frequency_hz: f64,
    /// `-Re s / |s|`, one over twice the quality factor; negative outside the unit circle.
    pub damping: f64,
    /// Whether the next lower order has a pole at this frequency.
    pub frequency_stable: bool,
    /// Whether that pole has this damping, too.
    pub damping_stable: bool,
    /// Index of the physical mode that it belongs to.
    pub mode: Option<usize>,
}

impl OrderedPole {
    /// `|s| / (-2 Re s)`.
    pub fn quality_factor(&self) -> f64 {
        0.5 / self.damping
    }

    /// Stable in frequency and damping.
    pub fn stable(&self) -> bool {
        self.frequency_stable && self.damping_stable
    }
}

/// A stabilisation diagram and what it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Stabilisation {
    /// All poles, by order, then by frequency.
    pub poles: Vec<OrderedPole>,
    /// The orders that were tried.
    pub orders: Vec<usize>,
    /// The physical modes, ascending in frequency.
    pub modes: Vec<PhysicalMode>,
    /// Least order at which every physical mode has a stable pole, and keeps it at the next; none without modes.
    pub order: Option<usize>,
}

/// Marks what is stable in the poles of ascending orders and gathers it into physical modes.
///
/// # Model
/// A physical mode has one pole at every order that can hold it; a pole that noise needs moves as the order changes.
/// # Method
/// Each pole is compared with the nearest in frequency at the next lower order that was tried. The stable ones with
/// enough quality are grouped around the frequency at which most orders agree, one per order, and so on with the rest;
/// a gathering is a mode if it has enough orders and its damping agrees. One record's noise is the same at every order,
/// and has poles that stay, too: [`Stabilisation::established`] drops what does not ring.
/// # Shapes
/// `candidates`: order and its poles, conjugates included.
/// # Units
/// Hertz; damping has none.
/// # Accuracy
/// On the paper's lever in noise, 3 or 4 modes, exactly those, once established, over 12 seeds and both start methods
/// (test). Medians are no better than the start method: its spread over orders says nothing of its bias, nor of the
/// noise that all orders share.
/// # Errors
/// Fewer than two orders, orders that do not ascend, criteria out of range.
/// # Source
/// H. Van der Auweraer and B. Peeters, Smart Struct. Syst. 1 (2004) 1; B. Peeters and G. De Roeck, J. Dyn. Syst. Meas.
/// Control 123 (2001) 659.
pub fn stabilisation(
    candidates: &[(usize, Vec<c64>)],
    sample_time_s: f64,
    criteria: &StabilisationCriteria,
) -> Result<Stabilisation, ModelError> {
    checked(candidates, sample_time_s, criteria)?;
    let mut poles: Vec<OrderedPole> = Vec::new();
    let mut lower: Vec<OrderedPole> = Vec::new();
    for (order, roots) in candidates {
        let mut own: Vec<OrderedPole> =
            roots.iter().filter(|z| z.im > 0.0).map(|z| ordered(*order, *z, sample_time_s)).collect();
        own.sort_by(|x, y| x.frequency_hz.total_cmp(&y.frequency_hz));
        own.iter_mut().for_each(|pole| compare(pole, &lower, criteria));
        poles.extend(&own);
        lower = own;
    }
    let orders: Vec<usize> = candidates.iter().map(|(order, _)| *order).collect();
    let modes = clustered(&mut poles, &orders, criteria);
    let order = proposed(&poles, &orders, modes.len());
    Ok(Stabilisation { poles, orders, modes, order })
}

fn checked(
    candidates: &[(usize, Vec<c64>)],
    sample_time_s: f64,
    criteria: &StabilisationCriteria,
) -> Result<(), ModelError> {
    let range = |name, found: f64, ok: bool, wanted| {
        if ok { Ok(()) } else { Err(ModelError::Parameter { name, found, wanted }) }
    };
    let positive = |name, value: f64| range(name, value, value > 0.0 && value.is_finite(), "above 0");
    range("orders", candidates.len() as f64, candidates.len() >= 2, "at least 2 of them")?;
    if let Some(pair) = candidates.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
        return range("an order", pair[1].0 as f64, false, "above the one before");
    }
    positive("sample_time_s", sample_time_s)?;
    positive("frequency", criteria.frequency)?;
    positive("damping", criteria.damping)?;
    range("min_quality_factor", criteria.min_quality_factor, criteria.min_quality_factor > 0.5, "above 0.5")?;
    range("min_count", criteria.min_count as f64, criteria.min_count >= 1, "at least 1")?;
    range("min_share", criteria.min_share, (0.0..=1.0).contains(&criteria.min_share), "0 to 1")
}

fn ordered(order: usize, z: c64, sample_time_s: f64) -> OrderedPole {
    let s = z.ln() / sample_time_s;
    OrderedPole {
        order,
        frequency_hz: s.norm() / std::f64::consts::TAU,
        damping: -s.re / s.norm(),
        frequency_stable: false,
        damping_stable: false,
        mode: None,
    }
}

/// Marks `pole` by the nearest of the next lower order.
fn compare(pole: &mut OrderedPole, lower: &[OrderedPole], criteria: &StabilisationCriteria) {
    let distance = |other: &OrderedPole| (other.frequency_hz / pole.frequency_hz - 1.0).abs();
    let nearest = lower.iter().min_by(|x, y| distance(x).total_cmp(&distance(y)));
    let Some(nearest) = nearest.filter(|other| distance(other) <= criteria.frequency) else { return };
    let change = (nearest.damping / pole.damping - 1.0).abs();
    pole.frequency_stable = true;
    pole.damping_stable = pole.damping > 0.0 && change <= criteria.damping;
}

/// The least order at which all modes are there, followed by one at which they still are.
fn proposed(poles: &[OrderedPole], orders: &[usize], modes: usize) -> Option<usize> {
    let complete = |order: usize| {
        let there = |mode: usize| poles.iter().any(|pole| pole.order == order && pole.mode == Some(mode));
        (0..modes).all(there)
    };
    let pair = || orders.windows(2).find(|pair| complete(pair[0]) && complete(pair[1])).map(|pair| pair[0]);
    if modes == 0 { None } else { pair() }
}
