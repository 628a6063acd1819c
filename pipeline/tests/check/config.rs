//! Reading configs: every error at its place, all at once, with a suggestion.

use afmid_pipeline::Config;

use crate::wrong;

const HEAD: &str = "[pipeline]\nname = \"test\"\n";

fn stage(lines: &str) -> String {
    format!("{HEAD}[[stage]]\nid = \"a\"\nuses = \"test.sine\"\n{lines}\n")
}

#[test]
fn a_right_config_is_read() {
    let text = "[pipeline]\nname = \"x\"\nseed = 0x10\n[[stage]]\nid = \"a-1\"\nuses = \"test.load\"\nparams.files = [\"b\"]\n";
    let config = Config::parse("some/where.toml", text, &[]).expect("it is right");
    assert_eq!((config.name.as_str(), config.seed, config.stages.len()), ("x", 16, 1));
    assert_eq!(config.stages[0].params["files"][0].as_str(), Some("b"));
    assert_eq!(config.base(), std::path::Path::new("some"));
    assert_eq!(config.text, text);
}

#[test]
fn misspelt_keys_have_suggestions() {
    let text = "[pipeline]\nname = \"x\"\nsed = 1\n[[stage]]\nid = \"a\"\nuses = \"test.sine\"\nparam = {}\n[[stages]]\nid = \"b\"\n";
    assert_eq!(
        wrong(text, &[]),
        [
            "sed | [pipeline] has no key `sed` | did you mean `seed`?",
            "param | a stage has no key `param` | did you mean `params`?",
            "stages | a config has no table `stages` | did you mean `stage`?",
        ]
    );
}

#[test]
fn parameters_beside_params_are_sent_there() {
    assert_eq!(
        wrong(&stage("samples = 3"), &[]),
        [
            "samples | a stage has no key `samples` | parameters go into `params = { samples = ... }`, wires into `inputs`"
        ]
    );
}

#[test]
fn what_a_config_lacks_is_said() {
    assert_eq!(
        wrong("", &[]),
        [
            " | the config has no [pipeline] table | begin it with `[pipeline]` and `name = \"...\"`",
            " | the config has no [[stage]] | add a `[[stage]]` table with `id` and `uses`",
        ]
    );
    assert_eq!(
        wrong("[pipeline]\n[[stage]]\n", &[]),
        [
            "[pipeline] | [pipeline] has no `name` | add a line such as `name = \"free-lever\"`",
            "[[stage]] | stage 1 has no `id` | add a line such as `id = \"events\"`",
            "[[stage]] | stage 1 has no `uses` | add a line such as `uses = \"events.correlation\"`",
        ]
    );
}

#[test]
fn one_bracket_too_few_is_explained() {
    let text = format!("{HEAD}[stage]\nid = \"a\"\n");
    assert_eq!(
        wrong(&text, &[]),
        [
            "[stage] | `stage`: found a table, wanted an array of tables | write [[stage]] with two brackets on each side"
        ]
    );
}

#[test]
fn ids_are_checked() {
    let ids = ["a", "a", "pipeline", "A b"].map(|id| format!("[[stage]]\nid = \"{id}\"\nuses = \"test.sine\"\n"));
    assert_eq!(
        wrong(&format!("{HEAD}{}", ids.concat()), &[]),
        [
            "\"a\" | stage id `a` is used twice | results are stored under it: rename one",
            "\"pipeline\" | stage id `pipeline` is reserved: `--set` means the `[pipeline]` table by it | choose another id",
            "\"A b\" | stage id \"A b\": found 'A', wanted only a-z, 0-9, `_` and `-` | results are stored under it: write `a-b`, for instance",
        ]
    );
}

#[test]
fn plugins_are_read_in_all_their_forms_and_every_mistake_has_its_place() {
    let text = format!(
        "{}[plugins]\na = \"python3 'my stage.py'\"\nb = [\"python3\", \"x.py\"]\nc = {{ command = \"x\", timeout_s = 5 }}\n",
        stage("")
    );
    let config = Config::parse("c.toml", &text, &[]).expect("right");
    let read: Vec<_> = config.plugins.iter().map(|plugin| (plugin.command.join("|"), plugin.timeout_s)).collect();
    let wanted = [("python3|my stage.py", 600.0), ("python3|x.py", 600.0), ("x", 5.0)];
    assert_eq!(read, wanted.map(|(command, timeout)| (command.to_owned(), timeout)));

    let text = format!(
        "{}[plugins]\nA = \"x\"\nb = 3\nc = []\nd = {{ comand = \"x\" }}\ne = {{ command = \"x\", timeout_s = 0 }}\nf = \"'x\"\ng = [\"x\", 1]\n",
        stage("")
    );
    let form = "write `NAME = \"python3 my_stage.py\"` or `NAME = { command = [\"python3\", \"my_stage.py\"], timeout_s = 600 }`";
    assert_eq!(
        wrong(&text, &[]),
        [
            "A | `A` cannot be the name of a plugin | names are of lowercase letters, digits, `-` and `_`, and begin with a letter".to_owned(),
            format!("3 | the command of plugin `b`: found the integer `3`, wanted text or an array | {form}"),
            format!("[] | the command of plugin `c`: it is empty | {form}"),
            format!("{{ comand = \"x\" }} | plugin `d` has no `command` | {form}"),
            "comand | plugin `d` has no key `comand` | did you mean `command`?".to_owned(),
            "0 | `timeout_s` of plugin `e`: found the integer `0`, wanted seconds above 0, at most a week | -".to_owned(),
            format!("\"'x\" | the command of plugin `f`: a quote ' is not closed | {form}"),
            format!("1 | the command of plugin `g`: found the integer `1`, wanted text | {form}"),
        ]
    );
}

#[test]
fn all_wrong_parameters_are_found_at_once_each_at_its_value() {
    let text = stage(
        "params = { smples = 3, amplitude_v = \"high\", start = \"at-peek\", spikes_v = [1.0, true], noise = { std = 1 } }",
    );
    assert_eq!(
        wrong(&text, &[]),
        [
            "smples | stage `a` (`test.sine`) has no parameter `smples` | did you mean `samples`?",
            "\"high\" | parameter `amplitude_v` of stage `a`: found the string \"high\", wanted a number | `afmid stages test.sine` lists the parameters",
            "\"at-peek\" | parameter `start` of stage `a`: found \"at-peek\", wanted \"at-zero\" or \"at-peak\" | did you mean \"at-peak\"?",
            "true | parameter `spikes_v[1]` of stage `a`: found the flag `true`, wanted a number | `afmid stages test.sine` lists the parameters",
            "std | `noise` of stage `a` has no parameter `std` | there is: `std_v`",
        ]
    );
}

#[test]
fn a_parameter_without_default_is_asked_for() {
    let text = format!("{HEAD}[[stage]]\nid = \"a\"\nuses = \"test.load\"\n[stage.params]\nfiles = 3\n");
    assert_eq!(
        wrong(&text, &[]),
        [
            "[stage.params] | stage `a` (`test.load`) lacks the parameter `channel` | it has no default: add `channel = ...`; `afmid stages test.load` lists the parameters",
            "3 | parameter `files` of stage `a`: found the integer `3`, wanted an array | `afmid stages test.load` lists the parameters",
        ]
    );
}

#[test]
fn a_check_that_names_a_parameter_points_at_it() {
    assert_eq!(
        wrong(&stage("params = { samples = 0 }"), &[]),
        ["0 | stage `a`: `samples` is 0, wanted 1 to 1000000 | How many samples. Why: two periods. Default: 16."]
    );
    assert_eq!(
        wrong(&stage("params = { amplitude_v = 0 }"), &[]),
        ["{ amplitude_v = 0 } | stage `a`: a sine without amplitude or noise is no signal | -"]
    );
}

#[test]
fn numbers_that_no_record_can_hold_are_refused() {
    assert_eq!(
        wrong(&stage("params = { amplitude_v = nan, samples = 99999999999999999999 }"), &[]),
        [
            "nan | found `nan`, wanted a finite number | -",
            "99999999999999999999 | the integer `99999999999999999999` is too large: found more than 63 bits | write it as a float if it need not be exact",
        ]
    );
}

#[test]
fn syntax_errors_come_alone_and_all_at_once() {
    let text = "[pipeline]\nname = x\nseed = \n[[stage]\nid = 3\n";
    let here = "a config is TOML: https://toml.io";
    assert_eq!(
        wrong(text, &[]),
        [
            "x | `x` is not a TOML value | text needs quotes: \"x\"".to_owned(),
            format!(" | string values must be quoted, wanted literal string | {here}"),
            format!(" | unclosed array table, wanted `]` | {here}"),
        ]
    );
}

#[test]
fn arguments_override_parameters_and_the_pipeline() {
    let text = stage("params = { samples = 3, noise = { std_v = 1 } }");
    let arguments =
        ["a.samples=5", "a.noise.std_v = 2.5", "a.spikes_v=[1, 2]", "pipeline.seed=3", "pipeline.name=\"y\""];
    let config = Config::parse("x.toml", &text, &arguments.map(str::to_owned)).expect("all are right");
    let params = &config.stages[0].params;
    assert_eq!(params["samples"].as_integer(), Some(5));
    assert_eq!(params["noise"]["std_v"].as_float(), Some(2.5));
    assert_eq!(params["spikes_v"].as_array().map(Vec::len), Some(2));
    assert_eq!((config.seed, config.name.as_str()), (3, "y"));
    assert_eq!(config.overrides, arguments);
}

#[test]
fn wrong_arguments_are_marked_in_the_argument() {
    let text = stage("params = { samples = 3 }");
    let arguments = [
        "b.samples=5",
        "a.smples=5",
        "a.samples=five",
        "a.amplitude_v=true",
        "a.noise.sdt_v=1",
        "samples",
        "a=3",
        "a.samples.x=1",
        "pipeline.sed=1",
        "pipeline.seed=-1",
        "a.spikes_v=[1, [2]]",
        "=",
    ];
    assert_eq!(
        wrong(&text, &arguments),
        [
            "b | there is no stage `b` | did you mean `a`?",
            "smples | stage `a` (`test.sine`) has no parameter `smples` | did you mean `samples`?",
            "five | parameter `samples` of stage `a`: found the string \"five\", wanted a whole number, 0 or more | `afmid stages test.sine` lists the parameters",
            "true | parameter `amplitude_v` of stage `a`: found the flag `true`, wanted a number | `afmid stages test.sine` lists the parameters",
            "sdt_v | `noise` of stage `a` has no parameter `sdt_v` | did you mean `std_v`?",
            "samples | the argument has no `=` | write `--set ID.PARAM=VALUE`, such as `--set fit.order=11`",
            "a | the argument names no parameter | write `--set ID.PARAM=VALUE`, such as `--set fit.order=11`",
            "samples | `samples` of stage `a`: found string, wanted a table | set it as a whole",
            "sed | [pipeline] has no key `sed` | did you mean `seed`?",
            "-1 | `seed`: found the integer `-1`, wanted a whole number from 0 to 2^64 - 1 | -",
            "[2] | parameter `spikes_v[1]` of stage `a`: found an array, wanted a number | `afmid stages test.sine` lists the parameters",
            " | found no dotted key before the `=` | write `--set ID.PARAM=VALUE`, such as `--set fit.order=11`",
        ]
    );
}

#[test]
fn an_argument_that_fails_a_check_is_named() {
    assert_eq!(
        wrong(&stage(""), &["a.samples=0"]),
        ["0 | stage `a`: `samples` is 0, wanted 1 to 1000000 | How many samples. Why: two periods. Default: 16."]
    );
    assert_eq!(
        wrong(&stage("params = { samples = 2 }"), &["a.amplitude_v=0"]),
        ["{ samples = 2 } | stage `a`: a sine without amplitude or noise is no signal | with --set a.amplitude_v=0"]
    );
}
