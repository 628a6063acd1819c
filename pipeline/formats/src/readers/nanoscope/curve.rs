//! The parts of one recorded quantity as channels.

use std::sync::Arc;

use crate::{FormatError, FoundChannel};

use super::header::{Header, Section};
use super::lengths::Lengths;
use super::scale;
use crate::fail;
use crate::grid::{Backwards, Grid, Store};
use crate::number::Number;
use crate::opened::Opened;
use crate::text;

/// One part of a curve.
struct Part {
    name: &'static str,
    samples: u64,
    /// Samples of the list that are stored before it.
    before: u64,
    backwards: bool,
    sample_rate_hz: Option<f64>,
}

/// Adds the channels of one force image list. Errors: its samples are not in the file.
pub(super) fn channels(
    file: &Opened,
    header: &Header,
    list: &Section,
    found: &mut Vec<FoundChannel>,
    remarks: &mut Vec<String>,
) -> Result<(), FormatError> {
    let force = header.section("Ciao force list");
    let lengths = Lengths::of(list, force, header)?;
    let Some(at) = list.integer("Data offset") else {
        return Err(fail::at(
            list.at,
            "found no `Data offset`, wanted the first byte of the samples",
            "copy the file again from the instrument",
        ));
    };
    let bytes = list.integer("Data length").unwrap_or_default();
    if at < header.end {
        let problem = format!("found samples from byte {at}, wanted them behind the header, from byte {}", header.end);
        return Err(fail::at(list.at, problem, "the header is damaged: copy the file again from the instrument"));
    }
    if at.checked_add(bytes).is_none_or(|end| end > file.bytes()) {
        return Err(fail::truncated("samples", at, bytes, file.bytes()));
    }
    let (internal, shown) = list.value("Image Data").map_or((None, None), scale::selection);
    let name = free_name(internal.or(shown).unwrap_or("data"), found);
    let (scale_factor, unit) = scale_of(header, list, &name, remarks);
    let code = if lengths.sample_bytes == 4 { Number::I32 } else { Number::I16 };
    for part in parts(&lengths, force, &name, remarks).into_iter().filter(|p| p.samples > 0) {
        let grid = Grid {
            store: Store::File(file.pinned().clone()),
            first: at + part.before * code.bytes(),
            step: code.bytes(),
            samples: part.samples as usize,
            number: code,
            big_endian: false,
        };
        let source: Arc<dyn crate::Source> = if part.backwards { Arc::new(Backwards(grid)) } else { Arc::new(grid) };
        let location = format!("/{name}/{}", part.name);
        found.push(FoundChannel {
            unit: unit.clone(),
            long_name: format!("{}, {}", shown.unwrap_or(&name), part.name),
            sample_rate_hz: part.sample_rate_hz,
            scale_factor,
            ..FoundChannel::new(location, part.samples as usize, code.name(), source)
        });
    }
    Ok(())
}

/// The same quantity may be recorded twice: `Height[2]`.
fn free_name(name: &str, found: &[FoundChannel]) -> String {
    let name = text::brief(name, 80);
    let taken = |n: &str| {
        found.iter().any(|c| c.location.strip_prefix('/').and_then(|l| l.rsplit_once('/')).is_some_and(|(l, _)| l == n))
    };
    if !taken(&name) {
        return name;
    }
    (2..).map(|i| format!("{name}[{i}]")).find(|n| !taken(n)).unwrap_or(name)
}

/// Factor and unit of the hard scale; what leads on to what the user sees is remarked.
fn scale_of(header: &Header, list: &Section, name: &str, remarks: &mut Vec<String>) -> (f64, String) {
    let value = list.value("Z scale").and_then(scale::value).unwrap_or_default();
    if let Some(soft) = &value.soft {
        let stated = header.anywhere(soft).and_then(|line| line.strip_prefix('V')).map(|v| text::brief(v.trim(), 60));
        let correction = header.anywhere("Deflection Sensitivity Correction").filter(|_| soft == "Sens. DeflSens");
        remarks.push(match stated {
            Some(stated) => {
                let correction = correction
                    .map_or(String::new(), |c| format!(" (Deflection Sensitivity Correction: {})", text::brief(c, 20)));
                format!("{name}: {soft} is {stated}{correction}; it is not applied")
            }
            None => format!("{name}: its soft scale {} is not in the header", text::brief(soft, 60)),
        });
    }
    if let Some(stiffness) = list.number("Spring Constant").filter(|_| value.soft.as_deref() == Some("Sens. DeflSens"))
    {
        remarks.push(format!("{name}: Spring Constant is {stiffness} N/m; it is not applied"));
    }
    value.hard.unwrap_or_else(|| {
        remarks.push(format!("{name}: no hard scale in the header: values are codes"));
        (1.0, String::new())
    })
}

/// The parts in the order in which they were recorded; stored are extend, retract, hold.
fn parts(lengths: &Lengths, force: Option<&Section>, name: &str, remarks: &mut Vec<String>) -> [Part; 3] {
    let duration = durations(force, lengths.retract > 0);
    if duration.is_none() {
        remarks.push(format!("{name}: no scan rate in the force list: no sample rate"));
    }
    let hold_s = force.and_then(|f| f.number("Hold Time")).filter(|&t| t > 0.0);
    if lengths.hold > 0 && hold_s.is_none() {
        remarks.push(format!("{name}: no hold time in the force list: no sample rate while the tip was held"));
    }
    let rate = |samples: u64, seconds: Option<f64>| seconds.map(|s| samples as f64 / s);
    let Lengths { extend, retract, hold, .. } = *lengths;
    [
        Part {
            name: "extend",
            samples: extend,
            before: 0,
            backwards: true,
            sample_rate_hz: rate(extend, duration.map(|d| d.0)),
        },
        Part {
            name: "hold",
            samples: hold,
            before: extend + retract,
            backwards: false,
            sample_rate_hz: rate(hold, hold_s),
        },
        Part {
            name: "retract",
            samples: retract,
            before: extend,
            backwards: false,
            sample_rate_hz: rate(retract, duration.map(|d| d.1)),
        },
    ]
}

/// Seconds of extend and retract: together 1/scan rate, inversely as their velocities, for both go the same way.
fn durations(force: Option<&Section>, both: bool) -> Option<(f64, f64)> {
    let cycle_s = 1.0 / force?.number("Scan rate").filter(|&r| r > 0.0)?;
    let velocity = |key| force.and_then(|f| f.number(key)).filter(|&v: &f64| v > 0.0);
    let (forward, reverse) = velocity("Forward vel.").zip(velocity("Reverse vel.")).unwrap_or((1.0, 1.0));
    let extend = cycle_s * reverse / (forward + reverse);
    let durations = (extend, cycle_s - extend);
    let sound = |d: f64| d.is_finite() && d > 0.0;
    (sound(durations.0) && (sound(durations.1) || !both)).then_some(durations)
}
