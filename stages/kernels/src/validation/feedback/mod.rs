//! Whether a measured input follows the output: feedback that makes open-loop estimates wrong.

mod lattice;
mod score;
#[cfg(test)]
mod tests;

use lattice::Lattice;
use score::{Known, effective_blocks, score};

use crate::linear_algebra::dot_in_lanes;
use crate::spectra::period_samples;

/// Share of the input's innovation that feedback predicts at least, and of the input that goes with what is left. Why:
/// with 100,000 samples any leftover is significant. A cubic spring that no model has predicts up to 0.7 % of measured
/// multisines, noise of 3 % of the input up to 1.5 % of its innovation; what feedback adds to an input of less than
/// half a hundredth of its power moves an estimate by less than the noise over the signal.
const SHARES: [f64; 2] = [0.02, 0.005];
/// Share of that of what is left from which on a function of the input alone counts as a predictor of it. Why: both then
/// see what its linear prediction does not, as the next frequency of a sweep.
const RIVAL_SHARE: f64 = 0.25;
/// Probability of a rival's score by chance, at most.
const RIVAL_P_VALUE: f64 = 0.05;

/// Lags of what is left at most, the first being 1: without a delay of one sample cause and effect cannot be distinguished.
const LAGS: usize = 20;
/// Lags at least; shorter records are not tested.
const LEAST_LAGS: usize = 4;
/// Samples for each lag: 80 blocks of twice the lags.
const SAMPLES_EACH: usize = 160;
/// Largest orders of the predictions of the input and of what is left from their own past, and samples for each order.
const ORDERS: [usize; 2] = [60, 30];
const SAMPLES_EACH_ORDER: usize = 20;
/// Lags of the model's output that are part of what is known: the state of an oscillator twice.
const RESPONSE_LAGS: usize = 4;
/// Samples that are tested at most: 2 % of an innovation is then known to a tenth.
const MOST_SAMPLES: usize = 10_000;
/// Power of the innovation over that of the input below which its own past predicts it up to rounding.
const PREDICTED: f64 = 1e-10;

/// Parts that are predicted each by itself, up to this order, and share of the squared error of one prediction of all from
/// which on a part's own one knows more than the spectrum. Why: noise of any colour leaves 0.9 and more, a sweep less than
/// 0.01.
const LOCAL_PARTS: usize = 8;
const LOCAL_ORDER: usize = 10;
const LOCAL_SHARE: f64 = 0.5;

/// Samples one after the other of a measured input, and what a model makes of it.
#[derive(Debug, Clone, Copy)]
pub struct Driven<'a> {
    /// The input.
    pub input: &'a [f64],
    /// Other inputs of the same system.
    pub others: &'a [&'a [f64]],
    /// What the model makes of all inputs.
    pub response: &'a [f64],
    /// The measured output less that; NaN where it is missing.
    pub left: &'a [f64],
}

/// How an input goes with what a model left of the output before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// Share of the variance of the input's innovation, of what its own past does not predict, that the past of what is left
    /// predicts.
    pub share: f64,
    /// Share of the input's variance that goes with the innovations of what is left, before it and at the same sample.
    pub of_input: f64,
    /// Probability of so close a relation where there is no feedback.
    pub p_value: f64,
    /// Lags of what is left.
    pub lags: usize,
}

impl Feedback {
    /// Whether the input follows the output: unlikely by chance, and large enough to matter.
    pub fn is_found(&self, level: f64) -> bool {
        self.p_value < level && self.share > SHARES[0] && self.of_input > SHARES[1]
    }
}

/// Tests whether an input follows the output.
///
/// # Model
/// `e = v + f(u, u before)`: what a model leaves is noise and what the model gets wrong. In open loop v is independent of
/// the input, and past e adds nothing to what the input's own past predicts of it. With feedback `u = r - K y` it does.
/// Lags begin at 1: a loop without delay whose output noise is white is not seen, and biases no model that has one.
/// # Method
/// The input's innovation by Burg's lattice, order by Akaike's criterion up to 60, and by four lags of the model's output and
/// twenty of other inputs, which remember more; e whitened likewise up to order 30. Score test of the innovation on 4 to 20
/// lags of whitened e with what is known taken out, by sums over blocks: neither bursts nor sweeps change its level. None
/// where that test says nothing: stretches whose periods repeat, an input that its own past predicts to 1e-10 of its power,
/// or by a law that changes (sweeps), fewer than some 800 samples, innovations in a few blocks alone (steps, hits), and an
/// input that the whitened model's output, its square or its cube predict as well: these are functions of the input alone.
/// # Shapes
/// All slices of a stretch have one length; stretches are of one system. Of more than 10,000 samples the middle of each
/// stretch is taken.
/// # Units
/// Any.
/// # Accuracy
/// Level by simulation: tests of this module. Noise of the input's own measurement above 3 % of it looks alike where the
/// input is smooth: the output tells more of the input than the input does. Some 20 ms for 10,000 samples and more.
/// # Source
/// C. W. J. Granger, Econometrica 37 (1969) 424; L. Ljung, System Identification, 2nd ed., 1999, sections 13.4 and 16.6;
/// T. Soderstrom, P. Stoica, System Identification, 1989, section 10.3.
pub fn feedback(stretches: &[Driven<'_>]) -> Option<Feedback> {
    let tested = Tested::new(stretches)?;
    if tested.is_locally_predicted()? {
        return None;
    }
    let lattice = Lattice::new(&tested.input, ORDERS[0].min(tested.count / SAMPLES_EACH_ORDER))?;
    if lattice.left < PREDICTED {
        return None;
    }
    let known = Known::new(tested.known(&lattice));
    let lags = (tested.rows() / SAMPLES_EACH).min(LAGS);
    let innovation = known.taken_out(&[tested.lagged(&lattice.forward, 0)]).pop()?;
    if lags < LEAST_LAGS || effective_blocks(&innovation, lags) < 2.0 * lags as f64 {
        return None;
    }
    let of = |whitened: &[Vec<f64>]| {
        let columns: Vec<Vec<f64>> = (1..=lags).map(|lag| tested.lagged(whitened, lag)).collect();
        score(&known.taken_out(&columns), &innovation)
    };
    let whitened = tested.whitened(&tested.left)?;
    let found = of(&whitened);
    let is_rival = |power: i32| {
        let made: Vec<Vec<f64>> = tested.response.iter().map(|y| y.iter().map(|y| y.powi(power)).collect()).collect();
        let rival = tested.whitened(&centred(made)).map(|made| of(&made));
        rival.is_some_and(|rival| {
            rival.share > RIVAL_SHARE * found.share.max(SHARES[0]) && rival.p_value < RIVAL_P_VALUE
        })
    };
    let of_input = tested.of_input(&whitened, lags);
    let test = Feedback { share: found.share, of_input, p_value: found.p_value, lags };
    (test.p_value > RIVAL_P_VALUE || !(1..=3).any(is_rival)).then_some(test)
}

/// The series of all stretches that can be tested, each about its mean.
struct Tested {
    input: Vec<Vec<f64>>,
    others: Vec<Vec<Vec<f64>>>,
    response: Vec<Vec<f64>>,
    /// 0 where missing.
    left: Vec<Vec<f64>>,
    /// Samples of all.
    count: usize,
    /// Samples that begin each, of which the past is not known.
    first: usize,
}

impl Tested {
    fn new(stretches: &[Driven<'_>]) -> Option<Self> {
        let first = ORDERS[0].max(ORDERS[1] + LAGS) + 1;
        let tested = |own: &&Driven<'_>| {
            let lengths = [own.response.len(), own.left.len()];
            let same = lengths.into_iter().chain(own.others.iter().map(|u| u.len())).all(|n| n == own.input.len());
            same && own.input.len() > 2 * first && period_samples(&[own.input]).is_none()
        };
        let all: Vec<&Driven<'_>> = stretches.iter().filter(tested).collect();
        let total: usize = all.iter().map(|own| own.input.len()).sum();
        let cut = |values: &[f64]| -> Vec<f64> {
            let length = (values.len() * MOST_SAMPLES).div_ceil(total.max(MOST_SAMPLES)).min(values.len());
            let begin = (values.len() - length) / 2;
            values[begin..begin + length].to_vec()
        };
        let each = |of: fn(&Driven<'_>) -> Vec<f64>| centred(all.iter().map(|own| cut(&of(own))).collect());
        let input = each(|own| own.input.to_vec());
        let inputs = all.iter().map(|own| own.others.len()).min().unwrap_or(0);
        let others = (0..inputs).map(|i| centred(all.iter().map(|own| cut(own.others[i])).collect())).collect();
        let response = each(|own| own.response.to_vec());
        let left = each(|own| own.left.to_vec());
        let count = input.iter().map(Vec::len).sum();
        (count > 0).then_some(Self { input, others, response, left, count, first })
    }

    fn rows(&self) -> usize {
        self.input.iter().map(|u| u.len().saturating_sub(self.first)).sum()
    }

    /// Whether each part's own prediction leaves far less than that of all parts: a sweep's next sample follows from the last
    /// few by a law that changes with its frequency, and anything that knows the frequency predicts it better.
    fn is_locally_predicted(&self) -> Option<bool> {
        let all = Lattice::new(&self.input, LOCAL_ORDER)?;
        let energy = |parts: &[Vec<f64>]| parts.iter().map(|x| dot_in_lanes(x, x)).sum::<f64>();
        let length = self.count.div_ceil(LOCAL_PARTS);
        let parts = self.input.iter().flat_map(|u| u.chunks(length).map(|part| vec![part.to_vec()]));
        let local: f64 = parts.filter_map(|part| Some(Lattice::new(&part, LOCAL_ORDER)?.left * energy(&part))).sum();
        Some(local < LOCAL_SHARE * all.left * energy(&self.input))
    }

    /// Values of a series `lag` samples before each sample that is tested.
    fn lagged(&self, series: &[Vec<f64>], lag: usize) -> Vec<f64> {
        series.iter().flat_map(|x| x.get(self.first - lag..x.len() - lag).unwrap_or_default()).copied().collect()
    }

    /// Innovations of a series.
    fn whitened(&self, series: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        Some(Lattice::new(series, ORDERS[1].min(self.count / SAMPLES_EACH_ORDER))?.forward)
    }

    /// What the past of the inputs says: a constant, the input's own past, a few lags of other inputs and of the model's
    /// output.
    fn known(&self, lattice: &Lattice) -> Vec<Vec<f64>> {
        let own = lattice.backward.iter().take(lattice.order);
        let mut columns = vec![vec![1.0; self.rows()]];
        columns.extend(own.map(|error| self.lagged(error, 1)));
        let more = self.others.iter().map(|u| (u, LAGS)).chain([(&self.response, RESPONSE_LAGS)]);
        for (series, lags) in more {
            // none of an input that does not move
            let errors = Lattice::new(series, lags).map_or(Vec::new(), |lattice| lattice.backward);
            columns.extend(errors.iter().map(|error| self.lagged(error, 1)));
        }
        columns
    }

    /// Share of the input's variance that goes with innovations at lags from 0 on, what chance would take taken off.
    fn of_input(&self, innovations: &[Vec<f64>], lags: usize) -> f64 {
        let input = self.lagged(&self.input, 0);
        let energy = |x: &[f64]| dot_in_lanes(x, x).max(f64::MIN_POSITIVE);
        let one = |lag: usize| {
            let own = self.lagged(innovations, lag);
            dot_in_lanes(&input, &own).powi(2) / energy(&own) / energy(&input)
        };
        (0..=lags).map(one).sum::<f64>() - (lags + 1) as f64 / self.rows() as f64
    }
}

/// Each series about its mean, 0 where missing.
fn centred(mut all: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for x in &mut all {
        let there = x.iter().filter(|x| x.is_finite());
        let (sum, count) = there.fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
        let mean = sum / f64::max(count, 1.0);
        x.iter_mut().for_each(|x| *x = if x.is_finite() { *x - mean } else { 0.0 });
    }
    all
}
