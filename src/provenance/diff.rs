//! What differs between two result files.

use std::collections::BTreeSet;
use std::path::Path;

use afmid_pipeline::error::StoreError;
use afmid_pipeline::store::{Difference, Numbers, ResultFile, StageSummary, compare};
use afmid_pipeline::{Shape, SourceFile, StageRecord};
use serde::Serialize;
use serde_json::{Value, json};

/// What differs between two result files. `/entry/run` is left out.
#[derive(Debug, Serialize)]
pub struct Diff {
    /// The first file.
    pub a: String,
    /// The second.
    pub b: String,
    /// Whether nothing differs at all.
    pub equal: bool,
    /// Whether no result differs: versions, parameters or places of files may.
    pub results_equal: bool,
    /// Program, name, seed and `--set` arguments, where they differ.
    pub run: Vec<Pair>,
    /// The texts of the configs.
    pub config: Lines,
    /// Stages that only the first has.
    pub stages_only_in_a: Vec<String>,
    /// Stages that only the second has.
    pub stages_only_in_b: Vec<String>,
    /// Stages of both that differ.
    pub stages: Vec<StageDiff>,
    /// Differences elsewhere in the files.
    pub other: Vec<Other>,
}

/// A value that differs.
#[derive(Debug, Serialize)]
pub struct Pair {
    /// What it is.
    pub name: String,
    /// In the first file; null: not there.
    pub a: Value,
    /// In the second.
    pub b: Value,
}

/// Lines that only one of two texts has.
#[derive(Debug, Serialize)]
pub struct Lines {
    /// Whether the texts differ, if only in white space or order.
    pub differs: bool,
    /// Lines that only the first has.
    pub lines_only_in_a: Vec<String>,
    /// Lines that only the second has.
    pub lines_only_in_b: Vec<String>,
}

/// What differs in a stage.
#[derive(Debug, Serialize)]
pub struct StageDiff {
    /// Its id.
    pub id: String,
    /// Stage name, version and seed.
    pub stage: Vec<Pair>,
    /// Parameters by name.
    pub parameters: Vec<Pair>,
    /// Wires by input port.
    pub inputs: Vec<Pair>,
    /// The files that it read.
    pub files: Files,
    /// Its warnings.
    pub warnings: Lines,
    /// Datasets of its outputs.
    pub results: Vec<ResultDiff>,
}

/// Files that a stage read, by name and hash.
#[derive(Debug, Default, Serialize)]
pub struct Files {
    /// Only read for the first file.
    pub only_in_a: Vec<String>,
    /// Only read for the second.
    pub only_in_b: Vec<String>,
    /// Of one name with other bytes.
    pub other_bytes: Vec<Pair>,
    /// Of one name and the same bytes, found elsewhere.
    pub moved: usize,
    /// The same files in another order.
    pub reordered: bool,
}

/// A dataset or attribute of an output that differs.
#[derive(Debug, Serialize)]
pub struct ResultDiff {
    /// The output's port.
    pub output: String,
    /// The dataset within it, `@attribute` behind it if that is meant.
    pub dataset: String,
    /// What differs, in words.
    pub what: String,
    /// Whether it says where files lie, and nothing about what is in them.
    pub place_only: bool,
    /// Numbers that differ; null: other things differ as well.
    pub differing: Option<usize>,
    /// Numbers in it.
    pub of: Option<usize>,
    /// Largest difference; null: an unknown number on one side.
    pub largest: Option<f64>,
    /// Largest difference relative to the larger of the two numbers.
    pub relative: Option<f64>,
    /// Largest difference in standard errors of the first file; null: there are none.
    pub in_errors: Option<f64>,
    /// Where the largest difference is: an index, or a path in a document.
    pub at: Option<String>,
    /// The same as the store measured it.
    #[serde(skip)]
    pub numbers: Option<Numbers>,
}

/// A difference elsewhere.
#[derive(Debug, Serialize)]
pub struct Other {
    /// The object in the file.
    pub place: String,
    /// What differs.
    pub what: String,
}

impl Diff {
    /// Compares two result files. Errors: one cannot be read or is damaged.
    pub fn of(a: &ResultFile, b: &ResultFile) -> Result<Self, StoreError> {
        let found = compare(a.path(), b.path())?;
        let equal = found.is_empty();
        let (results, other) = sorted(found, a, b);
        let mut stages = Vec::new();
        for (stage, mut results) in a.stages().iter().zip(results) {
            let Some(twin) = b.stage(&stage.record.id) else { continue };
            // stable: datasets stay in the order of the file
            results.sort_by_key(|result| result.output.clone());
            let diff = stage_diff(&stage.record, &twin.record, results);
            if diff.any() {
                stages.push(diff);
            }
        }
        let (only_in_a, only_in_b) = (only(a, b), only(b, a));
        let same_results = stages.iter().all(|stage| stage.results.iter().all(|result| result.place_only));
        Ok(Self {
            a: shown(a.path()),
            b: shown(b.path()),
            equal,
            results_equal: same_results && only_in_a.is_empty() && only_in_b.is_empty(),
            run: run_pairs(a, b),
            config: lines(&text_lines(&a.run().config), &text_lines(&b.run().config)),
            stages_only_in_a: only_in_a,
            stages_only_in_b: only_in_b,
            stages,
            other,
        })
    }
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn only(a: &ResultFile, b: &ResultFile) -> Vec<String> {
    let ids = a.stages().iter().map(|stage| &stage.record.id);
    ids.filter(|id| b.stage(id).is_none()).cloned().collect()
}

fn run_pairs(a: &ResultFile, b: &ResultFile) -> Vec<Pair> {
    let (x, y) = (a.run(), b.run());
    let mut pairs = Vec::new();
    pair(&mut pairs, "program", json!(x.program), json!(y.program));
    pair(&mut pairs, "name", json!(x.name), json!(y.name));
    pair(&mut pairs, "seed", json!(x.seed), json!(y.seed));
    pair(&mut pairs, "overrides", json!(x.overrides), json!(y.overrides));
    pairs
}

fn pair(pairs: &mut Vec<Pair>, name: &str, a: Value, b: Value) {
    if a != b {
        pairs.push(Pair { name: name.to_owned(), a, b });
    }
}

/// The differences in results of each stage of the first file, and all that belong to no stage of both.
fn sorted(found: Vec<Difference>, a: &ResultFile, b: &ResultFile) -> (Vec<Vec<ResultDiff>>, Vec<Other>) {
    let mut results: Vec<Vec<ResultDiff>> = a.stages().iter().map(|_| Vec::new()).collect();
    let mut other = Vec::new();
    for difference in found {
        let place = difference.place.clone();
        let inside = place.strip_prefix("/entry/").unwrap_or_default();
        let (group, rest) = inside.split_once('/').unwrap_or((inside, ""));
        let group = group.split('@').next().unwrap_or(group);
        let index = a.stages().iter().position(|stage| stage.group == group);
        let stage = index.and_then(|index| a.stages().get(index));
        let twin = stage.and_then(|stage| b.stage(&stage.record.id)).filter(|twin| twin.group == group);
        match (index, stage, twin) {
            // reported by name, from what the file says of itself
            _ if ["pipeline", "title"].contains(&group) || ["version", "sequence_index"].contains(&rest) => {}
            _ if rest.starts_with("provenance") => {}
            // a stage of one file only
            _ if rest.is_empty() && difference.numbers.is_none() && one_sided(group, a, b) => {}
            (Some(index), Some(stage), Some(_)) if !rest.is_empty() => {
                if let Some(list) = results.get_mut(index) {
                    list.push(result_diff(stage, rest, difference));
                }
            }
            _ => other.push(Other { place, what: difference.what }),
        }
    }
    (results, other)
}

fn one_sided(group: &str, a: &ResultFile, b: &ResultFile) -> bool {
    let has = |file: &ResultFile| file.stages().iter().any(|stage| stage.group == group);
    has(a) != has(b)
}

fn result_diff(stage: &StageSummary, rest: &str, difference: Difference) -> ResultDiff {
    let (group, dataset) = match rest.find(['/', '@']) {
        Some(end) => (&rest[..end], rest[end..].trim_start_matches('/')),
        None => (rest, ""),
    };
    let port = stage.ports.iter().find(|port| port.group == group);
    let recording = port.is_some_and(|port| port.shape == Shape::Recording);
    let numbers = difference.numbers;
    let finite = |of: fn(&Numbers) -> f64| numbers.as_ref().map(of).filter(|value| value.is_finite());
    ResultDiff {
        output: port.map_or(group, |port| &port.name).to_owned(),
        dataset: dataset.to_owned(),
        what: difference.what,
        place_only: recording && dataset == "records/path",
        differing: numbers.as_ref().map(|numbers| numbers.differing),
        of: numbers.as_ref().map(|numbers| numbers.of),
        largest: finite(|numbers| numbers.largest),
        relative: finite(|numbers| numbers.relative),
        in_errors: numbers.as_ref().and_then(|numbers| numbers.in_errors).filter(|errors| errors.is_finite()),
        at: numbers.as_ref().map(|numbers| numbers.at.clone()),
        numbers,
    }
}

fn stage_diff(a: &StageRecord, b: &StageRecord, results: Vec<ResultDiff>) -> StageDiff {
    let mut stage = Vec::new();
    pair(&mut stage, "uses", json!(a.uses), json!(b.uses));
    pair(&mut stage, "version", json!(a.version), json!(b.version));
    pair(&mut stage, "seed", json!(a.seed), json!(b.seed));
    StageDiff {
        id: a.id.clone(),
        stage,
        parameters: by_name(&members(&a.params), &members(&b.params)),
        inputs: by_name(&wires(a), &wires(b)),
        files: files(&a.sources, &b.sources),
        warnings: lines(&a.result.warnings, &b.result.warnings),
        results,
    }
}

impl StageDiff {
    fn any(&self) -> bool {
        let pairs = !(self.stage.is_empty() && self.parameters.is_empty() && self.inputs.is_empty());
        pairs || self.files.any() || self.warnings.differs || !self.results.is_empty()
    }
}

impl Files {
    /// Whether anything differs.
    pub fn any(&self) -> bool {
        let lists = !(self.only_in_a.is_empty() && self.only_in_b.is_empty() && self.other_bytes.is_empty());
        lists || self.moved > 0 || self.reordered
    }
}

type Member = (String, Value);

fn members(params: &Value) -> Vec<Member> {
    params.as_object().into_iter().flatten().map(|(name, value)| (name.clone(), value.clone())).collect()
}

fn wires(record: &StageRecord) -> Vec<Member> {
    record.wires.iter().map(|(port, stage, output)| (port.clone(), json!(format!("{stage}.{output}")))).collect()
}

fn by_name(a: &[Member], b: &[Member]) -> Vec<Pair> {
    let names: BTreeSet<&String> = a.iter().chain(b).map(|(name, _)| name).collect();
    let value =
        |list: &[Member], name: &str| list.iter().find(|(have, _)| have == name).map(|(_, value)| value.clone());
    let mut pairs = Vec::new();
    for name in names {
        let (x, y) = (value(a, name), value(b, name));
        if x != y {
            pairs.push(Pair { name: name.clone(), a: x.unwrap_or(Value::Null), b: y.unwrap_or(Value::Null) });
        }
    }
    pairs
}

/// A path's last part.
pub fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

fn files(a: &[SourceFile], b: &[SourceFile]) -> Files {
    let key = |file: &SourceFile| (file_name(&file.path).to_owned(), file.blake3.clone());
    let (left, right): (Vec<_>, Vec<_>) = (a.iter().map(key).collect(), b.iter().map(key).collect());
    let mut files = Files::default();
    for (name, hash) in left.iter().filter(|file| !right.contains(file)) {
        match right.iter().find(|(other, _)| other == name).filter(|file| !left.contains(file)) {
            Some((_, other)) => {
                files.other_bytes.push(Pair { name: name.clone(), a: json!(hash), b: json!(other) });
            }
            None => files.only_in_a.push(name.clone()),
        }
    }
    let paired = |name: &String| files.other_bytes.iter().any(|pair| pair.name == *name);
    let only_in_b = right.iter().filter(|file| !left.contains(file) && !paired(&file.0));
    files.only_in_b = only_in_b.map(|(name, _)| name.clone()).collect();
    let elsewhere = |file: &&SourceFile| b.iter().any(|other| key(other) == key(file) && other.path != file.path);
    files.moved = a.iter().filter(elsewhere).count();
    let same_set = files.only_in_a.is_empty() && files.only_in_b.is_empty() && files.other_bytes.is_empty();
    files.reordered = same_set && left != right;
    files
}

fn text_lines(text: &str) -> Vec<String> {
    // with its end: a line that only lacks one differs
    text.split_inclusive('\n').map(str::to_owned).collect()
}

/// Lines of either text that the other has not, or not as often.
fn lines(a: &[String], b: &[String]) -> Lines {
    let only = |these: &[String], others: &[String]| {
        let mut others: Vec<&String> = others.iter().collect();
        let mut left = Vec::new();
        for line in these {
            match others.iter().position(|other| *other == line) {
                Some(index) => {
                    others.swap_remove(index);
                }
                None => left.push(line.trim_end().to_owned()),
            }
        }
        left
    };
    Lines { differs: a != b, lines_only_in_a: only(a, b), lines_only_in_b: only(b, a) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(path: &str, hash: &str) -> SourceFile {
        SourceFile { path: path.to_owned(), size: 1, blake3: hash.to_owned() }
    }

    #[test]
    fn files_are_distinguished_by_name_and_bytes() {
        let found = files(
            &[file("x/a", "0"), file("x/b", "1"), file("x/c", "2")],
            &[file("y/a", "0"), file("y/b", "9"), file("y/d", "2")],
        );
        assert_eq!((found.only_in_a, found.only_in_b, found.moved), (vec!["c".to_owned()], vec!["d".to_owned()], 1));
        assert_eq!(found.other_bytes.len(), 1);
        assert!(files(&[file("a", "0"), file("b", "1")], &[file("b", "1"), file("a", "0")]).reordered);
        assert!(!files(&[file("a", "0")], &[file("a", "0")]).any());
    }

    #[test]
    fn lines_are_counted() {
        let text = |lines: &[&str]| lines.iter().map(|&line| line.to_owned()).collect::<Vec<_>>();
        let found = lines(&text(&["a", "b", "a"]), &text(&["a", "c"]));
        assert_eq!((found.lines_only_in_a, found.lines_only_in_b), (text(&["b", "a"]), text(&["c"])));
        let swapped = lines(&text(&["a", "b"]), &text(&["b", "a"]));
        assert!(swapped.differs && swapped.lines_only_in_a.is_empty());
    }
}
