//! `afmid exam`: hides causes in simulated recordings and judges what a config says of them.

use std::path::{Path, PathBuf};

use afmid_pipeline::cache::Cache;
use afmid_pipeline::files::{FilledFolder, LIST, sweep_folders, temporary_folder};
use afmid_pipeline::graph::Stages;
use afmid_pipeline::runner::{Options, run as run_plan};
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Artifact, Context, Ports, Stage};
use afmid_stages::causes::catalogue;
use afmid_stages::exam::{Draw, Judged, Kind, Score, draw, judge};
use serde_json::Value;

use super::load::load;
use super::sweep::refuse;
use super::target::provide_folder;
use crate::cli::{ExamArgs, ExamKind};
use crate::failure::Failure;
use crate::interrupt::{self, Silent};
use crate::output::{print, say};
use crate::printable;
use crate::relative::folder_of;
use crate::show::pretty;

/// The stage whose JSON is judged.
const STAGE: &str = "diagnosis";
/// The port whose document stands for a stage.
const SUMMARY: &str = "summary";

/// Runs an exam and prints its score.
pub fn run(args: &ExamArgs, stages: &dyn Stages) -> Result<(), Failure> {
    let score = score(args, stages)?;
    if args.json {
        return print(&pretty(&score)?);
    }
    print(&score.text())
}

fn score(args: &ExamArgs, stages: &dyn Stages) -> Result<Score, Failure> {
    let plan = load(&args.config.config, &args.config.set, stages)?;
    refuse(&plan, "an exam judges one set of parameters")?;
    for id in ["records", STAGE] {
        if plan.node(id).is_none() {
            let help =
                "an exam replaces the recordings of `records` and judges `diagnosis`, as in configs/diagnose.toml";
            return Err(Failure::usage(format!("the config has no stage `{id}`"), Some(help.to_owned())));
        }
    }
    args.keep.as_deref().map_or(Ok(()), |folder| provide_folder(folder_of(folder)))?;
    sweep_folders();
    let folder = temporary_folder("exam")
        .map_err(|error| Failure::failed(format!("no temporary folder can be made: {error}"), None))?;
    let _run = interrupt::Run::begin();
    let mut judged = Vec::new();
    for seed in args.first_seed..args.first_seed.saturating_add(args.seeds) {
        let Some(drawn) = draw(seed, args.only.map(kind), &catalogue()) else {
            say(&format!("seed {seed}: no cause of the catalogue can be hidden in this lever at its limit\n"));
            continue;
        };
        let one = sit(&drawn, args, stages, folder.path())?;
        interrupt::check()?;
        say(&line(&one));
        judged.push(one);
    }
    Ok(Score::new(judged))
}

fn kind(only: ExamKind) -> Kind {
    match only {
        ExamKind::Clean => Kind::Clean,
        ExamKind::One => Kind::One,
        ExamKind::Mixture => Kind::Mixture,
        ExamKind::LeftOut => Kind::LeftOut,
    }
}

fn line(one: &Judged) -> String {
    let hidden: Vec<String> =
        one.planted.iter().map(|planted| format!("{} {:.1}x", planted.id, planted.times_limit())).collect();
    let hidden = if hidden.is_empty() { "nothing".to_owned() } else { hidden.join(" + ") };
    let mark = if one.right { "right" } else { "WRONG" };
    let said = format!("seed {}: {hidden} -> {} {} ({mark})", one.seed, one.said.verdict, one.said.named.join(" + "));
    printable::one_line(&said) + "\n"
}

/// Writes an archive, has the config diagnose it, judges the JSON; the files are removed.
fn sit(drawn: &Draw, args: &ExamArgs, stages: &dyn Stages, scratch: &Path) -> Result<Judged, Failure> {
    let base = scratch.join(drawn.seed.to_string());
    let json = archive(drawn, &base).and_then(|()| diagnosed(drawn, args, stages, &base));
    interrupt::check()?;
    let (judged, json) = match json {
        Ok(json) => (judge(drawn, Some(&json)), json),
        Err(Sitting::Config(failure)) => return Err(failure),
        Err(Sitting::Run(message)) => {
            say(&format!("seed {}: {}\n", drawn.seed, printable::message(&message)));
            (judge(drawn, None), Value::Null)
        }
    };
    if let Some(folder) = args.keep.as_ref().filter(|_| !judged.right) {
        keep(drawn, &json, &base, &folder.join(drawn.seed.to_string()))?;
    }
    // a folder that stays behind goes with the scratch folder
    let _ = std::fs::remove_dir_all(&base);
    Ok(judged)
}

/// Copies an archive's recordings, with the draw and the verdict beside them.
fn keep(drawn: &Draw, verdict: &Value, base: &Path, folder: &Path) -> Result<(), Failure> {
    let failed = |error: &dyn std::fmt::Display| {
        Failure::failed(format!("{} cannot be written: {error}", folder.display()), None)
    };
    std::fs::create_dir_all(folder).map_err(|error| failed(&error))?;
    let archive = base.join(OUT);
    let filled = FilledFolder::open(folder).map_err(|error| failed(&error))?;
    for entry in std::fs::read_dir(&archive).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name == LIST {
            continue;
        }
        let copied = |temporary: &Path| std::fs::copy(entry.path(), temporary).map(|_| ());
        filled.replace_with(&name, |_| false, copied).map_err(|error| failed(&error))?;
    }
    let kept = serde_json::json!({ "draw": drawn, "diagnosis": verdict });
    let text = serde_json::to_string_pretty(&kept).map_err(|error| failed(&error))?;
    filled.write("exam.json", |_| false, (text + "\n").as_bytes()).map_err(|error| failed(&error))
}

/// Why there is no answer.
enum Sitting {
    /// The config cannot be used: no seed will do.
    Config(Failure),
    /// This archive could not be made or diagnosed.
    Run(String),
}

const OUT: &str = "archive";

fn archive(drawn: &Draw, base: &Path) -> Result<(), Sitting> {
    let failed = |error: &dyn std::fmt::Display| Sitting::Run(format!("the archive cannot be made: {error}"));
    std::fs::create_dir_all(base).map_err(|error| failed(&error))?;
    let mut afm = drawn.afm.clone();
    afm.out = PathBuf::from(OUT);
    let context = Context::new(base, drawn.seed, &NoProgress);
    afm.run(&Ports::new(), &context).map_err(|error| failed(&error))?;
    Ok(())
}

fn diagnosed(drawn: &Draw, args: &ExamArgs, stages: &dyn Stages, base: &Path) -> Result<Value, Sitting> {
    let poles: Vec<String> = drawn.nominal_poles_hz.iter().map(|pole| format!("{pole:?}")).collect();
    let mut set = args.config.set.clone();
    set.push(format!("records.files=[{:?}]", base.join(OUT).join("*.h5").display().to_string()));
    set.push("records.channel='/deflection'".to_owned());
    set.push(format!("{STAGE}.detector_poles_hz=[{}]", poles.join(", ")));
    set.push(format!("{STAGE}.without={:?}", drawn.without));
    let plan = load(&args.config.config, &set, stages).map_err(Sitting::Config)?;
    let cache = Cache::open(&base.join("cache"));
    let options = Options {
        base: plan.config.base().to_owned(),
        cache: &cache,
        files: cache.input_files(true),
        fresh: true,
        program: concat!("afmid ", env!("CARGO_PKG_VERSION")).to_owned(),
        overrides: plan.config.overrides.clone(),
        observer: &Silent,
    };
    let result = run_plan(&plan, &options)
        .map_err(|errors| Sitting::Run(errors.iter().map(ToString::to_string).collect::<Vec<String>>().join("; ")))?;
    let outputs = result.stage(STAGE).map(|stage| &stage.result.outputs);
    match outputs.and_then(|outputs| outputs.artifact(SUMMARY)) {
        Some(Artifact::Document(document)) => Ok(document.0.clone()),
        _ => Err(Sitting::Run(format!("stage `{STAGE}` has no document `{SUMMARY}`"))),
    }
}

#[cfg(test)]
#[path = "exam_tests.rs"]
mod tests;
