//! A run as a Process Run RO-Crate: its result, config and inputs, and the program that made the one from the others.

use std::path::{Path, PathBuf};

use afmid_pipeline::SourceFile;
use afmid_pipeline::store::ResultFile;
use serde_json::{Value, json};

use super::diff::file_name;
use super::digest::Sha;

/// The file that makes a folder a crate.
pub const METADATA: &str = "ro-crate-metadata.json";
/// The config's name in a crate.
pub const CONFIG: &str = "config.toml";

const CONTEXT: [&str; 2] = ["https://w3id.org/ro/crate/1.1/context", "https://w3id.org/ro/terms/workflow-run/context"];
const CRATE: &str = "https://w3id.org/ro/crate/1.1";
const PROFILE: &str = "https://w3id.org/ro/wfrun/process/0.5";

/// An input of the run.
#[derive(Debug, Clone)]
pub struct CrateInput {
    /// As the run read it.
    pub source: SourceFile,
    /// Where it is now, if it is there with the same bytes.
    pub found: Option<PathBuf>,
    /// Where it lies in the crate, if it is copied.
    pub copy: Option<String>,
}

/// What a crate says beyond what the result file says.
#[derive(Debug, Clone, Default)]
pub struct Stated {
    /// Who ran it.
    pub agent: Option<String>,
    /// The address of who ran it.
    pub agent_id: Option<String>,
    /// The licence's address.
    pub license: Option<String>,
}

/// The inputs of a run, each file once; with `copied`, with places of their own in the crate.
pub fn inputs(file: &ResultFile, find: impl Fn(&SourceFile) -> Option<PathBuf>, copied: bool) -> Vec<CrateInput> {
    let mut inputs: Vec<CrateInput> = Vec::new();
    for source in file.stages().iter().flat_map(|stage| &stage.record.sources) {
        let name = file_name(&source.path);
        let same = |other: &CrateInput| other.source.blake3 == source.blake3 && file_name(&other.source.path) == name;
        if inputs.iter().any(same) {
            continue;
        }
        let taken = inputs.iter().any(|other| file_name(&other.source.path) == name);
        let hash: String = source.blake3.chars().take(16).collect();
        let copy = if taken { format!("inputs/{hash}/{name}") } else { format!("inputs/{name}") };
        inputs.push(CrateInput { source: source.clone(), found: find(source), copy: copied.then_some(copy) });
    }
    inputs
}

/// The crate's metadata; the result lies in it as `result`. Same arguments, same text. Errors: a file cannot be read.
pub fn metadata(file: &ResultFile, result: &str, inputs: &[CrateInput], stated: &Stated) -> std::io::Result<Value> {
    let run = file.run();
    let files: Vec<Value> = inputs.iter().map(input_entity).collect::<std::io::Result<_>>()?;
    let ids: Vec<Value> = files.iter().map(|file| json!({ "@id": file["@id"] })).collect();
    let config = json!({
        "@id": CONFIG,
        "@type": "File",
        "name": format!("config of the pipeline {}", run.name),
        "encodingFormat": "application/toml",
        "contentSize": run.config.len().to_string(),
        "sha256": Sha::of_text(&run.config).hex(),
    });
    let size = std::fs::metadata(file.path())?.len();
    let outcome = json!({
        "@id": encoded(result),
        "@type": "File",
        "name": format!("result of the pipeline {}", run.name),
        "encodingFormat": "application/x-hdf5",
        "contentSize": size.to_string(),
        "sha256": Sha::of_file(file.path())?.hex(),
    });
    let (name, version) = run.program.rsplit_once(' ').unwrap_or((&run.program, ""));
    let software = json!({
        "@id": format!("#{}", encoded(&run.program.replace(' ', "-"))),
        "@type": "SoftwareApplication",
        "name": name,
        "softwareVersion": version,
    });
    let mut parts = vec![json!({ "@id": CONFIG }), json!({ "@id": outcome["@id"] })];
    parts.extend(ids.iter().cloned());
    let mut objects = vec![json!({ "@id": CONFIG })];
    objects.extend(ids);
    let action = action(file, &objects, &outcome, &software, stated);
    let mut graph = vec![descriptor(), root(file, parts, &action, stated), profile(), action];
    graph.extend(agent(stated));
    graph.extend([software, outcome, config]);
    graph.extend(files);
    Ok(json!({ "@context": CONTEXT, "@graph": graph }))
}

fn descriptor() -> Value {
    json!({
        "@id": METADATA,
        "@type": "CreativeWork",
        "about": { "@id": "./" },
        "conformsTo": { "@id": CRATE },
    })
}

fn root(file: &ResultFile, parts: Vec<Value>, action: &Value, stated: &Stated) -> Value {
    let run = file.run();
    let mut root = json!({
        "@id": "./",
        "@type": "Dataset",
        "conformsTo": { "@id": PROFILE },
        "name": format!("{} by {}", run.name, run.program),
        "description": format!("One run of the pipeline {}: its result, its config and the files that it read.", run.name),
        "hasPart": parts,
        "mentions": [{ "@id": action["@id"] }],
    });
    // a crate is as old as its run: exported again it is the same
    if !run.info.started_at.is_empty() {
        root["datePublished"] = json!(run.info.started_at);
    }
    if let Some(license) = &stated.license {
        root["license"] = json!({ "@id": license });
    }
    root
}

fn profile() -> Value {
    json!({ "@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5" })
}

fn action(file: &ResultFile, objects: &[Value], result: &Value, software: &Value, stated: &Stated) -> Value {
    let run = file.run();
    let sets: String = run.overrides.iter().map(|set| format!(" --set {set}")).collect();
    let mut action = json!({
        "@id": "#run",
        "@type": "CreateAction",
        "name": format!("{} ran {}", run.program, run.name),
        "description": format!("afmid run {CONFIG}{sets} (seed {}, {} stages)", run.seed, file.stages().len()),
        "instrument": { "@id": software["@id"] },
        "object": objects,
        "result": [{ "@id": result["@id"] }],
        "actionStatus": { "@id": "http://schema.org/CompletedActionStatus" },
    });
    if let Some((start, end)) = times(file) {
        (action["startTime"], action["endTime"]) = (json!(start), json!(end));
    }
    if let Some(agent) = agent(stated) {
        action["agent"] = json!({ "@id": agent["@id"] });
    }
    action
}

/// Start and end of the run, to the second.
fn times(file: &ResultFile) -> Option<(String, String)> {
    let info = &file.run().info;
    let start: jiff::Timestamp = info.started_at.parse().ok()?;
    let took = jiff::SignedDuration::try_from_secs_f64(info.seconds).ok()?;
    let end = start.checked_add(took).ok()?;
    Some((info.started_at.clone(), end.strftime("%Y-%m-%dT%H:%M:%SZ").to_string()))
}

fn agent(stated: &Stated) -> Option<Value> {
    let name = stated.agent.as_ref()?;
    let id = stated.agent_id.clone().unwrap_or_else(|| "#agent".to_owned());
    Some(json!({ "@id": id, "@type": "Person", "name": name }))
}

/// A file by its place in the crate, or by the hash of its bytes, or, if it is gone, by its BLAKE3 hash as a thing that
/// the crate does not hold.
fn input_entity(input: &CrateInput) -> std::io::Result<Value> {
    let source = &input.source;
    let sha = input.found.as_deref().map(Sha::of_file).transpose()?;
    let id = match (&input.copy, &sha) {
        (Some(place), _) => encoded(place),
        (None, Some(sha)) => sha.name(),
        (None, None) => format!("#blake3-{}", source.blake3),
    };
    let mut entity = json!({
        "@id": id,
        "@type": if sha.is_some() { "File" } else { "CreativeWork" },
        "name": file_name(&source.path),
        "contentSize": source.size.to_string(),
        "identifier": format!("blake3:{}", source.blake3),
    });
    if let Some(sha) = sha {
        entity["sha256"] = json!(sha.hex());
    }
    Ok(entity)
}

/// A relative path as a URI: what RFC 3986 does not allow in one is percent-encoded.
fn encoded(path: &str) -> String {
    let keep = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~/".contains(&byte);
    path.bytes().map(|byte| if keep(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// The name of a result file in its crate.
pub fn result_name(path: &Path) -> String {
    match path.file_name().map(|name| name.to_string_lossy().into_owned()) {
        // two files of the crate cannot have one name
        Some(name) if name != METADATA && name != CONFIG && name != "inputs" => name,
        _ => "result.h5".to_owned(),
    }
}
