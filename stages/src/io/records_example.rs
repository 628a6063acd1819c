//! The example of `io.records`: it writes three small records and opens them.

use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::{Artifact, Example, Ports, StageError};

/// An example's parameters are fixed text, so its folder is too.
const FOLDER: &str = "/tmp/afmid-example-records";

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "three records, opened in natural order, their codes untouched",
        params: "files = [\"/tmp/afmid-example-records/*.h5\"]",
        inputs: write_records,
        expect,
    }]
}

fn codes(number: i16) -> Vec<i16> {
    (0..1000).map(|k| k * 7 % 101 - 50 + number).collect()
}

fn write_records() -> Result<Ports, StageError> {
    std::fs::create_dir_all(FOLDER).map_err(|error| StageError::from_error(error).at(FOLDER))?;
    for number in [10, 9, 1] {
        let channel = NativeChannel {
            location: "deflection".to_owned(),
            codes: Codes::Int16(codes(number)),
            unit: "V".to_owned(),
            scale_factor: 0.977e-3,
            add_offset: 0.0,
            long_name: "photodiode signal".to_owned(),
        };
        let record = NativeRecord {
            sample_rate_hz: 5e6,
            started_at: "2005-03-01T10:00:00Z".to_owned(),
            channels: vec![channel],
        };
        let path = Path::new(FOLDER).join(format!("record_{number}.h5"));
        write_native(&path, &record, RecordStorage::Deflate(4)).map_err(StageError::from_error)?;
    }
    Ok(Ports::new())
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let Some(Artifact::Recording(recording)) = outputs.artifact("records") else {
        return Err("no recording".to_owned());
    };
    let names: Vec<&str> = recording.records.iter().map(|record| record.name.as_str()).collect();
    if names != ["record_1.h5", "record_9.h5", "record_10.h5"] {
        return Err(format!("found {names:?}"));
    }
    let channel = recording.records[2].channel("deflection").map_err(|error| error.to_string())?;
    let values = channel.read(500, 2).map_err(|error| error.to_string())?;
    let wanted: Vec<f64> = codes(10)[500..502].iter().map(|&code| f64::from(code) * 0.977e-3).collect();
    if values != wanted {
        return Err(format!("read {values:?} at sample 500, wanted {wanted:?}"));
    }
    Ok(format!("{} in this order, 1000 samples each at 5 MS/s", names.join(", ")))
}
