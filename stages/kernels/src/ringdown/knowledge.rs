//! What is known beforehand of a mode or a real pole.

use super::modal_form::Exponential;
use crate::model::ModelError;

/// A number of the shape that something can be known of; modes and real poles are counted from 0, ascending in
/// frequency and as started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// `abs(s) / 2 pi` of a mode, Hz.
    Frequency(usize),
    /// `abs(s) / (-2 Re s)` of a mode.
    QualityFactor(usize),
    /// `-s / 2 pi` of a real pole, Hz.
    RealPole(usize),
}

/// What is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// Nothing; a real pole loses the prior of
    /// [`RingdownOptions::real_pole_std`](super::RingdownOptions::real_pole_std).
    Free,
    /// The value: not estimated.
    Fixed(f64),
    /// Least and largest value.
    Between(f64, f64),
    /// Expected value and standard deviation of a Gaussian prior.
    About(f64, f64),
}

/// A number and what is known of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Known {
    /// Of what.
    pub quantity: Quantity,
    /// What.
    pub knowledge: Knowledge,
}

impl Quantity {
    /// Place of its exponential among `exponentials`, modes before real poles.
    pub(super) fn place(self, exponentials: &[Exponential]) -> Option<usize> {
        let (wanted, number) = match self {
            Self::Frequency(mode) | Self::QualityFactor(mode) => (true, mode),
            Self::RealPole(index) => (false, index),
        };
        (0..exponentials.len()).filter(|&i| exponentials[i].oscillates() == wanted).nth(number)
    }

    /// Its value in the search's coordinates over its value.
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Frequency(_) => std::f64::consts::TAU,
            Self::QualityFactor(_) => 1.0,
            Self::RealPole(_) => -std::f64::consts::TAU,
        }
    }
}

impl Knowledge {
    /// The allowed value nearest to `found`; three standard deviations round an expected one.
    pub(crate) fn nearest(self, found: f64) -> f64 {
        match self {
            Self::Free => found,
            Self::Fixed(value) => value,
            Self::Between(least, most) => found.clamp(least, most),
            Self::About(value, std) => found.clamp(value - 3.0 * std, value + 3.0 * std),
        }
    }

    /// The number that it is about.
    pub(crate) fn value(self) -> f64 {
        match self {
            Self::Free => f64::NAN,
            Self::Fixed(value) | Self::Between(value, _) | Self::About(value, _) => value,
        }
    }

    /// Whether it says something of a number above `floor`.
    pub(crate) fn is_possible(self, floor: f64) -> bool {
        match self {
            Self::Free => true,
            Self::Fixed(value) => value > floor && value.is_finite(),
            Self::Between(least, most) => least > floor && least < most && most.is_finite(),
            Self::About(value, std) => value > floor && value.is_finite() && std > 0.0 && std.is_finite(),
        }
    }
}

impl Known {
    /// Errors: a number that cannot be.
    pub fn check(&self) -> Result<(), ModelError> {
        // an oscillation has Q above 1/2
        let floor = if matches!(self.quantity, Quantity::QualityFactor(_)) { 0.5 } else { 0.0 };
        if self.knowledge.is_possible(floor) {
            return Ok(());
        }
        let wanted = "finite, above 0 (a quality factor above 0.5), ascending bounds, a standard deviation above 0";
        Err(ModelError::Parameter { name: "known", found: self.knowledge.value(), wanted })
    }
}

/// Errors: numbers that cannot be, two entries for one quantity.
pub(super) fn check(known: &[Known]) -> Result<(), ModelError> {
    for (i, entry) in known.iter().enumerate() {
        if known[..i].iter().any(|other| other.quantity == entry.quantity) {
            return Err(ModelError::Parameter { name: "known", found: i as f64, wanted: "one entry per quantity" });
        }
        entry.check()?;
    }
    Ok(())
}

/// Takes start values to where they may be. Errors: knowledge of an exponential that is not there.
pub(super) fn obey(exponentials: &mut [Exponential], known: &[Known]) -> Result<(), ModelError> {
    for entry in known {
        let Some(place) = entry.quantity.place(exponentials) else {
            let number = match entry.quantity {
                Quantity::Frequency(i) | Quantity::QualityFactor(i) | Quantity::RealPole(i) => i,
            };
            let wanted = "the number of a mode or real pole that is fitted, from 0";
            return Err(ModelError::Parameter { name: "known", found: number as f64, wanted });
        };
        let pole = exponentials[place].pole;
        let (w, q) = (pole.norm(), pole.norm() / (-2.0 * pole.re));
        let nearest = |value: f64| entry.knowledge.nearest(value / entry.quantity.factor()) * entry.quantity.factor();
        exponentials[place].pole = match entry.quantity {
            Quantity::Frequency(_) => super::coordinates::pole_of(nearest(w), q),
            Quantity::QualityFactor(_) => super::coordinates::pole_of(w, nearest(q)),
            Quantity::RealPole(_) => faer::c64::new(nearest(pole.re), 0.0),
        };
    }
    Ok(())
}
