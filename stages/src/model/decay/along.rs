//! A mode that follows laws of its amplitude, as rows, document and words.

use std::f64::consts::TAU;

use serde_json::{Value, json};

use super::course::{PartRow, digits};
use afmid_kernels::ringdown::moving::{CoursePoint, Term};
use afmid_kernels::ringdown::{AmplitudeCourse, Estimate};
use afmid_kernels::statistics::chi_square_tail;

/// A mode's laws, and when its largest hit reaches each amplitude.
pub(super) struct Along<'a> {
    course: &'a AmplitudeCourse,
    /// Points from the largest amplitude to the smallest, each with the time after the first free sample, s.
    points: Vec<(f64, CoursePoint)>,
}

impl<'a> Along<'a> {
    /// `end_s`: the decays' end, later than which no amplitude is reached: of laws that hold in a part of them, its end.
    pub fn new(course: &'a AmplitudeCourse, end_s: f64) -> Self {
        let rate = |at: &CoursePoint| TAU * at.frequency_hz.value * at.damping_ratio.value;
        let mut points: Vec<(f64, CoursePoint)> = Vec::new();
        for point in course.laws.course.iter().rev() {
            let time = match points.last() {
                // mean of the rates on the way from one amplitude to the next
                Some((time, last)) => {
                    let mean = 0.5 * (rate(last) + rate(point));
                    (time + (last.amplitude / point.amplitude).ln() / mean.max(f64::MIN_POSITIVE)).min(end_s)
                }
                None => 0.0,
            };
            points.push((time, *point));
        }
        Self { course, points }
    }

    pub fn mode(&self) -> usize {
        self.course.mode
    }

    /// Differences of frequency and damping ratio between the ends over both ends' errors, as if these were independent,
    /// and how probable both are.
    fn ends(&self) -> (f64, f64, f64) {
        let (Some((_, first)), Some((_, last))) = (self.points.first(), self.points.last()) else {
            return (0.0, 0.0, 1.0);
        };
        let z = |a: Estimate, b: Estimate| {
            let error = a.std.hypot(b.std);
            if error > 0.0 { (b.value - a.value) / error } else { 0.0 }
        };
        let (f, d) = (z(first.frequency_hz, last.frequency_hz), z(first.damping_ratio, last.damping_ratio));
        (f, d, chi_square_tail(f * f + d * d, 2))
    }

    pub fn rows(&self) -> Vec<PartRow> {
        let (frequency_z, damping_z, p_value) = self.ends();
        let row = |(time, at): &(f64, CoursePoint)| PartRow {
            mode: self.course.mode + 1,
            part: "along",
            from_s: *time,
            to_s: *time,
            amplitude: at.amplitude,
            frequency_hz: at.frequency_hz,
            damping_ratio: at.damping_ratio,
            frequency_z,
            damping_z,
            p_value,
        };
        self.points.iter().map(row).collect()
    }

    /// Entry of the summary's `course`: `first` and `last` are at the largest and the smallest amplitude.
    pub fn document(&self) -> Value {
        let (frequency_z, damping_z, p_value) = self.ends();
        let at = |(time, at): &(f64, CoursePoint)| {
            json!({
                "from_s": time,
                "to_s": time,
                "amplitude": at.amplitude,
                "frequency_hz": at.frequency_hz.value,
                "frequency_std_hz": at.frequency_hz.std,
                "damping_ratio": at.damping_ratio.value,
                "damping_ratio_std": at.damping_ratio.std,
            })
        };
        let laws = &self.course.laws;
        let law = |terms: &[(Term, Estimate)]| {
            let one = |(term, of): &(Term, Estimate)| json!({ "term": name(*term), "value": of.value, "std": of.std });
            terms.iter().map(one).collect::<Vec<Value>>()
        };
        json!({
            "mode": self.course.mode + 1,
            "first": self.points.first().map(at),
            "last": self.points.last().map(at),
            "frequency_z": frequency_z,
            "damping_z": damping_z,
            "p_value": p_value,
            "moves": true,
            "follows": "laws",
            "last_part_counts": false,
            "share": self.course.share,
            "along": self.points.iter().map(at).collect::<Vec<Value>>(),
            "amplitude_unit": laws.unit,
            "decay_rate_per_s": law(&laws.damping_terms),
            "frequency_rad_per_s": law(&laws.frequency_terms),
        })
    }

    pub fn warning(&self) -> String {
        let (Some((_, first)), Some((end, last))) = (self.points.first(), self.points.last()) else {
            return String::new();
        };
        format!(
            "mode {} moves with its amplitude: {} Hz and a damping ratio of {} % at {:.3e}, {} Hz and {} % at {:.3e} \
             ({end:.4} s later), as {} and {}: the table has the values at the smallest amplitude{}",
            self.course.mode + 1,
            digits(first.frequency_hz, 1.0),
            digits(first.damping_ratio, 100.0),
            first.amplitude,
            digits(last.frequency_hz, 1.0),
            digits(last.damping_ratio, 100.0),
            last.amplitude,
            law("frequency", &self.course.laws.frequency_terms),
            law("decay rate", &self.course.laws.damping_terms),
            self.limit(),
        )
    }
}

impl Along<'_> {
    /// How far the laws hold, in words.
    fn limit(&self) -> String {
        match self.course.share {
            share if share < 1.0 => {
                let percent = (100.0 * share).round();
                format!(" that the first {percent} % of the decays reach; later it follows none of these laws")
            }
            _ => String::new(),
        }
    }
}

/// A law in words: what it is a sum of.
fn law(what: &str, terms: &[(Term, Estimate)]) -> String {
    let names: Vec<&str> = terms.iter().map(|(term, _)| name(*term)).collect();
    if names == ["1"] { format!("constant {what}") } else { format!("{what} of terms {}", names.join(", ")) }
}

fn name(term: Term) -> &'static str {
    match term {
        Term::One => "1",
        Term::Linear => "a",
        Term::Square => "a^2",
        Term::Fourth => "a^4",
        Term::Log => "log a",
        Term::Inverse => "1/a",
    }
}
