//! `afmid trust`: consent for plugins, given once.

use std::path::Path;

use afmid_pipeline::plugin::{Candidate, Described, MadeOf, Plugins, Trust, Trusted};
use afmid_pipeline::{Config, Problem};
use serde_json::{Value, json};

use super::consent::{all, end, listing, trust};
use super::load::read;
use crate::cli::TrustArgs;
use crate::diagnostic::render;
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::printable::{help_line, message, one_line, shown};
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
        let (parsed, text) = parsed(config)?;
        let found = match (args.revoke, plugins.candidates(&parsed)) {
            (false, Err(problems)) => return Err(usage(config, &text, &problems)),
            (true, found) => {
                let rows = revoked(&trust, config, &parsed, &found.unwrap_or_default())?;
                if !args.json {
                    rows.iter().try_for_each(|row| print(&row.text()))?;
                }
                rows
            }
            (false, Ok(candidates)) => {
                let agreed = |candidate: &Candidate| agreed(&plugins, candidate, args.json);
                candidates.iter().map(agreed).collect::<Result<Vec<Row>, Failure>>()?
            }
        };
        if found.is_empty() && !args.json {
            print(&format!("{}: its stages start no plugin\n", shown(config)))?;
        }
        rows.extend(found);
    }
    end(&plugins)?;
    if args.json {
        let rows: Vec<Value> = rows.iter().map(Row::json).collect();
        print(&pretty(&json!({ "folder": trust.folder().display().to_string(), "plugins": rows }))?)?;
    }
    // what was printed says all
    let failed = rows.iter().any(|row| matches!(row.outcome, Outcome::Failed(..)));
    if failed { Err(Failure::Failed(Message::Rendered(String::new()))) } else { Ok(()) }
}

/// A config and its text. Errors, usage: what is wrong with it.
fn parsed(config: &Path) -> Result<(Config, String), Failure> {
    let text = read(config)?;
    match Config::parse(&config.display().to_string(), &text, &[]) {
        Ok(parsed) => Ok((parsed, text)),
        Err(problems) => Err(usage(config, &text, &problems)),
    }
}

fn usage(config: &Path, text: &str, problems: &[Problem]) -> Failure {
    Failure::Usage(Message::Rendered(render(&config.display().to_string(), text, problems)))
}

struct Row {
    name: String,
    /// None of one that is there no more.
    candidate: Option<Candidate>,
    outcome: Outcome,
}

enum Outcome {
    Trusted(Described),
    Revoked(usize),
    /// What is wrong, and what to do.
    Failed(String, String),
}

/// Errors: stdout cannot be written.
fn agreed(plugins: &Plugins, candidate: &Candidate, json: bool) -> Result<Row, Failure> {
    if !json {
        print(&listing(candidate))?;
    }
    let outcome = match plugins.agree(candidate) {
        Ok(described) => Outcome::Trusted(described),
        Err(error) => Outcome::Failed(error.message_for(candidate.name()), error.help),
    };
    let row = Row { name: candidate.name().to_owned(), candidate: Some(candidate.clone()), outcome };
    if !json {
        print(&row.text())?;
    }
    Ok(row)
}

/// Takes back consent for the plugins of a config, as they are and as they were: what ran under these names in its
/// folder, whether it is still there or not, and what is the same under another name.
fn revoked(trust: &Trust, config: &Path, parsed: &Config, found: &[Candidate]) -> Result<Vec<Row>, Failure> {
    let folder = match config.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned()).display().to_string();
    let mut names: Vec<&str> = Vec::new();
    for name in parsed.stages.iter().filter_map(|stage| stage.uses.strip_prefix("exec:")) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let revoked = |name: &str| {
        let candidate = found.iter().find(|candidate| candidate.name() == name);
        let seal = candidate.map(Candidate::seal);
        let own = |trusted: &Trusted| {
            (trusted.name == name && trusted.folder == folder) || Some(&trusted.seal) == seal.as_ref()
        };
        let mut count = 0;
        for trusted in trust.list().iter().filter(|trusted| own(trusted)) {
            let gone = trust.revoke(&trusted.seal).map_err(|error| Failure::failed(&error, error.help.clone()))?;
            count += usize::from(gone);
        }
        Ok(Row { name: name.to_owned(), candidate: candidate.cloned(), outcome: Outcome::Revoked(count) })
    };
    let rows = names.into_iter().map(revoked).collect::<Result<Vec<Row>, Failure>>()?;
    Ok(rows)
}

impl Row {
    fn text(&self) -> String {
        match &self.outcome {
            Outcome::Trusted(Described { name, version, summary, inputs, outputs }) => {
                let list = |names: &[String]| {
                    if names.is_empty() { "nothing".to_owned() } else { one_line(&names.join(", ")) }
                };
                let (name, version, summary) = (one_line(name), one_line(&version.to_string()), one_line(summary));
                format!(
                    "  is    {name} {version}: {summary}\n  takes {}\n  makes {}\n\
                     trusted, as long as nothing of this changes; what its files import is not seen\n",
                    list(inputs),
                    list(outputs)
                )
            }
            Outcome::Revoked(0) => format!("plugin {}: nobody had agreed to it\n", one_line(&self.name)),
            Outcome::Revoked(_) => format!("plugin {}: trusted no more\n", one_line(&self.name)),
            Outcome::Failed(error, help) => format!("not trusted: {}\n{}", message(error), help_line(help)),
        }
    }

    fn json(&self) -> Value {
        let candidate = self.candidate.as_ref();
        let files = |candidate: &Candidate| {
            let file = |file: &MadeOf| json!({ "path": file.path.display().to_string(), "blake3": file.blake3 });
            candidate.files().iter().map(file).collect::<Vec<_>>()
        };
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
            "name": self.name,
            "program": candidate.map(|candidate| candidate.program().display().to_string()),
            "arguments": candidate.map(Candidate::arguments),
            "environment": candidate.map(Candidate::environment),
            "folder": candidate.map(|candidate| candidate.folder().display().to_string()),
            "confined": candidate.map(Candidate::is_confined),
            "files": candidate.map(files),
            "seal": candidate.map(Candidate::seal),
            "trusted": matches!(self.outcome, Outcome::Trusted(_)),
            "described": described,
            "error": match &self.outcome {
                Outcome::Failed(error, help) => Some(format!("{error}\n  help: {help}")),
                _ => None,
            },
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
        let (name, version) = (one_line(name), one_line(version));
        format!(
            "plugin {} ({name} {version}), {}\n  runs  {}\n  in    {}\n",
            one_line(&trusted.name),
            one_line(&trusted.agreed_at),
            words.collect::<Vec<_>>().join(" "),
            one_line(&trusted.folder)
        )
    };
    let end = format!("{} trusted, in {}\n", all.len(), shown(trust.folder()));
    print(&(all.iter().map(row).collect::<String>() + &end))
}
