//! The stage `spectrum.thermal`.

use afmid_pipeline::{
    Array, Axis, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, Table, Values,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::artifacts::Density;
use crate::io::DENSITY;
use afmid_kernels::spectra::{
    AveragedDensity, Fitted, RESONANCE_FALSE_ALARM, SeenThrough, ThermalFit, ThermalFitSettings, resonance_chance,
    thermal_fit,
};

/// Fits a thermal spectrum: resonance, quality factor, level, white and 1/f noise.
///
/// # Model
/// One-sided density `A (2/pi) (f0^3/Q) / ((f0^2 - f^2)^2 + (f f0/Q)^2) + W + B/f`, seen through the window that the
/// spectra were made with. An average of n spectra is gamma distributed about it with shape n.
/// # Method
/// Maximum of Whittle's likelihood by Fisher scoring; lines (bins that chance does not explain at the stated
/// false-alarm rate, and those that the window spreads them to) are set aside and the fit repeated until they stay the
/// same.
/// # Shapes
/// `fit`: density, model and ratio over the frequencies fitted; `lines`: one row per line.
/// # Units
/// Hz; `variance` in the signal's unit squared, `white` the same per hertz.
/// # Accuracy
/// `std` from the Fisher information, the correlation of the window's bins counted; `robust_std` from the misfits
/// (sandwich), which also allows for a wrong number of averages. A resonance gains more in likelihood than noise alone does
/// in one spectrum of a thousand, all frequencies searched. Resonances two bins wide are unbiased. Cost: 0.2 us
/// per bin and step, some twenty steps.
/// # Errors
/// Fewer than 24 bins in the band, no resonance between the limits, none that noise alone does not show, no convergence.
/// # Source
/// P. Whittle, Ark. Mat. 2 (1953) 423; A. M. Sykulski et al., Biometrika 106 (2019) 251; H. White, Econometrica 50
/// (1982) 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Thermal {
    /// How the spectrum is fitted.
    #[serde(flatten)]
    pub fit: ThermalFitSettings,
    /// Only bins between these two frequencies are fitted, in Hz. Absent: all but the first three and the last three of
    /// a spectrum that begins at zero.
    #[schemars(inner(range(min = 0.0)))]
    pub fitted_hz: Option<[f64; 2]>,
    /// The window of the spectra: `auto` (from the input, or else from the correlation of neighbouring bins), `hann`,
    /// `rectangular`, or `none` for a density that no window has widened.
    pub window: SpectrumWindow,
}

/// The window of stored spectra.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SpectrumWindow {
    /// As the input says, or found from the data.
    Auto,
    /// Raised cosine.
    Hann,
    /// Plain segments.
    Rectangular,
    /// Values of the density itself.
    None,
}

impl Default for Thermal {
    fn default() -> Self {
        Self { fit: ThermalFitSettings::default(), fitted_hz: None, window: SpectrumWindow::Auto }
    }
}

const FIT: Port<Array> = Port::new("fit", "thermal-fit", "density, fitted density and their ratio over frequency");
const LINES: Port<Table> = Port::new("lines", "spectral-lines", "lines that were set aside");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "the fitted numbers with standard errors");

impl Stage for Thermal {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "spectrum.thermal",
        version: 5,
        summary: "fits resonance, quality factor and noise levels to a thermal spectrum",
        inputs: &[DENSITY.spec()],
        outputs: &[FIT.spec(), LINES.spec(), SUMMARY.spec()],
        source: "P. Whittle, Ark. Mat. 2 (1953) 423; A. M. Sykulski et al., Biometrika 106 (2019) 251",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        if let Some(highest) = self.fit.highest_hz {
            let lowest = self.fit.lowest_hz;
            faults
                .require(lowest < highest, || format!("`lowest_hz` is {lowest}, wanted below `highest_hz`, {highest}"));
        }
        if let Some([from, to]) = self.fitted_hz {
            faults.require(from < to, || format!("`fitted_hz` is [{from}, {to}], wanted two ascending frequencies"));
        }
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let density = Density::new(inputs.get(&DENSITY)?)?;
        let (f, p) = self.band(density.frequency_hz, density.density)?;
        let through = self.through(&density)?;
        let data = AveragedDensity { frequency_hz: f, density: p, averages: density.averages, through };
        let mut fit = thermal_fit(data, self.fit).map_err(StageError::from_error)?;
        let chance = resonance_chance(&data, &fit);
        if chance >= RESONANCE_FALSE_ALARM {
            return Err(no_resonance(&fit, chance));
        }
        let (hz, rate_error) = (&mut fit.frequency_hz, density.rate_error());
        (hz.std, hz.robust_std) = (rate_error.widened(hz.value, hz.std), rate_error.widened(hz.value, hz.robust_std));
        self.warn(&fit, f, data.averages, cx);
        Ok(Ports::new()
            .with(&FIT, fit_array(f, p, &fit, density.unit))
            .with(&LINES, lines_table(&fit))
            .with(&SUMMARY, Document::new(&summary(&fit, density.signal_unit(), self.fit.line_false_alarm))?))
    }

    fn examples() -> Vec<Example> {
        super::thermal_example::examples()
    }
}

impl Thermal {
    fn band<'a>(&self, f: &'a [f64], p: &'a [f64]) -> Result<(&'a [f64], &'a [f64]), StageError> {
        // bins next to zero hold the removed mean, the last the fold
        let edge = if f.first() == Some(&0.0) { 3 } else { 0 };
        let (mut from, mut to) = (edge.min(f.len()), f.len().saturating_sub(edge));
        if let Some([low, high]) = self.fitted_hz {
            from = from.max(f.partition_point(|f| *f < low));
            to = to.min(f.partition_point(|f| *f <= high));
        }
        match (f.get(from..to), p.get(from..to)) {
            (Some(f), Some(p)) => Ok((f, p)),
            _ => Err(StageError::new("no bin lies between the frequencies in `fitted_hz`")),
        }
    }

    fn through(&self, density: &Density<'_>) -> Result<Option<SeenThrough>, StageError> {
        Ok(match self.window {
            SpectrumWindow::Hann => Some(SeenThrough::Hann),
            SpectrumWindow::Rectangular => Some(SeenThrough::Rectangular),
            SpectrumWindow::None => Some(SeenThrough::Nothing),
            SpectrumWindow::Auto => match density.window() {
                None => None,
                Some("hann") => Some(SeenThrough::Hann),
                Some("rectangular") => Some(SeenThrough::Rectangular),
                Some(other) => {
                    return Err(StageError::new(format!("the spectra were made with the window `{other}`")).help(
                        "set `window = \"none\"` where the resonance is many bins wide, or make them with `hann`",
                    ));
                }
            },
        })
    }

    fn warn(&self, fit: &ThermalFit, f: &[f64], averages: f64, cx: &Context) {
        // the dispersion of n bins scatters by sqrt((2 + 6 / averages) c / n), c = 1.9 for correlated bins
        let std = ((2.0 + 6.0 / averages) * 1.9 / fit.bins as f64).sqrt();
        if (fit.dispersion - 1.0).abs() > 5.0 * std {
            cx.warn(format!(
                "the scatter about the fit is {:.2} times that of {averages} averages: use `robust_std`; a second resonance, a wrong number of averages, or drift",
                fit.dispersion
            ));
        }
        let bin = (f[f.len() - 1] - f[0]) / (f.len() - 1).max(1) as f64;
        let width = fit.frequency_hz.value / fit.quality_factor.value;
        if width < 0.2 * bin {
            cx.warn(format!(
                "the resonance is {:.3} bins wide: its quality factor rests on the window alone; average longer segments",
                width / bin
            ));
        }
    }
}

/// That the best resonance is one that noise alone shows.
fn no_resonance(fit: &ThermalFit, chance: f64) -> StageError {
    let often = match chance < 1.0 {
        true => format!("noise alone shows as much in {:.2} % of such spectra", 100.0 * chance),
        false => "noise alone shows as much".to_owned(),
    };
    let (bins, hz) = (fit.bins, fit.frequency_hz.value);
    let help = "average longer records; `fitted_hz = [..., ...]` searches fewer frequencies";
    StageError::new(format!(
        "no resonance: {bins} frequencies were searched, and at the best of them, {hz:.6} Hz, {often}"
    ))
    .help(help)
}

fn window_name(through: SeenThrough) -> &'static str {
    match through {
        SeenThrough::Hann => "hann",
        SeenThrough::Rectangular => "rectangular",
        SeenThrough::Nothing => "none",
    }
}

fn estimate(fitted: Fitted, unit: &str) -> Value {
    json!({ "value": fitted.value, "std": fitted.std, "robust_std": fitted.robust_std, "unit": unit })
}

fn summary(fit: &ThermalFit, signal: &str, false_alarm: f64) -> Value {
    let (square, density) = (format!("{signal}^2"), format!("{signal}^2/Hz"));
    json!({
        "frequency": estimate(fit.frequency_hz, "Hz"),
        "quality_factor": estimate(fit.quality_factor, "1"),
        "variance": estimate(fit.variance, &square),
        "peak_density": {
            "value": std::f64::consts::FRAC_2_PI * fit.variance.value * fit.quality_factor.value / fit.frequency_hz.value,
            "unit": density,
        },
        "white": estimate(fit.white, &density),
        "flicker_at_1_hz": estimate(fit.flicker, &square),
        "flicker_log_likelihood_gain": 0.5 * fit.flicker_gain,
        "lines": fit.lines.len(),
        "line_false_alarm": false_alarm,
        "window": window_name(fit.through),
        "bin_correlation": fit.bin_correlation,
        "dispersion": fit.dispersion,
        "bins": fit.bins,
    })
}

fn fit_array(f: &[f64], p: &[f64], fit: &ThermalFit, unit: &str) -> Array {
    let ratio: Vec<f64> = p.iter().zip(&fit.fitted).map(|(p, m)| p / m).collect();
    let over = &["frequency_hz"];
    Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", f.to_vec())])
        .with("density", unit, "one-sided power spectral density", over, Values::Real(p.to_vec()))
        .with("model", unit, "fitted density, as the window sees it", over, fit.fitted.clone())
        .with("ratio", "1", "density over fitted density", over, ratio)
}

fn lines_table(fit: &ThermalFit) -> Table {
    Table::of(&fit.lines)
        .with("frequency_hz", "Hz", "highest bin of the line", |l| l.frequency_hz)
        .with("ratio", "1", "density over the fitted one", |l| l.ratio)
        .with("p_value", "1", "chance of such a bin without a line", |l| l.p_value)
        .table()
}
