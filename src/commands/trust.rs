//! `afmid trust`: consent for plugins, given once.

use std::path::Path;

use afmid_pipeline::Config;
use afmid_pipeline::plugin::{Candidate, Described, Plugins, Trust, Trusted};
use serde_json::{Value, json};

use super::consent::{all, end, listing, trust};
use super::load::read;
use crate::cli::TrustArgs;
use crate::diagnostic::render;
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::show::pretty;

/// Lists, agrees, or takes it back.
pub fn run(args: &TrustArgs) -> Result<(), Failure> {
    let nowhere = || {
        let help = "set HOME, or AFMID_TRUST to a folder of your own".to_owned();
        Failure::usage("there is no folder to remember consent in", Some(help))
    };
    let trust = trust().ok_or_else(nowhere)?;
    if args.list {
        return list(&trust, args.json);
    }
    let plugins = all();
    let mut rows = Vec::new();
    for config in &args.configs {
        let candidates = candidates(config, &plugins)?;
        if candidates.is_empty() && !args.json {
            print(&format!("{}: its stages start no plugin\n", config.display()))?;
        }
        for candidate in candidates {
            let row = if args.revoke { revoked(&trust, &candidate)? } else { agreed(&plugins, &candidate, args.json)? };
            if !args.json {
                print(&row.text())?;
            }
            rows.push(row);
        }
    }
    end(&plugins)?;
    if args.json {
        let rows: Vec<Value> = rows.iter().map(Row::json).collect();
        print(&pretty(&json!({ "folder": trust.folder().display().to_string(), "plugins": rows }))?)?;
    }
    // what was printed says all
    let failed = rows.iter().any(|row| matches!(row.outcome, Outcome::Failed(_)));
    if failed { Err(Failure::Failed(Message::Rendered(String::new()))) } else { Ok(()) }
}

/// The plugins of a config. Errors, usage: what is wrong with it; a plugin that is not there.
fn candidates(config: &Path, plugins: &Plugins) -> Result<Vec<Candidate>, Failure> {
    let (file, text) = (config.display().to_string(), read(config)?);
    let found = Config::parse(&file, &text, &[]).and_then(|config| plugins.candidates(&config));
    found.map_err(|problems| Failure::Usage(Message::Rendered(render(&file, &text, &problems))))
}

struct Row {
    candidate: Candidate,
    outcome: Outcome,
}

enum Outcome {
    Trusted(Described),
    Revoked(usize),
    Failed(String),
}

/// Errors: stdout cannot be written.
fn agreed(plugins: &Plugins, candidate: &Candidate, json: bool) -> Result<Row, Failure> {
    if !json {
        print(&listing(candidate))?;
    }
    let outcome = match plugins.agree(candidate) {
        Ok(described) => Outcome::Trusted(described),
        Err(error) => Outcome::Failed(format!("{}\n  help: {}", error.told(candidate.name()), error.help)),
    };
    Ok(Row { candidate: candidate.clone(), outcome })
}

/// Takes back consent for the plugin as it is and as it was: what ran under this name in this folder.
fn revoked(trust: &Trust, candidate: &Candidate) -> Result<Row, Failure> {
    let folder = candidate.folder().display().to_string();
    let (mut count, seal) = (0, candidate.seal());
    let own =
        |trusted: &Trusted| (trusted.name == candidate.name() && trusted.folder == folder) || trusted.seal == seal;
    for trusted in trust.list().iter().filter(|trusted| own(trusted)) {
        let gone = trust.revoke(&trusted.seal).map_err(|error| Failure::failed(&error, error.help.clone()))?;
        count += usize::from(gone);
    }
    Ok(Row { candidate: candidate.clone(), outcome: Outcome::Revoked(count) })
}

impl Row {
    fn text(&self) -> String {
        match &self.outcome {
            Outcome::Trusted(Described { name, version, summary, inputs, outputs }) => {
                let list = |names: &[String]| if names.is_empty() { "nothing".to_owned() } else { names.join(", ") };
                format!(
                    "  is    {name} {version}: {summary}\n  takes {}\n  makes {}\ntrusted, as long as nothing of this changes; what its files import is not seen\n",
                    list(inputs),
                    list(outputs)
                )
            }
            Outcome::Revoked(0) => format!("plugin {}: nobody had agreed to it\n", self.candidate.name()),
            Outcome::Revoked(_) => format!("plugin {}: trusted no more\n", self.candidate.name()),
            Outcome::Failed(error) => format!("not trusted: {error}\n"),
        }
    }

    fn json(&self) -> Value {
        let candidate = &self.candidate;
        let files = candidate.files().iter();
        let described = match &self.outcome {
            Outcome::Trusted(described) => json!({
                "name": described.name,
                "version": described.version,
                "summary": described.summary,
                "inputs": described.inputs,
                "outputs": described.outputs,
            }),
            _ => Value::Null,
        };
        json!({
            "name": candidate.name(),
            "program": candidate.program().display().to_string(),
            "arguments": candidate.arguments(),
            "environment": candidate.environment(),
            "folder": candidate.folder().display().to_string(),
            "confined": candidate.is_confined(),
            "files": files.map(|file| json!({ "path": file.path.display().to_string(), "blake3": file.blake3 })).collect::<Vec<_>>(),
            "seal": candidate.seal(),
            "trusted": matches!(self.outcome, Outcome::Trusted(_)),
            "described": described,
            "error": if let Outcome::Failed(error) = &self.outcome { Some(error) } else { None },
        })
    }
}

fn list(trust: &Trust, as_json: bool) -> Result<(), Failure> {
    let all = trust.list();
    if as_json {
        let row = |trusted: &Trusted| {
            let (name, version) = trusted.identity();
            json!({
                "name": trusted.name,
                "program": trusted.program,
                "arguments": trusted.arguments,
                "environment": trusted.environment,
                "folder": trusted.folder,
                "confined": trusted.confined,
                "files": trusted.files.iter().map(|(path, hash)| json!({ "path": path, "blake3": hash })).collect::<Vec<_>>(),
                "seal": trusted.seal,
                "agreed_at": trusted.agreed_at,
                "identity": format!("{name} {version}"),
            })
        };
        let rows: Vec<Value> = all.iter().map(row).collect();
        return print(&pretty(&json!({ "folder": trust.folder().display().to_string(), "plugins": rows }))?);
    }
    let row = |trusted: &Trusted| {
        let words = std::iter::once(&trusted.program).chain(&trusted.arguments).map(crate::batch::shell::quoted);
        let (name, version) = trusted.identity();
        format!(
            "plugin {} ({name} {version}), {}\n  runs  {}\n  in    {}\n",
            trusted.name,
            trusted.agreed_at,
            words.collect::<Vec<_>>().join(" "),
            trusted.folder
        )
    };
    let end = format!("{} trusted, in {}\n", all.len(), trust.folder().display());
    print(&(all.iter().map(row).collect::<String>() + &end))
}
