//! What the models of an input and an output, or of decays, have to say for a verdict.

use super::answer::Findings;
use super::data::{Bench, Stretch};
use super::dynamics::{Kind, Section};
use super::fit::{Fit, Until};
use super::ruling::{Claim, Grounds, follows_output, high_band_variance, left_beyond_noise, left_repeating, repeats};
use super::scatter::{Compared, unlike_noise};
use super::selection::Judged;
use super::validation::{held_out, pooled_rms};
use super::verdict::NamedCause;
use crate::spectra::period_samples;
use crate::validation::{Driven, Feedback, feedback};

/// Nepers over the longest stretch below which nothing is known of a damping: of an error of a thousandth a share.
const ENDLESS: f64 = 1e-3;
/// Loss of an exponential over that of another within one another's width, at which it may be what the other's amplitude
/// makes of its frequency or damping: twice of its first power, three times of its square, as far as other terms let it
/// be seen.
const COMPANION: std::ops::Range<f64> = 1.7..3.5;
/// Highest multiple of a mode's frequency that a curve makes clearly, how near a mode lies to it, relative, and its loss
/// per second over that many times the other's.
const HARMONIC: usize = 3;
const NEAR: f64 = 0.005;
const ALIKE: std::ops::Range<f64> = 0.7..1.4;
/// Distance of two frequencies, relative, up to which they may be one mode's of a system that changed, and amplitude over
/// that of the other up to which a mode does not ring in a hit.
const CHANGED: f64 = 0.1;
const SILENT: f64 = 0.05;

impl Findings<'_> {
    /// What the verdict is made from; `named`: causes with a name, `errors`: on what was held out, model by model.
    pub(super) fn grounds(&self, named: &[NamedCause], errors: &[Option<f64>]) -> Grounds {
        let square = |rms: Option<f64>| rms.map(|rms| rms * rms);
        let of = |cause: &NamedCause| Claim {
            id: cause.id.clone(),
            held_out: square(cause.gain.rms_before).zip(square(cause.gain.rms_after)).map(|(a, b)| [a, b]),
        };
        let ends = errors.first().copied().flatten().zip(errors.last().copied().flatten());
        let noise = self.noise();
        Grounds {
            adequate: self.adequate,
            systematic: self.systematic(),
            claims: named.iter().map(of).collect(),
            unnamed: !self.choice.chosen.is_empty(),
            training: square(self.choice.ladder.last().and_then(|last| self.rms(last.fit.loss))),
            held_out: ends.map(|(before, after)| [before * before, after * after]),
            noise,
            against_clean: self.repeated().into_iter().chain(self.beyond_noise(noise)).collect(),
            unlike_noise: self.unlike_noise().into_iter().chain(self.untried().filter(|_| !self.is_open())).collect(),
            against_all: self
                .endless()
                .into_iter()
                .chain(self.follows())
                .chain(self.companion())
                .chain(self.changed())
                .chain(self.untried().filter(|_| self.is_open()))
                .collect(),
        }
    }

    /// What the limit of work left untried, in a sentence; none where it was not reached.
    fn untried(&self) -> Option<String> {
        let untried = self.choice.untried;
        let what = [
            (untried.causes, "further causes"),
            (untried.rivals, "their rivals"),
            (untried.laws, "laws without a name"),
        ];
        let what: Vec<&str> = what.into_iter().filter(|(is_left, _)| *is_left).map(|(_, what)| what).collect();
        let found: Vec<&str> = self.choice.chosen.iter().map(|chosen| chosen.about.id).collect();
        let found = if found.is_empty() { "no cause".to_owned() } else { found.join(", ") };
        (!what.is_empty()).then(|| {
            format!("the search came to its limit of work with {found}: {} were not tried", what.join(" and "))
        })
    }

    /// Whether what was not tried speaks against the names that were found, not only against noise as what they leave.
    fn is_open(&self) -> bool {
        self.choice.untried.rivals || self.choice.untried.laws
    }

    /// Mean square on what names have to gain on of the last model without the named causes that do not stand, refitted.
    pub(super) fn alone(&self, stand: &[usize]) -> Option<f64> {
        let named: Vec<usize> = self.choice.chosen.iter().filter(|own| own.has_a_name()).map(|own| own.place).collect();
        let mut gone: Vec<usize> =
            named.iter().enumerate().filter(|(number, _)| !stand.contains(number)).map(|(_, place)| *place).collect();
        gone.sort_unstable();
        let last = &self.choice.ladder.last()?.fit.model;
        let model = gone.into_iter().rev().fold(last.clone(), |model, which| model.without(which));
        let judged = Judged::new(Fit::new(self.bench, &model, Until::JUDGED)?, self.bench, &self.blocks);
        let rms = match held_out(&self.options.parts) {
            [] => self.rms(judged.unseen()),
            parts => pooled_rms(self.bench, self.records, &judged.fit.model, parts),
        };
        rms.map(|rms| rms * rms)
    }

    /// Variance of the noise in the output's unit, from where the system does not respond.
    fn noise(&self) -> Option<f64> {
        let loss = noise_loss(self.bench, &self.choice.ladder.last()?.fit)?;
        self.rms(loss).map(|rms| rms * rms)
    }

    /// What is left that repeats itself with the input, in a sentence; none where that may be noise.
    fn repeated(&self) -> Option<String> {
        let (stretch, last) = (self.bench.stretches.first()?, &self.choice.ladder.last()?.fit);
        let input = self.records.get(stretch.record)?.input.get(stretch.first..stretch.end)?;
        let period = period_samples(&[input])?;
        left_repeating(repeats(last.residual.get(self.bench.layout.part(0, 0, 0, input.len()))?, period)?)
    }

    /// What is left of a driven output beyond noise, where that is more than a linear model may leave, in a sentence.
    fn beyond_noise(&self, noise: Option<f64>) -> Option<String> {
        let (last, layout) = (self.choice.ladder.last()?, &self.bench.layout);
        let parts = (0..layout.stretches())
            .flat_map(|e| (0..layout.channels).map(move |channel| layout.part(e, channel, 0, layout.samples(e))));
        let variance: f64 = parts.map(|part| about_mean(&self.bench.output[part])).sum();
        let left = self.rms(last.fit.loss)?.powi(2) - noise?;
        self.bench.driven.then(|| left_beyond_noise(left / self.rms(variance)?.powi(2))).flatten()
    }

    /// What tells that which the last model leaves from noise, in sentences.
    fn unlike_noise(&self) -> Vec<String> {
        let (Some(last), layout) = (self.choice.ladder.last(), &self.bench.layout) else { return Vec::new() };
        let compared = |part: std::ops::Range<usize>| Compared {
            measured: &self.bench.output[part.clone()],
            simulated: &last.fit.simulated[part],
        };
        let parts = (0..layout.stretches())
            .flat_map(|e| (0..layout.channels).map(move |channel| layout.part(e, channel, 0, layout.samples(e))));
        unlike_noise(&parts.map(compared).collect::<Vec<_>>(), self.bench.interval_s)
    }

    /// What says that a measured input follows the output, in a sentence; none where nothing does, and where what is left is
    /// not what any linear model leaves.
    fn follows(&self) -> Option<String> {
        if !self.bench.driven || !self.adequate {
            return None;
        }
        let tests: Vec<Option<Feedback>> =
            (0..self.bench.layout.channels).map(|channel| self.feedback(channel)).collect();
        follows_output(&tests, self.options.false_alarm_rate)
    }

    /// The last model's test for feedback from one channel.
    fn feedback(&self, channel: usize) -> Option<Feedback> {
        let (last, layout) = (&self.choice.ladder.last()?.fit, &self.bench.layout);
        let one = |(e, stretch): (usize, &Stretch)| {
            let part = layout.part(e, channel, 0, layout.samples(e));
            Some(Driven {
                input: self.records.get(stretch.record)?.input.get(stretch.first..stretch.end)?,
                others: &[],
                response: last.simulated.get(part.clone())?,
                left: last.residual.get(part)?,
            })
        };
        let stretches: Option<Vec<Driven<'_>>> = self.bench.stretches.iter().enumerate().map(one).collect();
        feedback(&stretches?)
    }

    /// Two modes of free decays, beside causes, that one mode makes which moves with its amplitude or is seen through a
    /// curve, in a sentence; none where there are none.
    fn companion(&self) -> Option<String> {
        let last = &self.choice.ladder.last()?.fit.model;
        if self.bench.driven || last.causes.is_empty() {
            return None;
        }
        let modes = || last.dynamics.sections.iter().filter(|section| section.kind == Kind::Oscillator);
        let width = |of: &Section| of.loss * of.frequency_hz;
        let beside = |a: &Section, b: &Section| {
            (a.frequency_hz - b.frequency_hz).abs() < 0.5 * (width(a) + width(b))
                && COMPANION.contains(&(width(b) / width(a)))
        };
        let multiple = |a: &Section, b: &Section| {
            (2..=HARMONIC).find(|n| {
                let n = *n as f64;
                (b.frequency_hz / a.frequency_hz - n).abs() < NEAR * n && ALIKE.contains(&(width(b) / width(a) / n))
            })
        };
        let mut pairs = modes().flat_map(|a| modes().map(move |b| (a, b)));
        pairs.find_map(|(slow, fast)| {
            let said = match multiple(slow, fast) {
                Some(n) => format!("at {n} times the frequency: what a curve makes of the other's motion"),
                None if beside(slow, fast) => "within its width: one mode that moves with its amplitude makes both".to_owned(),
                None => return None,
            };
            Some(format!(
                "of two modes at {:.4} and {:.4} Hz the second dies away {:.1} times as fast, {said}; causes beside them \
                 stand for its law",
                slow.frequency_hz,
                fast.frequency_hz,
                width(fast) / width(slow)
            ))
        })
    }

    /// Two modes of free decays of which no hit has both: one of a system that changed between hits, in a sentence; none
    /// where there are none.
    fn changed(&self) -> Option<String> {
        let (last, layout) = (&self.choice.ladder.last()?.fit.model, &self.bench.layout);
        if self.bench.driven || layout.stretches() < 2 {
            return None;
        }
        let sections = &last.dynamics.sections;
        let modes: Vec<usize> = (0..sections.len()).filter(|s| sections[*s].kind == Kind::Oscillator).collect();
        let amplitude = |e: usize, s: usize| {
            let [deflection, rate] = last.states[e].sections[s];
            deflection.hypot(rate)
        };
        let has = |s: usize, other: usize| -> Vec<usize> {
            (0..layout.stretches()).filter(|e| amplitude(*e, other) < SILENT * amplitude(*e, s)).collect()
        };
        let mut pairs = modes.iter().flat_map(|a| modes.iter().map(move |b| (*a, *b))).filter(|(a, b)| a < b);
        pairs.find_map(|(a, b)| {
            let [from, to] = [a, b].map(|s| sections[s].frequency_hz);
            let (of_a, of_b) = (has(a, b), has(b, a));
            let apart = !of_a.is_empty() && !of_b.is_empty() && of_a.len() + of_b.len() == layout.stretches();
            let number = |e: &usize| (self.bench.stretches[*e].record + 1).to_string();
            let listed = |of: &[usize]| of.iter().map(number).collect::<Vec<String>>().join(", ");
            ((to / from - 1.0).abs() < CHANGED && apart).then(|| {
                format!(
                    "a mode is at {from:.4} Hz in some hits ({}) and at {to:.4} Hz in all others ({}): the system changed \
                     between them",
                    listed(&of_a),
                    listed(&of_b)
                )
            })
        })
    }

    /// The linear model's one mode, where it does not die away in a measured input and output, in a sentence.
    fn endless(&self) -> Option<String> {
        let (first, layout) = (self.choice.ladder.first()?, &self.bench.layout);
        let longest = (0..layout.stretches()).map(|e| layout.samples(e)).max()?;
        let lasts_s = longest as f64 * self.bench.interval_s;
        let goes_on = |section: &&Section| {
            section.kind == Kind::Oscillator && 0.5 * section.omega() * section.loss * lasts_s < ENDLESS
        };
        // beside other modes it was looked at when they were found
        let [section] = &first.fit.model.dynamics.sections[..] else { return None };
        if !self.bench.driven || !goes_on(&section) {
            return None;
        }
        Some(format!(
            "the linear model's oscillation at {:.4} Hz does not die away in the record: it stands for something else, an \
             integrator or a line",
            section.frequency_hz
        ))
    }
}

/// What noise makes of a fit's loss, from where the system does not respond.
pub(super) fn noise_loss(bench: &Bench, fit: &Fit) -> Option<f64> {
    let layout = &bench.layout;
    let mut sum = 0.0;
    for e in 0..layout.stretches() {
        for channel in 0..layout.channels {
            let part = layout.part(e, channel, 0, layout.samples(e));
            let there = bench.output[part.clone()].iter().zip(&fit.residual[part]);
            let values: Vec<f64> = there.map(|(y, left)| if y.is_finite() { *left } else { f64::NAN }).collect();
            sum += high_band_variance(&values)? * values.iter().filter(|value| value.is_finite()).count() as f64;
        }
    }
    Some(sum)
}

/// Sum of the squares of values about their mean; those that are missing are left out.
fn about_mean(values: &[f64]) -> f64 {
    let there: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = there.iter().sum::<f64>() / there.len().max(1) as f64;
    there.iter().map(|value| (value - mean).powi(2)).sum()
}
