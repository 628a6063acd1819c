//! The example of `spectrum.frf`.

use afmid_pipeline::{Example, Ports};

use super::frf::{ENSEMBLE, FRF, PAIR};
use crate::artifacts::DataSet;
use crate::ensemble::example::{FREQUENCY_HZ, QUALITY_FACTOR, ensemble, pair_of};

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "One resonance from twelve releases, in noise of a millivolt",
        params: "bandwidth_hz = 400e3",
        inputs: || {
            Ok(Ports::new().with(&ENSEMBLE, ensemble()).with(&PAIR, pair_of(&[0.0; 4096], None, &[DataSet::All])))
        },
        expect: |outputs| {
            let array = outputs.get(&FRF).map_err(|error| error.to_string())?;
            let f = &array.axis("frequency_hz").map_err(|error| error.to_string())?.values;
            let g = array.complex("transfer").map_err(|error| error.to_string())?;
            let v = array.real("variance").map_err(|error| error.to_string())?;
            let peak =
                (1..g.len()).filter(|&k| g[k].re.is_finite()).max_by(|&a, &b| g[a].norm().total_cmp(&g[b].norm()));
            let Some(k) = peak else { return Err("nothing is defined".to_owned()) };
            let error = v[k].sqrt();
            // the nearest bin: 120 kHz lies 0.3 bins from one, a twentieth of the width; the force scales with the mean
            // amplitude, 3 % of 12
            if (f[k] - FREQUENCY_HZ).abs() < 1.3e3 && (g[k].norm() / QUALITY_FACTOR - 1.0).abs() < 0.12 && error < 0.05
            {
                Ok(format!("It peaks at {:.1} kHz with {:.2} +- {error:.3}.", 1e-3 * f[k], g[k].norm()))
            } else {
                Err(format!("{} Hz, {} +- {error}", f[k], g[k].norm()))
            }
        },
    }]
}
