//! What of the shape is estimated, and what is known of it.

use super::knowledge::{Knowledge, Known, Quantity};
use super::modal_form::Exponential;
use super::normal::{Freedom, Prior};
use super::options::RingdownOptions;

/// Everything but the residue of the strongest mode, which fixes scale and time of the shape.
pub(super) fn freedom(exponentials: &[Exponential], options: &RingdownOptions) -> Freedom {
    let strongest = exponentials
        .iter()
        .enumerate()
        .filter(|(_, e)| e.oscillates())
        .max_by(|a, b| a.1.residue.norm().total_cmp(&b.1.residue.norm()))
        .map_or(0, |(i, _)| i);
    let (mut shared, mut priors, mut first) = (Vec::new(), Vec::new(), 0);
    for (i, e) in exponentials.iter().enumerate() {
        let count = e.parameters();
        let free = if i == strongest { count / 2 } else { count };
        shared.extend(first..first + free);
        priors.extend((0..count).map(|k| {
            (!e.oscillates() && k == 0 && options.real_pole_std.is_finite())
                .then(|| Prior { mean: e.pole.re, std: options.real_pole_std * e.pole.re.abs() })
        }));
        first += count;
    }
    let own = if options.drift { vec![0, 1, 2, 3] } else { vec![0, 1, 2] };
    let mut freedom =
        Freedom { limits: vec![None; first], resonance: vec![false; exponentials.len()], shared, priors, own };
    options.known.iter().for_each(|known| tell(&mut freedom, exponentials, known));
    freedom
}

/// Adds what is known of one parameter.
fn tell(freedom: &mut Freedom, exponentials: &[Exponential], known: &Known) {
    let Some(place) = known.quantity.place(exponentials) else { return };
    let Some(parameter) = parameter(known.quantity, exponentials) else { return };
    freedom.resonance[place] = exponentials[place].oscillates();
    freedom.priors[parameter] = None;
    let factor = known.quantity.factor();
    match known.knowledge {
        Knowledge::Free => {}
        Knowledge::Fixed(_) => freedom.shared.retain(|&other| other != parameter),
        Knowledge::Between(a, b) => {
            freedom.limits[parameter] = Some(((a * factor).min(b * factor), (a * factor).max(b * factor)));
        }
        Knowledge::About(mean, std) => {
            freedom.priors[parameter] = Some(Prior { mean: mean * factor, std: std * factor.abs() });
        }
    }
}

/// Which shared parameter a quantity is, in the coordinates of its mode's resonance.
pub(super) fn parameter(quantity: Quantity, exponentials: &[Exponential]) -> Option<usize> {
    let place = quantity.place(exponentials)?;
    let first: usize = exponentials[..place].iter().map(Exponential::parameters).sum();
    Some(first + usize::from(matches!(quantity, Quantity::QualityFactor(_))))
}
