//! Transfer functions: ETFE, smoothed ETFE and parametric estimate of one origin, as curves of a Bode plot.

use afmid_kernels::events::EventKind;
use afmid_pipeline::{Array, Document, RunResult, StageRecord, StateSpace};
use num_complex::Complex64;
use serde_json::Value;

use super::bode::{BodeCurve, Smoothness};
use super::response::model_curve;
use crate::report::figure::{Colour, Stroke};
use crate::report::find::{Found, all, depends_on, frequency_axis, real_over};
use crate::report::number::rounded;
use crate::report::origin::Origin;

/// What an estimate is, from the stage that made it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Role {
    Raw,
    Parametric,
    Smoothed,
}

/// All estimates of one origin, in drawing order; `prefix` begins their names.
pub(crate) fn curves(run: &RunResult, origin: Origin, prefix: &str) -> Vec<BodeCurve> {
    let mut found: Vec<(Role, &StageRecord, BodeCurve)> = Vec::new();
    for estimate in all::<Array>(run).filter(|estimate| estimate.origin(run) == origin) {
        if let Some((role, curve)) = array_curve(&estimate, origin, prefix) {
            found.push((role, estimate.stage, curve));
        }
    }
    if !found.iter().any(|(role, _, _)| *role == Role::Parametric) {
        found.extend(state_space_curve(run, origin, prefix).map(|(stage, curve)| (Role::Parametric, stage, curve)));
    }
    // several of one role (a plugin's beside a built-in one): the stage's id tells them apart
    for role in [Role::Raw, Role::Parametric, Role::Smoothed] {
        if found.iter().filter(|(have, _, _)| *have == role).count() > 1 {
            let same = found.iter_mut().filter(|(have, _, _)| *have == role);
            for (index, (_, stage, curve)) in same.enumerate() {
                curve.series = format!("{} ({})", curve.series, stage.id);
                if index > 0 {
                    curve.stroke.colour = Colour::cycle(index + 1);
                }
            }
        }
    }
    found.sort_by_key(|(role, _, _)| *role);
    found.into_iter().map(|(_, _, curve)| curve).collect()
}

fn style(role: Role, origin: Origin, prefix: &str) -> (String, Stroke) {
    let (name, stroke) = match (role, origin) {
        (Role::Raw, _) => ("ETFE", Stroke::solid(Colour::Vermillion, 0.8)),
        (Role::Smoothed, Origin::Event(EventKind::SnapIn)) => ("smoothed ETFE", Stroke::solid(Colour::Blue, 1.6)),
        (Role::Smoothed, _) => ("smoothed ETFE", Stroke::dashed(Colour::Sky, 1.6)),
        (Role::Parametric, _) => ("parametric", Stroke::solid(Colour::Ink, 1.5)),
    };
    (format!("{prefix}{name}"), stroke)
}

/// A curve from an array with a complex `transfer` over frequency.
fn array_curve(found: &Found<'_, Array>, origin: Origin, prefix: &str) -> Option<(Role, BodeCurve)> {
    let axis = frequency_axis(found.value)?;
    let transfer: &[Complex64] = found.value.complex("transfer").ok().filter(|h| h.len() == axis.values.len())?;
    let role = match found.stage.uses.as_str() {
        uses if uses.starts_with("model.") => Role::Parametric,
        uses if uses.contains("etfe") => Role::Raw,
        _ => Role::Smoothed,
    };
    let (name, stroke) = style(role, origin, prefix);
    let curve = BodeCurve::new(&name, &axis.values, transfer, stroke);
    let curve = match role {
        Role::Raw => curve.measured(Smoothness::Noisy),
        Role::Smoothed => curve.measured(Smoothness::Smoothed),
        Role::Parametric => curve,
    };
    let over = |name: &str| real_over(found.value, name, axis);
    let curve = match (over("variance"), over("magnitude_std"), over("phase_std")) {
        (_, Some(magnitude), Some(phase)) => curve.with_errors(&axis.values, magnitude, phase),
        (Some(variance), _, _) => curve.with_variance(&axis.values, transfer, variance),
        _ => curve,
    };
    Some((role, curve))
}

/// A curve computed from the model that the modes were taken from, else from the last model.
fn state_space_curve<'a>(run: &'a RunResult, origin: Origin, prefix: &str) -> Option<(&'a StageRecord, BodeCurve)> {
    let models: Vec<Found<'a, StateSpace>> =
        all::<StateSpace>(run).filter(|model| Origin::of(run, model.stage) == origin).collect();
    let modes: Vec<&StageRecord> = run.stages.iter().filter(|stage| stage.uses == "model.modes").collect();
    let read = |model: &&Found<'_, StateSpace>| modes.iter().any(|stage| depends_on(run, stage, &model.stage.id));
    let chosen = models.iter().rev().find(read).or(models.last())?;
    let lowest = all::<Array>(run)
        .filter_map(|array| frequency_axis(array.value)?.values.iter().copied().find(|f| *f > 0.0))
        .fold(f64::INFINITY, f64::min);
    let (frequency_hz, transfer) = model_curve(chosen.value, Some(lowest))?;
    let (name, stroke) = style(Role::Parametric, origin, prefix);
    Some((chosen.stage, BodeCurve::new(&name, &frequency_hz, &transfer, stroke)))
}

/// The resonances of the first modal table of one origin, as rules with their words.
pub(crate) fn mode_rules(run: &RunResult, origin: Origin) -> Vec<(f64, String)> {
    let documents = all::<Document>(run).filter(|found| Origin::of(run, found.stage) == origin);
    let modes =
        documents.filter_map(|found| found.value.0.get("modes")?.as_array().cloned()).next().unwrap_or_default();
    let frequency = |mode: &Value| mode.get("frequency_hz").and_then(Value::as_f64).filter(|f| *f > 0.0);
    modes.iter().filter_map(frequency).map(|f| (f, rounded(f, 4, "Hz"))).collect()
}
