//! What gave the causes away, and what remains, in plain sentences.

use super::blocks::evenness;
use super::choice::Judged;
use super::curves::Curve;
use super::findings::{Findings, Harmonics};
use super::judged_lines::JudgedFamily;

/// Standard errors from which a harmonic that a curve does not predict is mentioned.
const MENTIONED: f64 = 5.0;

impl Findings<'_> {
    pub fn evidence(&self, named: Option<&Judged>) -> Vec<String> {
        let mut lines = vec![self.steadiness(), self.list()];
        lines.extend(self.frozen());
        match self.harmonics {
            Harmonics::Clean => {}
            Harmonics::Named(_) => lines.extend(named.map_or(Vec::new(), |judged| self.of_curve(judged))),
            Harmonics::OwnMotion => lines.push(self.own_motion()),
            Harmonics::Unknown => lines.push(self.unknown()),
        }
        lines.extend(self.of_lines());
        lines
    }

    fn unit(&self) -> &str {
        &self.options.output_unit
    }

    fn steadiness(&self) -> String {
        let change = 100.0 * (1.0 - evenness(&self.blocks.blocks));
        format!(
            "a steady oscillation at {:.6e} Hz of amplitude {:.4e} {}, which changes by {change:.2} %: it is kept \
             going, so no quality factor can be had from this record",
            self.track.frequency * self.rate,
            self.amplitude(1).0,
            self.unit()
        )
    }

    fn list(&self) -> String {
        let one = |&k: &usize| {
            let (size, std) = self.amplitude(k);
            let phase = self.real.get(k).zip(self.imaginary.get(k)).map_or(0.0, |(re, im)| im.value.atan2(re.value));
            format!("{k}: {size:.3e}({std:.1e}) at {:.0} deg", phase.to_degrees())
        };
        let strong: Vec<usize> = (2..self.p_values.len())
            .filter(|&k| self.p_values.get(k).is_some_and(|p| *p < self.options.false_alarm_rate))
            .take(5)
            .collect();
        if strong.is_empty() {
            return format!("no harmonic above the false-alarm rate (least chance {:.2e})", self.p_harmonics());
        }
        format!("harmonics in {}: {}", self.unit(), strong.iter().map(one).collect::<Vec<_>>().join(", "))
    }

    /// Harmonics that can't be had.
    fn frozen(&self) -> Option<String> {
        let lost: Vec<String> = (2..=5).filter(|k| !self.blocks.kept.contains(k)).map(|k| k.to_string()).collect();
        (!lost.is_empty()).then(|| {
            format!("harmonics {} fall on others or on the level after sampling and were left out", lost.join(", "))
        })
    }

    fn of_curve(&self, judged: &Judged) -> Vec<String> {
        let curve = judged.fitted.curve;
        let mut lines = vec![format!(
            "{} from the first three harmonics predicts all harmonics of held-out blocks best: log likelihood \
             {:.1} over a pure sine less Schwarz's penalty for {} parameters; it leaves {:.1} % of the harmonics",
            curve.ids().join(" with "),
            judged.score,
            curve.parameters(),
            100.0 * self.left(judged)
        )];
        for other in self.judged.iter().filter(|other| other.fitted.curve != curve).take(2) {
            lines.push(format!("{}: {:.1}", other.fitted.curve.ids().join(" with "), other.score));
        }
        if curve == Curve::Fringe && self.blocks.kept.contains(&4) {
            let (predicted, std) = self.fourth(judged);
            let measured = self.real.get(4).copied().unwrap_or_default();
            lines.push(format!(
                "interferometer: the first three harmonics predict a fourth of {:.4e}({:.1e}) {unit}, measured \
                 {:.4e}({:.1e}) {unit}: {:.1} % off",
                predicted * self.scale,
                std.unwrap_or(f64::NAN) * self.scale,
                measured.value * self.scale,
                measured.std * self.scale,
                100.0 * (predicted / measured.value - 1.0),
                unit = self.unit()
            ));
        }
        lines.extend(self.shift(curve));
        let quadrature = self.quadrature();
        if quadrature > 0.02 {
            lines.push(format!(
                "{:.1} % of the harmonics are in quadrature: a lag of the detector or a gain that varies \
                 with the motion",
                100.0 * quadrature
            ));
        }
        lines.extend(self.not_predicted(judged));
        lines
    }

    /// How far a motion with these harmonics would shift its frequency.
    fn shift(&self, curve: Curve) -> Option<String> {
        let share = |k: usize| {
            let h = |k: usize| self.real.get(k).map_or(0.0, |mean| mean.value);
            h(k) / h(1)
        };
        // Lindstedt and Poincare: a third of share r goes with 12 r, a second with -15 r^2
        let shift = match curve {
            Curve::Cubic => 12.0 * share(3),
            Curve::Quadratic => -15.0 * share(2).powi(2),
            _ => return None,
        };
        Some(format!(
            "if the motion itself made these harmonics its frequency would lie {:.2} % off that of a small amplitude",
            100.0 * shift
        ))
    }

    fn not_predicted(&self, judged: &Judged) -> Option<String> {
        let fitted = judged.fitted;
        let predicted = fitted.curve.harmonics(fitted.shared, fitted.amplitude, self.real.len());
        let one = |&k: &usize| {
            let (mean, h) = (self.real.get(k)?, predicted.get(k - 1)?);
            let left = mean.value - h;
            (k > 3
                && left.abs() > MENTIONED * mean.std
                && left.abs() > 0.2 * mean.value.abs()
                && left.abs() > self.ripple)
                .then(|| format!("{k}: {:.2e} of {:.2e} {}", left * self.scale, mean.value * self.scale, self.unit()))
        };
        let found: Vec<String> = self.blocks.kept.iter().filter_map(one).take(4).collect();
        (!found.is_empty()).then(|| format!("not explained by the curve remain harmonics {}", found.join(", ")))
    }

    fn own_motion(&self) -> String {
        let quadrature = self.quadrature();
        if quadrature > 0.2 {
            return format!(
                "{:.0} % of the harmonics are in quadrature with the motion: no static curve of a detector makes them; \
                 they are the motion's own, or were filtered",
                100.0 * quadrature
            );
        }
        let best = self.judged.first().map_or(String::new(), |best| best.fitted.curve.ids().join(" with "));
        format!(
            "the harmonics are the motion's own or those of a curve that the catalogue lacks: their sizes are nearest \
             to those of {best}"
        )
    }

    fn unknown(&self) -> String {
        let Some(best) = self.judged.first().filter(|best| best.score > 0.0) else {
            return "harmonics that no curve of the catalogue makes".to_owned();
        };
        format!(
            "no allowed curve makes the harmonics; nearest is {}, which leaves {:.0} % of them",
            best.fitted.curve.ids().join(" with "),
            100.0 * self.left(best)
        )
    }

    fn of_lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let hz = |frequency: f64| format!("{:.2} Hz", frequency * self.rate);
        if let Some(line) = self.lines.subharmonic.first() {
            lines.push(format!(
                "subharmonic: a line of {:.2e} {} at {}, {:.3} of the fundamental's frequency ({} such)",
                line.amplitude * self.scale,
                self.unit(),
                hz(line.frequency),
                line.frequency / self.track.frequency,
                self.lines.subharmonic.len()
            ));
        }
        let own = [
            (self.lines.sidebands, "sidebands of slow modulation"),
            (self.lines.products, "products with other lines"),
        ];
        for (count, what) in own.into_iter().filter(|(count, _)| *count > 0) {
            lines.push(format!("{count} lines are the oscillation's {what}"));
        }
        let named = self.named_families().len();
        let describe = |judged: &JudgedFamily| {
            let family = &judged.family;
            let peak = family.lines.first().map_or(0.0, |line| line.amplitude) * self.scale;
            match family.lines.len() {
                1 => format!("{} ({peak:.2e} {})", hz(family.base), self.unit()),
                count => format!("{count} multiples of {} (up to {peak:.2e} {})", hz(family.base), self.unit()),
            }
        };
        if !self.families.is_empty() {
            let most: Vec<String> = self.families.iter().take(6).map(describe).collect();
            let more = self.families.len().saturating_sub(6);
            let more = if more > 0 { format!(", {more} weaker") } else { String::new() };
            lines.push(format!("lines of their own ({named} families named): {}{more}", most.join("; ")));
        }
        if let Some(crowd) = self.lines.crowds.first() {
            lines.push(format!(
                "narrow bands of noise, {} in number, one at {}",
                self.lines.crowds.len(),
                hz(crowd.frequency)
            ));
        }
        lines
    }
}
