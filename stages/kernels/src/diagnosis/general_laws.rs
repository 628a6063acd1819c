//! Forces that any smooth structure could have, as causes that have no name.

use crate::causes::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// A force on the first mode that it sees: minus `w^2 strength` times a sum of products of the motions that it sees.
pub(super) struct GeneralForce {
    about: About,
    law: Law,
}

enum Law {
    Sum(&'static [&'static [(Quantity, usize)]]),
    /// The sign of the rate, rounded below this share of the largest.
    Sign(f64),
}

const ONE: &[Need] = &[Need::Run, Need::Mode];
const TWO: &[Need] = &[Need::Run, Need::TwoModes];

impl GeneralForce {
    const fn new(needs: &'static [Need], law: Law) -> Self {
        let about = About {
            id: "general-force",
            physics: "a force by a product of deflections and rates",
            part: Part::Lever,
            needs,
            parameters: &[Parameter {
                name: "strength",
                unit: "1",
                meaning: "force over the mode's stiffness at a motion of 1",
                low: -10.0,
                high: 10.0,
            }],
            class: &["general-force"],
            resembles: "",
            next_measurement: "",
            identifiable: Identifiable::Shape,
            source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979",
        };
        Self { about, law }
    }

    const fn of_one(products: &'static [&'static [(Quantity, usize)]]) -> Self {
        Self::new(ONE, Law::Sum(products))
    }

    const fn of_two(products: &'static [&'static [(Quantity, usize)]]) -> Self {
        Self::new(TWO, Law::Sum(products))
    }

    /// What it is at those modes.
    pub fn words(&self, modes: &[usize]) -> String {
        let mode = |place: usize| modes.get(place).copied().unwrap_or(place) + 1;
        match self.law {
            Law::Sign(_) => format!("the sign of the rate of mode {}", mode(0)),
            Law::Sum(products) => {
                let product = |factors: &&[(Quantity, usize)]| words(factors, mode);
                products.iter().map(product).collect::<Vec<_>>().join(" plus ")
            }
        }
    }

    /// Its value at a motion of its one mode, deflection and rate / w; none where it sees two.
    pub fn at(&self, state: [f64; 2]) -> Option<f64> {
        match self.law {
            _ if self.about.modes() > 1 => None,
            Law::Sign(rounded) => Some((state[1] / rounded).tanh()),
            Law::Sum(products) => {
                let product =
                    |factors: &&[(Quantity, usize)]| factors.iter().map(|(of, _)| of.of(state)).product::<f64>();
                Some(products.iter().map(product).sum())
            }
        }
    }
}

/// A product in words.
fn words(factors: &[(Quantity, usize)], mode: impl Fn(usize) -> usize) -> String {
    let mut counted: Vec<((Quantity, usize), usize)> = Vec::new();
    for factor in factors {
        match counted.iter_mut().find(|(other, _)| other == factor) {
            Some((_, times)) => *times += 1,
            None => counted.push((*factor, 1)),
        }
    }
    let one = |((of, place), times): &((Quantity, usize), usize)| {
        let name = match of {
            Quantity::Deflection => "deflection",
            Quantity::Rate => "rate",
            Quantity::Distance => "|deflection|",
            Quantity::Speed => "|rate|",
            Quantity::Amplitude => "amplitude",
        };
        let power = if *times > 1 { format!("^{times}") } else { String::new() };
        format!("{name}{power} of mode {}", mode(*place))
    };
    if counted.is_empty() {
        "a constant".to_owned()
    } else {
        counted.iter().map(one).collect::<Vec<_>>().join(" times ")
    }
}

impl Cause for GeneralForce {
    fn about(&self) -> &About {
        &self.about
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let strength = values[0];
        match self.law {
            Law::Sum(products) => effects
                .modal_force
                .extend(products.iter().map(|factors| ModalForce::Power(PowerLaw::new(0, strength, factors)))),
            Law::Sign(rounded) => effects.modal_force.push(ModalForce::law(move |motion, acceleration| {
                if let (Some(a), Some(v), Some(w)) =
                    (acceleration.first_mut(), motion.velocity.first(), motion.omega.first())
                {
                    *a -= strength * w * w * (v / w / rounded).tanh();
                }
            })),
        }
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.003 / scene.level_v]]
    }
}

const Q: (Quantity, usize) = (Quantity::Deflection, 0);
const P: (Quantity, usize) = (Quantity::Rate, 0);
const A: (Quantity, usize) = (Quantity::Amplitude, 0);
/// Of the second mode.
const R: (Quantity, usize) = (Quantity::Deflection, 1);
const S: (Quantity, usize) = (Quantity::Rate, 1);

/// Absolute values, a constant, the sign, and all products up to degree three.
pub(super) static LOW: [GeneralForce; 15] = [
    GeneralForce::of_one(&[&[(Quantity::Distance, 0), Q]]),
    GeneralForce::of_one(&[&[(Quantity::Speed, 0), P]]),
    GeneralForce::of_one(&[&[(Quantity::Distance, 0)]]),
    GeneralForce::of_one(&[&[(Quantity::Speed, 0)]]),
    GeneralForce::of_one(&[&[]]),
    GeneralForce::of_one(&[&[A, P]]),
    GeneralForce::of_one(&[&[A, Q]]),
    GeneralForce::new(ONE, Law::Sign(0.02)),
    GeneralForce::of_one(&[&[Q, Q]]),
    GeneralForce::of_one(&[&[Q, P]]),
    GeneralForce::of_one(&[&[P, P]]),
    GeneralForce::of_one(&[&[Q, Q, Q]]),
    GeneralForce::of_one(&[&[Q, Q, P]]),
    GeneralForce::of_one(&[&[Q, P, P]]),
    GeneralForce::of_one(&[&[P, P, P]]),
];

/// All products of degrees four and five, those first that a spring or a loss by amplitude has next.
pub(super) static HIGH: [GeneralForce; 11] = [
    GeneralForce::of_one(&[&[Q, Q, Q, Q, Q]]),
    GeneralForce::of_one(&[&[Q, Q, Q, Q, P]]),
    GeneralForce::of_one(&[&[Q, Q, Q, Q]]),
    GeneralForce::of_one(&[&[Q, Q, Q, P]]),
    GeneralForce::of_one(&[&[Q, Q, P, P]]),
    GeneralForce::of_one(&[&[Q, P, P, P]]),
    GeneralForce::of_one(&[&[P, P, P, P]]),
    GeneralForce::of_one(&[&[Q, Q, Q, P, P]]),
    GeneralForce::of_one(&[&[Q, Q, P, P, P]]),
    GeneralForce::of_one(&[&[Q, P, P, P, P]]),
    GeneralForce::of_one(&[&[P, P, P, P, P]]),
];

/// On one mode by another's motion: products of degree two, and its own motion times the square of the other's
/// amplitude.
pub(super) static COUPLINGS: [GeneralForce; 9] = [
    GeneralForce::of_two(&[&[Q, R]]),
    GeneralForce::of_two(&[&[Q, S]]),
    GeneralForce::of_two(&[&[P, R]]),
    GeneralForce::of_two(&[&[P, S]]),
    GeneralForce::of_two(&[&[R, R]]),
    GeneralForce::of_two(&[&[R, S]]),
    GeneralForce::of_two(&[&[S, S]]),
    GeneralForce::of_two(&[&[Q, R, R], &[Q, S, S]]),
    GeneralForce::of_two(&[&[P, R, R], &[P, S, S]]),
];

/// Of [`HIGH`], those of each mode where there are several.
const OF_EACH: usize = 2;

/// Those that a model of so many modes is held against, each at every place; fewer where many modes have them.
pub(super) fn general_forces(modes: usize) -> Vec<(&'static GeneralForce, Vec<usize>)> {
    let mut all = Vec::new();
    for mode in 0..modes {
        let high = if modes > 1 { &HIGH[..OF_EACH] } else { &HIGH[..] };
        all.extend(LOW.iter().chain(high).map(|force| (force, vec![mode])));
        for other in (0..modes).filter(|other| *other != mode) {
            all.extend(COUPLINGS.iter().map(|force| (force, vec![mode, other])));
        }
    }
    all
}
