//! From the responses of files to one array.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{Degree, FileResponse};
use afmid_pipeline::{Document, StageError};
use serde_json::json;

use super::stage::{Frf, Roving};
use crate::artifacts::{NewFrf, Point, ResponseOf, Understood};
use crate::io::repeats::{CopyOf, name_beside, same_values, varies};

/// What frequencies of two responses may differ by, in steps: what is printed to seven digits.
const SAME: f64 = 1e-3;

/// All responses, and what the user should know of them.
pub(super) struct Assembled {
    pub frf: NewFrf,
    pub remarks: Vec<String>,
    /// Responses that are left out, since each is a copy of another one.
    pub copies: Vec<CopyOf>,
}

impl Assembled {
    /// Of files with these hashes. Errors: see the stage.
    pub fn new(
        wanted: &Frf,
        paths: &[PathBuf],
        hashes: &[String],
        read: Vec<Vec<FileResponse>>,
    ) -> Result<Self, StageError> {
        Self::of(wanted, hashes, named(paths, read))
    }

    /// Of responses that have their names. Errors: as [`Assembled::new`].
    pub fn of(wanted: &Frf, hashes: &[String], all: Vec<Named<'_>>) -> Result<Self, StageError> {
        let frequency_hz = common_frequencies(&all)?;
        check_lengths(wanted, all.len())?;
        let Understood { quantity, unit, factor, remark } = Understood::new(wanted.quantity, &unit(wanted, &all)?)?;
        let mut remarks: Vec<String> = remark.into_iter().collect();
        for remark in all.iter().flat_map(|named| &named.response.remarks) {
            if !remarks.contains(remark) {
                remarks.push(remark.clone());
            }
        }
        let responses = points(wanted, &all);
        let copies = copies(wanted, &all, hashes);
        let is_copy = |row: &usize| copies.iter().any(|(copy, _)| copy == row);
        let once: Vec<&ResponseOf> = (0..).zip(&responses).filter(|(row, _)| !is_copy(row)).map(|(_, of)| of).collect();
        remarks.extend(repeated(&once));
        let driving_point = wanted
            .driving_point
            .map(|number| number - 1)
            .or_else(|| responses.iter().position(|response| response.output.is(&response.input)));
        if driving_point.is_none() {
            remarks.push("no driving point: mode shapes have no scale of mass; give `driving_point`".to_owned());
        }
        let kept = band(wanted, &frequency_hz)?;
        let mut frf = Vec::with_capacity(all.len() * kept.len());
        for (Named { response, .. }, of) in all.iter().zip(&responses) {
            let sign = if of.output.turned != of.input.turned { -1.0 } else { 1.0 };
            frf.extend(response.values[kept.clone()].iter().map(|value| value * (sign * factor)));
        }
        let rows: Option<Vec<&Vec<f64>>> = all.iter().map(|named| named.response.coherence.as_ref()).collect();
        let coherence = rows.map(|rows| rows.iter().flat_map(|row| row[kept.clone()].to_vec()).collect());
        let squared = |row: &Vec<f64>| row[kept.clone()].iter().map(|v| v * (factor * factor)).collect::<Vec<f64>>();
        let rows: Option<Vec<&Vec<f64>>> = all.iter().map(|named| named.variance.as_ref()).collect();
        let variance = rows.map(|rows| rows.into_iter().flat_map(squared).collect());
        let mut frf = NewFrf {
            frequency_hz: frequency_hz[kept].to_vec(),
            responses,
            frf,
            variance,
            coherence,
            quantity,
            unit,
            driving_point,
            ..NewFrf::default()
        };
        frf.leave_out(&copies);
        let named =
            |(copy, of): &(usize, usize)| Some((all.get(*copy)?.beside(all.get(*of)?), all.get(*of)?.name.clone()));
        let copies = copies.iter().filter_map(named).collect();
        Ok(Self { frf, remarks, copies })
    }

    /// What is shown of it.
    pub fn summary(&self) -> Result<Document, StageError> {
        let frf = &self.frf;
        let row = |response: &ResponseOf| {
            json!({ "output": response.output.label(), "input": response.input.label(),
                    "position_m": response.input.position_m.or(response.output.position_m) })
        };
        Document::new(&json!({
            "responses": frf.responses.len(),
            "lines": frf.frequency_hz.len(),
            "lowest_hz": frf.frequency_hz.first(),
            "highest_hz": frf.frequency_hz.last(),
            "quantity": frf.quantity,
            "unit": frf.unit,
            "driving_point": frf.driving_point.map(|row| row + 1),
            "with_coherence": frf.coherence.is_some(),
            "points": frf.responses.iter().map(row).collect::<Vec<_>>(),
        }))
    }
}

/// A response with the file that it is from and its name: the file's, and its own if the file has several.
pub(super) struct Named<'a> {
    pub name: String,
    pub path: &'a Path,
    /// Number of its file, and its own among the responses of that.
    pub place: [usize; 2],
    pub response: FileResponse,
    /// Expected squared error of each value, which no file states.
    pub variance: Option<Vec<f64>>,
}

impl Named<'_> {
    /// Its name, with its folder where the other one has the same.
    fn beside(&self, other: &Self) -> String {
        if self.name == other.name { name_beside(self.path, other.path) } else { self.name.clone() }
    }
}

/// The responses that were measured once and lie there again, each with the first that it is a copy of: of files with
/// the same bytes, or with equal values, unless files or `positions_m` say that their points are others.
fn copies(wanted: &Frf, all: &[Named<'_>], hashes: &[String]) -> Vec<(usize, usize)> {
    let apart = |one: &Option<Degree>, other: &Option<Degree>| one.is_some() && other.is_some() && one != other;
    let is_copy = |(row, copy): (usize, &Named<'_>), (of, first): (usize, &Named<'_>)| {
        let [[file, number], [other, its]] = [copy.place, first.place];
        if file != other && hashes.get(file) == hashes.get(other) {
            return number == its;
        }
        let (one, two) = (&copy.response, &first.response);
        let elsewhere = apart(&one.output, &two.output)
            || apart(&one.input, &two.input)
            || wanted.positions_m.get(row) != wanted.positions_m.get(of);
        !elsewhere && varies(&one.values) && same_values(&one.values, &two.values)
    };
    let earlier = |(row, copy): (usize, &Named<'_>)| {
        let of = all[..row].iter().enumerate().find(|first| is_copy((row, copy), *first));
        of.map(|(of, _)| (row, of))
    };
    all.iter().enumerate().filter_map(earlier).collect()
}

fn named(paths: &[PathBuf], read: Vec<Vec<FileResponse>>) -> Vec<Named<'_>> {
    let one_file = paths.len() == 1;
    let mut all = Vec::new();
    for (number, (path, responses)) in paths.iter().zip(read).enumerate() {
        let file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let several = responses.len() > 1;
        for (own, response) in responses.into_iter().enumerate() {
            let name = match (several, one_file) {
                (false, _) => file.clone(),
                (true, true) => response.location.clone(),
                (true, false) => format!("{file}:{}", response.location),
            };
            all.push(Named { name, path, place: [number, own], response, variance: None });
        }
    }
    all
}

/// The frequencies, which must be those of all. Errors: others.
fn common_frequencies(all: &[Named<'_>]) -> Result<Vec<f64>, StageError> {
    let Some(first) = all.first() else { return Err(StageError::new("the files have no response")) };
    let wanted = &first.response.frequency_hz;
    let step = match wanted[..] {
        [low, .., high] => (high - low) / (wanted.len() - 1) as f64,
        _ => return Err(StageError::new("a single frequency, wanted two or more").at(first.path)),
    };
    for other in all {
        let found = &other.response.frequency_hz;
        let apart = found.iter().zip(wanted).position(|(a, b)| (a - b).abs() > SAME * step);
        let problem = match (found.len() == wanted.len(), apart) {
            (true, None) => continue,
            (true, Some(at)) => {
                format!("line {} is at {} Hz, in {} at {} Hz", at + 1, found[at], first.name, wanted[at])
            }
            (false, _) => format!("{} lines, {} has {}", found.len(), first.name, wanted.len()),
        };
        return Err(StageError::new(format!("{}: {problem}; wanted the same frequencies", other.name))
            .at(other.path)
            .help("read responses of other frequencies in a stage of their own"));
    }
    Ok(wanted.clone())
}

/// Errors: a list of another length than the responses, a driving point that is none of them.
fn check_lengths(wanted: &Frf, responses: usize) -> Result<(), StageError> {
    let wrong = |name: &str, found: usize| {
        Err(StageError::new(format!("`{name}` has {found}, there are {responses} responses")))
    };
    match (wanted.positions_m.len(), wanted.directions.len(), wanted.driving_point) {
        (positions, ..) if positions != 0 && positions != responses => wrong("positions_m", positions),
        (_, directions, _) if directions > 1 && directions != responses => wrong("directions", directions),
        (.., Some(number)) if number > responses => {
            Err(StageError::new(format!("`driving_point` is {number}, there are {responses} responses")))
        }
        _ => Ok(()),
    }
}

/// The unit of all. Errors: units that differ, or are not the one that is given.
fn unit(wanted: &Frf, all: &[Named<'_>]) -> Result<String, StageError> {
    let mut unit = wanted.unit.clone().unwrap_or_default();
    for Named { name, path, response, .. } in all.iter().filter(|named| !named.response.unit.is_empty()) {
        if unit.is_empty() {
            unit.clone_from(&response.unit);
        }
        if response.unit != unit {
            let problem = format!("{name} is in {}, wanted {unit}", response.unit);
            return Err(StageError::new(problem).at(path).help("leave `unit` out: it is for files that state no unit"));
        }
    }
    Ok(unit)
}

/// Responses that are of the points of an earlier one: a fit counts them as independent points.
fn repeated(responses: &[&ResponseOf]) -> Option<String> {
    let same = |a: &ResponseOf, b: &ResponseOf| a.output.is(&b.output) && a.input.is(&b.input);
    let (row, first) = responses
        .iter()
        .enumerate()
        .find_map(|(row, of)| Some((row, responses[..row].iter().position(|earlier| same(of, earlier))?)))?;
    let (output, input) = (responses[row].output.label(), responses[row].input.label());
    Some(format!(
        "responses {} and {} are both of output {output} and input {input}: they count as two points",
        first + 1,
        row + 1
    ))
}

/// Output and input of each response: as the files name them, or else one that stays and one that roves.
fn points(wanted: &Frf, all: &[Named<'_>]) -> Vec<ResponseOf> {
    let position = |row: usize| wanted.positions_m.get(row).copied();
    let turned = |row: usize| wanted.directions.get(row).or(wanted.directions.first()) == Some(&-1.0);
    let roving = |row: usize| Point {
        name: all.get(row).map(|named| named.name.clone()).unwrap_or_default(),
        position_m: position(row),
        ..Point::default()
    };
    let what = if wanted.roving == Roving::Hammer { "sensor" } else { "hammer" };
    let fixed = wanted
        .driving_point
        .map_or_else(|| Point { name: what.to_owned(), ..Point::default() }, |number| roving(number - 1));
    let of = |(row, named): (usize, &Named<'_>)| {
        let point = |degree: &Option<Degree>, otherwise: Point| degree.as_ref().map_or(otherwise, stated);
        let (output, input) = match wanted.roving {
            Roving::Hammer => (fixed.clone(), roving(row)),
            Roving::Sensor => (roving(row), fixed.clone()),
        };
        let mut response = ResponseOf {
            output: point(&named.response.output, output),
            input: point(&named.response.input, input),
            run: 0,
        };
        let roves = match wanted.roving {
            Roving::Hammer => &mut response.input,
            Roving::Sensor => &mut response.output,
        };
        roves.turned ^= turned(row);
        roves.position_m = position(row);
        response
    };
    all.iter().enumerate().map(of).collect()
}

/// A degree of freedom that a file states.
fn stated(degree: &Degree) -> Point {
    Point { name: degree.name.clone(), direction: degree.direction.clone(), turned: degree.against, position_m: None }
}

/// The lines within the band. Errors: fewer than two.
fn band(wanted: &Frf, frequency_hz: &[f64]) -> Result<std::ops::Range<usize>, StageError> {
    let Some([low, high]) = wanted.band_hz else { return Ok(0..frequency_hz.len()) };
    let kept = frequency_hz.partition_point(|f| *f < low)..frequency_hz.partition_point(|f| *f <= high);
    match kept.len() {
        0 | 1 => {
            let (first, last) = (frequency_hz.first(), frequency_hz.last());
            let found = format!("from {} to {}", first.unwrap_or(&f64::NAN), last.unwrap_or(&f64::NAN));
            Err(StageError::new(format!("`band_hz` is [{low}, {high}], the frequencies run {found}")))
        }
        _ => Ok(kept),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_responses_of_the_same_points_are_found() {
        let point = |name: &str| Point { name: name.to_owned(), ..Point::default() };
        let of = |output: &str| ResponseOf { output: point(output), input: point("1"), run: 0 };
        assert_eq!(repeated(&[&of("1"), &of("2"), &of("3")]), None);
        let remark = repeated(&[&of("1"), &of("2"), &of("3"), &of("2")]).unwrap();
        assert!(remark.contains("responses 2 and 4 are both of output 2 and input 1"), "{remark}");
    }
}
