//! Simulated records in memory for the examples of this domain: the default microscope of `simulate.afm`.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Ports, Recording, Shaped, StageError};

use crate::io::{memory_channel, memory_record};
use crate::simulate::Afm;
use afmid_kernels::simulate::{Archive, ArchiveLayout, Scatter, Target};

/// Two records of 0.12 s at 10 cycles per second, a snap-in and a snap-off in each.
pub(super) fn records() -> Result<Ports, StageError> {
    simulated(&Afm { ramp_hz: 10.0, samples: 600_000, ..Afm::default() }, 2, Some(2))
}

/// Four short records of the lever far from the sample.
pub(crate) fn free_records() -> Result<Ports, StageError> {
    simulated(&Afm { ramp_hz: 0.1, samples: 150_000, phases: Some(vec![0.0; 4]), ..Afm::default() }, 4, None)
}

fn simulated(afm: &Afm, records: usize, events: Option<usize>) -> Result<Ports, StageError> {
    let microscope = afm.microscope();
    let layout = ArchiveLayout {
        records,
        samples: afm.samples,
        margin_samples: 10_000,
        target: Target { snap_ins: events, snap_offs: events },
        phases: afm.phases.clone(),
        scatter: Scatter { surface_m: afm.surface_m, surface_std_m: afm.surface_std_m },
        seed: 4,
    };
    let archive = Archive::plan(&microscope, &layout).map_err(StageError::from_error)?;
    let records = (0..records)
        .map(|number| {
            let record = archive.simulate(&microscope, number);
            let deflection = memory_channel("deflection", Raw::Int16(record.deflection), afm.lsb_v);
            let piezo = memory_channel("piezo", Raw::Int16(record.piezo), afm.piezo_lsb_v);
            memory_record(&format!("record_{number:04}.h5"), afm.sample_rate_hz, vec![deflection, piezo])
        })
        .collect();
    let mut ports = Ports::new();
    ports.insert("records", Recording { records }.wrap());
    Ok(ports)
}
