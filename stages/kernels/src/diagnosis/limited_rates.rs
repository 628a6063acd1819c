//! What a limited rate would do to what is seen, among the general terms of a lack of fit.

use super::data::Bench;
use super::fit::Fit;
use super::score_test::first_channel;
use crate::causes::built_in;
use crate::effects::{Effects, Passage, pass};

/// Limits over the largest rate that is simulated.
const LIMITS: [f64; 3] = [0.9, 0.75, 0.6];

/// The effects with a share `small` of what each limit does to the output, in one channel.
///
/// Why: the few fastest flanks hold all that a limit does; no power of the motion predicts it, and the scatter between
/// blocks would count it as noise.
pub(super) fn limited(bench: &Bench, fit: &Fit, effects: &Effects, small: f64) -> Vec<Effects> {
    let seen = first_channel(bench, &fit.simulated);
    let fastest = seen.windows(2).fold(0.0, |most: f64, pair| most.max((pair[1] - pair[0]).abs())) / bench.interval_s;
    let (Some(limit), true) = (built_in("slew-rate"), bench.layout.channels == 1 && fastest > 0.0) else {
        return Vec::new();
    };
    let with = |share: f64| {
        let mut own = Effects::default();
        limit.add(&[1.0 / (share * fastest)], &mut own);
        let mut effects = effects.clone();
        effects.optics.push(Passage::path(move |times, values| {
            let mut slow = values.to_vec();
            pass(&own.optics, |k| times[k], &mut slow);
            values.iter_mut().zip(slow).for_each(|(value, slow)| *value += small * (slow - *value));
        }));
        effects
    };
    LIMITS.map(with).to_vec()
}
