//! Bode plots: magnitude and phase over log frequency.

use num_complex::Complex64;

use super::response::{broken_at_jumps, degrees_near, unwrapped_degrees, within_a_turn};
use crate::report::figure::{Axis, Band, Figure, Mark, Panel, Row, Stroke};

/// Standard errors that a band spans on either side: 95 % of a normal distribution.
const BAND: f64 = 1.96;

/// Curves of a Bode plot, its axes and the frequencies marked in it.
#[derive(Debug, Clone)]
pub(crate) struct Bode {
    /// The first lies lowest. Phases follow the turn of the smoothest curve, the last of several.
    pub curves: Vec<BodeCurve>,
    /// Frequencies in Hz with their words.
    pub rules: Vec<(f64, String)>,
    pub frequency: Axis,
    pub magnitude: Axis,
    /// Whether phases stay within about half a turn of zero, with breaks in their lines.
    pub within_a_turn: bool,
}

impl Bode {
    /// Curves of a response without unit, over decades of frequency.
    pub fn new(curves: Vec<BodeCurve>) -> Self {
        let magnitude = Axis::new("Magnitude", "1").log();
        Self { curves, rules: Vec::new(), frequency: Axis::frequency(), magnitude, within_a_turn: false }
    }
}

/// A curve of a Bode plot, ascending in frequency.
#[derive(Debug, Clone)]
pub(crate) struct BodeCurve {
    pub series: String,
    pub frequency_hz: Vec<f64>,
    pub transfer: Vec<Complex64>,
    /// Standard error of the magnitude; empty: unknown.
    pub magnitude_std: Vec<f64>,
    /// Standard error of the phase in radians; empty: unknown.
    pub phase_std_rad: Vec<f64>,
    pub stroke: Stroke,
    pub smoothness: Smoothness,
}

/// How far a curve may be trusted to unwrap phases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Smoothness {
    /// Its scatter shows its error, which is not drawn.
    Noisy,
    /// Smoothed data.
    Smoothed,
    /// A model's.
    Exact,
}

impl BodeCurve {
    /// A model's curve; bins at zero frequency have no place on the axis and are left out.
    pub fn new(series: &str, frequency_hz: &[f64], transfer: &[Complex64], stroke: Stroke) -> Self {
        let (frequency_hz, transfer) =
            frequency_hz.iter().zip(transfer).filter(|(f, _)| **f > 0.0).map(|(f, h)| (*f, *h)).unzip();
        Self {
            series: series.to_owned(),
            frequency_hz,
            transfer,
            magnitude_std: Vec::new(),
            phase_std_rad: Vec::new(),
            stroke,
            smoothness: Smoothness::Exact,
        }
    }

    /// With standard errors of magnitude and phase at each of the frequencies that [`BodeCurve::new`] was given.
    pub fn with_errors(mut self, frequency_hz: &[f64], magnitude_std: &[f64], phase_std_rad: &[f64]) -> Self {
        let shown =
            |values: &[f64]| frequency_hz.iter().zip(values).filter(|(f, _)| **f > 0.0).map(|(_, v)| *v).collect();
        (self.magnitude_std, self.phase_std_rad) = (shown(magnitude_std), shown(phase_std_rad));
        self
    }

    /// With a variance of the complex value, E|h - mean|^2, at each of the frequencies that [`BodeCurve::new`] was
    /// given: half of it lies along h, half across.
    pub fn with_variance(self, frequency_hz: &[f64], transfer: &[Complex64], variance: &[f64]) -> Self {
        let error: Vec<f64> = variance.iter().map(|v| (0.5 * v).sqrt()).collect();
        let turn: Vec<f64> = error.iter().zip(transfer).map(|(e, h)| e / h.norm()).collect();
        self.with_errors(frequency_hz, &error, &turn)
    }

    /// Without errors.
    pub fn plain(mut self) -> Self {
        self.magnitude_std.clear();
        self.phase_std_rad.clear();
        self
    }

    /// From data.
    pub fn measured(mut self, smoothness: Smoothness) -> Self {
        self.smoothness = smoothness;
        self
    }
}

/// Magnitude above phase.
pub(crate) fn bode_figure(id: &str, title: &str, caption: &str, bode: &Bode) -> Figure {
    let (magnitude, phase) = bode_panels(bode);
    Figure::new(id, title, caption).row(Row::one(340.0, magnitude)).row(Row::one(200.0, phase))
}

/// The panels of magnitude and phase; bands where a curve has errors. The frequencies are written under the phase.
pub(crate) fn bode_panels(bode: &Bode) -> (Panel, Panel) {
    let reference: Option<(Vec<f64>, Vec<f64>)> =
        bode.curves.iter().max_by_key(|curve| curve.smoothness).map(|curve| {
            let phases = unwrapped_degrees(&curve.transfer, &curve.phase_std_rad);
            let phases = if bode.within_a_turn { within_a_turn(&phases) } else { phases };
            curve.frequency_hz.iter().zip(phases).filter(|(_, phase)| phase.is_finite()).unzip()
        });
    let axis = match shown_range(&bode.curves) {
        Some((low, high)) => bode.frequency.clone().limits(low, high),
        None => bode.frequency.clone(),
    };
    let mut magnitude = Panel::new("", axis.clone().bare(), bode.magnitude.clone());
    let mut phase = Panel::new("", axis, Axis::phase());
    for curve in &bode.curves {
        let size: Vec<f64> = curve.transfer.iter().map(|h| h.norm()).collect();
        let angle = match &reference {
            Some((f, phases)) => degrees_near(&curve.frequency_hz, &curve.transfer, (f, phases)),
            None => unwrapped_degrees(&curve.transfer, &curve.phase_std_rad),
        };
        let angle = if bode.within_a_turn { broken_at_jumps(angle) } else { angle };
        let times = |std: &[f64], factor: f64| -> Vec<f64> { std.iter().map(|std| factor * std).collect() };
        if curve.smoothness > Smoothness::Noisy
            && curve.magnitude_std.len() == size.len()
            && curve.phase_std_rad.len() == size.len()
        {
            magnitude = magnitude.with(band(curve, &size, &times(&curve.magnitude_std, BAND)));
            // an error of half a turn says that nothing is known of the phase
            let turn = times(&curve.phase_std_rad, BAND)
                .iter()
                .map(|e| e.min(std::f64::consts::PI).to_degrees())
                .collect::<Vec<_>>();
            phase = phase.with(band(curve, &angle, &turn));
        }
        magnitude = magnitude.with(Mark::line(&curve.series, &curve.frequency_hz, &size, curve.stroke));
        phase = phase.with(Mark::line(&curve.series, &curve.frequency_hz, &angle, curve.stroke));
    }
    for (at, label) in &bode.rules {
        magnitude = magnitude.with(Mark::at_x(*at, label));
        phase = phase.with(Mark::at_x(*at, ""));
    }
    (magnitude, phase)
}

/// The range in which there are data, and a fifth beyond it; a model alone is shown whole.
fn shown_range(curves: &[BodeCurve]) -> Option<(f64, f64)> {
    let known = |curve: &BodeCurve| -> Option<(f64, f64)> {
        let mut known = curve.frequency_hz.iter().zip(&curve.transfer).filter(|(_, h)| h.is_finite()).map(|(f, _)| *f);
        let first = known.next()?;
        Some((first, known.next_back().unwrap_or(first)))
    };
    let range = |curves: &mut dyn Iterator<Item = &BodeCurve>| {
        curves.filter_map(known).reduce(|(low, high), (first, last)| (low.min(first), high.max(last)))
    };
    let measured = range(&mut curves.iter().filter(|curve| curve.smoothness < Smoothness::Exact));
    let all = range(&mut curves.iter())?;
    let (low, high) = measured.map_or(all, |(low, high)| (low, (1.2 * high).min(all.1)));
    (low < high).then_some((low, high))
}

fn band(curve: &BodeCurve, middle: &[f64], error: &[f64]) -> Mark {
    Mark::Band(Band {
        series: curve.series.clone(),
        x: curve.frequency_hz.clone(),
        low: middle.iter().zip(error).map(|(m, e)| m - e).collect(),
        high: middle.iter().zip(error).map(|(m, e)| m + e).collect(),
        colour: curve.stroke.colour,
        fits: false,
    })
}
