//! Waveforms of Keysight's Infiniium oscilloscopes.
//!
//! `/Waveforms/Channel 1` (also `Memory 1`, `Function 1`, ...) has the dataset `Channel 1Data`, or one for each segment,
//! `Channel 1 Seg2Data`, and the attributes `XInc`, `XOrg`, `XUnits` ("Second"), `YInc`, `YOrg`, `YUnits` ("Volt"),
//! `NumPoints`. Whole numbers are codes, value = code * YInc + YOrg; numbers with a fraction are values already. A
//! segment may have its own `SegmentedXOrg`.
//!
//! Source: Keysight, "Infiniium User's Guide", "HDF5 Schema for Infiniium Oscilloscope Data".

use hdf5::types::TypeDescriptor;

use super::stated::{Here, Stated, symbol};
use crate::recording::native::{number_attribute, text_attribute};

/// What an Infiniium's group states of a waveform; none if it is none.
pub(super) fn of(here: Here) -> Option<Stated> {
    let source = here.path.strip_prefix("/Waveforms/").filter(|source| !source.contains('/'))?;
    here.name.strip_prefix(source).filter(|rest| rest.ends_with("Data"))?;
    let number = |name: &str| number_attribute(here.group, here.path, name).ok().filter(|number| number.is_finite());
    let step_s = number("XInc")?;
    let text = |name: &str| text_attribute(here.group, name, here.allowance).unwrap_or_default();
    let mut stated = Stated { time_first: true, ..Stated::default() };
    match unfit(here, &text("XUnits"), number("NumPoints")) {
        None => {
            stated.sample_rate_hz = Some(step_s.recip());
            let own = number_attribute(here.dataset, here.location, "SegmentedXOrg").ok();
            stated.start_s = own.filter(|start| start.is_finite()).or_else(|| number("XOrg"));
        }
        Some(why) => stated.remarks.push(format!("{}: no sample rate: {why}", here.location)),
    }
    let unit = symbol(&text("YUnits"));
    match here.dataset.dtype().and_then(|kind| kind.to_descriptor()) {
        Ok(TypeDescriptor::Float(_)) => stated.unit = unit,
        _ => codes(here, unit, &mut stated),
    }
    Some(stated)
}

/// Why the samples do not follow one another in steps of `XInc` seconds.
fn unfit(here: Here, x_unit: &str, points: Option<f64>) -> Option<String> {
    let samples = here.dataset.size();
    if symbol(x_unit) != "s" {
        return Some(format!("XUnits is «{}», wanted Second", x_unit.escape_debug()));
    }
    let other = points.filter(|points| *points != samples as f64)?;
    Some(format!("NumPoints is {other}, there are {samples} samples"))
}

/// Scale and unit of whole numbers.
fn codes(here: Here, unit: String, stated: &mut Stated) {
    let number = |name: &str| number_attribute(here.group, here.path, name).ok();
    let (Some(step), Some(origin)) = (number("YInc"), number("YOrg")) else { return };
    match number("YReference").filter(|reference| *reference != 0.0) {
        None => (stated.scale, stated.unit) = (Some((step, origin)), unit),
        Some(reference) => stated.remarks.push(format!(
            "{}: the unit is not known: YReference is {reference}, wanted 0: the samples are left as codes",
            here.location
        )),
    }
}
