//! `afmid rerun`: repeats a run from its own result file and compares.

use std::path::{Path, PathBuf};

use afmid_pipeline::files::temporary_folder;
use afmid_pipeline::graph::{self, Stages};
use afmid_pipeline::store::ResultFile;
use afmid_pipeline::store::write_result;
use afmid_pipeline::{Plan, SourceFile};
use serde_json::{Value, json};

use super::diff::open;
use super::run::{Computation, PROGRAM, compute, open_cache, warn};
use super::target::{Input, Target, prepare};
use crate::cli::RerunArgs;
use crate::diagnostic::render;
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::printable::{one_line, shown};
use crate::provenance::diff::Diff;
use crate::provenance::differences::results_text;
use crate::provenance::files::{Finder, Now};
use crate::provenance::repeat::{Writer, base, config_path, places, unfit, writers};
use crate::provenance::same::{TOLERANCE, Verdict, distance, judge, results};
use crate::show::{number, pretty};

/// The most missing files that are listed.
const MOST: usize = 20;

/// Repeats a run and compares.
pub fn run(args: &RerunArgs, stages: &dyn Stages) -> Result<(), Failure> {
    let file = open(&args.result)?;
    let finder = Finder::new(&file.run().info, &args.data);
    require_inputs(&file, &finder)?;
    let scratch = temporary_folder("rerun")
        .map_err(|error| Failure::failed(format!("no temporary folder can be made: {error}"), None))?;
    let base = base(&file.run().info);
    let (plan, writers) = plan(&file, &base, &finder, scratch.path(), stages)?;
    let output = args.output.clone().unwrap_or_else(|| scratch.path().join("repeated.h5"));
    prepare(&output, Target::Result, &inputs(args, &file, &finder))?;
    let cache = open_cache(args.cache.as_deref());
    let overrides = &file.run().overrides;
    let mut repeated =
        compute(&plan, &Computation { base: &base, cache: &cache, fresh: !args.reuse, jobs: args.jobs, overrides });
    repeated.iter_mut().for_each(|repeated| writers.iter().for_each(|writer| writer.put_back(repeated)));
    warn(&cache);
    let failed = |error: &afmid_pipeline::error::StoreError| Failure::failed(error, error.help.clone());
    write_result(&output, &repeated?).map_err(|error| failed(&error))?;
    let diff = Diff::of(&file, &open(&output)?).map_err(|error| failed(&error))?;
    let verdict = judge(&diff);
    let comparison = Comparison { args, file: &file, plan: &plan, diff: &diff, verdict };
    print(&if args.json { pretty(&comparison.json()?)? } else { comparison.text() })?;
    // what was printed says all
    if verdict == Verdict::Differs { Err(Failure::Failed(Message::Rendered(String::new()))) } else { Ok(()) }
}

/// Errors: files are missing or have other bytes; the first [`MOST`] are listed.
fn require_inputs(file: &ResultFile, finder: &Finder) -> Result<(), Failure> {
    let unfit = unfit(file, finder);
    let Some(total) = Some(unfit.len()).filter(|&total| total > 0) else { return Ok(()) };
    let line = |(source, now): &(SourceFile, Now)| format!("  {}: {}", source.path, now.text());
    let mut list: Vec<String> = unfit.iter().take(MOST).map(line).collect();
    if total > MOST {
        list.push(format!("  ... and {} more", total - MOST));
    }
    let what = if total == 1 { "1 file that it read is" } else { &format!("{total} files that it read are") };
    let message = format!("{}: {what} not there with the same bytes:", file.path().display());
    let help = "nothing was run; `--data FOLDER` looks there by name and hash".to_owned();
    Err(Failure::Failed(Message::Listed(message, list, Some(help))))
}

/// The plan of the stored config, reading the files where they are now, and its stages that write. Errors, usage: this
/// program cannot run it any more.
fn plan(
    file: &ResultFile,
    base: &Path,
    finder: &Finder,
    scratch: &Path,
    stages: &dyn Stages,
) -> Result<(Plan, Vec<Writer>), Failure> {
    let run = file.run();
    let name = config_path(&run.info).display().to_string();
    let load = |sets: &[String]| {
        graph::load(&name, &run.config, sets, stages)
            .map_err(|problems| Failure::Usage(Message::Styled(render(&name, &run.config, &problems))))
    };
    let plan = load(&run.overrides)?;
    let writers = writers(&plan, base, scratch);
    let mut sets = places(&plan, file, base, finder);
    sets.extend(writers.iter().map(Writer::set));
    let plan = if sets.is_empty() { plan } else { load(&[&run.overrides[..], &sets].concat())? };
    Ok((plan, writers))
}

/// What the repetition must not write over.
fn inputs(args: &RerunArgs, file: &ResultFile, finder: &Finder) -> Vec<Input> {
    let mut inputs: Vec<Input> = vec![("the result file", args.result.clone())];
    for source in file.stages().iter().flat_map(|stage| &stage.record.sources) {
        if let Now::Same(path) = finder.find(source) {
            inputs.push(("a record", path));
        }
    }
    inputs
}

struct Comparison<'a> {
    args: &'a RerunArgs,
    file: &'a ResultFile,
    plan: &'a Plan,
    diff: &'a Diff,
    verdict: Verdict,
}

impl Comparison<'_> {
    fn outputs(&self) -> usize {
        self.file.stages().iter().map(|stage| stage.ports.len()).sum()
    }

    /// Stages of which this program has another version, as (id, then, now).
    fn versions(&self) -> Vec<(&str, u32, u32)> {
        let of = |node: &afmid_pipeline::Node| self.file.stage(&node.id).map(|stage| stage.record.version);
        let nodes = self.plan.nodes.iter();
        nodes
            .filter_map(|node| Some((node.id.as_str(), of(node)?, node.stage.spec().version)))
            .filter(|(_, then, now)| then != now)
            .collect()
    }

    fn largest(&self) -> f64 {
        results(self.diff).iter().map(|(_, result)| distance(result)).fold(0.0, f64::max)
    }

    fn text(&self) -> String {
        let (path, outputs) = (shown(self.file.path()), self.outputs());
        let mut text = String::new();
        if self.file.run().program != PROGRAM {
            text.push_str(&format!("made by {}, repeated by {PROGRAM}\n", one_line(&self.file.run().program)));
        }
        for (id, then, now) in self.versions() {
            text.push_str(&format!("stage {}: version {now} here, it was {then}\n", one_line(id)));
        }
        let rows = results(self.diff);
        let stages = self.plan.nodes.len();
        text.push_str(&match self.verdict {
            Verdict::Identical => format!("{path}: identical, all {outputs} outputs of {stages} stages bit for bit\n"),
            Verdict::Within => format!(
                "{path}: within {TOLERANCE:e}, {} of the datasets of {outputs} outputs differ, by {} at most\n",
                rows.len(),
                number(self.largest())
            ),
            Verdict::Differs => {
                let many = if rows.len() == 1 { "" } else { "s" };
                format!("{path}: differs in {} dataset{many} of {outputs} outputs\n", rows.len())
            }
        });
        for stage in &self.diff.stages {
            let of: Vec<_> = rows.iter().filter(|(id, _)| *id == stage.id).map(|(_, result)| *result).collect();
            if !of.is_empty() {
                text.push_str(&format!("stage {}\n{}", one_line(&stage.id), results_text(&of)));
            }
        }
        text
    }

    fn json(&self) -> Result<Value, Failure> {
        let output: Option<&PathBuf> = self.args.output.as_ref();
        let differences = results(self.diff).into_iter().map(|(id, result)| {
            let mut row = serde_json::to_value(result).map_err(|error| Failure::failed(error, None))?;
            row["stage"] = json!(id);
            row["distance"] = json!(Some(distance(result)).filter(|distance| distance.is_finite()));
            Ok(row)
        });
        let version = |(id, then, now): (&str, u32, u32)| json!({ "stage": id, "then": then, "now": now });
        Ok(json!({
            "file": self.file.path().display().to_string(),
            "output": output.map(|output| output.display().to_string()),
            "verdict": self.verdict.name(),
            "tolerance": TOLERANCE,
            "largest": Some(self.largest()).filter(|largest| largest.is_finite()),
            "outputs": self.outputs(),
            "program": { "then": self.file.run().program, "now": PROGRAM },
            "versions": self.versions().into_iter().map(version).collect::<Vec<_>>(),
            "differences": differences.collect::<Result<Vec<Value>, Failure>>()?,
        }))
    }
}
