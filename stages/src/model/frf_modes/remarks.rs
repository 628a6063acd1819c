//! What the user should know of a fit.

use super::super::count::Count;
use super::FrfModeFit;
use crate::artifacts::{Frf, Quantity, quantity_of_unit};
use afmid_kernels::frf_modes::{FrfMode, FrfModes};

/// Phase collinearity below which a shape is said to turn. Why: it is that of points whose phases scatter by 24 degrees.
const TURNING: f64 = 0.5;
/// Lines that count as one from which on it is said. Why: a Hann window makes two alike.
const ALIKE: f64 = 3.0;
/// Variance that a fit leaves round a mode, over that of the responses' noise, from which on it is said. Why: errors of
/// responses are known to a factor of two at worst.
const LACKS: f64 = 9.0;
/// Standard errors below zero from which on a modal constant has the wrong sign. Why: chance does so in a thousandth.
const WRONG: f64 = 3.0;

/// The driving point, if the responses have a scale of mass: displacement, velocity or acceleration per newton.
pub(super) fn driving_point(frf: &Frf<'_>) -> Option<usize> {
    let scaled = frf.quantity != Quantity::Transfer && quantity_of_unit(frf.unit) == Some(frf.quantity);
    frf.driving_point.filter(|_| scaled)
}

/// A fit with what it was of.
pub(super) struct Remarks<'a> {
    pub fit: &'a FrfModeFit,
    pub found: &'a FrfModes,
    pub frf: &'a Frf<'a>,
}

impl Remarks<'_> {
    /// All of them.
    pub fn all(&self) -> Vec<String> {
        [self.minimum(), self.count(), self.turning(), self.mass(), self.signs(), self.lacking(), self.alike()]
            .into_iter()
            .flatten()
            .collect()
    }

    fn minimum(&self) -> Option<String> {
        let verdict = self.found.verdict;
        let distance = verdict.distance;
        (!verdict.converged).then(|| format!("no minimum: the last step promised {distance:.2} standard errors"))
    }

    fn count(&self) -> Option<String> {
        let (found, most) = (self.found.modes.len(), self.fit.max_modes);
        match self.fit.modes {
            Count::Auto if found == most => {
                Some(format!("`modes = \"auto\"` found {most}, all that `max_modes` allows: there may be more"))
            }
            Count::Fixed(wanted) if found != wanted => Some(format!(
                "`modes = {wanted}`, found {found}: others gain nothing, lie beyond the band, or have no values left"
            )),
            _ => None,
        }
    }

    /// Numbers of the modes for which something holds, for a sentence; none where it holds for none.
    fn numbers(&self, holds: impl Fn(&FrfMode) -> bool) -> Option<String> {
        let modes = self.found.modes.iter().enumerate().filter(|(_, mode)| holds(mode));
        let numbers: Vec<String> = modes.map(|(number, _)| (number + 1).to_string()).collect();
        (!numbers.is_empty()).then(|| numbers.join(", "))
    }

    fn turning(&self) -> Option<String> {
        let numbers = self.numbers(|mode| mode.phase_collinearity < TURNING)?;
        Some(format!(
            "phase collinearity below {TURNING} of mode {numbers}: points of a lightly damped structure move in phase \
             or against it; such shapes are of modes that are too close, or of no mode"
        ))
    }

    fn mass(&self) -> Option<String> {
        let unscaled = self.frf.driving_point.is_some() && driving_point(self.frf).is_none();
        let unit = if self.frf.unit.is_empty() { "without a unit" } else { self.frf.unit };
        unscaled.then(|| {
            format!(
                "a driving point, but values of a {} ({unit}): shapes at unit modal mass need displacement, velocity \
                 or acceleration per newton",
                self.frf.quantity.name()
            )
        })
    }

    fn signs(&self) -> Option<String> {
        let negative = |mode: &FrfMode| mode.modal_constant.is_some_and(|found| found.value < -WRONG * found.std);
        let numbers = self.numbers(negative)?;
        Some(match self.found.modes.iter().all(negative) {
            true => "the response at the driving point is of the wrong sign in all modes: output and input point in \
                     opposite directions; say so with `directions`"
                .to_owned(),
            false => format!(
                "the response at the driving point is of the wrong sign in mode {numbers}: a passive structure moves \
                 with the force there in every mode, so the points are not one, or these are no modes; their shapes at \
                 unit modal mass have no meaning"
            ),
        })
    }

    fn lacking(&self) -> Option<String> {
        let modes = (1..).zip(&self.found.modes).filter(|(_, mode)| mode.lack_of_fit > LACKS);
        let factors: Vec<String> =
            modes.map(|(number, mode)| format!("{number} ({:.0})", mode.lack_of_fit.sqrt())).collect();
        (!factors.is_empty()).then(|| {
            format!(
                "the fit leaves more than the responses' noise round modes {}: their standard errors are widened by the \
                 factors given; what was measured is not linear there, or modes are missing",
                factors.join(", ")
            )
        })
    }

    fn alike(&self) -> Option<String> {
        let alike = self.found.modes.iter().map(|mode| mode.correlation).fold(1.0, f64::max);
        (alike > ALIKE).then(|| {
            format!(
                "neighbouring lines have like residuals: some {alike:.0} of them count as one. Standard errors are \
                 {:.1} times larger for it; windows, zero padding or modes that are missing leave such residuals",
                alike.sqrt()
            )
        })
    }
}
