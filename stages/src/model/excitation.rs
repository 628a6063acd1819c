//! What an input excites.

use afmid_pipeline::StageError;

use afmid_kernels::validation::single_sine;

/// Errors: the input does not change.
pub(super) fn require_a_change(input: &[f64]) -> Result<(), StageError> {
    let Some((first, rest)) = input.split_first() else { return Ok(()) };
    if rest.iter().any(|value| value != first) {
        return Ok(());
    }
    let problem =
        format!("the input is {first} throughout: it does nothing, and the output says nothing of a response");
    Err(StageError::new(problem).help(
        "begin the record before the input changes; of a free motion `model.decay` finds the modes (`afmid.ringdown` in \
         Python)",
    ))
}

/// Errors: the input is one sine and nothing else of it shows in the output, so that a model says nothing elsewhere.
pub(super) fn require_more_than_a_sine(input: &[f64], output: &[f64], rate_hz: f64) -> Result<(), StageError> {
    let Some(sine) = single_sine(input, output) else { return Ok(()) };
    let problem = format!(
        "the input is a sine of {:.6} Hz ({:.3} % of its energy), and nothing else of it shows in the output: nothing is \
         known of the system at any other frequency",
        sine.cycles_per_sample * rate_hz,
        100.0 * (1.0 - sine.rest)
    );
    Err(StageError::new(problem).help(
        "excite more than one frequency: a step, a hit, noise, a sweep; or fit a stretch in which the sine is switched \
         on or off, with what comes before",
    ))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use afmid_pipeline::{Array, Axis, Context, Ports, Stage};

    use crate::model::pem::PAIR;
    use crate::model::{Pem, SubspaceEstimate};

    /// A lag of a few samples that answers a sine, or a sine and a step; the output with noise.
    fn pair(cycles: f64, step: f64) -> Ports {
        pair_of((0..600).map(|k| (TAU * cycles * k as f64).sin() + if k > 250 { step } else { 0.0 }).collect())
    }

    fn pair_of(u: Vec<f64>) -> Ports {
        let samples = u.len();
        let mut y = vec![0.0; samples];
        for k in 1..samples {
            y[k] = 0.8 * y[k - 1] + 0.2 * u[k - 1];
        }
        let noise = |k: usize| 1e-3 * ((k * k) as f64).sin();
        y.iter_mut().enumerate().for_each(|(k, y)| *y += noise(k));
        let time = Axis::new("time", "s", "time", (0..samples).map(|k| k as f64 / 200.0).collect());
        let array = Array::over(vec![time])
            .with("force", "V", "input", &["time"], u)
            .with("response", "V", "output", &["time"], y)
            .attribute("sample_rate_hz", 200.0);
        Ports::new().with(&PAIR, array)
    }

    #[test]
    fn a_model_of_an_input_that_does_nothing_is_refused() {
        let still = pair_of(vec![0.3; 600]);
        let subspace = SubspaceEstimate { weight: afmid_kernels::subspace::Weight::Cva, ..SubspaceEstimate::default() };
        let pem = Pem { order: crate::model::Count::Fixed(1), ..Pem::default() };
        for refused in [pem.run(&still, &Context::alone(0)), subspace.run(&still, &Context::alone(0))] {
            let refused = refused.unwrap_err();
            assert!(refused.problem.starts_with("the input is 0.3 throughout: it does nothing"), "{}", refused.problem);
        }
    }

    #[test]
    fn a_model_of_a_single_sine_is_refused_with_its_frequency() {
        let pem = Pem { order: crate::model::Count::Fixed(1), ..Pem::default() };
        for cycles in [0.012, 0.1, 0.31] {
            let wanted = format!("the input is a sine of {:.6} Hz", 200.0 * cycles);
            let refused = pem.run(&pair(cycles, 0.0), &Context::alone(0)).unwrap_err().problem;
            assert!(refused.starts_with(&wanted), "{refused}");
            let refused = SubspaceEstimate::default().run(&pair(cycles, 0.0), &Context::alone(0)).unwrap_err().problem;
            assert!(refused.starts_with(&wanted), "{refused}");
            assert!(pem.run(&pair(cycles, 0.5), &Context::alone(0)).is_ok());
        }
    }
}
