//! What was found, for people.

use std::path::Path;

use super::channel::Channel;
use super::file::{Holdings, Inspected, Outcome};
use crate::printable::{help_line, one_line};
use crate::show::{grid, number};

/// Channels shown of one file, and remarks.
const MOST_ROWS: usize = 40;

/// One file in full.
pub fn file_text(inspected: &Inspected) -> String {
    let size = inspected.size_bytes.map_or(String::new(), |bytes| format!(", {bytes} bytes"));
    let file = one_line(&inspected.file.display().to_string());
    match &inspected.outcome {
        Outcome::Own => format!("{file}{size}\n  a result of afmid's, no recording: `afmid show` shows it\n"),
        Outcome::Refused { problem, help } => {
            let help = help.as_deref().map(help_line).unwrap_or_default();
            format!("{file}{size}\n  refused: {}\n{help}", one_line(problem))
        }
        Outcome::Read(holdings) => format!("{file}{size}\n{}", holdings_text(holdings)),
    }
}

fn holdings_text(holdings: &Holdings) -> String {
    let mut text = format!("  {}\n", one_line(&holdings.format));
    if !holdings.started_at.is_empty() {
        text += &format!("  started {}\n", one_line(&holdings.started_at));
    }
    if !holdings.channels.is_empty() {
        let header = ["channel", "samples", "rate/Hz", "unit", "stored as", "gaps", "least", "largest"];
        let rows = holdings.channels.iter().take(MOST_ROWS).map(row);
        let rows: Vec<Vec<String>> = std::iter::once(header.map(str::to_owned).to_vec()).chain(rows).collect();
        text.extend(grid(&rows).lines().map(|line| format!("  {line}\n")));
        text += &more(holdings.channels.len(), "channels");
    }
    text.extend(holdings.remarks.iter().take(MOST_ROWS).map(|remark| format!("  note: {}\n", one_line(remark))));
    text += &more(holdings.remarks.len(), "notes");
    let verdict = &holdings.ringdown;
    let channel = verdict.channel.and_then(|index| holdings.channels.get(index));
    let of = channel.map(|channel| format!("{}: ", channel.location)).unwrap_or_default();
    text += &format!("  ringdown: {}; {}\n", verdict.answer.word(), one_line(&format!("{of}{}", verdict.reason)));
    if let Some(stage) = &holdings.stage {
        text += "\n";
        text.extend(stage.lines().map(|line| if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") }));
    }
    text
}

fn more(count: usize, what: &str) -> String {
    if count <= MOST_ROWS {
        return String::new();
    }
    format!("  {} more {what}: --json lists all\n", count - MOST_ROWS)
}

fn row(channel: &Channel) -> Vec<String> {
    let unknown = || "-".to_owned();
    let (least, largest) =
        channel.values.as_ref().map_or_else(|| (unknown(), unknown()), |v| (number(v.least), number(v.largest)));
    vec![
        channel.location.clone(),
        channel.samples.to_string(),
        channel.sample_rate_hz.map_or_else(unknown, number),
        if channel.unit.is_empty() { unknown() } else { channel.unit.clone() },
        channel.stored_as.to_owned(),
        channel.gaps.len().to_string(),
        least,
        largest,
    ]
}

/// The files of a folder, one line each.
pub fn folder_text(folder: &Path, files: &[Inspected]) -> String {
    let header = ["file", "format", "channels", "samples", "rate/Hz", "ringdown", "reason"];
    let rows = files.iter().map(|inspected| line(folder, inspected));
    let rows: Vec<Vec<String>> = std::iter::once(header.map(str::to_owned).to_vec()).chain(rows).collect();
    format!("{}\n{}", one_line(&folder.display().to_string()), grid(&rows))
}

fn line(folder: &Path, inspected: &Inspected) -> Vec<String> {
    let name = inspected.file.strip_prefix(folder).unwrap_or(&inspected.file).display().to_string();
    let short = |format: &str, ringdown: &str, reason: &str| {
        let unknown = || "-".to_owned();
        vec![name.clone(), format.to_owned(), unknown(), unknown(), unknown(), ringdown.to_owned(), reason.to_owned()]
    };
    match &inspected.outcome {
        Outcome::Own => short("a result of afmid's", "-", "no recording"),
        Outcome::Refused { problem, .. } => short("refused", "-", problem),
        Outcome::Read(holdings) => {
            let best = holdings.ringdown.channel.and_then(|index| holdings.channels.get(index));
            vec![
                name,
                holdings.format.clone(),
                holdings.channels.len().to_string(),
                best.map_or_else(|| "-".to_owned(), |channel| channel.samples.to_string()),
                best.and_then(|channel| channel.sample_rate_hz).map_or_else(|| "-".to_owned(), number),
                holdings.ringdown.answer.word().to_owned(),
                holdings.ringdown.reason.clone(),
            ]
        }
    }
}
