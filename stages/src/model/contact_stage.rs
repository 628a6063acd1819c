//! The stage `model.contact`.

use afmid_pipeline::{Array, Axis, Caching, Context, Document, Example, Port, Ports, Spec, Stage, StageError, Table};
use faer::{Mat, c64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::contact::{
    ContactEstimate, CoupledPoles, FreeLever, LOADED_BEAM_SHARES, PoleContact, contact_stiffness, coupled_poles,
};
use super::ringdown::{Estimate, ModeEstimate};
use super::ringdown_stage::POLES;
use crate::calibration::StiffnessSummary;
use crate::calibration::reading::within;

/// Stiffness and damping of the contact, from the resonances of the free lever and of the lever on the surface.
///
/// Model: at every pole s of the coupled lever kappa(s) = k_c + eta s = -1 / G(s), G(s) = (1/k) (sum_n c_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + 1 -
/// sum_n c_n) the free lever as its tip sees it: exact for a modal lever with a linear contact at the tip. Detector and excitation are in no pole.
/// Method: each pole alone gives both numbers; together by generalised least squares over the poles, weighted by their full covariance
/// plus the free modes' errors and those of stiffness and tip shares, carried to the poles by implicit derivatives.
/// Shapes: `contact` by coupled pole, ascending.
/// Units: N/m, N s/m, Hz.
/// Accuracy: to first order in the errors; known stiffness recovered within its errors over 50 simulated archives (docs/accuracy.md). Bias: modes beyond
/// the free lever's count as a static compliance only, which the highest pole feels most; tip shares are assumed, not measured, and wrong ones show as
/// poles that disagree (p-value). A relative error of k is the same relative error of both results.
/// Errors: as many shares as free modes are wanted; no stiffness; poles that no linear contact on this lever gives. Poles that disagree
/// are a warning.
/// Source: U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ContactFit {
    /// Static stiffness of the lever at its tip in N/m, above 0, where `stiffness` is not wired. Default: absent.
    pub stiffness_n_per_m: Option<f64>,
    /// Its relative standard error, 0 to 1, where `stiffness` is not wired. Default: 0, errors are then those of the ratio to k.
    pub stiffness_error: f64,
    /// What each free mode has of the tip's static compliance, ascending, above 0, their sum at most 1; the rest counts as static. Default:
    /// 0.9713, 0.0247, 0.0032, 0.0008, a beam loaded at its end as in `simulate.afm`: an assumption.
    pub tip_shares: Vec<f64>,
    /// Relative standard error of each share but the first, which makes up for the others, 0 to 1. Default: 0, the shares are taken as they are.
    pub tip_share_error: f64,
    /// Coupled poles above this frequency in Hz are left out; above 0. Default: absent, all count.
    pub max_frequency_hz: Option<f64>,
}

impl Default for ContactFit {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: None,
            stiffness_error: 0.0,
            tip_shares: LOADED_BEAM_SHARES.to_vec(),
            tip_share_error: 0.0,
            max_frequency_hz: None,
        }
    }
}

const FREE: Port<Table> = Port::new("free", "", "modes of the free lever: of `model.ringdown` or `model.modes`");
const STIFFNESS: Port<Document> = Port::optional("stiffness", "stiffness", "the summary of `calibration.stiffness`");
const CONTACT: Port<Table> = Port::new("contact", "contact-poles", "what each coupled pole says, and what it counts");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "contact stiffness and damping with their errors");

/// Poles that agree give a smaller p-value once in a hundred archives.
const DISAGREEMENT: f64 = 0.01;

impl Stage for ContactFit {
    const SPEC: Spec = Spec {
        name: "model.contact",
        version: 1,
        summary: "contact stiffness and damping from the poles that the contact moves",
        inputs: &[FREE.spec(), POLES.spec(), STIFFNESS.spec()],
        outputs: &[CONTACT.spec(), SUMMARY.spec()],
        caching: Caching::Stored,
        seeded: false,
        source: "U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281",
    };

    fn check(&self) -> Result<(), StageError> {
        within("stiffness_n_per_m", self.stiffness_n_per_m.unwrap_or(1.0), 1e-6, 1e6)?;
        within("stiffness_error", self.stiffness_error, 0.0, 1.0)?;
        within("tip_share_error", self.tip_share_error, 0.0, 1.0)?;
        within("max_frequency_hz", self.max_frequency_hz.unwrap_or(1.0), 1e-6, 1e12)?;
        for &share in &self.tip_shares {
            within("tip_shares", share, 1e-12, 1.0)?;
        }
        // 1e-6: rounding of their decimal digits
        within("sum of `tip_shares`", self.tip_shares.iter().sum(), 1e-12, 1.0 + 1e-6)
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let lever = self.lever(inputs.get(&FREE)?, inputs.find(&STIFFNESS)?)?;
        let coupled = self.coupled(inputs.get(&POLES)?)?;
        let contact = contact_stiffness(&lever, &coupled).map_err(|error| {
            StageError::from_error(error)
                .help("look at the coupled modes: leave wrong ones out with `max_frequency_hz` or fit fewer `modes`")
        })?;
        if contact.p_value < DISAGREEMENT {
            cx.warn(format!(
                "the poles disagree on the contact: chi square {:.1} with {} degrees of freedom (p = {:.1e}); its errors are too small: tip shares, \
                 missing modes or a nonlinear contact (see `contact`)",
                contact.chi_square, contact.freedom, contact.p_value
            ));
        }
        if contact.stiffness_n_per_m.value <= 0.0 || contact.damping_n_s_per_m.value < 0.0 {
            cx.warn(format!(
                "a contact of {:.3e} N/m and {:.3e} N s/m: not of a surface that only holds and damps",
                contact.stiffness_n_per_m.value, contact.damping_n_s_per_m.value
            ));
        }
        Ok(Ports::new().with(&CONTACT, table(&contact)).with(&SUMMARY, summary(&contact, &lever)?))
    }

    fn examples() -> Vec<Example> {
        vec![Example {
            title: "Two poles of a lever on 60 N/m",
            params: "stiffness_n_per_m = 3.8\ntip_shares = [0.97, 0.03]",
            inputs: example_inputs,
            expect: |outputs| {
                let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
                let number = |name: &str| summary[name].as_f64().unwrap_or(f64::NAN);
                let (k, eta) = (number("contact_stiffness_n_per_m"), number("contact_damping_n_s_per_m"));
                // noise-free: rounding
                if (k / 60.0 - 1.0).abs() < 1e-9 && (eta / 8e-6 - 1.0).abs() < 1e-8 {
                    Ok(format!("{k:.2} N/m +- {:.2}.", number("contact_stiffness_std_n_per_m")))
                } else {
                    Err(format!("{k} {eta}"))
                }
            },
        }]
    }
}

impl ContactFit {
    fn lever(&self, free: &Table, wired: Option<&Document>) -> Result<FreeLever, StageError> {
        let stiffness = match (wired, self.stiffness_n_per_m) {
            (Some(document), _) => {
                let found = document.read::<StiffnessSummary>()?.stiffness_n_per_m;
                Estimate { value: found.value, std: found.std }
            }
            (None, Some(value)) => Estimate { value, std: value * self.stiffness_error },
            (None, None) => {
                return Err(StageError::new(
                    "no stiffness of the lever: neither `stiffness` is wired nor `stiffness_n_per_m` given",
                )
                .help("wire the summary of `calibration.stiffness`, or give the number"));
            }
        };
        let (f, f_std) = (free.real("frequency_hz")?, free.real("frequency_std_hz")?);
        let (q, q_std) = (free.real("quality_factor")?, free.real("quality_factor_std")?);
        if f.len() != self.tip_shares.len() {
            return Err(StageError::new(format!(
                "the free lever has {} modes, `tip_shares` {} numbers",
                f.len(),
                self.tip_shares.len()
            ))
            .help("give one share for each mode"));
        }
        let estimate = |value: &[f64], std: &[f64], i: usize| Estimate { value: value[i], std: std[i] };
        let modes = (0..f.len())
            .map(|i| ModeEstimate { frequency_hz: estimate(f, f_std, i), quality_factor: estimate(q, q_std, i) })
            .collect();
        FreeLever::new(stiffness, modes, self.tip_shares.clone(), self.tip_share_error).map_err(StageError::from_error)
    }

    fn coupled(&self, array: &Array) -> Result<CoupledPoles, StageError> {
        let (values, covariance) = (array.real("pole")?, array.real("covariance")?);
        let count = values.len();
        if covariance.len() != count * count || !count.is_multiple_of(2) {
            return Err(StageError::new(format!(
                "{count} parts of poles with {} covariances, wanted two parts of each pole and the square of their number",
                covariance.len()
            )));
        }
        let most = self.max_frequency_hz.map_or(f64::INFINITY, |f| std::f64::consts::TAU * f);
        let kept: Vec<usize> = (0..count / 2).filter(|&j| values[2 * j].hypot(values[2 * j + 1]) <= most).collect();
        let rows: Vec<usize> = kept.iter().flat_map(|&j| [2 * j, 2 * j + 1]).collect();
        Ok(CoupledPoles {
            poles: kept.iter().map(|&j| c64::new(values[2 * j], values[2 * j + 1])).collect(),
            covariance: Mat::from_fn(rows.len(), rows.len(), |i, j| covariance[rows[i] * count + rows[j]]),
        })
    }
}

fn table(contact: &ContactEstimate) -> Table {
    let column = |value: fn(&PoleContact) -> f64| contact.poles.iter().map(value).collect::<Vec<f64>>();
    Table::new()
        .with("frequency_hz", "Hz", "coupled resonance", column(|p| p.pole.norm() / std::f64::consts::TAU))
        .with("quality_factor", "1", "its quality factor", column(|p| p.pole.norm() / (-2.0 * p.pole.re)))
        .with("fitted_hz", "Hz", "where the contact puts it", column(|p| p.fitted.norm() / std::f64::consts::TAU))
        .with(
            "fitted_quality_factor",
            "1",
            "quality factor that the contact gives it",
            column(|p| p.fitted.norm() / (-2.0 * p.fitted.re)),
        )
        .with("stiffness", "N/m", "contact stiffness from this pole alone", column(|p| p.stiffness_n_per_m.value))
        .with("stiffness_std", "N/m", "its standard error", column(|p| p.stiffness_n_per_m.std))
        .with("damping", "N s/m", "contact damping from this pole alone", column(|p| p.damping_n_s_per_m.value))
        .with("damping_std", "N s/m", "its standard error", column(|p| p.damping_n_s_per_m.std))
        .with("stiffness_weight", "1", "what it counts in the stiffness", column(|p| p.stiffness_weight))
        .with("damping_weight", "1", "what it counts in the damping", column(|p| p.damping_weight))
}

fn summary(contact: &ContactEstimate, lever: &FreeLever) -> Result<Document, StageError> {
    let poles: Vec<Value> = contact
        .poles
        .iter()
        .map(|p| {
            json!({
                "frequency_hz": p.pole.norm() / std::f64::consts::TAU,
                "contact_stiffness_n_per_m": p.stiffness_n_per_m.value,
                "contact_stiffness_std_n_per_m": p.stiffness_n_per_m.std,
                "stiffness_weight": p.stiffness_weight,
                "damping_weight": p.damping_weight,
            })
        })
        .collect();
    Document::new(&json!({
        "contact_stiffness_n_per_m": contact.stiffness_n_per_m.value,
        "contact_stiffness_std_n_per_m": contact.stiffness_n_per_m.std,
        "contact_damping_n_s_per_m": contact.damping_n_s_per_m.value,
        "contact_damping_std_n_s_per_m": contact.damping_n_s_per_m.std,
        "correlation": contact.correlation,
        "lever_stiffness_n_per_m": lever.stiffness().value,
        "chi_square": contact.chi_square,
        "freedom": contact.freedom,
        "p_value": if contact.p_value.is_nan() { Value::Null } else { json!(contact.p_value) },
        "stiffness_std_by_origin_n_per_m": {
            "poles": contact.budget.poles,
            "lever_stiffness": contact.budget.stiffness,
            "free_modes": contact.budget.free_modes,
            "tip_shares": contact.budget.tip_shares,
        },
        "poles": poles,
    }))
}

/// A lever of two modes, and its exact poles on a contact of 60 N/m and 8e-6 N s/m.
fn example_inputs() -> Result<Ports, StageError> {
    let (f, q) = ([46.3e3, 247.4e3], [40.8, 193.2]);
    let free = Table::new()
        .with("frequency_hz", "Hz", "resonance frequency", f.to_vec())
        .with("frequency_std_hz", "Hz", "its standard error", vec![0.1, 1.0])
        .with("quality_factor", "1", "quality factor", q.to_vec())
        .with("quality_factor_std", "1", "its standard error", vec![0.01, 0.1]);
    let stage = ContactFit { stiffness_n_per_m: Some(3.8), tip_shares: vec![0.97, 0.03], ..ContactFit::default() };
    let lever = stage.lever(&free, None)?;
    let start = [c64::new(-3e4, 9.3e5), c64::new(-1e5, 2e6)];
    let poles = coupled_poles(&lever, [60.0, 8e-6], &start).ok_or_else(|| StageError::new("no coupled poles"))?;
    let axis = |name: &str| Axis::new(name, "1", "parts of the poles", vec![0.0, 1.0, 2.0, 3.0]);
    let array = Array::over(vec![axis("parameter"), axis("other")])
        .with("pole", "rad/s", "poles", &["parameter"], poles.iter().flat_map(|p| [p.re, p.im]).collect::<Vec<f64>>())
        .with(
            "covariance",
            "rad^2/s^2",
            "their covariance",
            &["parameter", "other"],
            (0..16).map(|i| if i % 5 == 0 { 1e4 } else { 0.0 }).collect::<Vec<f64>>(),
        );
    Ok(Ports::new().with(&FREE, free).with(&POLES, array))
}
