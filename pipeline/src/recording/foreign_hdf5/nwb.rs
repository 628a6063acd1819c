//! Time series of Neurodata Without Borders (NWB).
//!
//! A group with the dataset `data` (time is its first axis), and the single number `starting_time` with the attribute
//! `rate`, or the dataset `timestamps`, which is an axis as any other. Values are `data * conversion + offset` in
//! `unit`, attributes of `data`; of electrical series each channel may have a factor of its own on top, the dataset
//! `channel_conversion`.
//!
//! Source: "NWB Format Specification", version 2.8, `TimeSeries` and `ElectricalSeries`
//! (<https://nwb-schema.readthedocs.io>).

use super::stated::{Here, Stated, symbol};
use crate::hdf5_files::links::require_own_values;
use crate::hdf5_files::read::check_size;
use crate::recording::native::{has_attribute, number_attribute, text_attribute};

/// What `starting_time` is in.
const SECONDS: [&str; 4] = ["seconds", "second", "sec", "s"];

/// What an NWB time series states of its data; none if it is none.
pub(super) fn of(here: Here) -> Option<Stated> {
    if here.name != "data" {
        return None;
    }
    let kind = text_attribute(here.group, "neurodata_type", here.allowance);
    let clock = here.group.dataset("starting_time").ok().filter(|start| has_attribute(start, "rate"));
    if kind.is_none() && clock.is_none() {
        return None;
    }
    // rows of spikes are events: time runs along them
    let time_first = kind.is_none_or(|kind| kind != "SpikeEventSeries");
    let mut stated = Stated { time_first, ..Stated::default() };
    values(here, &mut stated);
    if let Some(clock) = clock.filter(|_| time_first) {
        let place = format!("{}/starting_time", here.path);
        match text_attribute(&clock, "unit", here.allowance) {
            Some(unit) if !SECONDS.contains(&unit.as_str()) => {
                let location = here.location;
                stated.remarks.push(format!("{location}: no sample rate: {place} is in «{unit}», wanted seconds"));
            }
            _ => {
                stated.sample_rate_hz = number_attribute(&clock, &place, "rate").ok();
                stated.start_s = single(&clock);
            }
        }
    }
    Some(stated)
}

/// Unit, scale and factors of the channels.
fn values(here: Here, stated: &mut Stated) {
    let number = |name: &str| number_attribute(here.dataset, here.location, name).ok();
    stated.unit = symbol(&text_attribute(here.dataset, "unit", here.allowance).unwrap_or_default());
    if let Some(conversion) = number("conversion") {
        stated.scale = Some((conversion, number("offset").unwrap_or(0.0)));
    }
    let Ok(factors) = here.group.dataset("channel_conversion") else { return };
    let own = require_own_values(&factors).is_ok() && check_size(&factors, size_of::<f64>(), here.allowance).is_ok();
    let columns = here.dataset.shape().get(1).copied().unwrap_or(1);
    let read = if own { factors.read_raw::<f64>().ok() } else { None };
    match read.filter(|factors| factors.len() == columns && factors.iter().all(|factor| factor.is_normal())) {
        Some(factors) => stated.factors = factors,
        None => {
            // without them the values would be wrong
            (stated.scale, stated.unit) = (None, String::new());
            stated.remarks.push(format!(
                "{}: the unit is not known: channel_conversion does not have a factor for each of {columns} channels",
                here.location
            ));
        }
    }
}

/// The value of a dataset of one number.
fn single(dataset: &hdf5::Dataset) -> Option<f64> {
    require_own_values(dataset).ok()?;
    let one = dataset.size() == 1 && dataset.dtype().ok()?.to_descriptor().is_ok_and(|kind| is_number(&kind));
    let values = if one { dataset.read_raw::<f64>().ok()? } else { Vec::new() };
    values.first().copied().filter(|value| value.is_finite())
}

fn is_number(kind: &hdf5::types::TypeDescriptor) -> bool {
    use hdf5::types::TypeDescriptor as T;
    matches!(kind, T::Integer(_) | T::Unsigned(_) | T::Float(_))
}
