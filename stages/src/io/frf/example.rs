//! The example of `io.frf`: it writes the responses of an oscillator at two points and reads them.

use std::path::Path;

use afmid_pipeline::{Example, Ports, StageError};
use num_complex::Complex64;

use super::stage::FRF;
use crate::artifacts::Frf;

/// An example's parameters are fixed text, so its folder is too.
const FOLDER: &str = "/tmp/afmid-example-frf";

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "two points of an oscillator, amplitude and phase in columns with titles, the sensor the other way round",
        params: "files = [\"/tmp/afmid-example-frf/points.csv\"]\npositions_m = [0.1, 0.3]\ndirections = [-1]\ndriving_point = 2",
        inputs: write_table,
        expect,
    }]
}

/// Receptance of an oscillator of 1 kg at 50 Hz, damping 2 %.
fn truth(frequency_hz: f64) -> Complex64 {
    let (w, natural) = (std::f64::consts::TAU * frequency_hz, std::f64::consts::TAU * 50.0);
    1.0 / Complex64::new(natural * natural - w * w, 2.0 * 0.02 * natural * w)
}

fn write_table() -> Result<Ports, StageError> {
    std::fs::create_dir_all(FOLDER).map_err(|error| StageError::from_error(error).at(FOLDER))?;
    let line = |k: usize| {
        let (f, h) = (k as f64, -truth(k as f64));
        format!("{f},{},{},{},{}\n", h.norm(), h.arg().to_degrees(), 0.5 * h.norm(), h.arg().to_degrees())
    };
    let rows: String = (1..=100).map(line).collect();
    // written whole under another name, then renamed: examples may run at the same time
    let partial = format!("{FOLDER}/{:?}.tmp", std::thread::current().id());
    let titles = "Frequency (Hz),Amplitude a (m/N),Phase a (deg),Amplitude b (m/N),Phase b (deg)\n";
    std::fs::write(&partial, format!("{titles}{rows}"))
        .and_then(|()| std::fs::rename(&partial, Path::new(FOLDER).join("points.csv")))
        .map_err(|error| StageError::from_error(error).at(FOLDER))?;
    Ok(Ports::new())
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let array = outputs.get(&FRF).map_err(|error| error.to_string())?;
    let frf = Frf::new(array).map_err(|error| error.to_string())?;
    // amplitude and phase are written to sixteen digits
    let near = |(value, f): (&Complex64, &f64)| (value - truth(*f)).norm() < 1e-12 * truth(*f).norm();
    let right = frf.row(0).iter().zip(frf.frequency_hz).all(near);
    let [first, second] = &frf.responses[..] else { return Err(format!("{} responses", frf.responses.len())) };
    let placed = first.input.position_m == Some(0.1) && second.output.is(&second.input) && first.input.turned;
    let stated = frf.quantity.name() == "receptance" && frf.unit == "m/N" && frf.driving_point == Some(1);
    match right && placed && stated {
        true => Ok("two receptances in m/N, driving point at 0.3 m".to_owned()),
        false => Err(format!("{:?}: {:?}", frf.quantity, frf.responses)),
    }
}
