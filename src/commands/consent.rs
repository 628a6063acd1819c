//! Which plugins a command may start, and how a user says so.

use std::collections::BTreeSet;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use afmid_pipeline::Config;
use afmid_pipeline::files::read_regular;
use afmid_pipeline::plugin::{Ask, Candidate, Host, Plugins, Rule, Trust, is_seal};

use crate::batch::shell::quoted;
use crate::cli::AllowArgs;
use crate::diagnostic::render;
use crate::failure::{Failure, Message};
use crate::output::say;
use crate::printable::one_line;

/// For commands that start nothing: what plugins are is known as far as it is remembered.
pub fn none() -> Plugins {
    Plugins::new(Rule::Never, trust())
}

/// For commands whose user has typed what is started.
pub fn all() -> Plugins {
    starting(Rule::All)
}

/// Each plugin under a process that ends it, and all that it started, with this one.
fn starting(rule: Rule) -> Plugins {
    Plugins::new(rule, trust()).hosted(Host::this_program())
}

/// For commands that may start plugins: all of them with `--allow-plugins`, else those that are trusted, whose seals
/// are in the file `agreed`, or that somebody who sits before a terminal says yes to. Errors, usage: the file cannot be
/// read.
pub fn plugins(allow: &AllowArgs, agreed: Option<&Path>) -> Result<Plugins, Failure> {
    if allow.allow_plugins {
        return Ok(all());
    }
    let seals = agreed.map(read).transpose()?.unwrap_or_default();
    let before = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let ask = before.then(|| Box::new(question) as Ask);
    Ok(starting(Rule::Agreed { seals, ask }))
}

/// Ends what was started, and says what was noted. Errors: a plugin wrote something that nobody had asked for.
pub fn end(plugins: &Plugins) -> Result<(), Failure> {
    let wrong = plugins.shut_down();
    plugins.take_notes().iter().for_each(|note| say(&format!("note: {}\n", one_line(note))));
    if wrong.is_empty() {
        return Ok(());
    }
    let help =
        "stdout of a plugin is for the protocol alone: mend it, what it made may be wrong; `afmid plugin check` \
        tries it"
            .to_owned();
    Err(Failure::failed(wrong.join("; "), Some(help)))
}

/// The plugins of a config, all agreed to, without starting any. Errors, usage: one is not there; one is not agreed to.
pub fn agreed(allow: &AllowArgs, config: &Config) -> Result<Vec<Candidate>, Failure> {
    let plugins = plugins(allow, None)?;
    let candidates = plugins
        .candidates(config)
        .map_err(|problems| Failure::Usage(Message::Rendered(render(&config.file, &config.text, &problems))))?;
    match candidates.iter().find(|candidate| !plugins.may_start(candidate)) {
        None => Ok(candidates),
        Some(candidate) => {
            let message = format!("the plugin `{}` is not agreed to:", candidate.name());
            let list = listing(candidate).lines().map(str::to_owned).collect();
            let help = format!(
                "`afmid trust {}` lists what its plugins would run, and remembers that you agree; `--allow-plugins` \
                 allows it for this submission",
                quoted(&config.file)
            );
            Err(Failure::Usage(Message::Listed(message, list, Some(help))))
        }
    }
}

/// What [`plugins`] reads as the file `agreed`.
pub fn seals(agreed: &[Candidate]) -> String {
    let mut text =
        "# Written by `afmid submit`: the plugins that its jobs may start, as long as nothing of them changes.\n"
            .to_owned();
    for candidate in agreed {
        for line in listing(candidate).lines() {
            text.push_str(&format!("# {line}\n"));
        }
        text.push_str(&format!("{}\n", candidate.seal()));
    }
    text
}

/// The largest list of seals: a million of them with what they stand for.
const MOST_BYTES: u64 = 1 << 30;

fn read(file: &Path) -> Result<BTreeSet<String>, Failure> {
    let shown = file.display();
    let text = read_regular(file, MOST_BYTES)
        .and_then(|bytes| String::from_utf8(bytes).map_err(std::io::Error::other))
        .map_err(|error| Failure::usage(format!("the plugins agreed to, {shown}, cannot be read: {error}"), None))?;
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| match is_seal(line) {
            true => Ok(line.to_owned()),
            false => Err(Failure::usage(
                format!("{shown}: found a line that is no seal, wanted 64 hexadecimal digits"),
                None,
            )),
        })
        .collect()
}

/// What a plugin would run, in some lines.
pub fn listing(candidate: &Candidate) -> String {
    let words: Vec<String> =
        std::iter::once(quoted(candidate.program())).chain(candidate.arguments().iter().map(quoted)).collect();
    let mut text = format!(
        "plugin {}\n  runs  {}\n  in    {}\n",
        one_line(candidate.name()),
        words.join(" "),
        quoted(candidate.folder())
    );
    for (name, value) in candidate.environment() {
        text.push_str(&format!("  with  {}={}\n", one_line(name), quoted(value)));
    }
    if !candidate.is_confined() {
        text.push_str("  free  it may write anywhere and use the network: `confined = false`\n");
    }
    for file in candidate.files() {
        text.push_str(&format!("  file  {} blake3:{}\n", quoted(&file.path), file.blake3));
    }
    text
}

fn question(candidate: &Candidate) -> bool {
    let listing = listing(candidate);
    say(&format!(
        "{listing}Start it, now and as long as nothing of this changes? What its files import is not seen. [y/N] "
    ));
    let mut answer = String::new();
    let read = std::io::stdin().read_line(&mut answer);
    read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes")
}

/// `$AFMID_TRUST`, or `afmid/trust` in the user's data folder: none that a config or a cache could bring along.
pub fn trust() -> Option<Trust> {
    let folder = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let data = || folder("XDG_DATA_HOME").filter(|data| data.is_absolute());
    let home = || folder("HOME").filter(|home| home.is_absolute()).map(|home| home.join(".local/share"));
    let own = folder("AFMID_TRUST").or_else(|| data().or_else(home).map(|data| data.join("afmid").join("trust")));
    own.map(|own| Trust::at(&std::path::absolute(&own).unwrap_or(own)))
}
