//! Sweeps: read, checked value by value, and made into plans.

use afmid_pipeline::graph::Format;
use afmid_pipeline::{Plan, graph};
use serde_json::json;

use crate::{stages, wrong};

const CONFIG: &str = "[pipeline]\nname = \"test\"\n[[stage]]\nid = \"a\"\nuses = \"test.sine\"\n[[stage]]\nid = \"b\"\nuses = \"test.sine\"\n";

fn plan(sweep: &str, arguments: &[&str]) -> Plan {
    let arguments: Vec<String> = arguments.iter().map(|&argument| argument.to_owned()).collect();
    graph::load("test.toml", &format!("{CONFIG}[sweep]\n{sweep}"), &arguments, &stages::registry())
        .expect("it is right")
}

fn faults(sweep: &str) -> Vec<String> {
    wrong(&format!("{CONFIG}[sweep]\n{sweep}"), &[])
}

#[test]
fn points_are_the_grid_in_declared_order_the_last_parameter_fastest() {
    let plan = plan("\"b.samples\" = [3, 5]\na.amplitude_v = [0.5, 1.5, 2.5]\n", &[]);
    assert_eq!(plan.points(), Some(6));
    let points: Vec<_> = (0..6).map(|index| plan.values(index)).collect();
    let expected = |samples: i64, volts: f64| {
        vec![("b.samples".to_owned(), json!(samples)), ("a.amplitude_v".to_owned(), json!(volts))]
    };
    assert_eq!(points[0], expected(3, 0.5));
    assert_eq!(points[1], expected(3, 1.5));
    assert_eq!(points[5], expected(5, 2.5));
    let last = plan.point(5).expect("a point");
    assert_eq!(last.node("b").expect("b").params["samples"], 5);
    assert_eq!(last.node("a").expect("a").params["amplitude_v"], 2.5);
    assert_eq!(last.config.overrides, ["b.samples=5", "a.amplitude_v=2.5"]);
    assert_eq!(last.points(), None);
    // other commands take the first point
    assert_eq!(plan.node("b").expect("b").params["samples"], 3);
}

#[test]
fn every_value_is_checked_at_its_place() {
    assert_eq!(
        faults("\"a.samples\" = [1, 2, \"x\", 0]\n\"b.start\" = [\"at-peak\", \"at-peek\"]\n"),
        [
            "\"x\" | parameter `samples` of stage `a`: found the string \"x\", wanted a whole number, 0 or more | `afmid stages test.sine` lists the parameters",
            "0 | stage `a`: `samples` is 0, wanted 1 to 1000000 | How many samples. Why: two periods. Default: 16.",
            "\"at-peek\" | parameter `start` of stage `b`: found \"at-peek\", wanted \"at-zero\" or \"at-peak\" | did you mean \"at-peak\"?",
        ]
    );
}

#[test]
fn what_is_no_sweep_is_said_with_a_suggestion() {
    let found = faults(
        "\"a.samles\" = [1, 2]\n\"c.samples\" = [1]\n\"b.samples\" = 3\nb.spikes_v = []\nb.start = [\"at-peak\"]\nb = 3\n",
    );
    // `b` twice is TOML's to complain about: the text cannot be read further
    assert!(!found.is_empty());
    let found = faults(
        "\"a.samles\" = [1, 2]\n\"c.samples\" = [1]\n\"b.samples\" = 3\nb.spikes_v = []\nlone = [1]\n\"pipeline.seed\" = [1]\n",
    );
    let all = found.join("\n");
    for said in [
        "stage `a` (`test.sine`) has no parameter `samles` | did you mean `samples`?",
        "there is no stage `c`",
        "[sweep] `b.samples`: found the integer `3`, wanted a list of values",
        "[sweep] `b.spikes_v`: found an empty list",
        "[sweep] `lone` names no parameter",
        "only parameters of stages can be swept",
    ] {
        assert!(all.contains(said), "{said} in\n{all}");
    }
    let twice = faults("\"a.samples\" = [1]\na.samples = [2]\n");
    assert!(twice.iter().any(|line| line.contains("[sweep] gives `a.samples` twice")), "{twice:?}");
    let many = format!("\"a.samples\" = {0:?}\n\"b.samples\" = {0:?}\n", (1..=101).collect::<Vec<i64>>());
    assert!(faults(&many)[0].contains("more than 10000 points"));
}

#[test]
fn an_argument_takes_the_place_of_the_swept_parameter() {
    let plan = plan("\"a.samples\" = [3, 5]\n\"b.samples\" = [7, 9]\n", &["a.samples=4"]);
    assert_eq!(plan.points(), Some(2));
    assert_eq!(plan.node("a").expect("a").params["samples"], 4);
}

#[test]
fn points_share_what_is_not_swept() {
    let plan = plan("\"b.samples\" = [7, 9]\n", &[]);
    let point = plan.point(1).expect("a point");
    let [one, other] = [&plan, &point].map(|plan| &plan.node("a").expect("a").stage);
    assert!(std::sync::Arc::ptr_eq(one, other));
    assert_eq!((plan.seed(), plan.config_text()), (point.seed(), point.config_text()));
}

#[test]
fn values_may_be_of_any_type_and_lie_within_tables() {
    let plan = plan("a.noise.std_v = [0.5, 1]\nb.spikes_v = [[], [1.0, 2.0]]\nb.noise = [{ std_v = 2.0 }]\n", &[]);
    assert_eq!(plan.points(), Some(4));
    let (last, values) = (plan.point(3).expect("a point"), plan.values(3));
    assert_eq!(last.node("a").expect("a").params["noise"]["std_v"], 1.0);
    assert_eq!(last.node("b").expect("b").params["spikes_v"], json!([1.0, 2.0]));
    assert_eq!(values[2], ("b.noise".to_owned(), json!({ "std_v": 2.0 })));
    // what a result file states of a point makes the same plan again
    let text = format!("{CONFIG}[sweep]\na.noise.std_v = [0.5, 1]\nb.spikes_v = [[]]\nb.noise = [{{}}]\n");
    let again = graph::load("test.toml", &text, &last.config.overrides, &stages::registry()).expect("it is right");
    assert_eq!(again.points(), None);
    for (one, other) in again.nodes.iter().zip(&last.nodes) {
        assert_eq!(one.params, other.params);
    }
}

#[test]
fn what_is_wrong_with_one_value_is_reported_once() {
    let found = faults("\"a.samples\" = [2, 0]\n\"a.amplitude_v\" = [0.5, 1.5, 2.5]\n");
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(faults("")[0].starts_with("[sweep] | [sweep] is empty, wanted parameters | "));
}

#[test]
fn a_graph_says_what_is_swept() {
    let plan = plan("\"b.samples\" = [7, 9]\na.samples = [1]\n", &[]);
    let said = "2 points, the same graph in each: b.samples (2), a.samples (1)\n";
    assert!(plan.render(Format::Text).ends_with(&format!("\nsweep: {said}")), "{}", plan.render(Format::Text));
    assert!(plan.render(Format::Mermaid).contains(&format!("\n    %% sweep: {said}")));
    assert!(plan.render(Format::Dot).contains(&format!("\n    // sweep: {said}")));
}
