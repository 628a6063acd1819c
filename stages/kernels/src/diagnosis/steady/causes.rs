//! Named causes with their numbers.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, PI};

use crate::diagnosis::verdict::{Gain, NamedCause, RunnerUp, Value};

use super::answer::finite;
use super::choice::{Fitted, Judged};
use super::curves::{CURVES, Curve, clipped_mean};
use super::findings::Findings;
use super::judged_lines::JudgedFamily;
use super::lines::Line;

impl Findings<'_> {
    /// The curve as one or two causes.
    pub(super) fn curve_causes(&self, named: &Judged) -> Vec<NamedCause> {
        let curve = named.fitted.curve;
        let runner_up = self.judged.iter().find(|other| other.fitted.curve != curve && other.score > 0.0);
        let runner_up = runner_up.and_then(|other| {
            let id = (*other.fitted.curve.ids().last()?).to_owned();
            Some(RunnerUp { id, share_of_gain: finite(other.score / named.score) })
        });
        let held_out = "each quarter of the blocks in turn".to_owned();
        // the quadratic part's gain is that of the quadratic curve, the cubic part's what it adds
        let quadratic = self.judged.iter().find(|other| other.fitted.curve == Curve::Quadratic && curve == Curve::Both);
        let half = quadratic.map(|half| (half.left, half.gains.iter().sum::<f64>()));
        let (first, total) = (self.measured.straight_left(), named.gains.iter().sum::<f64>());
        let one = |(i, id): (usize, &&str)| {
            let (before, after, gain) = match (half, i) {
                (Some((left, gain)), 0) => (first, left, gain),
                (Some((left, gain)), _) => (left, named.left, total - gain),
                (None, _) => (first, named.left, total),
            };
            NamedCause {
                id: (*id).to_owned(),
                class: self.class(named),
                p_value: finite((self.p_harmonics() * CURVES.len() as f64).min(1.0)),
                parameters: self.curve_parameters(named, i),
                gain: Gain {
                    rms_before: self.rms(before),
                    rms_after: self.rms(after),
                    unit: self.options.output_unit.clone(),
                    log_likelihood: finite(gain),
                    held_out: held_out.clone(),
                },
                runner_up: runner_up.clone(),
                next_measurement: next_measurement(id).to_owned(),
            }
        };
        curve.ids().iter().enumerate().map(one).collect()
    }

    /// Root mean square of a record whose harmonics have this mean square left.
    pub(super) fn rms(&self, left: f64) -> Option<f64> {
        finite((left + self.blocks.noise().powi(2)).sqrt() * self.scale)
    }

    fn curve_parameters(&self, named: &Judged, which: usize) -> BTreeMap<String, Value> {
        let curve = named.fitted.curve;
        let of = |fitted: &Fitted| [fitted.shared[0], fitted.shared[1], fitted.amplitude];
        let [p, q, a] = of(&named.fitted);
        let [p_std, q_std, a_std] = self.measured.jackknife(curve, of);
        let v = self.scale;
        let times = |std: Option<f64>, factor: f64| std.map(|std| std * factor);
        let list = match (curve, which) {
            (Curve::Quadratic, _) | (Curve::Both, 0) => vec![("a2", self.value(p / v, times(p_std, 1.0 / v), "1/V"))],
            (Curve::Cubic, _) => vec![("a3", self.value(p / (v * v), times(p_std, 1.0 / (v * v)), "1/V^2"))],
            (Curve::Both, _) => vec![("a3", self.value(q / (v * v), times(q_std, 1.0 / (v * v)), "1/V^2"))],
            (Curve::Fringe, _) => {
                let (predicted, predicted_std) = self.fourth(named);
                let measured = self.real.get(4).copied().unwrap_or_default();
                let mut list = vec![
                    ("modulation_depth_rad", self.value(a, a_std, "rad")),
                    ("phase_rad", self.value(p, p_std, "rad")),
                    ("fringe_amplitude_v", self.value(q * v, times(q_std, v), "V")),
                ];
                if self.blocks.kept.contains(&4) {
                    list.push(("fourth_harmonic_predicted_v", self.value(predicted * v, times(predicted_std, v), "V")));
                    list.push((
                        "fourth_harmonic_measured_v",
                        self.value(measured.value * v, Some(measured.std * v), "V"),
                    ));
                }
                list
            }
            (Curve::Clipping, _) => {
                let mean = clipped_mean(p, q, a);
                let level = self.blocks.mean(|block| block.level).value - mean;
                let limit = |limit: f64, std| self.value((limit + level) * v + self.offset, times(std, v), "V");
                let mut list = Vec::new();
                if p.abs() < a {
                    list.push(("lower_limit_v", limit(p, p_std)));
                }
                if q.abs() < a {
                    list.push(("upper_limit_v", limit(q, q_std)));
                }
                list
            }
            _ => Vec::new(),
        };
        list.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    /// Fourth harmonic that the first three predict, with its standard error.
    pub(super) fn fourth(&self, named: &Judged) -> (f64, Option<f64>) {
        let of = |fitted: &Fitted| {
            [fitted.curve.harmonics(fitted.shared, fitted.amplitude, 4).last().copied().unwrap_or(0.0)]
        };
        let [value] = of(&named.fitted);
        let [std] = self.measured.jackknife(named.fitted.curve, of);
        (value, std)
    }

    /// A family of lines as a cause.
    pub(super) fn line_cause(&self, judged: &JudgedFamily) -> NamedCause {
        let family = &judged.family;
        let strongest = family.lines.first().copied();
        let std = strongest.map(|line| line.level * (0.5 / LN_2).sqrt() * self.scale);
        let samples = self.blocks.rest.len().max(1) as f64;
        let at = |line: Line| line.frequency * self.rate;
        // twice the bound at the level around: two bins of a Hann window have so much
        let frequency_std = strongest.map(|line| {
            let relative = line.level / line.amplitude.max(f64::MIN_POSITIVE);
            2.0 * self.rate / samples * relative * (1.0 / (PI.powi(2) * LN_2)).sqrt()
        });
        let mut parameters = vec![
            ("amplitude", self.value(strongest.map_or(f64::NAN, |line| line.amplitude * self.scale), std, "V")),
            ("frequency_hz", self.value(family.base * self.rate, frequency_std, "Hz")),
        ];
        if family.lines.len() > 1 {
            parameters.push(("lines", self.value(family.lines.len() as f64, None, "1")));
            parameters.push(("strongest_line_hz", self.value(strongest.map_or(f64::NAN, at), frequency_std, "Hz")));
        }
        // noise exceeds x medians with probability 2^(-x^2)
        let chance = |line: Line| (0.5 * samples * (-(line.amplitude / line.level).powi(2) * LN_2).exp()).min(1.0);
        let rms = |square: f64| finite(square.max(0.0).sqrt() * self.scale);
        NamedCause {
            id: "spurious-line".to_owned(),
            class: vec!["spurious-line".to_owned()],
            p_value: strongest.map(chance).and_then(finite),
            parameters: parameters.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            gain: Gain {
                rms_before: rms(judged.before),
                rms_after: rms(judged.after),
                unit: self.options.output_unit.clone(),
                log_likelihood: finite(judged.gain),
                held_out: "the odd blocks, sines from the even ones".to_owned(),
            },
            runner_up: None,
            next_measurement: next_measurement("spurious-line").to_owned(),
        }
    }
}

fn next_measurement(id: &str) -> &'static str {
    match id {
        "self-fringe" => {
            "shift the fibre by an eighth of the wavelength: even and odd harmonics change places, the motion stays"
        }
        "quadratic-detector" => {
            "oscillate at half the amplitude: the second harmonic falls to a quarter; shift the spot: it changes sign"
        }
        "cubic-detector" => {
            "oscillate at half the amplitude: the third falls to an eighth; the frequency stays if it is the detector"
        }
        "clipping" => "reduce the amplitude or the gain below the limits: all harmonics vanish at once",
        _ => "record with the oscillation off: the line stays",
    }
}
