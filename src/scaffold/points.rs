//! A config for a structure that was measured point by point: a file each, force and response in it.

use std::path::Path;

use afmid_kernels::spectra::{hit_begins, hit_spacing};
use afmid_pipeline::recording::{Reading, open_unpacked};
use afmid_pipeline::toml::{Table, Value};

use super::choice::{Choice, Question};
use super::pipeline::{Wanted, columns, path, quantity};
use super::recordings::Source;
use crate::inspect::first_samples;

/// Samples before a hit, and the share of the largest force that begins one: those of `spectrum.measured_frf`.
const BEFORE: usize = 32;
const HIT: f64 = 0.1;
/// Segments in a record, if they did not overlap: likewise.
const EIGHTH: usize = 8;

/// The config of all points, from that of one: its stages `data` and `frf` once for each. Errors: what is not known of the
/// recordings; a file that cannot be read.
pub fn in_place_of_one(
    config: &str,
    source: &Source,
    choice: &Choice<'_>,
    wanted: Wanted<'_>,
    folder: &Path,
) -> Result<String, Question> {
    let stages = stages(source, choice, wanted, folder)?;
    let (head, rest) = config.split_once("[[stage]]").unwrap_or((config, ""));
    let modes = rest.rfind("[[stage]]").and_then(|at| rest.get(at..)).unwrap_or_default();
    Ok(format!("{head}{stages}{modes}"))
}

/// Samples before the hits of all files, where they are fewer than usual. Errors: a file cannot be read.
pub fn fewer_before(source: &Source, choice: &Choice<'_>) -> Result<Option<usize>, Question> {
    Ok(Some(Blocks::of(source, choice)?.before).filter(|before| *before < BEFORE))
}

/// The stages that read the files, estimate their responses and join them; the last one has the id `frf`.
fn stages(source: &Source, choice: &Choice<'_>, wanted: Wanted<'_>, folder: &Path) -> Result<String, Question> {
    let blocks = Blocks::of(source, choice)?;
    let mut text = String::new();
    let mut before = None;
    for (number, file) in source.files.iter().enumerate() {
        let data = format!("data_{}", number + 1);
        let id = if number + 1 == source.files.len() { "frf".to_owned() } else { format!("frf_{}", number + 1) };
        let params = columns(source, ("file", path(file, folder)), choice, wanted, folder)?;
        text += &format!("[[stage]]\nid = \"{data}\"\nuses = \"io.columns\"\n{params}\n");
        let before_input = before.map(|before| format!(", before = \"{before}.frf\"")).unwrap_or_default();
        let point = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let params = Value::Table(blocks.params(&point, choice, wanted));
        text += &format!("[[stage]]\nid = \"{id}\"\nuses = \"spectrum.measured_frf\"\n");
        text += &format!("inputs = {{ pair = \"{data}.pair\"{before_input} }}\nparams = {params}\n\n");
        before = Some(id);
    }
    Ok(text)
}

/// What all files are cut into, so that their responses have the same bins.
struct Blocks {
    samples: usize,
    before: usize,
}

impl Blocks {
    /// Blocks that fit every file. Errors: one cannot be read.
    fn of(source: &Source, choice: &Choice<'_>) -> Result<Self, Question> {
        let mut blocks = Self { samples: usize::MAX, before: BEFORE };
        let force = choice.inputs.first().map(|input| input.location.as_str()).unwrap_or_default();
        let forces: Vec<Vec<f64>> =
            source.files.iter().map(|file| series(source, file, force)).collect::<Result<_, _>>()?;
        if choice.struck {
            blocks.before = forces.iter().map(|force| hit_begins(force, HIT)).fold(BEFORE, usize::min);
        }
        let samples = |force: &Vec<f64>| match choice.struck {
            true => hit_spacing(force, blocks.before).unwrap_or(force.len() - hit_begins(force, HIT) + blocks.before),
            false => force.len() / EIGHTH,
        };
        blocks.samples = forces.iter().map(samples).min().unwrap_or_default();
        Ok(blocks)
    }

    fn params(&self, point: &str, choice: &Choice<'_>, wanted: Wanted<'_>) -> Table {
        let text = |text: &str| Value::String(text.to_owned());
        let number = |number: usize| Value::Integer(i64::try_from(number).unwrap_or(i64::MAX));
        let mut params = Table::new();
        params.insert("point".to_owned(), text(point));
        params.insert("blocks".to_owned(), text(if choice.struck { "hits" } else { "segments" }));
        params.insert("block_samples".to_owned(), number(self.samples));
        if choice.struck && self.before < BEFORE {
            params.insert("before_samples".to_owned(), number(self.before));
        }
        if let Some(quantity) = quantity(wanted.unit.unwrap_or(&choice.channels[0].unit)) {
            params.insert("quantity".to_owned(), text(quantity));
        }
        params
    }
}

/// A channel of a file. Errors: it is not there or cannot be read.
fn series(source: &Source, file: &Path, location: &str) -> Result<Vec<f64>, Question> {
    let plain = |problem: String| (format!("{}: {problem}", file.display()), None);
    let opened = open_unpacked(&source.opened, file, &Reading::of("auto", None).resampled(source.resample));
    let opened = opened.map_err(|error| plain(error.problem))?;
    let found = opened.contents.channels.iter().find(|channel| channel.location == location);
    let found = found.ok_or_else(|| plain(format!("there is no channel {location}")))?;
    first_samples(found).map_err(|error| plain(error.problem))
}
