//! The arguments of the commands about where results come from, and of the cache.

use std::num::NonZeroU16;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::{AllowArgs, threads};

/// What to compare.
#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The first result file: differences are given in its standard errors.
    #[arg(value_name = "A.h5")]
    pub a: PathBuf,
    /// The second.
    #[arg(value_name = "B.h5")]
    pub b: PathBuf,
    /// Every dataset that differs, by how much, and the hashes of files.
    #[arg(long)]
    pub all: bool,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
    /// End with exit code 1 if they differ, as `git diff` does.
    #[arg(long)]
    pub exit_code: bool,
}

/// What to trace.
#[derive(Debug, Args)]
pub struct TraceArgs {
    /// The result file.
    pub result: PathBuf,
    /// The number: the stage's id, then its place in what `afmid show RESULT ID --json` prints, such as
    /// `modes[0].frequency_hz`.
    #[arg(value_name = "ID.PATH")]
    pub path: String,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What to repeat.
#[derive(Debug, Args)]
pub struct RerunArgs {
    /// The result file.
    pub result: PathBuf,
    /// Keep what comes out in this file.
    #[arg(short, long, value_name = "OUT.h5")]
    pub output: Option<PathBuf>,
    /// Look for the inputs in this folder as well, by name and hash.
    #[arg(long, value_name = "FOLDER")]
    pub data: Vec<PathBuf>,
    /// Take what is in the cache instead of computing everything again.
    #[arg(long)]
    pub reuse: bool,
    /// Threads [default: one per processor]; results don't depend on it.
    #[arg(short, long, value_name = "N", value_parser = threads)]
    pub jobs: Option<NonZeroU16>,
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Whether plugins may start.
    #[command(flatten)]
    pub plugins: AllowArgs,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What to export.
#[derive(Debug, Args)]
pub struct CrateArgs {
    /// The result file.
    pub result: PathBuf,
    /// The crate's folder [default: the result file's name with `-crate`, in the working directory].
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Copy the inputs into the crate instead of referring to them by hash.
    #[arg(long)]
    pub with_data: bool,
    /// Look for the inputs in this folder as well, by name and hash.
    #[arg(long, value_name = "FOLDER")]
    pub data: Vec<PathBuf>,
    /// Who ran it; without it, the crate names nobody.
    #[arg(long, value_name = "NAME")]
    pub agent: Option<String>,
    /// The address of who ran it, such as an ORCID.
    #[arg(long, value_name = "URL", requires = "agent")]
    pub agent_id: Option<String>,
    /// The licence of the crate, as an address.
    #[arg(long, value_name = "URL")]
    pub license: Option<String>,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What to free.
#[derive(Debug, Args)]
pub struct GcArgs {
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Remove what has not been used for longer, such as `30d` (s, m, h, d or w).
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub older_than: Option<Duration>,
    /// Remove the least recently used results until the rest is at most this large, such as `20G` (k, M, G, T, or Ki,
    /// Mi, Gi, Ti).
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub max_size: Option<u64>,
    /// Remove nothing, say what would go.
    #[arg(long)]
    pub dry_run: bool,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// A number and what follows it.
fn quantity(text: &str) -> Option<(f64, &str)> {
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text.get(..end)?.parse().ok()?;
    Some((number, text.get(end..)?.trim()))
}

fn duration(text: &str) -> Result<Duration, String> {
    let wanted = || "wanted a number and s, m, h, d or w, such as 30d".to_owned();
    let (number, unit) = quantity(text.trim()).ok_or_else(wanted)?;
    let seconds = match unit {
        "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        "d" => 86400.0,
        "w" => 7.0 * 86400.0,
        _ => return Err(wanted()),
    };
    Duration::try_from_secs_f64(number * seconds).map_err(|_| "the time is too long".to_owned())
}

fn bytes(text: &str) -> Result<u64, String> {
    let wanted = || "wanted a number and k, M, G or T (or Ki, Mi, Gi, Ti; a B may follow), such as 20G".to_owned();
    let (number, unit) = quantity(text.trim()).ok_or_else(wanted)?;
    let factor: f64 = match unit.strip_suffix('B').unwrap_or(unit) {
        "" => 1.0,
        "k" | "K" => 1e3,
        "M" => 1e6,
        "G" => 1e9,
        "T" => 1e12,
        "Ki" => 1024.0,
        "Mi" => 1024f64.powi(2),
        "Gi" => 1024f64.powi(3),
        "Ti" => 1024f64.powi(4),
        _ => return Err(wanted()),
    };
    let bytes = number * factor;
    // a u64's range; beyond 2^53 nobody counts single bytes
    if bytes < 1.8e19 { Ok(bytes as u64) } else { Err("the size is too large".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_have_units() {
        assert_eq!(duration("30d"), Ok(Duration::from_secs(30 * 86400)));
        assert_eq!(duration("1.5 h"), Ok(Duration::from_secs(5400)));
        assert_eq!(
            (bytes("20G"), bytes("1.5KiB"), bytes("7"), bytes("0")),
            (Ok(20_000_000_000), Ok(1536), Ok(7), Ok(0))
        );
        for wrong in ["", "d", "30", "30 years", "-1d", "1..2d"] {
            assert!(duration(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "G", "20 potatoes", "-1G", "1e9"] {
            assert!(bytes(wrong).is_err(), "{wrong}");
        }
    }
}
