//! Contact, tip shares and contact resonances from both ringings together.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::estimate::contact_stiffness;
use super::joint_model::JointModel;
use super::joint_result::{JointContact, ResidueTest, Solved};
use super::law::ContactLaw;
use super::least_squares::minimise;
use super::lever::FreeLever;
use super::quantities::quantities;
use super::ringing::Ringing;
use crate::model::ModelError;
use crate::statistics::chi_square_tail;

/// How the contact's force depends on frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LawChoice {
    /// A spring and a damper: `k_c + eta s`.
    SpringDamper,
    /// With a term of second order: `k_c + eta s + mu s^2`.
    SecondOrder,
    /// The second where it lowers chi square by more than nine: three standard errors of its term.
    Auto,
}

/// What is known beforehand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct JointOptions {
    /// Relative standard error of each given tip share but the first, which makes up for the others; 0 takes them as
    /// they are. Absent: the data alone say them; wanted where there are fewer coupled poles than shares.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub tip_share_error: Option<f64>,
    /// The contact's law: `spring-damper`, `second-order`, or `auto`, which takes the second where it lowers chi square
    /// by more than 9.
    pub law: LawChoice,
}

impl Default for JointOptions {
    fn default() -> Self {
        Self { tip_share_error: None, law: LawChoice::Auto }
    }
}

/// By chance once in 370 contacts of spring and damper.
const LAW_GAIN: f64 = 9.0;
/// Residues of a step at the tip give a smaller p-value once in a hundred archives.
const RESIDUES_MISFIT: f64 = 0.01;

/// Stiffness and damping of the contact, tip shares and contact resonances from the ringings of the free lever and of
/// the lever on the contact.
///
/// # Model
/// A force at the tip moves what the detector sees by `H(s) D(s)`, the tip by `G(s)`; `H` and `G` are sums over the
/// free modes, with real gains `g_n` and tip shares `c_n`; `D` is a chain of real poles. On the contact the force of
/// the catch gives `H D / (1 + kappa G)`: zeros and detector are the free lever's, poles are where `1 + kappa G = 0`.
/// The free ringing follows a step of the force, and so does the coupled one: the tip is caught at rest, or in the
/// shape of a load at the tip, which a thermal peak has. Amplitudes and onsets are the events' own.
/// # Method
/// Generalised least squares of all poles and residues, each ringing with its full covariance, over contact, shares,
/// free poles, gains and detector at once. Detector corners are held to a factor of 1.6 (one standard error) round the
/// single corner that suits the residues best. Residues are used where they raise chi square by no more than their
/// number allows (p above 0.01), else poles alone.
/// # Shapes
/// `N` free modes with a tip share each, `M` coupled ones, `M <= N`.
/// # Units
/// rad/s, N/m, N s/m, kg.
/// # Accuracy
/// To first order in the errors; rms z over simulated archives: docs/results/contact.md. Degrees of freedom count what
/// the data determine of the corners. **Bias**: modes beyond the free lever's act as a static compliance only, of what
/// the given shares leave of one; a second-order term below its threshold shifts the shares and, through them, the
/// stiffness by up to three errors of what they would have beside that term.
/// # Errors
/// As many shares as free modes are wanted; poles that no contact on this lever gives; fewer numbers than are asked
/// for.
/// # Source
/// U. Rabe, K. Janser, W. Arnold, Rev. Sci. Instrum. 67 (1996) 3281 (contact resonances);
/// A. C. Aitken, Proc. R. Soc. Edinb. 55 (1936) 42 (generalised least squares).
pub fn joint_contact(
    lever: &FreeLever,
    free: &Ringing,
    coupled: &Ringing,
    options: &JointOptions,
) -> Result<JointContact, ModelError> {
    free.check("free lever's ringing")?;
    coupled.check("coupled lever's ringing")?;
    if free.poles.len() != lever.tip_share.len() {
        return Err(ModelError::Parameter {
            name: "number of the free lever's poles",
            found: free.poles.len() as f64,
            wanted: "one for each tip share",
        });
    }
    let start: ContactLaw = {
        let alone = contact_stiffness(lever, &coupled.coupled_poles())?;
        [alone.stiffness_n_per_m.value, alone.damping_n_s_per_m.value].into()
    };
    let bare = [free.poles_only(), coupled.poles_only()];
    let of_poles = |law| chosen(lever, [&bare[0], &bare[1]], start, JointOptions { law, ..*options });
    if free.reference().is_none() || coupled.reference().is_none() {
        return Ok(of_poles(options.law)?.result(lever, None));
    }
    let all = chosen(lever, [free, coupled], start, *options)?;
    // what the residues add to chi square under the same law
    let Ok(without) = of_poles(all.law_choice()) else {
        return Ok(all.result(lever, None));
    };
    let freedom = all.freedom.saturating_sub(without.freedom);
    let chi_square = (all.minimum.cost - without.minimum.cost).max(0.0);
    let p_value = chi_square_tail(chi_square, freedom);
    let used = p_value.is_nan() || p_value >= RESIDUES_MISFIT;
    let test = Some(ResidueTest { chi_square, freedom, p_value, used });
    Ok(if used { all.result(lever, test) } else { of_poles(options.law)?.result(lever, test) })
}

/// The fit under the law that is asked for, or that the data ask for.
fn chosen<'a>(
    lever: &'a FreeLever,
    [free, coupled]: [&'a Ringing; 2],
    start: ContactLaw,
    options: JointOptions,
) -> Result<Solved<'a>, ModelError> {
    let solve = |second: bool, start| solved(lever, [free, coupled], start, second, options.tip_share_error);
    match options.law {
        LawChoice::SpringDamper => solve(false, start),
        LawChoice::SecondOrder => solve(true, start),
        LawChoice::Auto => {
            let first = solve(false, start)?;
            // without a degree of freedom left nothing speaks for the term
            if first.freedom < 2 {
                return Ok(first);
            }
            match solve(true, first.law()) {
                Ok(mut second) if first.minimum.cost - second.minimum.cost > LAW_GAIN => {
                    second.law_gain = Some(first.minimum.cost - second.minimum.cost);
                    Ok(second)
                }
                _ => Ok(first),
            }
        }
    }
}

fn solved<'a>(
    lever: &'a FreeLever,
    [free, coupled]: [&'a Ringing; 2],
    start: ContactLaw,
    second: bool,
    share_error: Option<f64>,
) -> Result<Solved<'a>, ModelError> {
    let parameters = quantities(lever, free, start, second, share_error);
    let model = JointModel::new(lever, free, coupled, parameters)
        .ok_or(ModelError::Degenerate("no linear contact on this lever has as many poles near the measured ones"))?;
    let values: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
    let step: Vec<f64> = model.parameters.iter().map(|p| p.step).collect();
    let minimum = minimise(&|values| model.residuals(values), values, &step)?;
    Ok(Solved::new(model, minimum))
}
