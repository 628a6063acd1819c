//! What was found, for people.

use std::path::Path;

use super::channel::Channel;
use super::file::{Holdings, Inspected, Outcome};
use super::verdict::{Answer, Verdict};
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
        Outcome::Refused { problem, help, .. } => {
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
    let why =
        |channel: &Channel| channel.no_sensor.as_ref().map(|why| format!("{} is no sensor: {why}", channel.location));
    text.extend(
        holdings.channels.iter().filter_map(why).take(MOST_ROWS).map(|why| format!("  note: {}\n", one_line(&why))),
    );
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

/// The files of a folder: a line for those alike that follow each other, then the reasons, each once.
pub fn folder_text(folder: &Path, files: &[Inspected]) -> String {
    let lines: Vec<(String, Line)> = files.iter().map(|inspected| (name(folder, inspected), line(inspected))).collect();
    let groups: Vec<&[(String, Line)]> = lines.chunk_by(|(_, one), (_, next)| one.cells == next.cells).collect();
    let header = ["file", "format", "channels", "samples", "rate/Hz", "ringdown"].map(str::to_owned).to_vec();
    let rows = groups.iter().filter_map(|group| row_of(group));
    let rows: Vec<Vec<String>> = std::iter::once(header).chain(rows).collect();
    let mut text = format!("{}\n{}", one_line(&folder.display().to_string()), grid(&rows));
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (name, reason) in groups.iter().flat_map(|group| reasons_of(group)) {
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, names)) => names.push(name),
            None => reasons.push((reason, vec![name])),
        }
    }
    if !reasons.is_empty() {
        text.push('\n');
    }
    for (reason, names) in reasons.iter().take(MOST_ROWS) {
        text += &format!("{}: {}\n", one_line(&names.join(", ")), one_line(reason));
    }
    text + &more(reasons.len(), "reasons")
}

/// The reasons of files that are alike: of ringdowns in many files that of the first.
fn reasons_of(group: &[(String, Line)]) -> Vec<(String, &str)> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for (file, line) in group.iter().filter(|(_, line)| !line.reason.is_empty()) {
        match reasons.iter_mut().find(|(known, _)| *known == line.reason || line.found) {
            Some((_, files)) => files.push(file),
            None => reasons.push((&line.reason, vec![file])),
        }
    }
    let named = |files: &[&str]| match files {
        [first, .., _] => format!("{first} and {} more", files.len() - 1),
        _ => files.concat(),
    };
    reasons.into_iter().map(|(reason, files)| (named(&files), reason)).collect()
}

/// What is said of a file: cells of the table, and the reason below it.
struct Line {
    cells: Vec<String>,
    reason: String,
    /// Whether a ringdown was found: the reason then gives numbers of its own.
    found: bool,
}

/// The row of files that are alike.
fn row_of(group: &[(String, Line)]) -> Option<Vec<String>> {
    let (first, line) = group.first()?;
    let name = match group.len() {
        1 => first.clone(),
        count => format!("{first} ... {} ({count} files)", group.last()?.0),
    };
    Some(std::iter::once(name).chain(line.cells.iter().cloned()).collect())
}

fn name(folder: &Path, inspected: &Inspected) -> String {
    inspected.file.strip_prefix(folder).unwrap_or(&inspected.file).display().to_string()
}

fn line(inspected: &Inspected) -> Line {
    let unknown = || "-".to_owned();
    let short = |format: &str, reason: &str| Line {
        cells: vec![format.to_owned(), unknown(), unknown(), unknown(), unknown()],
        reason: reason.to_owned(),
        found: false,
    };
    match &inspected.outcome {
        Outcome::Own => short("a result of afmid's", ""),
        Outcome::Refused { no_recording: true, problem, .. } => short("no recording", problem),
        Outcome::Refused { problem, .. } => short("refused", problem),
        Outcome::Read(holdings) => {
            let best = holdings.ringdown.channel.and_then(|index| holdings.channels.get(index));
            let cells = vec![
                holdings.format.clone(),
                holdings.channels.len().to_string(),
                best.map_or_else(unknown, |channel| channel.samples.to_string()),
                best.and_then(|channel| channel.sample_rate_hz).map_or_else(unknown, number),
                holdings.ringdown.answer.word().to_owned(),
            ];
            let Verdict { answer, reason, .. } = &holdings.ringdown;
            Line { cells, reason: reason.clone(), found: *answer > Answer::No }
        }
    }
}
