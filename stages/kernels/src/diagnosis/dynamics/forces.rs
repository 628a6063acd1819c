//! The forces of causes on the modes of several motions at once.

use super::lane::{LANES, Lane};
use crate::effects::{Effects, Factor, ModalForce, Motion, PowerLaw, Quantity};

/// Products of powers that any of the motions has, each with its strength in each; and each motion's other forces.
pub(super) struct Forces<'a> {
    /// By the mode that they act on.
    terms: Vec<Vec<Term>>,
    laws: [Vec<&'a ModalForce>; LANES],
    /// Whether there are others.
    any_law: bool,
    /// Columns of the table that any term reads.
    wanted: [bool; COLUMNS],
    modes: usize,
}

/// A product of three entries of the table: no branch and no loop where most of a diagnosis is spent.
struct Term {
    strength: Lane,
    entries: [Entry; 3],
    /// What three entries cannot hold.
    further: Vec<Entry>,
    factors: Vec<Factor>,
}

/// An entry of the table: of which mode, in which column.
type Entry = (usize, usize);

/// Columns of the table: deflection, rate, their absolute values, their squares, amplitude, one.
const COLUMNS: usize = 8;
const ONE: usize = 7;

/// Every quantity of every mode at an instant.
pub(super) type Table<const N: usize> = [[Lane; COLUMNS]; N];

/// A table in which nothing has been written but ones.
pub(super) fn table<const N: usize>() -> Table<N> {
    [[Lane::splat(1.0); COLUMNS]; N]
}

impl<'a> Forces<'a> {
    /// Those of each motion's effects, on so many modes.
    pub fn new(effects: &[&'a Effects], modes: usize) -> Self {
        let (terms, laws) = ((0..modes).map(|_| Vec::new()).collect(), std::array::from_fn(|_| Vec::new()));
        let mut forces = Self { terms, laws, any_law: false, wanted: [false; COLUMNS], modes };
        for (l, effects) in effects.iter().enumerate() {
            for force in &effects.modal_force {
                match force {
                    ModalForce::Law(..) => {
                        forces.laws[l].push(force);
                        forces.any_law = true;
                    }
                    ModalForce::Power(law) => forces.take(l, law),
                }
            }
        }
        // one order whatever motions are together: each has the sums, to the last bit, that it has by itself
        forces.terms.iter_mut().for_each(|terms| terms.sort_by(|a, b| a.factors.cmp(&b.factors)));
        forces
    }

    /// Takes a product for one of the motions; one on or of modes that are not there is none.
    fn take(&mut self, l: usize, law: &PowerLaw) {
        if law.factors.iter().any(|factor| factor.mode >= self.modes) {
            return;
        }
        let Some(terms) = self.terms.get_mut(law.on) else { return };
        let mut factors = law.factors.clone();
        factors.sort_unstable();
        if let Some(term) = terms.iter_mut().find(|term| term.factors == factors) {
            term.strength.0[l] += law.strength;
            return;
        }
        let mut strength = Lane::default();
        strength.0[l] = law.strength;
        let entries = entries(&factors);
        entries.iter().for_each(|(_, column)| self.wanted[*column] = true);
        let mut entries = entries.into_iter();
        let three = std::array::from_fn(|_| entries.next().unwrap_or((0, ONE)));
        terms.push(Term { strength, entries: three, further: entries.collect(), factors });
    }

    /// Takes force / omega^2 of each mode to what drives it.
    #[inline(always)]
    pub fn add<const N: usize>(
        &self,
        states: &[[Lane; 2]; N],
        omega: &[Lane; N],
        table: &mut Table<N>,
        drive: &mut [Lane; N],
    ) {
        for s in 0..N {
            let [q, p] = states[s];
            let row = &mut table[s];
            row[0] = q;
            row[1] = p;
            // what no term reads is not written
            if self.wanted[2] {
                row[2] = q.abs();
            }
            if self.wanted[3] {
                row[3] = p.abs();
            }
            if self.wanted[4] {
                row[4] = q * q;
            }
            if self.wanted[5] {
                row[5] = p * p;
            }
            if self.wanted[6] {
                row[6] = (q * q + p * p).sqrt();
            }
        }
        let at = |(mode, column): Entry| table[mode][column & (COLUMNS - 1)];
        for (terms, drive) in self.terms.iter().zip(drive.iter_mut()) {
            let mut sum = *drive;
            for term in terms {
                let [a, b, c] = term.entries;
                let mut product = term.strength * at(a) * (at(b) * at(c));
                for entry in &term.further {
                    product = product * at(*entry);
                }
                sum = sum - product;
            }
            *drive = sum;
        }
        if self.any_law {
            self.add_laws(states, omega, drive);
        }
    }

    #[inline(never)]
    fn add_laws<const N: usize>(&self, states: &[[Lane; 2]; N], omega: &[Lane; N], drive: &mut [Lane; N]) {
        for (l, laws) in self.laws.iter().enumerate().filter(|(_, laws)| !laws.is_empty()) {
            let position: [f64; N] = std::array::from_fn(|s| states[s][0].0[l]);
            let omega: [f64; N] = std::array::from_fn(|s| omega[s].0[l]);
            let velocity: [f64; N] = std::array::from_fn(|s| states[s][1].0[l] * omega[s]);
            let mut acceleration = [0.0; N];
            let motion = Motion {
                position: &position[..self.modes],
                velocity: &velocity[..self.modes],
                omega: &omega[..self.modes],
                gap: if self.modes > 0 { position[0] } else { 0.0 },
                thermal: 0.0,
            };
            laws.iter().for_each(|law| law.add(&motion, &mut acceleration[..self.modes]));
            for s in 0..self.modes {
                drive[s].0[l] += acceleration[s] / (omega[s] * omega[s]);
            }
        }
    }
}

/// Entries of the table whose product sorted factors are; two equal ones are a square.
fn entries(sorted: &[Factor]) -> Vec<Entry> {
    let mut left = sorted.to_vec();
    let mut entries = Vec::new();
    while let Some(factor) = left.pop() {
        let square = match factor.of {
            Quantity::Deflection | Quantity::Distance => 4,
            Quantity::Rate | Quantity::Speed => 5,
            Quantity::Amplitude => ONE,
        };
        if left.last() == Some(&factor) && square != ONE {
            left.pop();
            entries.push((factor.mode, square));
        } else {
            entries.push((factor.mode, column(factor.of)));
        }
    }
    entries
}

fn column(quantity: Quantity) -> usize {
    match quantity {
        Quantity::Deflection => 0,
        Quantity::Rate => 1,
        Quantity::Distance => 2,
        Quantity::Speed => 3,
        Quantity::Amplitude => 6,
    }
}
