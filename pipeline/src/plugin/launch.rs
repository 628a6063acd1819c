//! How a plugin is started: which program, with which arguments, where.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::error::PluginError;
use crate::config::{DEFAULT_TIMEOUT_S, PluginDecl};

/// How a plugin is started.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Launch {
    /// What messages call it: NAME of `exec:NAME`.
    pub(super) name: String,
    /// The program.
    pub(super) program: PathBuf,
    /// Its arguments.
    pub(super) arguments: Vec<String>,
    /// Variables of its environment, beside those that this program has.
    pub(super) environment: BTreeMap<String, String>,
    /// The folder that it runs in: the config's.
    pub(super) folder: PathBuf,
    /// Whether it may write to its own folder alone, and use no TCP.
    pub(super) confined: bool,
    /// How long a request may take.
    pub(super) timeout: Duration,
}

/// A handshake comes at once or never; the rest is for a machine under load.
const MOST_START: Duration = Duration::from_secs(120);

impl Launch {
    /// From a command: a program with a `/` in its name is looked for from `folder` on, another one on the PATH.
    /// Errors: there is none.
    pub fn command(name: &str, command: &[String], folder: &Path, timeout_s: f64) -> Result<Self, PluginError> {
        let no_folder = |error: std::io::Error| {
            PluginError::new(format!("cannot run in {}: {error}", folder.display()), "check the config's folder")
        };
        let folder = folder.canonicalize().map_err(no_folder)?;
        let (program, arguments) = match command {
            [program, arguments @ ..] => (program, arguments.to_vec()),
            [] => return Err(PluginError::new("has an empty command", "name a program")),
        };
        let timeout = Duration::try_from_secs_f64(timeout_s).unwrap_or(MOST_START);
        let program = if program.contains('/') { executable(folder.join(program)) } else { on_path(program) };
        let program = program.ok_or_else(|| {
            let what = format!("cannot be started: there is no program `{}`", command[0]);
            PluginError::new(what, "name a program on the PATH, or a path from the config's folder with a `/` in it")
        })?;
        Ok(Self {
            name: name.to_owned(),
            program,
            arguments,
            environment: BTreeMap::new(),
            folder,
            confined: true,
            timeout,
        })
    }

    /// From `[plugins]` of a config.
    pub(super) fn declared(decl: &PluginDecl, folder: &Path) -> Result<Self, PluginError> {
        let launch = Self::command(&decl.name, &decl.command, folder, decl.timeout_s)?;
        Ok(Self { environment: decl.environment.clone(), confined: decl.confined, ..launch })
    }

    /// `afmid-stage-NAME` on the PATH, if it is there.
    pub(super) fn installed(name: &str, folder: &Path) -> Option<Self> {
        let program = on_path(&program_name(name))?;
        let (folder, timeout) = (folder.canonicalize().ok()?, Duration::from_secs_f64(DEFAULT_TIMEOUT_S));
        let (arguments, environment) = (Vec::new(), BTreeMap::new());
        Some(Self { name: name.to_owned(), program, arguments, environment, folder, confined: true, timeout })
    }

    /// How long it may take from the start to its description.
    pub(super) fn start_timeout(&self) -> Duration {
        self.timeout.min(MOST_START)
    }
}

/// The program that `exec:NAME` stands for on the PATH.
pub(super) fn program_name(name: &str) -> String {
    format!("afmid-stage-{name}")
}

fn on_path(program: &str) -> Option<PathBuf> {
    std::env::split_paths(&std::env::var_os("PATH")?).find_map(|folder| executable(folder.join(program)))
}

fn executable(path: PathBuf) -> Option<PathBuf> {
    // the PATH may hold relative folders, and the plugin runs elsewhere
    let path = std::path::absolute(path).ok()?;
    let metadata = std::fs::metadata(&path).ok().filter(std::fs::Metadata::is_file)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        (metadata.permissions().mode() & 0o111 != 0).then_some(path)
    }
    #[cfg(not(unix))]
    {
        let _ = metadata;
        Some(path)
    }
}
