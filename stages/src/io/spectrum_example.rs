//! The example of `io.spectrum`: it writes a small spectrum and opens it.

use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::{Example, Ports, StageError};

use super::spectrum::DENSITY;

/// An example's parameters are fixed text, so its folder is too.
const FOLDER: &str = "/tmp/afmid-example-spectrum";

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "a flat spectrum of 64 averages, its first bin left out",
        params: "file = \"/tmp/afmid-example-spectrum/flat.h5\"\nfrequency = \"/f\"\ndensity = \"/psd\"\naverages = 64\nlowest_hz = 1",
        inputs: write,
        expect: |outputs| {
            let array = outputs.get(&DENSITY).map_err(|error| error.to_string())?;
            let frequency = &array.axis("frequency_hz").map_err(|error| error.to_string())?.values;
            let error = array.real("standard_error").map_err(|error| error.to_string())?;
            // steps of 0.5 Hz from 0 to 49.5, from 1 on: 98; an eighth of 3e-3
            if frequency.len() == 98 && frequency[0] == 1.0 && error.iter().all(|e| (e - 3.75e-4).abs() < 1e-15) {
                Ok(format!("{} bins from {} Hz, each good to an eighth.", frequency.len(), frequency[0]))
            } else {
                Err(format!("{} bins, errors {error:?}", frequency.len()))
            }
        },
    }]
}

fn write() -> Result<Ports, StageError> {
    std::fs::create_dir_all(FOLDER).map_err(|error| StageError::from_error(error).at(FOLDER))?;
    let dataset = |location: &str, codes: Vec<i16>, unit: &str, scale_factor: f64| NativeChannel {
        location: location.to_owned(),
        codes: Codes::Int16(codes),
        unit: unit.to_owned(),
        scale_factor,
        add_offset: 0.0,
        long_name: String::new(),
    };
    let channels = vec![dataset("f", (0..100).collect(), "Hz", 0.5), dataset("psd", vec![3; 100], "V^2/Hz", 1e-3)];
    let record = NativeRecord { sample_rate_hz: 1.0, started_at: String::new(), channels };
    let path = Path::new(FOLDER).join("flat.h5");
    // two examples may run at once: the file comes whole or not at all
    let own = path.with_extension(format!("{}-{:?}", std::process::id(), std::thread::current().id()));
    write_native(&own, &record, RecordStorage::Deflate(4)).map_err(StageError::from_error)?;
    std::fs::rename(&own, &path).map_err(|error| StageError::from_error(error).at(&path))?;
    Ok(Ports::new())
}
