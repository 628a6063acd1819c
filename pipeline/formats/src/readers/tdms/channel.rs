//! From the objects of a file to its channels.

use super::object::{Object, Stream, group_and_channel};
use super::scale::{self, Scaling};
use super::source::Samples;
use super::timing;
use super::walk::Recorded;
use crate::facts::BEGINS_LATER;
use crate::number::Order;
use crate::pinned::Pinned;
use crate::rate::{Clue, agreed_rate, agreed_start};
use crate::{Contents, FoundChannel};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// What a file of these objects holds.
pub(super) fn contents(recorded: Recorded, pinned: &Pinned) -> Contents {
    let Recorded { version, order, mut objects, mut remarks } = recorded;
    for object in objects.iter_mut().filter(|o| !o.streams.is_empty()) {
        object.timing.finish(&object.properties);
    }
    let began = objects.iter().filter_map(|o| o.timing.began).min();
    let stated = objects.iter().find(|o| o.path == "/").and_then(|root| root.properties.time("DateTime"));
    let started_at = began.or(stated).and_then(|stamp| stamp.iso()).unwrap_or_default();
    let scalings = scalings(&objects);
    let locations = locations(&objects);
    let named: Vec<(Said, Said)> =
        (0..objects.len()).map(|at| (named_rate(at, &objects), named_start(at, &objects))).collect();
    let mut channels = Vec::new();
    for (((object, scaling), location), named) in objects.iter_mut().zip(scalings).zip(locations).zip(named) {
        if object.streams.is_empty() {
            if object.index.is_some() {
                remarks.push(format!("{location} has no samples: it is left out"));
            }
            continue;
        }
        match scaling.and_then(|scaling| channel(object, scaling, &location, pinned, &mut remarks)) {
            Ok(mut channel) => {
                if channel.sample_rate_hz.is_none() {
                    channel.sample_rate_hz = named.0.0;
                    remarks.extend(named.0.1.filter(|remark| !remarks.contains(remark)));
                }
                channel.start_s = match (object.timing.began, began) {
                    (Some(own), Some(first)) => Some(own.seconds_since(first)),
                    // of channels without stamps the offsets alone tell, or a number that is named so
                    (None, None) if named.1 == (None, None) => Some(object.timing.offset_s),
                    (None, None) => named.1.0,
                    _ => None,
                };
                remarks.extend(named.1.1.filter(|remark| !remarks.contains(remark)));
                if let Some(later) = channel.start_s.filter(|start| *start != 0.0) {
                    remarks.push(format!("{location} begins {later} {BEGINS_LATER}"));
                }
                channels.push(channel);
            }
            Err(why) => remarks.push(format!("{location} is left out: {why}")),
        }
    }
    let lengths: HashSet<usize> = channels.iter().map(|c| c.samples).collect();
    if lengths.len() > 1 {
        remarks.push("the channels have different numbers of samples".to_owned());
    }
    let number = if version == 4712 { "1.0" } else { "2.0" };
    let order = if order == Order::Little { "little-endian" } else { "big-endian" };
    Contents {
        format: format!("NI TDMS {number} ({version}), {order}"),
        started_at,
        channels,
        responses: Vec::new(),
        remarks,
    }
}

fn channel(
    object: &mut Object,
    scaling: Scaling,
    location: &str,
    pinned: &Pinned,
    remarks: &mut Vec<String>,
) -> Result<FoundChannel, String> {
    let Stream { extents, .. } = take_stream(object, scaling.scaler)?;
    let (kind, digital) = extents.kind().ok_or("its type changes from segment to segment")?;
    if !kind.is_number() {
        return Err(format!("{} values are {}, no channel of numbers", extents.samples(), kind.name()));
    }
    if kind.is_long() && !digital {
        remarks.push(format!("{location} holds {}: given as float64, exact to 2^53", kind.name()));
    }
    if object.timing.uneven {
        remarks.push(format!("{location}: wf_increment changes on the way, so that it has no one sample rate"));
    }
    if let Some(odd) = timing::odd_increment(&object.properties) {
        remarks.push(format!("{location}: no sample rate: wf_increment is {odd}, wanted a number above 0"));
    }
    if let Some(unit) = timing::other_unit(&object.properties) {
        remarks.push(format!("{location}: no sample rate: its x axis is in «{unit}», no unit of time"));
    }
    let rate = timing::increment_s(&object.properties).map(f64::recip).filter(|_| !object.timing.uneven);
    let (scale_factor, add_offset) = scaling.line().unwrap_or((1.0, 0.0));
    let curve = scaling.line().is_none().then_some(scaling);
    let text = |name| object.properties.text(name);
    let unit = text("unit_string").or_else(|| text("NI_UnitDescription")).unwrap_or_default().to_owned();
    let name = group_and_channel(&object.path).map_or_else(|| object.path.clone(), |(_, channel)| channel);
    let long_name = text("description").or_else(|| text("NI_ChannelName")).unwrap_or(&name).to_owned();
    let samples = extents.samples();
    let gaps = std::mem::take(&mut object.gaps);
    let source = Arc::new(Samples { pinned: pinned.clone(), extents, kind, digital, curve });
    Ok(FoundChannel {
        unit,
        long_name,
        sample_rate_hz: rate,
        scale_factor,
        add_offset,
        gaps,
        ..FoundChannel::new(location, samples, kind.name(), source)
    })
}

/// A rate or a start, and what to say of it.
type Said = (Option<f64>, Option<String>);

/// The rate that a property named like one states where there is no waveform.
fn named_rate(at: usize, objects: &[Object]) -> Said {
    let none = (None, None);
    let Some(object) = objects.get(at) else { return none };
    if object.streams.is_empty() || timing::increment_s(&object.properties).is_some() || object.timing.uneven {
        return none;
    }
    let said = |clues: &[Clue]| clues.iter().any(Clue::is_of_rate).then(|| agreed_rate(clues));
    nearest(object, objects, said).unwrap_or(none)
}

/// The start that a property named like one states where there is no offset of a waveform.
fn named_start(at: usize, objects: &[Object]) -> Said {
    let offset = |object: &Object| object.properties.number("wf_start_offset").is_some();
    let object = objects.get(at).filter(|object| !object.streams.is_empty() && !offset(object));
    object.and_then(|object| nearest(object, objects, agreed_start)).unwrap_or_default()
}

/// What the properties of the channel say, else those of its group, else those of the file.
fn nearest<T>(object: &Object, objects: &[Object], said: impl Fn(&[Clue]) -> Option<T>) -> Option<T> {
    let group = group_and_channel(&object.path).map(|(group, _)| format!("/'{}'", group.replace('\'', "''")));
    let around = [Some(object.path.clone()), group, Some("/".to_owned())];
    let clues = |path: String| objects.iter().find(|o| o.path == path).map(|o| o.properties.clues(&path));
    around.into_iter().flatten().filter_map(clues).find_map(|clues| said(&clues))
}

/// The samples that go into the scaling: those of the scaler it names, else the first ones.
fn take_stream(object: &mut Object, scaler: Option<u32>) -> Result<Stream, String> {
    let daqmx = object.streams.iter().any(|s| s.scaler.is_some());
    let at = match scaler.filter(|_| daqmx) {
        Some(id) => object.streams.iter().position(|s| s.scaler == Some(id)),
        None => Some(0),
    };
    let at = at.filter(|&at| at < object.streams.len());
    let at = at.ok_or_else(|| format!("its scales build on DAQmx scaler {}, which it lacks", scaler.unwrap_or(0)))?;
    // Segments without the scaler would otherwise be missing unseen.
    if object.streams.iter().any(|s| s.extents.samples() != object.samples()) {
        return Err("its DAQmx scalers change from segment to segment".to_owned());
    }
    Ok(object.streams.swap_remove(at))
}

/// Each object's scaling, with what it inherits from group and file.
fn scalings(objects: &[Object]) -> Vec<Result<Scaling, String>> {
    let by_path: HashMap<&str, &Object> = objects.iter().map(|o| (o.path.as_str(), o)).collect();
    let root = by_path.get("/").map(|o| &o.properties);
    let of = |object: &Object| {
        let group = group_and_channel(&object.path).map(|(group, _)| format!("/'{}'", group.replace('\'', "''")));
        let group = group.and_then(|path| by_path.get(path.as_str()).map(|o| &o.properties));
        scale::scaling([Some(&object.properties), group, root])
    };
    objects.iter().map(of).collect()
}

/// Each object's location: `/Group/Channel`, or the path with its quotes where that could mean two channels.
fn locations(objects: &[Object]) -> Vec<String> {
    let of = |object: &Object| match group_and_channel(&object.path) {
        Some((group, channel)) if !group.contains('/') && !channel.contains('/') => format!("/{group}/{channel}"),
        _ => object.path.clone(),
    };
    objects.iter().map(of).collect()
}
