//! The stage `model.contact`.

mod output;
#[cfg(test)]
mod tests;

use afmid_pipeline::{Array, Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, Table};
use faer::{Mat, c64};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::output::{contact_table, share_table, summary};
use super::ringdown::POLES;
use crate::artifacts::{mode_table, modes, ringing, ringing_array};
use crate::calibration::StiffnessSummary;
use afmid_kernels::contact::{
    FreeLever, JointContact, JointOptions, LOADED_BEAM_SHARES, Ringing, coupled_poles, joint_contact,
};
use afmid_kernels::ringdown::{Estimate, ModeEstimate};

/// Stiffness and damping of the contact, contact resonances and tip shares, from the ringings of the free lever and of
/// the lever on the surface.
///
/// Model: the free lever as its tip sees it is G(s) = (1/k) (sum_n c_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + 1 - sum_n
/// c_n), as the detector sees it H(s) D(s), H with real gains in the place of the tip shares c_n, D a chain of real
/// poles. The contact is kappa(s) = k_c + eta s + mu s^2. Poles of the coupled lever are where 1 + kappa G = 0; its
/// response is H D / (1 + kappa G): zeros and detector are the free lever's. Both ringings follow a step of the tip's
/// force.
/// Method: generalised least squares of all poles and residues, each ringing with its full covariance, over contact,
/// tip shares, free poles, gains and detector at once. Without residues, or where they do not fit (p below 0.01, a
/// warning), poles alone.
/// Shapes: `contact` by coupled pole, ascending; `shares` by free mode.
/// Units: N/m, N s/m, kg, Hz.
/// Accuracy: to first order in the errors; known stiffness, damping and shares recovered within their errors over 100
/// simulated archives (docs/results/contact.md). Bias: modes beyond the free lever's count as a static compliance only,
/// of what the given shares leave of one; a second-order term below its threshold shifts shares and stiffness. A
/// relative error of k is the same relative error of the contact.
/// Errors: as many shares as free modes are wanted; no stiffness; poles that no linear contact on this lever gives;
/// fewer poles than shares and contact ask for. Poles that disagree are a warning.
/// Source: U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281; A. C. Aitken, Proc. R. Soc. Edinb. 55
/// (1936) 42.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ContactFit {
    /// Static stiffness of the lever at its tip in N/m, where `stiffness` is not wired.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub stiffness_n_per_m: Option<f64>,
    /// Its relative standard error, where `stiffness` is not wired. Why: errors are then those of the ratio to k.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stiffness_error: f64,
    /// What each free mode has of the tip's static compliance, ascending, their sum at most 1; the rest counts as
    /// static. Their sum is kept, each is a start. Why: a beam loaded at its end.
    #[schemars(inner(range(min = 1e-12, max = 1.0)))]
    pub tip_shares: Vec<f64>,
    /// What is known of shares and law beforehand.
    #[serde(flatten)]
    pub options: JointOptions,
    /// Coupled poles above this frequency in Hz are left out. Absent: all count.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max_frequency_hz: Option<f64>,
}

impl Default for ContactFit {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: None,
            stiffness_error: 0.0,
            tip_shares: LOADED_BEAM_SHARES.to_vec(),
            options: JointOptions::default(),
            max_frequency_hz: None,
        }
    }
}

const FREE: Port<Table> = Port::new("free", "", "modes of the free lever: of `model.ringdown` or `model.modes`");
const FREE_POLES: Port<Array> = Port::optional(
    "free_poles",
    "ringdown-poles",
    "the same fit's poles and residues: what zeros and detector are known from",
);
const STIFFNESS: Port<Document> = Port::optional("stiffness", "stiffness", "the summary of `calibration.stiffness`");
const CONTACT: Port<Table> =
    Port::new("contact", "contact-poles", "contact resonances; what each says alone, and what it counts");
const SHARES: Port<Table> = Port::new("shares", "tip-shares", "tip shares of the free modes");
const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "the contact with its errors, shares, resonances, tests");

/// Poles that agree give a smaller p-value once in a hundred archives.
const DISAGREEMENT: f64 = 0.01;

impl Stage for ContactFit {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.contact",
        version: 2,
        summary: "contact stiffness, damping and resonances, sharing zeros and detector with the free lever",
        inputs: &[FREE.spec(), FREE_POLES.spec(), POLES.spec(), STIFFNESS.spec()],
        outputs: &[CONTACT.spec(), SHARES.spec(), SUMMARY.spec()],
        source: "U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        // 1e-6: rounding of their decimal digits
        let sum: f64 = self.tip_shares.iter().sum();
        let one = self.tip_shares.is_empty() || sum <= 1.0 + 1e-6;
        faults.require(one, || format!("`tip_shares` add up to {sum}, wanted 1 or less"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let lever = self.lever(inputs.get(&FREE)?, inputs.find(&STIFFNESS)?)?;
        let free = match inputs.find(&FREE_POLES)? {
            Some(array) => ringing(array, f64::INFINITY)?,
            None => Ringing::of_modes(&lever),
        };
        let most = self.max_frequency_hz.map_or(f64::INFINITY, |f| std::f64::consts::TAU * f);
        let coupled = ringing(inputs.get(&POLES)?, most)?;
        let contact = joint_contact(&lever, &free, &coupled, &self.options).map_err(|error| {
            StageError::from_error(error).help(
                "look at the coupled modes: leave wrong ones out with `max_frequency_hz` or fit fewer `modes`; with fewer poles than shares give \
                 `tip_share_error`",
            )
        })?;
        warn(&contact, cx);
        Ok(Ports::new()
            .with(&CONTACT, contact_table(&contact))
            .with(&SHARES, share_table(&contact, &lever, &self.tip_shares))
            .with(&SUMMARY, summary(&contact, &lever)?))
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

fn warn(contact: &JointContact, cx: &Context) {
    // where poles alone disagree already, residues cannot say more
    let disagree = contact.p_value < DISAGREEMENT;
    if let Some(test) = contact.residues.filter(|test| !test.used && !disagree) {
        cx.warn(format!(
            "the residues are not those of a step of force at the tip (chi square {:.1} with {} degrees of freedom, p = {:.1e}): poles alone are used; \
             the catch takes time, or the detector is not the free lever's",
            test.chi_square, test.freedom, test.p_value
        ));
    }
    if disagree {
        cx.warn(format!(
            "poles{} disagree on the contact: chi square {:.1} with {} degrees of freedom (p = {:.1e}); its errors are too small: missing modes, a \
             nonlinear contact, or given shares that are wrong",
            if contact.residues.is_some_and(|test| test.used) { " and residues" } else { "" },
            contact.chi_square,
            contact.freedom,
            contact.p_value
        ));
    }
    if let (Some(gain), Some(inertia)) = (contact.law_gain, contact.inertia_kg) {
        cx.warn(format!(
            "not a contact of spring and damper: a term of {:.2e} +- {:.1e} kg lowers chi square by {gain:.1}; {}",
            inertia.value,
            inertia.std,
            if inertia.value < 0.0 {
                "it stiffens with frequency, as one that relaxes or whose force comes late"
            } else {
                "it moves a mass"
            }
        ));
    }
    if contact.stiffness_n_per_m.value <= 0.0 || contact.damping_n_s_per_m.value < 0.0 {
        cx.warn(format!(
            "a contact of {:.3e} N/m and {:.3e} N s/m: not of a surface that only holds and damps",
            contact.stiffness_n_per_m.value, contact.damping_n_s_per_m.value
        ));
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
        let modes = modes(free)?;
        if modes.len() != self.tip_shares.len() {
            return Err(StageError::new(format!(
                "the free lever has {} modes, `tip_shares` {} numbers",
                modes.len(),
                self.tip_shares.len()
            ))
            .help("give one share for each mode"));
        }
        // shares with an error are the joint estimate's to count
        FreeLever::new(stiffness, modes, self.tip_shares.clone(), 0.0).map_err(StageError::from_error)
    }
}

/// A lever of two modes, and its exact poles on a contact of 60 N/m and 8e-6 N s/m.
fn example_inputs() -> Result<Ports, StageError> {
    let estimate = |value: f64, std: f64| Estimate { value, std };
    let free = mode_table(&[
        ModeEstimate { frequency_hz: estimate(46.3e3, 0.1), quality_factor: estimate(40.8, 0.01) },
        ModeEstimate { frequency_hz: estimate(247.4e3, 1.0), quality_factor: estimate(193.2, 0.1) },
    ]);
    let stage = ContactFit { stiffness_n_per_m: Some(3.8), tip_shares: vec![0.97, 0.03], ..ContactFit::default() };
    let lever = stage.lever(&free, None)?;
    let start = [c64::new(-3e4, 9.3e5), c64::new(-1e5, 2e6)];
    let poles = coupled_poles(&lever, [60.0, 8e-6], &start).ok_or_else(|| StageError::new("no coupled poles"))?;
    let covariance = Mat::from_fn(4, 4, |i, j| if i == j { 1e4 } else { 0.0 });
    let array = ringing_array(&Ringing { poles, residues: None, covariance, real_poles: 0 });
    Ok(Ports::new().with(&FREE, free).with(&POLES, array))
}
