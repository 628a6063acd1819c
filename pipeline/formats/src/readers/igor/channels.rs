//! The columns of a wave as channels.

use std::sync::Arc;

use crate::{FormatError, FoundChannel};

use super::header::{Header, Part};
use super::note::{Note, part};
use crate::fail;
use crate::grid::{Grid, Store};
use crate::number::{Number, Order};
use crate::opened::Opened;
use crate::text;

/// Above this a wave is a picture or a map, and channels are more trouble than help; a curve has a handful of columns.
const MOST_COLUMNS: u64 = 4096;

/// One channel per column. Errors: too many columns.
pub(super) fn of(
    file: &Opened,
    header: &Header,
    code: Number,
    note: &Note,
    remarks: &mut Vec<String>,
) -> Result<Vec<FoundChannel>, FormatError> {
    if header.unsaved() {
        remarks.push(format!(
            "the {} samples of wave `{}` were not saved, for the formula gives them: no channel; in Igor, copy it to a \
             free wave (`Duplicate`) and save that",
            header.points, header.name
        ));
        return Ok(Vec::new());
    }
    if header.points == 0 {
        remarks.push(format!("wave `{}` has no points", header.name));
    }
    let rows = header.dims.first().copied().unwrap_or(0);
    // check() made dims' product the number of points, so this divides
    let columns = header.points.checked_div(rows).unwrap_or(1);
    if columns > MOST_COLUMNS {
        return Err(fail::at(
            132,
            format!(
                "found {columns} columns of {rows} samples, wanted at most {MOST_COLUMNS}: this looks like an image or \
                 a map, not like recordings"
            ),
            "save the columns of interest as a wave of their own",
        ));
    }
    let sample_rate_hz = sample_rate_hz(file, header, note, remarks);
    let unit =
        long_text(file, "the data unit", header.long_data_unit, remarks).unwrap_or_else(|| header.data_unit.clone());
    calibration(note, remarks);
    let labels = labels(file, header.column_labels, columns, remarks);
    let channel = |column: u64| {
        let label = labels.get(column as usize).filter(|label| is_unique(label, &labels));
        let grid = Grid {
            store: Store::File(file.pinned().clone()),
            first: header.data.at + column * rows * code.bytes(),
            step: code.bytes(),
            samples: rows as usize,
            number: code,
            big_endian: header.order == Order::Big,
        };
        FoundChannel {
            unit: unit_of(&unit, label, note),
            long_name: label.map_or_else(|| header.name.clone(), |label| format!("{}, {label}", header.name)),
            sample_rate_hz,
            ..FoundChannel::new(location(header, label, column, columns), rows as usize, code.name(), Arc::new(grid))
        }
    };
    let channels: Vec<_> = (0..columns).map(channel).collect();
    if unit.is_empty() && channels.iter().any(|c| !c.unit.is_empty()) {
        remarks.push(
            "the wave states no data unit: units are those of Asylum Research's channels of these names".to_owned(),
        );
    }
    Ok(channels)
}

fn location(header: &Header, label: Option<&String>, column: u64, columns: u64) -> String {
    match label {
        Some(label) => format!("/{label}"),
        None if columns == 1 => format!("/{}", header.name),
        None => format!("/{}[{column}]", header.name),
    }
}

/// A label locates its column if it is not empty and no other column's.
fn is_unique(label: &str, labels: &[String]) -> bool {
    !label.is_empty() && labels.iter().filter(|other| *other == label).count() == 1
}

/// Labels of the columns: fields of 32 bytes, the first of which names the dimension itself.
fn labels(file: &Opened, at: Part, columns: u64, remarks: &mut Vec<String>) -> Vec<String> {
    let bytes = part(file, "the column labels", at, remarks).unwrap_or_default();
    bytes.as_chunks::<32>().0.iter().skip(1).take(columns as usize).map(|label| text::field(label)).collect()
}

fn long_text(file: &Opened, what: &str, at: Part, remarks: &mut Vec<String>) -> Option<String> {
    part(file, what, at, remarks).map(|bytes| text::field(&bytes))
}

/// From the row scaling if its unit is a time, else from the note.
fn sample_rate_hz(file: &Opened, header: &Header, note: &Note, remarks: &mut Vec<String>) -> Option<f64> {
    let unit = long_text(file, "the x unit", header.long_x_unit, remarks).unwrap_or_else(|| header.x_unit.clone());
    let noted = note.positive("NumPtsPerSec");
    let Some(unit_s) = seconds(&unit) else {
        let axis = if unit.is_empty() {
            "the x axis has no unit".to_owned()
        } else {
            format!("the x axis is in {}, no time", text::brief(&unit, 40))
        };
        remarks.push(match noted {
            Some(rate) => format!("{axis}: the sample rate is the note's NumPtsPerSec, {rate} Hz"),
            None => format!("{axis}: no sample rate"),
        });
        return noted;
    };
    let rate = 1.0 / (header.x_step * unit_s);
    if !(rate.is_finite() && rate > 0.0) {
        remarks.push(format!("the time step is {} {unit}, wanted one above 0: it gives no sample rate", header.x_step));
        return noted;
    }
    // 1e-3: far above rounding of either number, far below any other setting of the instrument
    if let Some(noted) = noted.filter(|noted| (noted / rate - 1.0).abs() > 1e-3) {
        remarks.push(format!(
            "the x scaling gives a sample rate of {rate} Hz, the note's NumPtsPerSec {noted}: the former is used"
        ));
    }
    if header.x_start != 0.0 {
        remarks.push(format!("time starts at {} {unit}", header.x_start));
    }
    Some(rate)
}

/// Length of a unit of time; `dat` is Igor's name for dates in seconds.
fn seconds(unit: &str) -> Option<f64> {
    match unit {
        "s" | "sec" | "dat" => Some(1.0),
        "ms" => Some(1e-3),
        "us" | "µs" | "μs" => Some(1e-6),
        "ns" => Some(1e-9),
        _ => None,
    }
}

/// The header's unit; where it has none and the note is Asylum's, that of its channel of this name.
fn unit_of(unit: &str, label: Option<&String>, note: &Note) -> String {
    let known = match label.map(String::as_str) {
        Some("Raw" | "Defl" | "Deflection" | "ZSnsr" | "ZSensor" | "LVDT" | "Height") => "m",
        Some("DeflV" | "DeflVolts" | "ZSensorVolts" | "Volts") => "V",
        Some("Force") => "N",
        _ => "",
    };
    let asylum = note.value("InvOLS").is_some();
    if unit.is_empty() && asylum { known.to_owned() } else { unit.to_owned() }
}

/// Remarks what Asylum's note says of the cantilever: it leads from metres back to volts and on to newtons.
fn calibration(note: &Note, remarks: &mut Vec<String>) {
    if let Some(sensitivity) = note.positive("InvOLS") {
        remarks.push(format!(
            "InvOLS (deflection sensitivity) is {sensitivity} m/V: deflection in m divided by it gives V"
        ));
    }
    if let Some(stiffness) = note.positive("SpringConstant") {
        remarks.push(format!("SpringConstant is {stiffness} N/m: deflection in m times it gives N"));
    }
}
