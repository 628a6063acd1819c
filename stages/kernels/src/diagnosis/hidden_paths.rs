//! What remembers or changes with time, simulated in small steps: the numerics of the tests, not those of the causes.

use crate::causes::built_in;
use crate::effects::{Effects, Passage};

/// What a signal passes through, called with its value, the time and the time since it was called before.
pub(super) type Step = Box<dyn FnMut(f64, f64, f64) -> f64>;

/// An actuator's steps, in the order of the causes.
pub(super) fn actuator(hidden: &[(&str, Vec<f64>)]) -> Vec<Step> {
    hidden.iter().flat_map(|(id, values)| input(id, values)).collect()
}

/// A detector's steps, in the order of the causes.
pub(super) fn detector(hidden: &[(&str, Vec<f64>)]) -> Vec<Step> {
    hidden.iter().flat_map(|(id, values)| output(id, values)).collect()
}

/// A value through all steps.
pub(super) fn through(steps: &mut [Step], value: f64, time_s: f64, since_s: f64) -> f64 {
    steps.iter_mut().fold(value, |value, step| step(value, time_s, since_s))
}

fn maps(passages: Vec<Passage>) -> Vec<Step> {
    let of = |passage| -> Step {
        match passage {
            Passage::Map(map) => Box::new(move |value, _, _| map(value)),
            Passage::Path(_) => panic!("a path that is not simulated here"),
        }
    };
    passages.into_iter().map(of).collect()
}

fn added(id: &str, values: &[f64]) -> Effects {
    let mut effects = Effects::default();
    built_in(id).expect("a cause").add(values, &mut effects);
    effects
}

fn input(id: &str, values: &[f64]) -> Vec<Step> {
    match id {
        "backlash" => {
            let (width, mut place) = (values[0], 0.0);
            vec![Box::new(move |u, _, _| {
                if u - place > width {
                    place = u - width;
                } else if place - u > width {
                    place = u + width;
                }
                place
            })]
        }
        "creep" => {
            let (share, time_s) = (values[0], values[1]);
            let mut before: Option<(f64, [f64; 6])> = None;
            vec![Box::new(move |u, _, since_s| {
                let (from, mut lags) = before.unwrap_or((u, [0.0; 6]));
                for (i, lag) in lags.iter_mut().enumerate() {
                    // the trapezoidal rule
                    let a = 0.5 * since_s / (time_s * 10f64.powi(i as i32));
                    *lag = (*lag * (1.0 - a) + a * (from + u)) / (1.0 + a);
                }
                before = Some((u, lags));
                u + share * lags.iter().sum::<f64>()
            })]
        }
        _ => maps(added(id, values).input),
    }
}

fn output(id: &str, values: &[f64]) -> Vec<Step> {
    match id {
        "slew-rate" => {
            let (rate, mut seen) = (1.0 / values[0], None);
            vec![Box::new(move |v, _, since_s| {
                let from = seen.unwrap_or(v);
                let next =
                    if (v - from).abs() > rate * since_s { from + rate * since_s * (v - from).signum() } else { v };
                seen = Some(next);
                next
            })]
        }
        "gain-step" => {
            let (change, at_s) = (values[0], values[1]);
            vec![Box::new(move |v, time_s, _| if time_s >= at_s { v * (1.0 + change) } else { v })]
        }
        _ => maps(added(id, values).optics),
    }
}
