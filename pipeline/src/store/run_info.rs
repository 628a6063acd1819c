//! `/entry/run`: when and where.

use hdf5::Group;

use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};
use crate::outcome::{RunInfo, Unfinished};

const FOLDER: &str = "folder";
const CONFIG_FILE: &str = "config_file";
const LOG_STAGE: &str = "log_stage";
const LOG: &str = "log";
/// Ids, names and reasons of stages without a result.
const UNFINISHED: [&str; 3] = ["unfinished_stage", "unfinished_uses", "unfinished_reason"];

pub(super) fn write_run_info(parent: &Group, name: &str, info: &RunInfo) -> Result<()> {
    let group = write::nexus_group(parent, name, "NXcollection")?;
    write::text(&group, "started_at", &info.started_at)?;
    let seconds = write::scalar(&group, "seconds", info.seconds)?;
    write::text_attribute(&seconds, "units", "s")?;
    write::text(&group, "host", &info.host)?;
    write::scalar(&group, "threads", info.threads as u64)?;
    write::text(&group, FOLDER, &info.folder)?;
    write::text(&group, CONFIG_FILE, &info.config_file)?;
    let stages = &info.stages;
    write::texts(&group, "stage", &stages.iter().map(|stage| stage.0.as_str()).collect::<Vec<_>>())?;
    let seconds: Vec<f64> = stages.iter().map(|stage| stage.1).collect();
    let seconds = write::dataset(&group, "stage_seconds", &[stages.len()], &seconds)?;
    write::text_attribute(&seconds, "units", "s")?;
    let cached: Vec<i8> = stages.iter().map(|stage| i8::from(stage.2)).collect();
    let cached = write::dataset(&group, "stage_from_cache", &[stages.len()], &cached)?;
    write::text_attribute(&cached, "dtype", "bool")?;
    // HDF5 text ends at a NUL, and the text is whatever a process wrote
    let text = |log: &(String, String)| log.1.replace('\0', "\u{fffd}");
    let logged: Vec<&str> = info.logs.iter().map(|log| log.0.as_str()).collect();
    write::texts(&group, LOG_STAGE, &logged)?;
    write::texts(&group, LOG, &info.logs.iter().map(text).collect::<Vec<_>>())?;
    if !info.unfinished.is_empty() {
        write_unfinished(&group, &info.unfinished)?;
    }
    Ok(())
}

/// Files of runs that went through have none of these.
fn write_unfinished(group: &Group, unfinished: &[Unfinished]) -> Result<()> {
    let texts = |of: fn(&Unfinished) -> &str| unfinished.iter().map(of).collect::<Vec<&str>>();
    write::texts(group, UNFINISHED[0], &texts(|stage| &stage.id))?;
    write::texts(group, UNFINISHED[1], &texts(|stage| &stage.uses))?;
    let reasons = unfinished.iter().map(|stage| stage.reason.as_deref().unwrap_or_default().replace('\0', "\u{fffd}"));
    write::texts(group, UNFINISHED[2], &reasons.collect::<Vec<String>>())?;
    Ok(())
}

pub(super) fn read_run_info(parent: &Node, name: &str) -> Result<RunInfo> {
    let group = read::group(parent, name)?;
    let names = read::texts(&group, "stage")?;
    let seconds: Vec<f64> = read::numbers(&group, "stage_seconds")?;
    let cached: Vec<i8> = read::numbers(&group, "stage_from_cache")?;
    if names.len() != seconds.len() || names.len() != cached.len() {
        return Err(StoreError::new("the lists of stages differ in length").at(group.name()));
    }
    // files of earlier versions have none of these
    let optional = |name: &str| if group.link_exists(name) { read::text(&group, name) } else { Ok(String::new()) };
    let texts = |name: &str| if group.link_exists(name) { read::texts(&group, name) } else { Ok(Vec::new()) };
    let (logged, logs) = (texts(LOG_STAGE)?, texts(LOG)?);
    let [ids, uses, reasons] = UNFINISHED.map(texts);
    let unfinished = ids?.into_iter().zip(uses?).zip(reasons?).map(|((id, uses), reason)| {
        let reason = Some(reason).filter(|reason| !reason.is_empty());
        Unfinished { id, uses, reason }
    });
    let unfinished = unfinished.collect();
    Ok(RunInfo {
        folder: optional(FOLDER)?,
        config_file: optional(CONFIG_FILE)?,
        started_at: read::text(&group, "started_at")?,
        seconds: read::number(&group, "seconds")?,
        host: read::text(&group, "host")?,
        threads: read::number::<u64>(&group, "threads")? as usize,
        stages: names.into_iter().zip(seconds).zip(cached).map(|((id, time), hit)| (id, time, hit != 0)).collect(),
        logs: logged.into_iter().zip(logs).collect(),
        unfinished,
    })
}
