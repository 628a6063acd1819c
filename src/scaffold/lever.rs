//! Whether recordings are force curves of a lever.

use std::path::Path;

use afmid_kernels::events::decay::FreeDecay;
use afmid_kernels::events::{BlockMeans, DetectionSettings, EventKind, detect};
use afmid_pipeline::recording::{InputFiles, Reading, open_unpacked};

use super::channels::is_named;
use super::first_file::FirstFile;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::inspect::{Channel, first_samples};
use crate::show::number;

/// Files that are searched for a rupture: not every force curve has one.
const SEARCHED: usize = 8;
/// The search of `events.correlation` by default: samples in a block, blocks of a level, robust standard deviations.
const BLOCK_SAMPLES: usize = 16;
const LEVEL_BLOCKS: usize = 64;
const SIGNIFICANCE: f64 = 8.0;
/// Least step of the level, in peaks of the ringing, that a snap-off has: it lets the whole load go.
const STEP: f64 = 0.5;

/// What names of the channel of the distance between lever and sample contain.
const DISTANCES: [&str; 6] = ["piezo", "height", "zsens", "zsnsr", "lvdt", "position"];

/// Of these such that say that a sensor measured it.
const SENSORS: [&str; 5] = ["measured", "sensor", "zsens", "zsnsr", "lvdt"];

/// Formats of force microscopes, and afmid's own; or a channel that is named as a deflection.
pub fn is_of_a_lever(source: &Source) -> bool {
    let format = source.format.to_lowercase();
    let of_microscope = ["native", "jpk", "nanoscope", "igor"].iter().any(|name| format.contains(name));
    let named = source.channels.iter().any(|channel| channel.location.to_lowercase().contains("defl"));
    named || of_microscope
}

/// Why a lever's recordings are force curves: the distance is recorded and moves, or a contact ruptures. None where
/// neither is so.
pub fn force_curve(file: &FirstFile<'_>, wanted: &Wanted<'_>) -> Option<String> {
    let source = file.source;
    if !is_of_a_lever(source) {
        return None;
    }
    let named = wanted.channels.first().and_then(|name| source.channels.iter().find(|one| is_named(one, name)));
    let best = named.or_else(|| source.best.and_then(|index| source.channels.get(index)))?;
    if let Some(distance) = distance(source, best) {
        return Some(format!("snap-offs: {} has the distance {}, too", source.name(), distance.location));
    }
    let ruptures = source
        .files
        .iter()
        .take(SEARCHED)
        .find_map(|path| rupture(&source.opened, path, &best.location).map(|at| (path, at)));
    let (path, sample) = ruptures.filter(|_| !rings_without_a_step(file, best, wanted))?;
    let rate = file.rate(best, wanted).ok();
    let at = rate.map_or_else(|| format!("sample {sample}"), |rate| format!("{} s", number(sample as f64 / rate)));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Some(format!("snap-offs: a rupture at {at} of {name}"))
}

/// The channel of the distance between lever and sample, if it moves: a sensor's before what was commanded.
pub fn distance<'a>(source: &'a Source, signal: &Channel) -> Option<&'a Channel> {
    let moves = |channel: &Channel| channel.values.as_ref().is_none_or(|values| values.least < values.largest);
    let named = |channel: &Channel| {
        let name = channel.location.rsplit(['/', '.']).next().unwrap_or_default().to_lowercase();
        name == "z" || DISTANCES.iter().any(|distance| name.contains(distance))
    };
    let distances = || source.channels.iter().filter(|one| one.location != signal.location && named(one) && moves(one));
    let sensed = |channel: &&Channel| {
        let name = channel.location.to_lowercase();
        SENSORS.iter().any(|sensor| name.contains(sensor))
    };
    distances().find(sensed).or_else(|| distances().next())
}

/// The sample at which a contact ruptures in a file; none where none does, or it cannot be read.
fn rupture(files: &InputFiles, path: &Path, location: &str) -> Option<usize> {
    let opened = open_unpacked(files, path, &Reading::of("auto", None)).ok()?;
    let found = opened.contents.channels.iter().find(|channel| channel.location == location)?;
    let mut means = BlockMeans::new(BLOCK_SAMPLES, 1.0, None);
    means.push(&first_samples(found).ok()?);
    let settings = DetectionSettings {
        level_blocks: LEVEL_BLOCKS,
        significance: SIGNIFICANCE,
        rounding_std: if found.stored_as.starts_with("int") { found.scale_factor.abs() / 12_f64.sqrt() } else { 0.0 },
        block_samples: BLOCK_SAMPLES,
    };
    let events = detect(means.means(), &settings).events;
    events.iter().find(|event| event.kind == EventKind::SnapOff).map(|event| event.block * BLOCK_SAMPLES)
}

/// Whether a channel rings down from about the level that it rings round: nothing was let go.
fn rings_without_a_step(file: &FirstFile<'_>, channel: &Channel, wanted: &Wanted<'_>) -> bool {
    let Ok((values, found)) = file.search(&[channel], None, wanted) else { return false };
    let level = |decay: &FreeDecay| {
        let tail = &values[0][decay.range.start + decay.range.len() / 2..decay.range.end];
        tail.iter().sum::<f64>() / tail.len().max(1) as f64
    };
    let steps = found.decays.iter().filter(|decay| {
        let before = decay.channels.first().and_then(|channel| channel.level_before);
        let peak = decay.channels.first().map_or(f64::NAN, |channel| channel.peak.abs());
        before.is_none_or(|before| (before - level(decay)).abs() > STEP * peak)
    });
    2 * steps.count() < found.decays.len()
}
