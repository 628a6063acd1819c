//! Pages of diagnoses.

use serde_json::{Value, json};

use super::fixture::{clean, named, of_system, release, system, unexplained};
use super::telling::{View, main_cause, telling};
use crate::report::figure::tests::assert_well_formed;
use crate::report::figures;
use crate::report::tests::{alone, assert_page};

fn page(run: &afmid_pipeline::RunResult) -> String {
    let page = alone(run).expect("a page");
    assert_page(&page);
    figures(run).iter().for_each(|(_, text)| assert_well_formed(text));
    page
}

/// The part of the page that tells the story: what follows shows every artifact anyway.
fn section(page: &str) -> String {
    let (_, rest) = page.split_once("<section id=\"diagnosis\">").expect("the section");
    // the template escapes slashes, too
    rest.split_once("</section>").expect("its end").0.replace("&#x2f;", "/")
}

#[test]
fn a_named_cause_is_shown_with_its_numbers_and_figures() {
    let whole = page(&release(named()));
    let page = section(&whole);
    for text in [
        "The linear model is wrong: quadratic-detector.",
        "0.01201(9) 1/V",
        "p = 1·10⁻¹²⁰",
        "4.120 mV → 1.230 mV",
        "+812",
        "10 events in two halves",
        "extra-mode (86 % of the gain)",
        "nothing of the catalogue",
        "halve the &lt;laser&gt; power",
        "near 2 f1",
        "What gave quadratic-detector away",
        "3.910 mV",
        "381.0 µV",
        "+25134",
        // 10 Hz at 2 Hz
        "46.3000(15) kHz",
        "−5.0",
    ] {
        assert!(page.contains(text), "{text}");
    }
    for id in ["overlay", "telling", "tiles"] {
        assert!(page.contains(&format!("id=\"diagnosis-diagnosis-{id}\"")), "{id}");
    }
    let order = ["The linear model is wrong", "-overlay", "-telling", "The ladder of models", "Modes of the linear"];
    let places: Vec<usize> = order.iter().map(|text| page.find(text).expect("a part")).collect();
    assert!(places.is_sorted(), "{places:?}");
    // the ladder's bars: the smallest error has the shortest
    assert_eq!(page.matches("class=\"bar\"").count(), 3);
    // the modes, their combinations, and the legend of both models
    for text in [
        "2 f₁",
        "f₂ − f₁",
        "linear model",
        "extended model",
        "noise level",
        "Residual by level",
        "Free level by position",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(!whole.contains("id=\"periodograms\""), "spectra of residuals are no power spectra of the run");
}

#[test]
fn a_clean_page_says_so_and_draws_one_model() {
    let page = page(&release(clean()));
    let page = section(&page);
    assert!(page.contains("Clean: the linear model holds") && page.contains("p = 0.046"));
    assert!(page.contains("Nothing stands out") && page.contains("There is one model"));
    assert!(!page.contains("extended model") && !page.contains("class=\"cause\"") && !page.contains("moved"));
}

#[test]
fn an_unexplained_page_shows_the_nearest_and_names_none() {
    let page = page(&release(unexplained()));
    let page = section(&page);
    assert!(page.contains("Unexplained: the linear model is wrong"));
    assert!(page.contains("extra-mode (97 % of the gain) and mode-coupling") && page.contains("ring at 2 f1"));
    assert!(!page.contains("class=\"cause\"") && !page.contains("gave extra-mode away"));
}

#[test]
fn a_system_s_page_shows_its_parts() {
    let page = page(&system(of_system()));
    let page = section(&page);
    for text in [
        "duffing",
        "output-cubic",
        "14.75 mV",
        "239.0 µV",
        "Part “arrow”",
        "Error by the output",
        "Output where it is largest",
    ] {
        assert!(page.contains(text), "{text}");
    }
    assert!(page.contains("What gave duffing away: where the output is large"));
}

#[test]
fn the_picture_follows_the_cause() {
    for (id, view) in [
        ("quadratic-detector", View::Spectrum),
        ("frequency-drift", View::Events),
        ("tether-tail", View::Time),
        ("piezo-crosstalk", View::Positions),
        ("photodiode-tail", View::Time),
        ("duffing", View::Sizes),
        ("intersample", View::Spectrum),
        ("no such cause", View::Spectrum),
    ] {
        assert_eq!(telling(id), view, "{id}");
    }
    let answer = |value: Value| serde_json::from_value::<afmid_stages::diagnosis::Diagnosis>(value).expect("an answer");
    assert_eq!(main_cause(&answer(named())), Some("quadratic-detector"));
    assert_eq!(main_cause(&answer(clean())), None);
    assert_eq!(main_cause(&answer(unexplained())), Some("extra-mode"));
}

#[test]
fn what_is_missing_or_strange_is_survived() {
    let whole = release(named());
    for gone in ["residuals", "tiles", "summary"] {
        let mut run = whole.clone();
        let kept: Vec<_> = run.stages[0]
            .result
            .outputs
            .iter()
            .filter(|(port, _)| *port != gone)
            .map(|(p, a)| (p.to_owned(), a.clone()))
            .collect();
        let mut outputs = afmid_pipeline::Ports::new();
        kept.into_iter().for_each(|(port, artifact)| outputs.insert(&port, artifact));
        run.stages[0].result.outputs = outputs;
        page(&run);
    }
    let mut odd = named();
    odd["ladder"] = json!([]);
    odd["modes_before"] = json!([]);
    odd["causes"][0]["id"] = json!("<b>own</b>");
    odd["causes"][0]["p_value"] = Value::Null;
    odd["causes"][0]["gain"]["rms_before"] = Value::Null;
    page(&release(odd));
    // a document that is no diagnosis makes no section
    assert!(!page(&release(json!({"verdict": "fine"}))).contains("id=\"diagnosis\""));
}
