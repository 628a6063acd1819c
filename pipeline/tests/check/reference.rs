//! Documentation and checks that are derived from the registry.

use afmid_pipeline::conformance::violations;
use afmid_pipeline::outcome::difference;
use afmid_pipeline::reference::{Examples, config_schema, files, page, parameters};
use afmid_pipeline::{Array, Axis, Port, Ports, Registry};

use crate::stages;

fn sine() -> afmid_pipeline::Entry {
    *stages::registry().find("test.sine").expect("it is registered")
}

#[test]
fn a_good_stage_keeps_all_rules() {
    assert_eq!(violations(&sine()), Vec::<String>::new());
}

#[test]
fn a_stage_without_docs_or_examples_is_found_out() {
    let found = violations(stages::registry().find("test.peaks").expect("it is registered")).join("\n");
    for wanted in ["lacks the heading Method", "lacks the heading Errors", "there is no example"] {
        assert!(found.contains(wanted), "{wanted} in:\n{found}");
    }
}

#[test]
fn parameters_are_read_from_the_schema() {
    let rows = parameters(&sine());
    let row = |name: &str| {
        let row = rows.iter().find(|row| row.name == name).expect(name);
        format!("{} | {} | {} | {}", row.kind, row.default.as_deref().unwrap_or("required"), row.range, row.doc)
    };
    assert_eq!(row("samples"), "whole number | 16 | 1 to 1000000 | How many samples. Why: two periods.");
    assert_eq!(row("amplitude_v"), "number | 1.0 |  | Amplitude in V.");
    assert_eq!(
        row("start"),
        "\"at-zero\" or \"at-peak\" | \"at-zero\" |  | What becomes of the first sample. \"at-zero\": At zero. \"at-peak\": At its maximum."
    );
    assert_eq!(row("noise"), "table | { std_v = 0.0 } |  | Noise that is added.");
    assert_eq!(row("noise.std_v"), "number | 0.0 |  | Standard deviation in V.");
    assert_eq!(row("spikes_v"), "array of numbers | [] |  | Values that are put in, in order.");
}

#[test]
fn a_page_tells_everything_in_order() {
    let text = page(&sine(), Examples::Run).expect("the example runs");
    let parts = [
        "# test.sine\n\nA sine.\n\nVersion 1; it runs every time.\n",
        "## Inputs\n\nNone.\n",
        "| `signal` | array | `signal` | samples of a sine |",
        "| `samples` | whole number | `16` | 1 to 1000000 |",
        "## Method\n\nSamples of `amplitude_v",
        "## Source\n\nAny textbook.\n",
        "## Example: Half the amplitude\n\n```toml\n[[stage]]\nid = \"sine\"\nuses = \"test.sine\"\n[stage.params]\namplitude_v = 0.5\n```",
        "The peak is 0.500 V.",
    ];
    let mut rest = text.as_str();
    for part in parts {
        let place = rest.find(part).unwrap_or_else(|| panic!("{part:?} comes next in:\n{text}"));
        rest = &rest[place + part.len()..];
    }
    assert!(!page(&sine(), Examples::Shown).expect("nothing is run").contains("The peak is"));
}

#[test]
fn there_is_a_page_for_every_stage_and_an_index() {
    let registry = Registry::new().with(&[sine()]).expect("one name");
    let files = files(&registry).expect("the example runs");
    assert_eq!(files.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), ["README.md", "test.sine.md"]);
    assert!(files[0].1.contains("## test\n"));
    assert!(files[0].1.contains("| [`test.sine`](test.sine.md) | a sine |"));
}

#[test]
fn the_schema_selects_the_stage_and_names_its_ports() {
    let schema = config_schema(&stages::registry());
    let rules = schema["properties"]["stage"]["items"]["allOf"].as_array().expect("rules");
    assert_eq!(rules.len(), stages::registry().entries().len());
    let split = &schema["definitions"]["stage-test.split"];
    assert_eq!(split["properties"]["inputs"]["required"][0], "signal");
    assert_eq!(schema["definitions"]["stage-test.load"]["required"], serde_json::json!(["id", "uses", "params"]));
    assert!(schema["definitions"]["Noise"]["properties"]["std_v"].is_object());
}

#[test]
fn a_difference_of_one_bit_is_found_and_nan_equals_nan() {
    const PORT: Port<Array> = Port::new("signal", "signal", "a signal");
    let ports = |value: f64| {
        let axis = Axis::new("time", "s", "time", vec![0.0, 1.0]);
        Ports::new().with(&PORT, Array::over(vec![axis]).with("signal", "V", "x", &["time"], vec![f64::NAN, value]))
    };
    assert_eq!(difference(&ports(1.0), &ports(1.0)), None);
    let found = difference(&ports(1.0), &ports(1.0 + f64::EPSILON));
    assert_eq!(found.as_deref(), Some("port `signal`: variable `signal`"));
}
