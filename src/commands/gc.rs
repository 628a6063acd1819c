//! `afmid gc`: frees the cache.

use std::path::Path;
use std::time::{Duration, SystemTime};

use afmid_pipeline::cache::{Freed, Gone, Limits, Sort, Why, free};
use afmid_pipeline::files::sweep_folders;
use serde_json::{Value, json};

use super::run::cache_folder;
use crate::cli::GcArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::output::print;
use crate::printable::shown;
use crate::show::{pretty, size};

/// Results idle for so many days are reported where no limit is given.
const IDLE_DAYS: u64 = 30;

/// Frees the cache and says what went and what is left.
pub fn run(args: &GcArgs) -> Result<(), Failure> {
    let folder = cache_folder(args.cache.as_deref());
    let limits = Limits { older_than: args.older_than, max_bytes: args.max_size };
    interrupt::writes_in(&folder);
    sweep_folders();
    let freed = free(&folder, &limits, args.dry_run).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let text = if args.json { pretty(&as_json(args, &folder, &freed))? } else { as_text(args, &folder, &freed) };
    print(&text)?;
    match freed.failed.first() {
        None => Ok(()),
        Some((gone, why)) => Err(Failure::failed(
            format!("{} files cannot be removed, first {}: {why}", freed.failed.len(), gone.file.path.display()),
            Some("remove them as their owner".to_owned()),
        )),
    }
}

fn idle(freed: &Freed) -> (usize, u64) {
    freed.left.idle(Duration::from_secs(IDLE_DAYS * 24 * 3600), SystemTime::now())
}

fn as_text(args: &GcArgs, folder: &Path, freed: &Freed) -> String {
    let (results, bytes) = freed.left.total(Sort::Result);
    let (stamps, stamp_bytes) = freed.left.total(Sort::Stamp);
    let mut text = format!("cache {}\n", shown(folder));
    for why in [Why::Leftover, Why::Old, Why::Size] {
        let of: Vec<&Gone> = freed.gone.iter().filter(|gone| gone.why == why).collect();
        if !of.is_empty() {
            let bytes = of.iter().map(|gone| gone.file.bytes).sum();
            let verb = if args.dry_run { "would free" } else { "freed" };
            text.push_str(&format!("{verb}  {} ({})\n", counted(of.len(), "file", bytes), why.name()));
        }
    }
    if freed.gone.is_empty() {
        text.push_str(if args.dry_run { "would free nothing\n" } else { "freed nothing\n" });
    }
    text.push_str(&format!("left   {}", counted(results, "result", bytes)));
    if stamps > 0 {
        text.push_str(&format!(", {}", counted(stamps, "stamp", stamp_bytes)));
    }
    text.push('\n');
    if args.older_than.is_none() && args.max_size.is_none() {
        text.push_str(&advice(idle(freed)));
    }
    text
}

/// What a limit would free.
fn advice((count, bytes): (usize, u64)) -> String {
    match count {
        0 => format!("every result was used within {IDLE_DAYS} days; `--max-size 20G` bounds the whole\n"),
        _ => format!(
            "{} not used for {IDLE_DAYS} days: `--older-than {IDLE_DAYS}d` frees them; `--max-size 20G` bounds the \
             whole\n",
            counted(count, "result", bytes)
        ),
    }
}

fn counted(count: usize, what: &str, bytes: u64) -> String {
    format!("{count} {what}{}, {}", if count == 1 { "" } else { "s" }, size(bytes))
}

fn as_json(args: &GcArgs, folder: &Path, freed: &Freed) -> Value {
    let total = |(files, bytes): (usize, u64)| json!({ "files": files, "bytes": bytes });
    let gone = |gone: &Gone| {
        json!({
            "file": gone.file.path.display().to_string(),
            "kind": gone.file.sort.name(),
            "bytes": gone.file.bytes,
            "idle_s": SystemTime::now().duration_since(gone.file.used).map_or(0, |age| age.as_secs()),
            "why": gone.why.name(),
        })
    };
    let failed = freed.failed.iter().map(|(file, why)| json!({ "file": gone(file), "why": why }));
    json!({
        "folder": folder.display().to_string(),
        "dry_run": args.dry_run,
        "freed": total((freed.gone.len(), freed.gone.iter().map(|gone| gone.file.bytes).sum())),
        "removed": freed.gone.iter().map(gone).collect::<Vec<_>>(),
        "failed": failed.collect::<Vec<_>>(),
        "left": { "results": total(freed.left.total(Sort::Result)), "stamps": total(freed.left.total(Sort::Stamp)) },
        "idle_for_30_days": total(idle(freed)),
    })
}
