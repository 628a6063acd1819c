//! What of the shape is estimated, and what is known of it.

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
    let own = if options.slope { vec![0, 1, 2, 3] } else { vec![0, 1, 2] };
    Freedom { shared, priors, own }
}
