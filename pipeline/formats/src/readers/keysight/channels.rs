//! From waveforms to channels.

use std::collections::HashMap;
use std::sync::Arc;

use super::waveform::{Buffer, Waveform};
use crate::FoundChannel;
use crate::grid::{Grid, Store};
use crate::joined::Joined;
use crate::number::Number;
use crate::opened::Opened;

const LOGIC: u32 = 6;

/// A channel while its segments are put together.
#[derive(Debug)]
struct Part {
    name: String,
    first: Waveform,
    number: Number,
    grids: Vec<Grid>,
}

/// The channels of waveforms, in their order.
pub(super) fn of(file: &Opened, waveforms: Vec<Waveform>, remarks: &mut Vec<String>) -> Vec<FoundChannel> {
    let mut parts: Vec<Part> = Vec::new();
    let mut open: HashMap<(String, Option<u64>), usize> = HashMap::new();
    for (number, mut waveform) in waveforms.into_iter().enumerate() {
        let label = if waveform.label.is_empty() { "waveform".to_owned() } else { waveform.label.clone() };
        for buffer in std::mem::take(&mut waveform.buffers) {
            let grid = match grid(file, &waveform, buffer) {
                Ok(grid) => grid,
                Err(why) => {
                    remarks.push(format!("a buffer of waveform {} (/{label}) is left out: {why}", number + 1));
                    continue;
                }
            };
            let name = format!("/{label}{}", role(&waveform, buffer));
            let key = (name.clone(), waveform.rate_hz.map(f64::to_bits));
            // a further segment of the same channel
            match open.get(&key).filter(|_| waveform.segment > 1).and_then(|at| parts.get_mut(*at)) {
                Some(part) if part.number == grid.number => part.grids.push(grid),
                _ => {
                    open.insert(key, parts.len());
                    let first = Waveform {
                        buffers: Vec::new(),
                        label: label.clone(),
                        frame: waveform.frame.clone(),
                        started_at: None,
                        ..waveform
                    };
                    parts.push(Part { name, first, number: grid.number, grids: vec![grid] });
                }
            }
        }
    }
    let mut seen: HashMap<String, usize> = HashMap::new();
    let mut channels = Vec::new();
    for part in parts {
        let (step, known) = (part.first.step, part.first.rate_hz.is_some());
        let Some(channel) = channel(part, &mut seen) else { continue };
        if !known {
            let location = &channel.location;
            remarks
                .push(format!("{location}: no sample rate: the axis has steps of {step}, wanted steps in s above 0"));
        }
        channels.push(channel);
    }
    channels
}

fn channel(part: Part, seen: &mut HashMap<String, usize>) -> Option<FoundChannel> {
    let times = seen.entry(part.name.clone()).and_modify(|times| *times += 1).or_insert(1);
    let location = if *times == 1 { part.name } else { format!("{}[{times}]", part.name) };
    let joined = Joined::of(part.grids)?;
    Some(FoundChannel {
        // the lines of a logic analyser are bits
        unit: if part.number == Number::U8 { String::new() } else { part.first.unit.to_owned() },
        long_name: part.first.long_name(),
        sample_rate_hz: part.first.rate_hz,
        gaps: joined.starts(),
        ..FoundChannel::new(location, joined.samples(), part.number.name(), Arc::new(joined))
    })
}

/// What a buffer is if a waveform has several.
fn role(waveform: &Waveform, buffer: Buffer) -> &'static str {
    match buffer.kind {
        2 if waveform.kind != LOGIC => "/maximum",
        3 => "/minimum",
        _ => "",
    }
}

/// Where a buffer's samples are. Errors: why they are no channel.
fn grid(file: &Opened, waveform: &Waveform, buffer: Buffer) -> Result<Grid, String> {
    let number = match (buffer.kind, buffer.bytes_per_point) {
        (0..=3, 4) => Number::F32,
        (_, 1) if waveform.kind == LOGIC || buffer.kind == 6 => Number::U8,
        (4, _) => return Err("it holds times".to_owned()),
        (5, _) => return Err("it holds counts".to_owned()),
        (kind, bytes) => return Err(format!("it is of kind {kind} with {bytes} bytes a point, wanted float32")),
    };
    if matches!(waveform.kind, 4 | 5) {
        return Err("it is a histogram".to_owned());
    }
    let samples = usize::try_from(buffer.bytes / number.bytes()).unwrap_or(0);
    if samples == 0 {
        return Err("it has no samples".to_owned());
    }
    let wanted = u64::from(waveform.points) * number.bytes();
    if waveform.points > 0 && buffer.bytes != wanted {
        let found = buffer.bytes;
        return Err(format!("it has {found} bytes, wanted {wanted} for the {} points stated", waveform.points));
    }
    let store = Store::File(file.pinned().clone());
    Ok(Grid { store, first: buffer.from, step: number.bytes(), samples, number, big_endian: false })
}
