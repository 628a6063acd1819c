//! The stage `spectrum.window`.

use afmid_pipeline::{Array, Context, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::artifacts::Pair;
use afmid_kernels::spectra::{Taper, difference, taper, taper_gains};

/// Multiplies force and response by a window in time.
///
/// Model: none; a window trades leakage for resolution. The paper's is Tukey's with alpha = 0.1: flat, with cosine
/// edges over 5 % of the length at either end. Its Eq. 9 as printed jumps from 1 to 0.97 where the taper starts and
/// ends at 0.33; what is meant is computed here.
/// Method: with `differenced`, force and response are replaced by their first differences before: the step becomes a
/// pulse, nothing jumps from the end of the window to its start, and the transfer function is the same. With a
/// rectangular window and a transient in `spectrum.smoothing`, the closed-form lever is recovered to 1e-5 at
/// resonances, against 1.5e-2 with the paper's window.
/// Shapes: as the pair's, with the variable `window` beside.
/// Units: the pair's; a difference is per sample. Attributes: `coherent_gain` (mean of the window), `noise_gain` (mean
/// square) and `equivalent_bins` (noise-equivalent bandwidth, noise gain over the squared coherent gain).
/// Accuracy: rounding.
/// Errors: alpha outside 0 to 1.
/// Source: Stark et al. 2005, Eq. 9; Harris, Proc. IEEE 66 (1978) 51.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Window {
    /// `tukey`, `rectangular` or `hann`. Why: the paper's.
    pub kind: Taper,
    /// Tapered share of a Tukey window. Why: the paper's.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub alpha: f64,
    /// Take first differences before. Why: as in the paper; true with `kind = "rectangular"` is better.
    pub differenced: bool,
}

impl Default for Window {
    fn default() -> Self {
        Self { kind: Taper::Tukey, alpha: 0.1, differenced: false }
    }
}

pub(super) const PAIR: Port<Array> = Port::new("pair", "pair", "force and response over time since t0");
pub(super) const WINDOWED: Port<Array> = Port::new("windowed", "pair", "force and response under the window");

impl Stage for Window {
    const SPEC: Spec = Spec {
        name: "spectrum.window",
        version: 1,
        summary: "multiplies force and response by a Tukey, Hann or rectangular window",
        inputs: &[PAIR.spec()],
        outputs: &[WINDOWED.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005, Eq. 9; Harris, Proc. IEEE 66 (1978) 51",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let pair = Pair::new(inputs.get(&PAIR)?);
        if pair.windowed() {
            return Err(
                StageError::new("the pair has been windowed already").help("wire the pair of `force.extrapolation`")
            );
        }
        let samples = pair.samples()?;
        let window = taper(self.kind, self.alpha, samples).map_err(StageError::from_error)?;
        let t0 = pair.t0_sample()?;
        if let Some(&weight) = window.get(t0 as usize)
            && weight < 1.0
        {
            cx.warn(format!(
                "the event (sample {t0}) lies under the taper, where the window is {weight:.3}: take a longer stretch before it or a smaller alpha"
            ));
        }
        let gains = taper_gains(&window);
        let gains = [gains.coherent, gains.noise, gains.equivalent_bins];
        let differences = |name: &str| self.differenced && !name.starts_with("standard_error");
        let result = pair.windowed_by(self.kind.name(), self.differenced, gains, |name, values| {
            if differences(name) {
                *values = difference(values);
            }
            values.iter_mut().zip(&window).for_each(|(v, w)| *v *= w);
        });
        let result = result.with("window", "1", "window", &["time"], window);
        Ok(Ports::new().with(&WINDOWED, result))
    }

    fn examples() -> Vec<Example> {
        super::example::window()
    }
}
