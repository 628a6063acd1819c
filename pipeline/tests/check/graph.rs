//! Planning graphs: wires, kinds, order, cycles.

use afmid_pipeline::graph::{Format, Wire, load};

use crate::{stages, wrong};

const HEAD: &str = "[pipeline]\nname = \"test\"\nseed = 7\n";

fn config(stages: &[(&str, &str, &str)]) -> String {
    let stage = |&(id, uses, inputs): &(&str, &str, &str)| {
        format!("[[stage]]\nid = \"{id}\"\nuses = \"test.{uses}\"\ninputs = {{ {inputs} }}\n")
    };
    format!("{HEAD}{}", stages.iter().map(stage).collect::<String>())
}

#[test]
fn stages_are_ordered_by_need_and_stay_in_the_order_of_the_text_otherwise() {
    let text = config(&[
        ("count", "count", "table = \"peaks\""),
        ("sine", "sine", ""),
        ("peaks", "peaks", "signal = \"split.clean\""),
        ("other", "sine", ""),
        ("split", "split", "signal = \"sine\""),
    ]);
    let plan = load("x.toml", &text, &[], &stages::registry()).expect("it is right");
    let ids: Vec<&str> = plan.nodes.iter().map(|node| node.id.as_str()).collect();
    assert_eq!(ids, ["sine", "other", "split", "peaks", "count"]);
    assert_eq!(plan.nodes[3].inputs, [Wire { port: "signal", node: 2, output: "clean" }]);
    assert_eq!(plan.nodes[4].inputs, [Wire { port: "table", node: 3, output: "peaks" }]);
    assert_eq!(plan.nodes[0].params["amplitude_v"], 1.0);
    assert_eq!((plan.name(), plan.seed(), plan.config_text()), ("test", 7, text.as_str()));
}

#[test]
fn misspelt_stages_ids_and_ports_have_suggestions_and_no_echoes() {
    let text = config(&[
        ("sine", "sin", ""),
        ("split", "split", "singal = \"sine\""),
        ("peaks", "peaks", "signal = \"splt.clean\""),
        ("more", "peaks", "signal = \"split.claen\""),
        ("source", "sine", "signal = \"split\""),
    ]);
    assert_eq!(
        wrong(&text, &[]),
        [
            "\"test.sin\" | there is no stage named `test.sin` | did you mean `test.sine`?",
            "singal | stage `split` (`test.split`) has no input `singal` | did you mean `signal`?",
            "\"splt.clean\" | input `signal`: there is no stage with the id `splt` | did you mean `split`?",
            "\"split.claen\" | stage `split` (`test.split`) has no output `claen` | did you mean `clean`?",
            "signal | stage `source` (`test.sine`) has no input `signal` | there is no input",
        ]
    );
}

#[test]
fn a_stage_alone_means_its_only_fitting_output() {
    let text = config(&[
        ("sine", "sine", ""),
        ("split", "split", "signal = \"sine\""),
        ("peaks", "peaks", "signal = \"split\""),
    ]);
    assert_eq!(
        wrong(&text, &[]),
        ["\"split\" | stage `split` makes 2 outputs that fit input `signal` | name one: `split.clean`, `split.noise`"]
    );
}

#[test]
fn shapes_and_tags_must_fit() {
    let text = config(&[
        ("sine", "sine", ""),
        ("peaks", "peaks", "signal = \"sine\", weights = \"peaks2.peaks\""),
        ("peaks2", "peaks", "signal = \"count\""),
        ("count", "count", "table = \"sine.signal\""),
    ]);
    assert_eq!(
        wrong(&text, &[]),
        [
            "\"peaks2.peaks\" | `peaks2.peaks` is a table tagged `peaks`, input `weights` wants a table tagged `marks` | these fit: `count.marks`",
            "\"count\" | stage `count` makes nothing that fits input `signal`: wanted an array tagged `signal` | `marks` is a table tagged `marks`",
            "\"sine.signal\" | `sine.signal` is an array tagged `signal`, input `table` wants a table | these fit: `peaks.peaks`, `peaks2.peaks`",
        ]
    );
}

#[test]
fn missing_wires_are_asked_for_and_optional_ones_are_not() {
    let text = config(&[("sine", "sine", ""), ("peaks", "peaks", ""), ("count", "count", "")]);
    let wrong = wrong(&text, &[]);
    assert_eq!(
        wrong,
        [
            "{  } | input `signal` of stage `peaks` (`test.peaks`) is not wired | write `inputs = { signal = \"sine.signal\" }`",
            "{  } | input `table` of stage `count` (`test.count`) is not wired | write `inputs = { table = \"peaks.peaks\" }`",
        ]
    );
}

#[test]
fn doubled_wires_are_found_however_they_are_written() {
    let sine = config(&[("sine", "sine", "")]);
    let inline = format!(
        "{sine}{}",
        "[[stage]]\nid = \"p\"\nuses = \"test.peaks\"\ninputs = { signal = \"sine\", signal = \"sine\" }\n"
    );
    assert_eq!(wrong(&inline, &[]), ["signal | port `signal` is wired twice | a port takes one wire: remove one"]);
    let table = format!(
        "{sine}[[stage]]\nid = \"p\"\nuses = \"test.peaks\"\n[stage.inputs]\nsignal = \"sine\"\nsignal = \"sine\"\n"
    );
    assert_eq!(wrong(&table, &[]), ["signal | port `signal` is wired twice | a port takes one wire: remove one"]);
    let array = format!("{sine}[[stage]]\nid = \"p\"\nuses = \"test.peaks\"\ninputs.signal = [\"sine\", \"sine\"]\n");
    assert_eq!(
        wrong(&array, &[]),
        [
            "[\"sine\", \"sine\"] | port `signal` of stage `p` is wired 2 times | a port takes one wire: remove the others"
        ]
    );
    let key = format!("{sine}uses = \"test.sine\"\n");
    assert_eq!(wrong(&key, &[]), ["uses | the key `uses` is given twice | remove one"]);
}

#[test]
fn cycles_are_named_each_of_them() {
    let text = config(&[
        ("a", "split", "signal = \"c.clean\""),
        ("b", "split", "signal = \"a.noise\""),
        ("c", "split", "signal = \"b.noise\""),
        ("after", "peaks", "signal = \"c.noise\""),
        ("self", "count", "table = \"self\""),
    ]);
    assert_eq!(
        wrong(&text, &[]),
        [
            "\"c.clean\" | the stages wait for each other: a -> b -> c -> a | remove one of these wires",
            "\"self\" | the stages wait for each other: self -> self | remove one of these wires",
        ]
    );
}

#[test]
fn a_plugin_that_is_not_there_is_said_with_what_to_do() {
    let text = format!("{HEAD}[[stage]]\nid = \"x\"\nuses = \"exec:mine\"\n");
    let said = "\"exec:mine\" | stage `x`: there is no plugin `mine`: neither in [plugins] nor as `afmid-stage-mine` on the PATH | ";
    assert_eq!(
        wrong(&text, &[]),
        [format!("{said}add `mine = \"python3 my_stage.py\"` to [plugins], or install `afmid-stage-mine`")]
    );
    let near = format!("{text}[plugins]\nmien = \"python3 x.py\"\n");
    assert_eq!(wrong(&near, &[]), [format!("{said}did you mean `mien`?")]);
    let gone = format!("{text}[plugins]\nmine = \"a-program-that-nobody-has x.py\"\n");
    assert_eq!(
        wrong(&gone, &[]),
        [
            "\"a-program-that-nobody-has x.py\" | the plugin `mine` cannot be started: there is no program `a-program-that-nobody-has` | \
          name a program on the PATH, or a path from the config's folder with a `/` in it"
        ]
    );
}

#[test]
fn problems_of_all_kinds_come_at_once_in_the_order_of_the_text() {
    let text = "[pipeline]\nnam = \"x\"\n[[stage]]\nid = \"a\"\nuses = \"test.sine\"\nparams = { samples = -1 }\n\
                [[stage]]\nid = \"a\"\nuses = \"test.peks\"\n[[stage]]\nid = \"c\"\nuses = \"test.count\"\n";
    let found: Vec<String> =
        wrong(text, &[]).iter().map(|line| line.split(" | ").nth(1).unwrap_or("").to_owned()).collect();
    assert_eq!(
        found,
        [
            "[pipeline] has no key `nam`",
            "parameter `samples` of stage `a`: found the integer `-1`, wanted 1 to 1000000",
            "stage id `a` is used twice",
            "there is no stage named `test.peks`",
            "input `table` of stage `c` (`test.count`) is not wired",
        ]
    );
}

#[test]
fn a_graph_is_drawn_in_three_ways() {
    let text = config(&[
        ("sine", "sine", ""),
        ("split", "split", "signal = \"sine\""),
        ("peaks", "peaks", "signal = \"split.clean\""),
    ]);
    let plan = load("x.toml", &text, &[], &stages::registry()).expect("it is right");
    assert_eq!(
        plan.render(Format::Text),
        "test (seed 7): 3 stages\n\
         sine   test.sine\n\
         split  test.split  signal <- sine.signal\n\
         peaks  test.peaks  signal <- split.clean\n"
    );
    assert_eq!(
        plan.render(Format::Mermaid),
        "flowchart TD\n    n0[\"sine<br/>test.sine\"]\n    n1[\"split<br/>test.split\"]\n    n2[\"peaks<br/>test.peaks\"]\n    \
         n0 -- \"signal\" --> n1\n    n1 -- \"clean to signal\" --> n2\n"
    );
    let dot = plan.render(Format::Dot);
    assert!(
        dot.starts_with("digraph \"test\" {\n    node [shape=box];\n    n0 [label=\"sine\\ntest.sine\"];\n"),
        "{dot}"
    );
    assert!(dot.ends_with("    n1 -> n2 [label=\"clean to signal\"];\n}\n"), "{dot}");
}
