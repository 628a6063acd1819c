//! What holds for every page.

use afmid_pipeline::{Array, Axis, Document, RunInfo, RunResult, Shaped, StateSpace, Table};
use serde_json::json;

use super::figure::tests::assert_well_formed;
use super::fixture::{paper, stage};
use super::page::ReportError;
use super::{figures, report};

/// The page of a run beside nothing.
pub(in crate::report) fn alone(run: &RunResult) -> Result<String, ReportError> {
    report(run, &|_| String::new(), None)
}

pub(in crate::report) fn bare(stages: Vec<afmid_pipeline::StageRecord>) -> RunResult {
    RunResult {
        name: "bare".to_owned(),
        seed: 0,
        config: String::new(),
        overrides: Vec::new(),
        program: String::new(),
        stages,
        info: RunInfo::default(),
    }
}

/// A page is HTML; with its void elements closed and its script left out it must be well-formed XML.
pub(in crate::report) fn assert_page(page: &str) {
    let (head, rest) = page.split_once("<script>").expect("a script");
    let (_, tail) = rest.split_once("</script>").expect("the end of the script");
    let text = format!("{head}{tail}").replace("<!DOCTYPE html>", "");
    let text: Vec<String> = text
        .split_inclusive('>')
        .map(|part| {
            if part.contains("<meta ") && part.ends_with('>') {
                format!("{}/>", &part[..part.len() - 1])
            } else {
                part.to_owned()
            }
        })
        .collect();
    assert_well_formed(&text.concat());
    assert!(page.len() < 5_000_000, "{} bytes", page.len());
    let links =
        ["http://", "https://", "src=", "@import", "url("].map(|link| page.matches(link).filter(|_| true).count());
    // the SVG namespace and the clip paths are names, not addresses
    assert_eq!(links[0], page.matches("http://www.w3.org/2000/svg").count());
    assert_eq!((links[1], links[2], links[3]), (0, 0, 0));
    assert_eq!(links[4], page.matches("url(#").count());
}

#[test]
fn the_paper_s_run_shows_every_figure() {
    let page = alone(&paper()).expect("a page");
    assert_page(&page);
    for id in ["figure-2", "figure-3", "figure-4", "figure-5", "drift", "residuals"] {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
    assert!(!page.contains("Not in this run"), "a section is missing");
    assert!(page.contains("46.30009(19) kHz"), "the modal table");
    assert!(page.contains("no rupture") && page.contains("&lt;config&gt; &amp; more"));
}

#[test]
fn exported_figures_are_files_of_their_own() {
    let files = figures(&paper());
    assert!(files.len() > 10);
    for (name, text) in &files {
        assert!(name.ends_with(".svg") && !name.contains('/'), "{name}");
        assert_well_formed(text);
        assert!(!text.contains("var("), "{name}");
    }
    let mut names: Vec<&String> = files.iter().map(|(name, _)| name).collect();
    names.dedup();
    assert_eq!(names.len(), files.len());
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    assert_eq!(alone(&paper()).expect("a page"), alone(&paper()).expect("a page"));
}

#[test]
fn ids_are_unique() {
    let page = alone(&paper()).expect("a page");
    let mut ids: Vec<&str> = page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    ids.sort_unstable();
    let twice: Vec<_> = ids.windows(2).filter(|pair| pair[0] == pair[1]).collect();
    assert!(twice.is_empty(), "{twice:?}");
}

#[test]
fn a_run_of_a_lever_says_what_is_missing_and_a_run_of_anything_else_shows_what_it_has() {
    let events = stage("events", "events.correlation", &[], json!({"kind": "snap-off"}), vec![]);
    let page = alone(&bare(vec![events])).expect("a page");
    assert_page(&page);
    assert!(page.contains("Not in this run") && page.contains("no frequency response of a snap-off"));
    let page = alone(&bare(Vec::new())).expect("a page");
    assert_page(&page);
    assert!(!page.contains("Not in this run"));
}

#[test]
fn parameters_that_are_empty_are_left_out() {
    let params = json!({"files": ["a.h5"], "channels": [], "monitor": "", "rate": null, "order": 0, "fast": false});
    let page = alone(&bare(vec![stage("records", "io.records", &[], params, vec![])])).expect("a page");
    let (_, rest) = page.split_once("empty ones left out</h4>").expect("parameters");
    let shown = rest.split("</pre>").next().expect("their end");
    assert!(["files", "order", "fast"].iter().all(|name| shown.contains(name)), "{shown}");
    assert!(!["channels", "monitor", "rate"].iter().any(|name| shown.contains(name)), "{shown}");
}

#[test]
fn every_stage_of_the_paper_s_run_may_be_missing() {
    let whole = paper();
    for gone in 0..whole.stages.len() {
        let mut run = whole.clone();
        run.stages.remove(gone);
        // generic parts are checked above: only the paper's figures look across stages
        for drawn in super::paper::sections(&run) {
            drawn.figures.iter().for_each(|figure| assert_well_formed(&figure.svg()));
        }
    }
}

#[test]
fn empty_and_unknown_values_are_survived() {
    let frequency = |values: Vec<f64>| Axis::new("frequency_hz", "Hz", "", values);
    let empty = Array::over(vec![frequency(Vec::new())]).with(
        "transfer",
        "1",
        "",
        &["frequency_hz"],
        Vec::<num_complex::Complex64>::new(),
    );
    let unknown = Array::over(vec![frequency(vec![f64::NAN; 3])]).with(
        "transfer",
        "1",
        "",
        &["frequency_hz"],
        vec![num_complex::Complex64::new(f64::NAN, f64::INFINITY); 3],
    );
    let time = || Axis::new("time", "s", "", vec![0.0, 0.0, f64::NAN]);
    let pair = Array::over(vec![time()]).with("force", "V", "", &["time"], vec![f64::NAN; 3]).with(
        "response",
        "V",
        "",
        &["time"],
        vec![0.0; 3],
    );
    let none = Array::over(vec![Axis::new("event", "1", "", Vec::new()), time()]).with(
        "signal",
        "V",
        "",
        &["event", "time"],
        Vec::<f64>::new(),
    );
    let roots = Table::new()
        .with("kind", "", "", vec!["pole".to_owned(), "zero".to_owned()])
        .with("z_re", "1", "", vec![f64::NAN, 1.0])
        .with("z_im", "1", "", vec![0.0, f64::INFINITY]);
    let scalar = Array::default().with("one", "1", "", &[], vec![1.0]);
    let modes = Document(
        json!({"modes": [{"frequency_hz": null}, {}, 3], "fit_percent": null, "events": {"found": "many", "rejected": 7}}),
    );
    let outputs = vec![
        ("empty", empty.wrap()),
        ("unknown", unknown.wrap()),
        ("pair", pair.wrap()),
        ("none", none.wrap()),
        ("roots", roots.wrap()),
        ("nothing", Table::new().wrap()),
        ("scalar", scalar.wrap()),
        ("model", StateSpace::default().wrap()),
        ("summary", modes.wrap()),
    ];
    let mut run = bare(vec![stage(
        "odd <id> \"quoted\"",
        "exec:plugin & co",
        &[("a", "odd <id> \"quoted\"")],
        json!(null),
        outputs,
    )]);
    run.stages[0].result.warnings.push("<script>alert(1)</script>".to_owned());
    let page = alone(&run).expect("a page");
    assert!(!page.contains("<script>alert"));
    assert_page(&page);
    figures(&run).iter().for_each(|(_, text)| assert_well_formed(text));
}

#[test]
fn a_huge_run_stays_small() {
    let count = 1_000_000;
    let time: Vec<f64> = (0..count).map(f64::from).collect();
    let signal: Vec<f64> = time.iter().map(|t| (t * 0.37).sin() * (t * 1e-5).cos()).collect();
    let array = Array::over(vec![Axis::new("time", "s", "", time)]).with("signal", "V", "", &["time"], signal).wrap();
    let rows = 100_000;
    let table = Table::new()
        .with("x", "1", "", vec![1.25; rows])
        .with("name", "", "", vec!["a long text in every row".to_owned(); rows])
        .wrap();
    let list: Vec<_> = (0..50_000).map(|k| json!({"k": k, "reason": "no rupture"})).collect();
    let summary = Document(json!({"events": {"found": 0, "rejected": list}})).wrap();
    let outputs = |k: usize| {
        let outputs = vec![("array", array.clone()), ("table", table.clone()), ("summary", summary.clone())];
        stage(&format!("stage-{k}"), "any.thing", &[], json!({}), outputs)
    };
    let page = alone(&bare((0..15).map(outputs).collect())).expect("a page");
    assert_page(&page);
    assert!(page.contains("40 of 100000 rows shown"));
}
