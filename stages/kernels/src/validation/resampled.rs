//! Intervals on a model's numbers from the events themselves.

use faer::c64;

use super::bootstrap::{BootstrapSettings, Bootstrapped, bootstrap};
use crate::model::{InnovationsModel, ModelError, transmission_zeros};
use crate::monitor::Monitor;
use crate::pem::{Experiment, PemOptions, refit};

/// What is drawn from, and what is made of each drawing.
pub struct Drawing<'a> {
    /// Aligned responses.
    pub events: &'a [&'a [f64]],
    /// Of each event, relative to the mean.
    pub amplitude: &'a [f64],
    /// Of the mean event.
    pub force: &'a [f64],
    /// The model of all events.
    pub start: &'a InnovationsModel,
    /// Of the frequency response, Hz.
    pub frequencies: &'a [f64],
    /// Whether an offset is fitted.
    pub offset: bool,
    /// Whether a drift is fitted.
    pub drift: bool,
}

/// A pole or a zero with its intervals.
pub struct RootInterval {
    /// Which it is.
    pub pole: bool,
    /// `abs(s) / 2 pi`, Hz.
    pub frequency: Bootstrapped,
    /// `abs(s) / (-2 Re s)`.
    pub quality: Bootstrapped,
}

/// Everything with its intervals.
pub struct Intervals {
    /// Static gain.
    pub gain: Bootstrapped,
    /// Group delay at zero frequency, s, the hold's half sample included.
    pub delay_s: Bootstrapped,
    /// Poles, then zeros, of pairs the upper one.
    pub roots: Vec<RootInterval>,
    /// Logarithm of the magnitude, and phase.
    pub response: Vec<(Bootstrapped, Bootstrapped)>,
}

impl Drawing<'_> {
    /// Draws, refits and gathers. Errors: as [`bootstrap`], and a model without poles.
    pub fn intervals(&self, settings: &BootstrapSettings, monitor: &dyn Monitor) -> Result<Intervals, ModelError> {
        let all: Vec<usize> = (0..self.events.len()).collect();
        let whole = self.fitted(&all, self.start)?;
        let (poles, zeros) = (upper(poles_of(&whole)), upper(transmission_zeros(&whole)?));
        let statistic = |chosen: &[usize]| {
            let model = self.fitted(chosen, &whole)?;
            let rest = model.transfer(c64::new(1.0, 0.0)).re;
            let slope = model.transfer_slope(c64::new(1.0, 0.0)).re;
            let mut values = vec![rest, -model.sample_time_s * slope / rest];
            let near = |found: Vec<c64>, wanted: &[c64]| -> Vec<f64> {
                let found = upper(found);
                wanted.iter().flat_map(|z| frequency_and_quality(nearest(&found, *z), model.sample_time_s)).collect()
            };
            values.extend(near(poles_of(&model), &poles));
            values.extend(near(transmission_zeros(&model)?, &zeros));
            for f in self.frequencies {
                let z = c64::cis(std::f64::consts::TAU * f * model.sample_time_s);
                let (g, g0) = (model.transfer(z), whole.transfer(z));
                // the phase stays within half a turn of the whole's
                values.extend([g.norm().ln(), g0.arg() + (g / g0).arg()]);
            }
            Ok(values)
        };
        let found = bootstrap(self.events.len(), settings, statistic, monitor)?;
        let (rest, others) = found.split_at(2);
        let (roots, response) = others.split_at(2 * (poles.len() + zeros.len()));
        let root = |(i, own): (usize, &[Bootstrapped])| RootInterval {
            pole: i < poles.len(),
            frequency: own[0],
            quality: own[1],
        };
        Ok(Intervals {
            gain: rest[0],
            delay_s: rest[1],
            roots: roots.chunks_exact(2).enumerate().map(root).collect(),
            response: response.chunks_exact(2).map(|own| (own[0], own[1])).collect(),
        })
    }

    /// The model of the chosen events' mean, from another's poles on.
    fn fitted(&self, chosen: &[usize], from: &InnovationsModel) -> Result<InnovationsModel, ModelError> {
        let count = chosen.len() as f64;
        let mut mean = vec![0.0; self.force.len()];
        chosen.iter().for_each(|&i| mean.iter_mut().zip(self.events[i]).for_each(|(m, y)| *m += y / count));
        let scale = chosen.iter().map(|&i| self.amplitude[i]).sum::<f64>() / count;
        let force: Vec<f64> = self.force.iter().map(|u| scale * u).collect();
        let options = PemOptions {
            block_rows: from.order() + 1,
            offset: self.offset,
            drift: self.drift,
            // a thirtieth of a standard error at 8192 samples: small beside what the drawing scatters by
            gradient_tolerance: 3e-4,
            ..PemOptions::default()
        };
        let experiment = Experiment { input: &force, output: &mean };
        Ok(refit(&[experiment], from.sample_time_s, &poles_of(from), &options)?.model)
    }
}

fn poles_of(model: &InnovationsModel) -> Vec<c64> {
    model.sections.iter().flat_map(|section| section.poles()).collect()
}

/// Of a pair the upper one; ascending in frequency.
fn upper(mut roots: Vec<c64>) -> Vec<c64> {
    roots.retain(|z| z.im >= 0.0);
    roots.sort_by(|x, y| x.ln().norm().total_cmp(&y.ln().norm()));
    roots
}

/// The nearest root of the same kind, pair or real; none: NaN.
fn nearest(found: &[c64], wanted: c64) -> c64 {
    let same = found.iter().filter(|z| (z.im > 0.0) == (wanted.im > 0.0));
    let nearest = same.min_by(|x, y| (*x - wanted).norm().total_cmp(&(*y - wanted).norm()));
    nearest.copied().unwrap_or(c64::new(f64::NAN, f64::NAN))
}

fn frequency_and_quality(z: c64, sample_time_s: f64) -> [f64; 2] {
    let s = z.ln() / sample_time_s;
    [s.norm() / std::f64::consts::TAU, s.norm() / (-2.0 * s.re)]
}

#[cfg(test)]
#[test]
fn intervals_from_events_cover_zero_gain_delay_and_response() {
    use crate::fixture::white_noise;
    use crate::model::Section;
    let polynomial = |radius: f64, angle: f64| [-2.0 * radius * angle.cos(), radius * radius];
    let (a, zeros, feedthrough) = (polynomial(0.9, 0.5), polynomial(0.9, 1.2), 0.5);
    let b = [feedthrough * (zeros[0] - a[0]), feedthrough * (zeros[1] - a[1])];
    let section = Section { order: 2, a, b, k: [0.0; 2] };
    let truth = InnovationsModel { sections: vec![section], feedthrough, sample_time_s: 1.0 };
    // from rest, and let go: both edges of a pulse
    let force: Vec<f64> = (0..160).map(|k| if (10..70).contains(&k) { -1.0 } else { 0.0 }).collect();
    let clean = truth.simulate(&force, &[0.0; 2]).unwrap();
    let one = c64::new(1.0, 0.0);
    let frequencies = [0.03, 0.1, 0.3];
    let gain = truth.transfer(one).re;
    let delay = -truth.transfer_slope(one).re / gain;
    let zero = frequency_and_quality(c64::from_polar(0.9, 1.2), 1.0);
    let at = |f: f64| truth.transfer(c64::cis(std::f64::consts::TAU * f));
    let seeds = 100;
    let mut covered = [0; 10];
    for seed in 0..seeds {
        let events: Vec<Vec<f64>> = (0..16)
            .map(|i| clean.iter().zip(white_noise(160, 0.05, 1000 * seed + i)).map(|(y, e)| y + e).collect())
            .collect();
        let events: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
        let drawing = Drawing {
            events: &events,
            amplitude: &[1.0; 16],
            force: &force,
            start: &truth,
            frequencies: &frequencies,
            offset: false,
            drift: false,
        };
        let found = drawing
            .intervals(&BootstrapSettings { replicates: 80, seed, ..Default::default() }, &crate::Unwatched)
            .unwrap();
        let root = found.roots.iter().find(|root| !root.pole).unwrap();
        let mut inside = vec![
            root.frequency.interval.covers(zero[0]),
            root.quality.interval.covers(zero[1]),
            found.gain.interval.covers(gain),
            found.delay_s.interval.covers(delay),
        ];
        for (f, (magnitude, phase)) in frequencies.iter().zip(&found.response) {
            inside.push(magnitude.interval.covers(at(*f).norm().ln()));
            inside.push(phase.interval.covers(at(*f).arg()));
        }
        covered.iter_mut().zip(inside).for_each(|(count, inside)| *count += usize::from(inside));
    }
    let shares: Vec<f64> = covered.iter().map(|count| *count as f64 / seeds as f64).collect();
    println!("bootstrap coverage: {shares:?}");
    let pooled = shares.iter().sum::<f64>() / shares.len() as f64;
    assert!((0.90..=0.99).contains(&pooled), "{pooled}");
    // one number over 100 seeds at 93 to 95 %: standard error 2.5 %, three of them
    assert!(shares.iter().all(|share| *share >= 0.855), "{shares:?}");
}
