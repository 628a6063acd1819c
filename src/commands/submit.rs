//! `afmid submit`: a batch as jobs of a cluster.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use afmid_pipeline::Registry;
use afmid_pipeline::files::FilledFolder;
use afmid_pipeline::own_command::own_file;
use afmid_pipeline::plugin::{AllStages, Candidate};
use serde_json::json;

use super::batch::{data_sets, ledger, planned, whole};
use super::consent;
use super::run::cache_folder;
use super::target::text_of;
use crate::batch::dataset::DataSet;
use crate::batch::manifest;
use crate::batch::shard::Shard;
use crate::batch::slurm::{
    AGREED, ARRAY, COLLECT, CONFIG, DEPENDENCY, FOLDER, Jobs, LOG, MANIFEST, Resources, SUBMIT, job_id,
};
use crate::cli::{SlurmArgs, SubmitTo};
use crate::failure::{Failure, Message};
use crate::output::{print, say};
use crate::printable::shown;
use crate::show::pretty;

/// Variables that configs refer to: a job gets those of its submission, whatever the site hands on.
const ENVIRONMENT: [&str; 1] = ["AFMID_DATA"];

/// Writes the jobs, and sends them if asked to.
pub fn run(to: &SubmitTo, registry: &Registry) -> Result<(), Failure> {
    match to {
        SubmitTo::Slurm(args) => slurm(args, registry),
    }
}

fn slurm(args: &SlurmArgs, registry: &Registry) -> Result<(), Failure> {
    let sets = data_sets(&args.sets)?;
    // nothing is started here: the jobs do that, and only what is agreed to
    let nothing = consent::none();
    let stages = AllStages { registry, plugins: &nothing };
    let plan = whole(&args.config, &stages)?;
    let agreed = consent::agreed(&args.plugins, &plan.config)?;
    planned(&args.config, sets.iter(), &stages)?;
    let shards: BTreeSet<u64> = sets.iter().map(|set| Shard::of(&set.name, args.shards.into()).index()).collect();
    let filled: Vec<u64> = shards.into_iter().collect();
    let (folder, cache) = (absolute(&args.output)?, absolute(&cache_folder(args.cache.as_deref()))?);
    for folder in [&folder, &cache] {
        if folder.to_str().is_none() {
            let help = "HDF5 files cannot be written there: give another folder".to_owned();
            return Err(Failure::usage(format!("the name {} is not UTF-8", folder.display()), Some(help)));
        }
    }
    // makes the folder: a cluster's file system may refuse
    ledger(&args.output)?;
    let environment: Vec<(&str, OsString)> =
        ENVIRONMENT.iter().filter_map(|name| Some((*name, std::env::var_os(name)?))).collect();
    let jobs = Jobs {
        name: plan.name(),
        program: &own_file().map_err(|error| Failure::failed(format!("afmid cannot find itself: {error}"), None))?,
        config: &absolute(&args.config.config)?,
        folder: &folder,
        cache: &cache,
        environment: &environment,
        set: &args.config.set,
        retry_failed: args.retry_failed,
        plugins: !agreed.is_empty(),
        data_sets: sets.len(),
        shards: args.shards.get(),
        filled: &filled,
        resources: Resources {
            partition: args.partition.as_ref(),
            time: args.time.as_ref(),
            memory: args.memory.as_ref(),
            cpus: args.cpus.get(),
            account: args.account.as_ref(),
            passed: &args.sbatch,
        },
    };
    let here = folder.join(FOLDER);
    write(&here, &jobs, &sets, plan.config_text(), &agreed)?;
    let sent = if args.send { Some(send(&here)?) } else { None };
    print(&summary(args.json, &here, &jobs, sent.as_ref())?)
}

/// Links stay: where they lead may be called otherwise on another machine.
fn absolute(path: &Path) -> Result<PathBuf, Failure> {
    std::path::absolute(path)
        .map_err(|error| Failure::failed(format!("the working directory cannot be found: {error}"), None))
}

fn write(here: &Path, jobs: &Jobs, sets: &[DataSet], config: &str, agreed: &[Candidate]) -> Result<(), Failure> {
    let failed = |error: &dyn std::fmt::Display| Failure::failed(format!("the jobs cannot be written: {error}"), None);
    std::fs::create_dir_all(here.join(LOG)).map_err(|error| failed(&error))?;
    let manifest = manifest::write(sets).map_err(|error| failed(&error))?;
    // a version that kept no list is known by its script
    let earlier = text_of(&here.join(SUBMIT)).contains(ARRAY);
    let filled = FilledFolder::open(here).map_err(|error| failed(&error))?;
    for name in [MANIFEST, CONFIG, ARRAY, COLLECT, SUBMIT] {
        filled.require_own(name, |_| earlier).map_err(|error| failed(&error))?;
    }
    for (name, text) in [
        (MANIFEST, manifest.as_str()),
        (CONFIG, config),
        (AGREED, &consent::seals(agreed)),
        (ARRAY, &jobs.array()),
        (COLLECT, &jobs.collect()),
        (SUBMIT, &jobs.submit()),
    ] {
        let mode = if name == SUBMIT { 0o755 } else { 0o644 };
        let fill = |path: &Path| {
            std::fs::write(path, text)?;
            std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode))
        };
        filled.replace_with(name, |_| earlier, fill).map_err(|error| failed(&error))?;
    }
    Ok(())
}

/// Numbers of jobs.
struct Sent {
    array: String,
    collect: String,
}

fn send(here: &Path) -> Result<Sent, Failure> {
    let array = sbatch(here, &[ARRAY.to_owned()])?;
    let collect = sbatch(here, &[format!("{DEPENDENCY}{array}"), COLLECT.to_owned()]);
    match collect {
        Ok(collect) => Ok(Sent { array, collect }),
        Err(failure) => {
            say(&format!(
                "the shards are sent, job {array}, the collecting job is not: `afmid batch ... --collect` when they \
                 have ended, or `scancel {array}`\n"
            ));
            Err(failure)
        }
    }
}

/// Sends one script and returns its number. What sbatch has to say beside goes to stderr.
fn sbatch(here: &Path, arguments: &[String]) -> Result<String, Failure> {
    let output = Command::new("sbatch").current_dir(here).arg("--parsable").args(arguments).output();
    let output = output.map_err(|error| match error.kind() {
        ErrorKind::NotFound => Failure::failed(
            "sbatch is not on the PATH: this machine has no Slurm, or its module is not loaded",
            Some(format!("the jobs are written: where Slurm is, `bash {}` sends them", script(here))),
        ),
        _ => Failure::failed(format!("sbatch does not start: {error}"), None),
    })?;
    let [stdout, stderr] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let script = arguments.last().map(String::as_str).unwrap_or_default();
    if !output.status.success() {
        let help = format!(
            "the jobs are written in {}; the options above come from this command line, --sbatch among them",
            here.display()
        );
        let said = [stderr.trim(), stdout.trim()].join("\n");
        let mut lines = said.trim().lines();
        let message = format!("sbatch refused {script} ({}): {}", output.status, lines.next().unwrap_or_default());
        let list = lines.map(|line| format!("  {line}")).collect();
        return Err(Failure::Failed(Message::Listed(message, list, Some(help))));
    }
    say(&stderr);
    job_id(&stdout).ok_or_else(|| {
        Failure::failed(
            format!("sbatch took {script}, but printed no job number: {}", stdout.trim()),
            Some("look for it with `squeue --me`".to_owned()),
        )
    })
}

fn script(here: &Path) -> String {
    crate::batch::shell::quoted(here.join(SUBMIT))
}

fn summary(json: bool, here: &Path, jobs: &Jobs, sent: Option<&Sent>) -> Result<String, Failure> {
    if json {
        return pretty(&json!({
            "folder": here.display().to_string(),
            "data_sets": jobs.data_sets,
            "shards": jobs.shards,
            "tasks": jobs.filled.len(),
            "array": sent.map(|sent| &sent.array),
            "collect": sent.map(|sent| &sent.collect),
        }));
    }
    let shards = if jobs.shards == 1 { "shard" } else { "shards" };
    let mut text = format!("{}: {} data sets in {} {shards}", shown(here), jobs.data_sets, jobs.shards);
    if jobs.filled.len() < jobs.shards as usize {
        text.push_str(&format!(", {} of them without any, left out", jobs.shards as usize - jobs.filled.len()));
    }
    text.push_str(&match sent {
        Some(sent) => format!("\nsent: array {}, after it {}, which collects\n", sent.array, sent.collect),
        None => format!("\nto send them: bash {}\n", script(here)),
    });
    Ok(text)
}
