//! From findings to the answer that is stored and shown.

use crate::diagnosis::verdict::{BaselineSummary, Diagnosis, Rung, RunnerUp, Validation, Value, Verdict};

use super::SteadyDiagnosis;
use super::blocks::HARMONICS;
use super::choice::{Judged, tied};
use super::curves::Curve;
use super::findings::{Findings, Harmonics};

/// A number that JSON can hold.
pub(super) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Findings<'_> {
    pub fn answer(&self) -> SteadyDiagnosis {
        let named = self.named();
        let (before, after) = self.series(named);
        let verdict = self.verdict();
        let mut causes = Vec::new();
        if verdict == Verdict::Named {
            causes.extend(named.map_or(Vec::new(), |judged| self.curve_causes(judged)));
            causes.extend(self.named_families().into_iter().map(|family| self.line_cause(family)));
        }
        let p_value = causes.iter().filter_map(|cause| cause.p_value).fold(self.p_harmonics(), f64::min);
        let diagnosis = Diagnosis {
            verdict,
            p_value: finite(p_value),
            baseline: self.baseline(),
            causes,
            evidence: self.evidence(named),
            nearest: if verdict == Verdict::Unexplained { self.nearest() } else { Vec::new() },
            modes_before: Vec::new(),
            modes_after: Vec::new(),
            validation: self.validation(&before, &after),
            ladder: self.ladder(named),
            false_alarm_rate: self.options.false_alarm_rate,
        };
        SteadyDiagnosis {
            diagnosis,
            frequency_hz: self.track.frequency * self.rate,
            first_sample: self.track.first,
            before,
            after,
            harmonics: (1..=HARMONICS).map(|k| self.blocks.kept.contains(&k).then(|| self.amplitude(k))).collect(),
        }
    }

    /// The curve that is named.
    fn named(&self) -> Option<&Judged> {
        if let Harmonics::Named(place) = self.harmonics { self.judged.get(place) } else { None }
    }

    fn verdict(&self) -> Verdict {
        let lines = !self.named_families().is_empty();
        // lines that must not be named are something wrong all the same
        let unnamed = self.families.iter().any(|family| family.gain > 3.0) && !lines;
        match self.harmonics {
            Harmonics::OwnMotion | Harmonics::Unknown => Verdict::Unexplained,
            Harmonics::Named(_) => Verdict::Named,
            Harmonics::Clean if !self.lines.subharmonic.is_empty() => Verdict::Unexplained,
            Harmonics::Clean if lines => Verdict::Named,
            Harmonics::Clean if unnamed => Verdict::Unexplained,
            Harmonics::Clean => Verdict::Clean,
        }
    }

    /// Amplitude of a harmonic with its standard error, in the signal's unit.
    pub(super) fn amplitude(&self, k: usize) -> (f64, f64) {
        let (re, im) =
            (self.real.get(k).copied().unwrap_or_default(), self.imaginary.get(k).copied().unwrap_or_default());
        let size = re.value.hypot(im.value);
        let std = (re.value * re.std).hypot(im.value * im.std) / size.max(f64::MIN_POSITIVE);
        (size * self.scale, if std > 0.0 { std * self.scale } else { re.std.max(im.std) * self.scale })
    }

    pub(super) fn value(&self, value: f64, std: Option<f64>, unit: &str) -> Value {
        let unit = unit.replace('V', &self.options.output_unit);
        Value { value: finite(value), std: std.and_then(finite), unit }
    }

    fn baseline(&self) -> BaselineSummary {
        let (amplitude, std) = self.amplitude(1);
        let frequency = self.blocks.mean(|block| block.frequency);
        let frequency_std = (self.track.bandwidth > 0.0).then_some(frequency.std * self.rate);
        let parameters = [
            ("amplitude", self.value(amplitude, Some(std), "V")),
            ("frequency_hz", self.value(self.track.frequency * self.rate, frequency_std, "Hz")),
        ];
        BaselineSummary {
            adequate: true,
            order: Some(2),
            parameters: parameters.map(|(name, value)| (name.to_owned(), value)).into(),
            noise_rms: finite(self.blocks.noise() * self.scale),
            distortion_rms: finite(self.distortion() * self.scale),
        }
    }

    /// Ids of a curve and of those that can't be distinguished from it.
    pub(super) fn class(&self, named: &Judged) -> Vec<String> {
        let mut ids: Vec<&str> = named.fitted.curve.ids().to_vec();
        // both contains either
        let rivals = self.judged.iter().filter(|other| other.fitted.curve != Curve::Both && other.score > 0.0);
        for other in rivals.filter(|other| tied(named, other)) {
            ids.extend(other.fitted.curve.ids().iter().filter(|id| !ids.contains(id)).copied().collect::<Vec<_>>());
        }
        ids.into_iter().map(str::to_owned).collect()
    }

    fn nearest(&self) -> Vec<RunnerUp> {
        let Some(best) = self.judged.first().filter(|best| best.score > 0.0) else { return Vec::new() };
        let one = |judged: &Judged| {
            let id = judged.fitted.curve.ids().join(" + ");
            RunnerUp { id, share_of_gain: finite(judged.score / best.score) }
        };
        self.judged.iter().filter(|judged| judged.score > 0.0).take(3).map(one).collect()
    }

    fn validation(&self, before: &[f64], after: &[f64]) -> Vec<Validation> {
        let one = |(name, part): &(String, std::ops::Range<usize>)| {
            let from = part.start.saturating_sub(self.track.first).min(before.len());
            let to = part.end.saturating_sub(self.track.first).min(before.len());
            let rms = |series: &[f64]| {
                let part = series.get(from..to).filter(|part| !part.is_empty())?;
                finite((part.iter().map(|v| v * v).sum::<f64>() / part.len() as f64).sqrt())
            };
            let unit = self.options.output_unit.clone();
            Validation { name: name.clone(), rms_before: rms(before), rms_after: rms(after), unit }
        };
        self.options.parts.iter().map(one).collect()
    }

    fn ladder(&self, named: Option<&Judged>) -> Vec<Rung> {
        let rung = |added: String, parameters: usize, left: f64, gain: Option<f64>| Rung {
            added,
            parameters,
            rms: self.rms(left),
            held_out_rms: self.rms(left),
            unit: self.options.output_unit.clone(),
            log_likelihood_gain: gain,
            bic: None,
        };
        let mut rungs = vec![rung("steady oscillation".to_owned(), 2, self.measured.straight_left(), None)];
        rungs.extend(named.map(|judged| {
            let curve = judged.fitted.curve;
            let gain = finite(judged.gains.iter().sum::<f64>());
            rung(curve.ids().join(" + "), 2 + curve.parameters(), judged.left, gain)
        }));
        rungs
    }
}
