use std::borrow::Cow;

use super::motion::Run;
use super::{Kind, Modal, Section, Sensed, Span, State, motions, outputs};
use crate::effects::{Effects, ModalForce, Motion, PowerLaw, Quantity};

const SAMPLES: usize = 400;

fn modes() -> Modal {
    let mode = |frequency_hz, loss| Section { kind: Kind::Oscillator, frequency_hz, loss, gain: 0.5 };
    Modal::sum(vec![mode(0.01, 0.01), mode(0.023, 0.02)], Sensed::Deflection, true, 1.0)
}

fn state(level: f64) -> State {
    State { sections: vec![[level, 0.0], [0.3 * level, -0.2 * level]], offsets: Vec::new() }
}

fn run<'a>(state: &'a State, effects: &'a Effects, input: Option<&'a [f64]>, samples: usize) -> Run<'a> {
    let (interval_s, reference_s, stored) = (1.0, 1.0, samples);
    let span = Span { interval_s, begin_s: 0.0, origin_s: 0.0, reference_s, record: 0, steps: 2, samples, stored };
    Run { dynamics: Cow::Owned(modes()), state, nodes: input, effects, span }
}

/// Products of every quantity, up to five factors, of one mode and of two.
fn laws() -> Vec<PowerLaw> {
    use Quantity::{Amplitude as A, Deflection as Q, Distance as D, Rate as P, Speed as S};
    vec![
        PowerLaw::new(0, 0.05, &[(Q, 0), (Q, 0), (Q, 0)]),
        PowerLaw::new(1, 0.04, &[(D, 1), (Q, 1)]),
        PowerLaw::new(0, 0.03, &[(S, 0), (P, 0)]),
        PowerLaw::new(1, 0.02, &[(A, 1), (P, 1)]),
        PowerLaw::new(0, -0.02, &[(Q, 1), (Q, 0), (P, 1)]),
        PowerLaw::new(1, 0.03, &[(Q, 0), (P, 0), (Q, 0), (P, 1), (Q, 1)]),
        PowerLaw::new(0, 0.01, &[(D, 0), (D, 0), (S, 1), (A, 0), (P, 0), (S, 1), (A, 0), (Q, 0)]),
        PowerLaw::new(1, 0.01, &[]),
    ]
}

fn effects(forces: Vec<ModalForce>) -> Effects {
    Effects { modal_force: forces, ..Effects::default() }
}

#[test]
fn a_run_has_the_same_bits_by_itself_and_beside_others() {
    let input: Vec<f64> = (0..5 * (SAMPLES - 1)).map(|k| (0.11 * k as f64).sin()).collect();
    let all = laws();
    // each has other laws, in another order, some none, some one that is no product; lengths differ
    let own: Vec<Effects> = (0..19)
        .map(|i| {
            let mut forces: Vec<ModalForce> =
                (0..i % all.len()).map(|k| ModalForce::Power(all[(i + 3 * k) % all.len()].clone())).collect();
            if i % 5 == 0 {
                forces.push(ModalForce::law(|motion, a| a[0] -= 1e-4 * motion.velocity[0].tanh()));
            }
            effects(forces)
        })
        .collect();
    let states: Vec<State> = (0..own.len()).map(|i| state(0.2 + 0.03 * i as f64)).collect();
    let one = |i: usize| {
        let samples = SAMPLES - 7 * i;
        run(&states[i], &own[i], (!i.is_multiple_of(3)).then(|| &input[..5 * (samples - 1)]), samples)
    };
    let together = outputs(&(0..own.len()).map(one).collect::<Vec<_>>());
    for (i, beside) in together.iter().enumerate() {
        let alone = outputs(&[one(i)]).pop().expect("a run");
        assert_eq!(alone.len(), SAMPLES - 7 * i);
        assert!(alone.iter().all(|y| y.is_finite()), "{i}");
        assert_eq!(
            alone.iter().map(|y| y.to_bits()).collect::<Vec<_>>(),
            beside.iter().map(|y| y.to_bits()).collect::<Vec<_>>(),
            "{i}"
        );
    }
}

#[test]
fn a_product_moves_the_modes_as_the_same_law_does() {
    let start = state(0.8);
    let still = effects(Vec::new());
    let linear = outputs(&[run(&start, &still, None, SAMPLES)]).pop().expect("a run");
    for law in laws() {
        let product = effects(vec![ModalForce::Power(law.clone())]);
        let named = law.clone();
        // written out once more, from velocities as causes see them
        let written = effects(vec![ModalForce::law(move |motion: &Motion<'_>, a| {
            let of = |m: usize| [motion.position[m], motion.velocity[m] / motion.omega[m]];
            let values = named.factors.iter().map(|factor| factor.of.of(of(factor.mode)));
            a[named.on] -= motion.omega[named.on].powi(2) * named.strength * values.product::<f64>();
        })]);
        let both = outputs(&[run(&start, &product, None, SAMPLES), run(&start, &written, None, SAMPLES)]);
        let moved = both[0].iter().zip(&linear).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let apart = both[0].iter().zip(&both[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // rounding of some thousand steps
        assert!(moved > 1e-6 && apart < 1e-12, "{law:?}: {moved} {apart}");
    }
}

#[test]
fn an_accelerometer_shows_the_force_at_once() {
    let hard = effects(vec![ModalForce::Power(PowerLaw::new(0, 2.0, &[(Quantity::Deflection, 0); 3]))]);
    let state = state(0.3);
    let mut seen = run(&state, &hard, None, SAMPLES);
    seen.dynamics.to_mut().sensed = vec![Sensed::Acceleration];
    let states = motions(&[run(&state, &hard, None, SAMPLES)]).remove(0);
    let shown = outputs(&[seen]).remove(0);
    for k in 1..SAMPLES - 1 {
        // a mode's - q'' / w^2 from its rate / w before and after
        let of =
            |(s, section): (usize, &Section)| -(states[s][k + 1][1] - states[s][k - 1][1]) / (2.0 * section.omega());
        let expected: f64 = modes().sections.iter().enumerate().map(of).sum();
        // differences over 0.14 rad are wrong by a sixth of its square; the force makes a fifth of the acceleration
        assert!((shown[k] - expected).abs() < 0.005, "{k}: {} {expected}", shown[k]);
    }
}

#[test]
fn a_relaxation_is_seen_whatever_is_sensed() {
    let nothing = effects(Vec::new());
    let start = State { sections: vec![[1.0, 0.0]], offsets: Vec::new() };
    let section = Section { kind: Kind::Relaxation, frequency_hz: 0.01, loss: 0.0, gain: 0.0 };
    for sensed in [Sensed::Deflection, Sensed::Rate, Sensed::Acceleration] {
        let mut seen = run(&start, &nothing, None, SAMPLES);
        seen.dynamics = Cow::Owned(Modal::sum(vec![section], sensed, false, 1.0));
        let shown = outputs(&[seen]).remove(0);
        for (k, y) in shown.iter().enumerate() {
            let expected = (-section.omega() * k as f64).exp();
            // exact between samples but for rounding
            assert!((y - expected).abs() < 1e-12, "{sensed:?} {k}: {y} {expected}");
        }
    }
}
