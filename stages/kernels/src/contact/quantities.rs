//! The numbers of the joint estimate, where they start, and what is known of them.

use super::detector::{Detector, release};
use super::law::ContactLaw;
use super::lever::FreeLever;
use super::ringing::Ringing;

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Quantity {
    Stiffness,
    Damping,
    Inertia,
    /// Logarithm of a mode's tip share.
    Share(usize),
    PoleRe(usize),
    PoleIm(usize),
    /// What the detector sees of a mode, over the first one's.
    Gain(usize),
    /// Logarithm of a corner of the detector.
    Corner,
}

pub(super) struct Parameter {
    pub quantity: Quantity,
    pub start: f64,
    /// A change for differences: small beside what bends the model, large beside its rounding.
    pub step: f64,
    /// Standard error of the start where it is known beforehand.
    pub prior: Option<f64>,
}

/// Changes for differences, of numbers of order one: central ones are right to 1e-10, and rounding over them is 1e-10.
const STEP: f64 = 1e-5;
/// The same of a pole: a thousandth of a linewidth of Q = 1e4.
const POLE_STEP: f64 = 1e-7;
/// The corners' logarithms are held to this round the start: residues show the chain as a whole, and single corners
/// would run away.
const CORNER_WIDTH: f64 = 0.5;

/// All numbers of an estimate.
///
/// `share_error` is the relative standard error of the given tip shares: none where nothing is known of them, zero
/// where they are exact.
pub(super) fn quantities(
    lever: &FreeLever,
    free: &Ringing,
    start: ContactLaw,
    second_order: bool,
    share_error: Option<f64>,
) -> Vec<Parameter> {
    let mut all = of_the_contact(lever, free, start, second_order);
    if share_error != Some(0.0) {
        let share = |n: usize| Parameter {
            quantity: Quantity::Share(n),
            start: lever.tip_share[n].ln(),
            step: STEP,
            prior: share_error,
        };
        all.extend((1..lever.tip_share.len()).map(share));
    }
    let width = free.width();
    for (n, pole) in free.poles.iter().enumerate() {
        let parts = [(Quantity::PoleRe(n), pole.re), (Quantity::PoleIm(n), pole.im)];
        for (part, (quantity, start)) in parts.into_iter().enumerate() {
            // a number without error is given
            if free.covariance[(width * n + part, width * n + part)] > 0.0 {
                all.push(Parameter { quantity, start, step: POLE_STEP * pole.norm(), prior: None });
            }
        }
    }
    if let Some(reference) = free.reference() {
        all.extend(in_front(free, reference));
    }
    all
}

fn of_the_contact(lever: &FreeLever, free: &Ringing, start: ContactLaw, second_order: bool) -> Vec<Parameter> {
    let number = |quantity, start, step| Parameter { quantity, start, step, prior: None };
    let scale = STEP * start.stiffness_n_per_m.abs().max(lever.stiffness_n_per_m.value);
    let highest = free.poles.iter().map(|p| p.norm()).fold(1.0, f64::max);
    let mut all = vec![
        number(Quantity::Stiffness, start.stiffness_n_per_m, scale),
        number(Quantity::Damping, start.damping_n_s_per_m, scale / highest),
    ];
    if second_order {
        all.push(number(Quantity::Inertia, start.inertia_kg, scale / (highest * highest)));
    }
    all
}

/// Gains and detector, from the free residues.
fn in_front(free: &Ringing, reference: usize) -> Vec<Parameter> {
    let detector = Detector::start(free, reference, free.real_poles);
    let size: Vec<f64> = match &free.residues {
        Some(residues) => {
            free.poles.iter().zip(residues).map(|(&p, r)| r.norm() / (release(p) * detector.at(p)).norm()).collect()
        }
        None => Vec::new(),
    };
    let gain = |n: usize| {
        let start = size[n] / size[0];
        Parameter { quantity: Quantity::Gain(n), start, step: STEP * start, prior: None }
    };
    let corner = |d: &f64| {
        let (quantity, start) = (Quantity::Corner, d.ln());
        Parameter { quantity, start, step: STEP, prior: Some(CORNER_WIDTH) }
    };
    (1..size.len()).map(gain).chain(detector.corner.iter().map(corner)).collect()
}
