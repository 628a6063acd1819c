//! The stage `spectrum.smoothing`.

use afmid_pipeline::{Array, Context, Example, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::etfe::ETFE;
use crate::artifacts::Transfer;
use afmid_kernels::spectra::{
    Bins, PolynomialSettings, Presence, RationalSettings, SuppressedLine, local_polynomial, local_rational,
};

/// Smooths a transfer function by local models of real and imaginary parts.
///
/// Model: around each bin a quotient of two polynomials (`local-rational`: one resonance and one antiresonance are
/// exact in it) or a polynomial (`local-polynomial`, the paper's). Magnitudes are never smoothed: noise adds phi /
/// abs(U)^2 to their square (Eq. 10).
/// Method: rational: Levy's least squares reweighted (Sanathanan and Koerner), then Gauss-Newton; a plain polynomial is
/// averaged with it by the weights of the corrected Akaike criterion. A transient, which turns with the delay of the
/// event, takes up what the ends of the window add. Polynomial: the widest neighbourhood whose value agrees with all
/// narrower ones. Bins of a line in `lines` are left out and filled in.
/// Shapes: as the estimate's; `half_width_bins` says how many bins on either side each value comes from.
/// Units: the estimate's.
/// Accuracy: noise-free, the rational lowers no resonance two bins wide by more than 1e-6; a fixed parabola over 8 bins
/// on either side lowers the paper's by 48 to 67 %. `variance` is that of the local models and of what they differ by,
/// good to 2 % over seeds; `misfit` is its residual per degree of freedom over the variance given, one if that is
/// right.
/// Errors: a neighbourhood with too few bins for the coefficients.
/// Source: Stark et al. 2005, Eq. 10; McKelvey and Guerin, IFAC SYSID 2012; Pintelon and Schoukens, System
/// Identification, 2012, ch. 7; Buckland et al., Biometrics 53 (1997) 603; Goldenshluger and Nemirovski, Math. Meth.
/// Stat. 6 (1997) 135.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Smoothing {
    /// `local-rational` or `local-polynomial`.
    pub method: SmoothingMethod,
    /// Bins on either side of each bin that are used (the most, for an adaptive polynomial). Why: five widths of a
    /// resonance two bins wide.
    #[schemars(range(min = 1, max = 1000))]
    pub half_width_bins: usize,
    /// Order of the rational's numerator.
    #[schemars(range(min = 0, max = 6))]
    pub numerator_order: usize,
    /// Order of the rational's denominator. Why: one resonance.
    #[schemars(range(min = 0, max = 6))]
    pub denominator_order: usize,
    /// Transient in the rational: `auto` (for differences), `on` or `off`. Why: tapered series have their own errors,
    /// which it does not describe.
    pub transient: Presence,
    /// Order of the transient.
    #[schemars(range(min = 0, max = 6))]
    pub transient_order: usize,
    /// Degree of the polynomial.
    #[schemars(range(min = 0, max = 6))]
    pub degree: usize,
    /// Standard errors by which neighbourhoods of the polynomial may disagree; 0 for a fixed neighbourhood.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub adapt_sigma: f64,
    /// Lines that do not belong to the transfer function. None: the second harmonic of the first mode is the usual one.
    pub lines: Vec<SuppressedLine>,
}

/// Local models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SmoothingMethod {
    /// Quotient of polynomials.
    LocalRational,
    /// Polynomial.
    LocalPolynomial,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self {
            method: SmoothingMethod::LocalRational,
            half_width_bins: 10,
            numerator_order: 2,
            denominator_order: 2,
            transient: Presence::Auto,
            transient_order: 1,
            degree: 2,
            adapt_sigma: 2.0,
            lines: Vec::new(),
        }
    }
}

pub(super) const SMOOTHED: Port<Array> =
    Port::new("smoothed", "transfer", "smoothed transfer function and its variance");

impl Stage for Smoothing {
    const SPEC: Spec = Spec {
        name: "spectrum.smoothing",
        version: 4,
        summary: "smooths a transfer function by local rationals or polynomials of real and imaginary parts",
        inputs: &[ETFE.spec()],
        outputs: &[SMOOTHED.spec()],
        source: "Stark et al., Rev. Sci. Instrum. 2005; McKelvey and Guerin, IFAC SYSID 2012",
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let etfe = Transfer::new(inputs.get(&ETFE)?)?;
        let Transfer { frequency_hz, transfer, variance, .. } = etfe;
        let bins = Bins { frequency_hz, transfer, variance };
        let smoothed = match self.method {
            SmoothingMethod::LocalRational => local_rational(bins, self.rational(&etfe)?, &self.lines),
            SmoothingMethod::LocalPolynomial => {
                let adapt_sigma = (self.adapt_sigma > 0.0).then_some(self.adapt_sigma);
                let half_width_bins = self.half_width_bins;
                local_polynomial(
                    bins,
                    PolynomialSettings { degree: self.degree, half_width_bins, adapt_sigma },
                    &self.lines,
                )
            }
        }
        .map_err(StageError::from_error)?;
        let result = etfe.smoothed(smoothed.transfer, smoothed.variance, smoothed.half_width).with(
            "misfit",
            "1",
            "residual per degree of freedom over the variance given",
            &["frequency_hz"],
            smoothed.misfit,
        );
        Ok(Ports::new().with(&SMOOTHED, result))
    }

    fn examples() -> Vec<Example> {
        super::example::smoothing()
    }
}

impl Smoothing {
    fn rational(&self, etfe: &Transfer<'_>) -> Result<RationalSettings, StageError> {
        let wanted = self.transient.given().unwrap_or(etfe.differenced());
        let transient = if wanted { Some((self.transient_order, etfe.event_turns_per_bin()?)) } else { None };
        Ok(RationalSettings {
            numerator_order: self.numerator_order,
            denominator_order: self.denominator_order,
            half_width_bins: self.half_width_bins,
            transient,
        })
    }
}
