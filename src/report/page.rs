//! Assembles the page.

use std::borrow::Cow;

use afmid_pipeline::files::marked;
use afmid_pipeline::{Document, Recording, RunResult, Unfinished};
use minijinja::value::{Serde, Value as Text};
use minijinja::{Environment, Output, State, escape_formatter};
use serde::Serialize;
use serde_json::Value;

use super::batch::{self, Link};
use super::diagnosis;
use super::drawn::Drawn;
use super::figure::Figure;
use super::find::all;
use super::generic::stage_view;
use super::measured;
use super::number::{bytes, duration, quantity, with_error};
use super::origin::{Origin, of_a_lever};
use super::palette;
use super::paper;
use super::view::{Fact, Head, Picture, Section, StageView, TableView, Tile};
use crate::printable::{few, printable};

/// Bytes that the figures of the sections, and of the stages, may take together, so that the page stays under 5 MB.
const SECTION_FIGURES: usize = 2_500_000;
const STAGE_FIGURES: usize = 1_200_000;

/// Why a page could not be made.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReportError {
    /// The template does not fit the data: a fault of this program.
    #[error("the report's template does not fit: {0}")]
    Template(#[from] minijinja::Error),
}

/// What the template reads.
#[derive(Serialize)]
struct Page<'a> {
    name: &'a str,
    /// The name, and of what data.
    title: String,
    program: &'a str,
    facts: Vec<Fact>,
    tiles: Vec<Tile>,
    /// Stages without a result, by name and reason; empty for a run that went through.
    unfinished: Vec<Fact>,
    warnings: Vec<(String, Vec<String>)>,
    sections: Vec<Section>,
    skipped: Vec<Section>,
    rejected: TableView,
    stages: Vec<StageView>,
    provenance: TableView,
    config: &'a str,
    overrides: &'a [String],
    variables: String,
    figure_css: &'static str,
    page_css: &'static str,
    script: &'static str,
}

/// One self-contained HTML page about a run.
///
/// `link` gives the addresses of the results of a batch's data sets. `own`: a title of the reader's own.
pub(crate) fn report(run: &RunResult, link: &Link<'_>, own: Option<&str>) -> Result<String, ReportError> {
    let mut room = SECTION_FIGURES;
    let sections: Vec<Section> = sections(run, link).map(|drawn| section(drawn, &mut room)).collect();
    let (shown, skipped): (Vec<Section>, Vec<Section>) =
        sections.into_iter().partition(|section| section.missing.is_empty());
    let warnings: Vec<(String, Vec<String>)> = run
        .stages
        .iter()
        .filter(|stage| !stage.result.warnings.is_empty())
        .map(|stage| (stage.id.clone(), few(&stage.result.warnings)))
        .collect();
    let mut environment = Environment::new();
    environment.set_formatter(shown_text);
    environment.add_template("report.html", include_str!("template.html"))?;
    let page = Page {
        name: &run.name,
        title: own.map_or_else(|| title(run), |own| printable(own).into_owned()),
        program: &run.program,
        facts: facts(run),
        tiles: tiles(run),
        unfinished: run.info.unfinished.iter().map(unfinished).collect(),
        warnings,
        sections: shown,
        skipped,
        rejected: rejected(run),
        stages: stages(run),
        provenance: provenance(run),
        config: &run.config,
        overrides: &run.overrides,
        variables: palette::variables(),
        figure_css: include_str!("figure.css"),
        page_css: include_str!("page.css"),
        script: include_str!("figure.js"),
    };
    let page = environment.get_template("report.html")?.render(Serde(page))?;
    let marked = marked(|mark| format!("{}\n<!-- {mark} -->\n", page.trim_end()).into_bytes());
    Ok(marked.and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or(page))
}

fn unfinished(stage: &Unfinished) -> Fact {
    let reason = stage.reason.as_ref().map(|reason| format!("failed: {reason}"));
    Fact::new(&stage.id, reason.unwrap_or_else(|| "was not run: something that it needs has no result".to_owned()))
}

/// Whether a file that begins with these bytes is a page of [`report`]: pages of earlier versions bear no mark.
pub(crate) fn is_page(head: &[u8]) -> bool {
    String::from_utf8_lossy(head).contains("<meta name=\"generator\" content=\"afmid")
}

/// As text of the page, escaped; what acts on a page instead of being seen (controls, marks of direction) as printable
/// escapes.
fn shown_text(out: &mut Output, state: &mut State, value: &Text) -> Result<(), minijinja::Error> {
    match value.as_str().filter(|_| !value.is_safe()).map(printable) {
        Some(Cow::Owned(text)) => escape_formatter(out, state, &Text::from(text)),
        _ => escape_formatter(out, state, value),
    }
}

/// A batch's own; or the diagnosis first, where there is one: it is what the run was for. The others are those of what
/// was measured.
fn sections(run: &RunResult, link: &Link<'_>) -> impl Iterator<Item = Drawn> {
    let batch = batch::sections(run, link);
    let of_run = match (batch.is_empty(), of_a_lever(run)) {
        (true, true) => paper::sections(run),
        (true, false) => measured::sections(run),
        (false, _) => Vec::new(),
    };
    batch.into_iter().chain(diagnosis::section(run)).chain(of_run)
}

/// Every figure of a run as (file name, SVG file).
pub(crate) fn figures(run: &RunResult) -> Vec<(String, String)> {
    let style = palette::in_light(include_str!("figure.css"));
    let of_sections = sections(run, &|_| String::new()).flat_map(|drawn| drawn.figures);
    let of_stages = run.stages.iter().flat_map(|stage| stage_view(run, stage).1.into_iter().flatten());
    of_sections.chain(of_stages).map(|figure| (format!("{}.svg", figure.id), figure.standalone(&style))).collect()
}

/// Draws the figures of a section, as long as there is room for them.
fn section(drawn: Drawn, room: &mut usize) -> Section {
    let missing = if drawn.is_empty() { drawn.missing.to_owned() } else { String::new() };
    let mut pictures = Vec::new();
    for picture in drawn.figures.iter().map(picture) {
        if let Some(left) = room.checked_sub(picture.svg.len()) {
            *room = left;
            pictures.push(picture);
        }
    }
    let left_out = match drawn.figures.len() - pictures.len() {
        0 => String::new(),
        count => format!("{count} figures left out to keep the page small; `afmid report --figures DIR` writes them."),
    };
    Section {
        id: drawn.id.to_owned(),
        title: drawn.title.to_owned(),
        stories: drawn.stories,
        pictures,
        tables: drawn.tables,
        groups: drawn.groups,
        missing,
        left_out,
    }
}

fn picture(figure: &Figure) -> Picture {
    Picture { id: figure.id.clone(), title: figure.title.clone(), caption: figure.caption.clone(), svg: figure.svg() }
}

/// The pipeline's name, and the names of the first files that it read.
fn title(run: &RunResult) -> String {
    const MOST: usize = 2;
    let mut names: Vec<&str> = Vec::new();
    for source in run.stages.iter().flat_map(|stage| &stage.sources) {
        let name = source.path.rsplit('/').next().unwrap_or_default();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let shown = names.iter().take(MOST).copied().collect::<Vec<_>>().join(", ");
    match names.len() {
        0 => run.name.clone(),
        1..=MOST => format!("{}: {shown}", run.name),
        more => format!("{}: {shown} and {} more", run.name, more - MOST),
    }
}

fn facts(run: &RunResult) -> Vec<Fact> {
    let info = &run.info;
    let cached = info.stages.iter().filter(|(_, _, cached)| *cached).count();
    vec![
        Fact::new("Run", info.started_at.clone()),
        Fact::new(
            "Took",
            format!("{}, {} of {} stages from the cache", duration(info.seconds), cached, run.stages.len()),
        ),
        Fact::new("On", format!("{} ({} threads)", info.host, info.threads)),
        Fact::new("By", run.program.clone()),
        Fact::new("Seed", run.seed.to_string()),
    ]
}

/// The numbers that matter: records, events, fits.
fn tiles(run: &RunResult) -> Vec<Tile> {
    let mut tiles = diagnosis::verdict_tiles(run);
    let tile = |label: &str, value: String, note: String| Tile { label: label.to_owned(), value, note };
    for found in all::<Recording>(run) {
        let size = found.value.file_bytes();
        tiles.push(tile("records", found.value.records.len().to_string(), bytes(size)));
    }
    for found in all::<Document>(run) {
        let document = &found.value.0;
        if let Some(count) = document.pointer("/events/found").and_then(Value::as_u64) {
            let kind = document
                .pointer("/events/kind")
                .and_then(Value::as_str)
                .map_or("events".to_owned(), |kind| format!("{kind}s"));
            let rejected = document.pointer("/events/rejected").and_then(Value::as_array).map_or(0, Vec::len);
            let note = if rejected == 0 { "none rejected".to_owned() } else { format!("{rejected} rejected") };
            tiles.push(tile(&kind, count.to_string(), note));
        }
        if let Some(force) = document.get("force").filter(|force| force.get("value").is_some()) {
            let at = |name: &str| force.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let unit = force.get("unit").and_then(Value::as_str).unwrap_or_default();
            let event = document.get("kind").and_then(Value::as_str).unwrap_or("event");
            tiles.push(tile(
                &format!("force at the {event}"),
                quantity(at("value"), at("std"), unit),
                format!("stage {}", found.stage.id),
            ));
        }
        if let Some(fit) = document.get("fit_percent") {
            let at = |name: &str| fit.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
            let held_out = at("held_out");
            if held_out.is_finite() {
                let ceiling = Some(at("noise_ceiling")).filter(|ceiling| ceiling.is_finite());
                let note = ceiling.map_or_else(String::new, |ceiling| format!("noise allows {}", percent(ceiling)));
                tiles.push(tile(Origin::of(run, found.stage).words().held_out, percent(held_out), note));
            }
        }
    }
    tiles
}

fn percent(value: f64) -> String {
    format!("{} %", with_error(value, 0.005).split('(').next().unwrap_or_default())
}

/// What was rejected, and why.
fn rejected(run: &RunResult) -> TableView {
    let mut table = TableView::new("Rejected", vec![Head::text("stage"), Head::text("record"), Head::text("reason")]);
    let mut total = 0;
    for found in all::<Document>(run) {
        let Some(list) = found.value.0.pointer("/events/rejected").and_then(Value::as_array) else { continue };
        total += list.len();
        for item in list.iter().take(200) {
            let text = |name: &str| item.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
            table.rows.push(vec![found.stage.id.clone(), text("record"), text("reason")]);
        }
    }
    table.truncated(200, total)
}

/// All stages, with figures as long as there is room for them.
fn stages(run: &RunResult) -> Vec<StageView> {
    let mut room = STAGE_FIGURES;
    run.stages
        .iter()
        .map(|stage| {
            let (mut view, figures) = stage_view(run, stage);
            for (artifact, figure) in view.artifacts.iter_mut().zip(figures) {
                let Some(picture) = figure.as_ref().map(picture) else { continue };
                match room.checked_sub(picture.svg.len()) {
                    Some(left) => {
                        room = left;
                        artifact.picture = Some(picture);
                    }
                    None => {
                        artifact.facts.push(Fact::new("plot", "left out to keep the page small; `--figures` writes it"))
                    }
                }
            }
            view
        })
        .collect()
}

fn provenance(run: &RunResult) -> TableView {
    let heads = vec![
        Head::text("stage"),
        Head::text("uses"),
        Head::number("version", ""),
        Head::number("time", ""),
        Head::text("from the cache"),
        Head::number("files", ""),
        Head::text("key"),
    ];
    let mut table = TableView::new("", heads);
    for stage in &run.stages {
        let timing = run.info.stages.iter().find(|(id, _, _)| *id == stage.id);
        table.rows.push(vec![
            stage.id.clone(),
            stage.uses.clone(),
            stage.version.to_string(),
            timing.map(|(_, seconds, _)| duration(*seconds)).unwrap_or_default(),
            timing.map(|(_, _, cached)| if *cached { "yes" } else { "no" }.to_owned()).unwrap_or_default(),
            stage.sources.len().to_string(),
            stage.key.chars().take(16).collect(),
        ]);
    }
    table
}
