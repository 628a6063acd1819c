//! What to say of a model without a mode.

use afmid_kernels::modes::{ModeCriteria, Pole, PoleClass};
use afmid_pipeline::THIS_STAGE;

/// A pair of a smaller amplitude, in its standard errors, is noise.
const LEAST: f64 = 3.0;

/// Why no pole is a mode: which criteria keep the strongest complex pair out and what lets it in, or that all poles are
/// real, with their time constants.
pub(super) fn no_mode(poles: &[Pole], criteria: &ModeCriteria) -> String {
    let pairs = poles.iter().filter(|pole| pole.kind != PoleClass::Mechanical && pole.root.is_complex());
    // a pair that passes was left out for another reason, which is said elsewhere
    let strongest = pairs.filter(|pole| !barriers(pole, criteria).is_empty());
    let Some(pole) = strongest.max_by(|a, b| a.significance.total_cmp(&b.significance)) else {
        return nothing_oscillates(poles);
    };
    let (root, significance) = (&pole.root, pole.significance);
    let which = format!(
        "no pole passes as a mode: the strongest complex pair has {:.4} Hz, Q = {:.3} and an amplitude of {:.3} times \
         its standard error",
        root.frequency_hz, root.quality_factor, significance
    );
    if significance < LEAST {
        return format!("{which}, which is noise: a longer record or a stronger excitation shows more");
    }
    let sets: Option<Vec<String>> = barriers(pole, criteria)
        .into_iter()
        .map(|(name, value)| value.map(|value| format!("--set {THIS_STAGE}.{name}={value}")))
        .collect();
    match sets {
        Some(sets) => format!("{which}; `{}` lets it in", sets.join(" ")),
        None => format!("{which}: its damping is unknown"),
    }
}

/// The criteria that a pair fails, and for each the value that lets it in.
fn barriers(pole: &Pole, criteria: &ModeCriteria) -> Vec<(&'static str, Option<f64>)> {
    let (root, mut found) = (&pole.root, Vec::new());
    if root.quality_factor < criteria.min_quality_factor {
        let least = below(root.quality_factor).max(f64::midpoint(0.5, root.quality_factor));
        // what grows has a negative one
        found.push(("min_quality_factor", Some(least).filter(|least| *least > 0.5)));
    }
    if pole.significance < criteria.min_significance {
        found.push(("min_significance", Some(below(pole.significance))));
    }
    let relative = root.quality_factor_std / root.quality_factor;
    if relative.is_nan() || relative > criteria.max_quality_factor_error {
        found.push(("max_quality_factor_error", relative.is_finite().then(|| above(relative))));
    }
    if criteria.max_frequency_hz.is_some_and(|most| root.frequency_hz > most) {
        found.push(("max_frequency_hz", Some(above(root.frequency_hz))));
    }
    found
}

fn nothing_oscillates(poles: &[Pole]) -> String {
    if poles.iter().any(|pole| pole.root.is_complex()) {
        return "no pole passes as a mode".to_owned();
    }
    let real = poles.iter().filter(|pole| pole.kind == PoleClass::Detector && !pole.root.is_complex());
    let mut times: Vec<f64> = real.map(|pole| -pole.root.s.re.recip()).filter(|time| time.is_finite()).collect();
    if times.is_empty() {
        return "no pole passes as a mode: raise the order".to_owned();
    }
    times.sort_by(|a, b| b.total_cmp(a));
    let times: Vec<String> = times.iter().map(|time| format!("{time:.3e} s")).collect();
    format!("nothing oscillates: all poles are real, of the time constants {}", times.join(", "))
}

/// A value of two digits below.
fn below(value: f64) -> f64 {
    rounded(value, f64::floor)
}

/// A value of two digits above.
fn above(value: f64) -> f64 {
    rounded(value, f64::ceil)
}

fn rounded(value: f64, round: fn(f64) -> f64) -> f64 {
    let unit = 10_f64.powi(value.abs().log10().floor() as i32 - 1);
    let text = format!("{:.1e}", round(value / unit) * unit);
    text.parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use afmid_kernels::modes::Root;
    use faer::c64;

    use super::*;

    /// A pole at `s`, in 1/s, of a record of 1 kHz.
    fn pole(s: c64, significance: f64) -> Pole {
        let (z, magnitude) = ((s / 1e3).exp(), s.norm());
        let root = Root {
            z,
            s,
            frequency_hz: magnitude / std::f64::consts::TAU,
            frequency_std_hz: 0.1,
            quality_factor: magnitude / (-2.0 * s.re),
            quality_factor_std: 0.1,
        };
        let zero = c64::new(0.0, 0.0);
        let kind = PoleClass::Detector;
        Pole { root, kind, static_share: 1.0, static_share_std: 0.1, amplitude: zero, significance }
    }

    #[test]
    fn the_strongest_pair_comes_with_what_lets_it_in() {
        let criteria = ModeCriteria::default();
        let (damped, weak, real) = (c64::new(-100.0, 425.0), c64::new(-1.0, 300.0), c64::new(-20.0, 0.0));
        let said = no_mode(&[pole(damped, 40.0), pole(weak, 4.0), pole(real, 90.0)], &criteria);
        assert!(
            said.contains("69.4880 Hz") && said.contains("`--set <this stage>.min_quality_factor=2.1` lets"),
            "{said}"
        );
        assert!(!said.contains("min_significance"), "{said}");
        let said = no_mode(&[pole(weak, 4.58)], &criteria);
        assert!(said.contains("`--set <this stage>.min_significance=4.5` lets it in"), "{said}");
        let said = no_mode(&[pole(weak, 1.2), pole(real, 90.0)], &criteria);
        assert!(said.contains("which is noise") && !said.contains("--set"), "{said}");
    }

    #[test]
    fn real_poles_have_time_constants() {
        let poles = [pole(c64::new(-20.0, 0.0), 90.0), pole(c64::new(-400.0, 0.0), 30.0)];
        let said = no_mode(&poles, &ModeCriteria::default());
        assert!(said.contains("nothing oscillates") && said.contains("5.000e-2 s, 2.500e-3 s"), "{said}");
    }
}
