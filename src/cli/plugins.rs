//! The arguments of the commands about plugins.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// What to do with a plugin.
#[derive(Debug, Subcommand)]
pub enum PluginCommand {
    /// Try whether a command is a plugin as docs/plugins.md has it: exit code 0 if everything passed, 1 if not. The
    /// command is started.
    Check {
        /// How long one request may take, in seconds.
        #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = seconds)]
        timeout: f64,
        /// As JSON, alone on stdout.
        #[arg(long)]
        json: bool,
        /// The command: a program, and its arguments.
        #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true, value_name = "CMD")]
        command: Vec<String>,
    },
}

/// A time limit.
fn seconds(text: &str) -> Result<f64, String> {
    let wanted = || "wanted seconds above 0, at most a week".to_owned();
    text.parse().ok().filter(|seconds| *seconds > 0.0 && *seconds <= 604_800.0).ok_or_else(wanted)
}

/// Whether plugins may start.
#[derive(Debug, Default, Args)]
pub struct AllowArgs {
    /// Start the plugins of the config, this once; without it only those that `afmid trust CONFIG` has listed and
    /// remembered.
    #[arg(long)]
    pub allow_plugins: bool,
}

/// Which plugins to agree to.
#[derive(Debug, Args)]
pub struct TrustArgs {
    /// The configs: their plugins are listed, started to describe themselves, and remembered.
    #[arg(required_unless_present = "list", value_name = "CONFIG")]
    pub configs: Vec<PathBuf>,
    /// Take it back: the plugins of these configs start no more without being asked for.
    #[arg(long, conflicts_with = "list")]
    pub revoke: bool,
    /// List what was agreed to, and start nothing.
    #[arg(long, conflicts_with = "configs")]
    pub list: bool,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}
