//! Names that a plugin gives: one that cannot be stored is that plugin's fault, and costs the other stages nothing.

use super::{Project, all};

/// A stage of the plugin beside one that reads a table.
const CONFIG: &str = "[pipeline]\nname = \"strange\"\n[plugins]\nmine = \"python3 mine.py\"\n\
    [[stage]]\nid = \"data\"\nuses = \"io.columns\"\nparams = { file = \"data.csv\", sample_rate_hz = 100.0 }\n\
    [[stage]]\nid = \"one\"\nuses = \"exec:mine\"\n";

/// Lines of a plugin that makes a table.
fn table(made: &str) -> String {
    format!(
        "DESCRIPTION['outputs'] = [{{'name': 'out', 'shape': 'table'}}]\n\
         def column(name, kind='real', values=(1, 2)):\n    \
         return {{'name': name, 'unit': '1', 'kind': kind, 'values': list(values)}}\n\
         def run(params):\n    \
         table = {{'shape': 'table', 'rows': 2, 'columns': [column('good')]}}\n    {made}\n    \
         return {{'outputs': {{'out': table}}, 'warnings': ['a\\0b']}}\n"
    )
}

/// Lines of a plugin that makes an array.
fn array(made: &str) -> String {
    format!(
        "def run(params):\n    answer = made([1, 2, 3])\n    out = answer['outputs']['out']\n    {made}\n    \
         return answer\n"
    )
}

fn project(changed: &str) -> Project {
    let project = Project::new(changed);
    project.put("c.toml", CONFIG);
    let rows: String = (0..200).map(|k| format!("{},{}\n", (k * 7919) % 31, (k * 104_729) % 37)).collect();
    project.put("data.csv", &format!("u,y\n{rows}"));
    project
}

const RUN: [&str; 5] = ["run", "c.toml", "--allow-plugins", "-o", "out.h5"];

#[test]
fn a_name_that_cannot_be_stored_fails_the_plugins_stage_alone() {
    let column = |name: &str| table(&format!("table['columns'].append(column({name}))"));
    let cases = [
        (column("'../../x'"), "../../x"),
        (column("''"), "column \\\"\\\""),
        (column("'a\\0b'"), "a\\\\0b"),
        (column("'..'"), ".."),
        (column("'x' * 70000"), "bytes more"),
        (column("'a\\x1bb'"), "control characters"),
        (column("'t', 'text', ['a\\0', 'b']"), "NUL"),
        (table("table['attributes'] = {'a\\0': 1}"), "attribute"),
        (table("table['columns'][0]['unit'] = '\\0'"), "NUL"),
        (array("out['axes'][0]['name'] = '/'; out['variables'][0]['dims'] = ['/']"), "axis"),
        (array("out['variables'][0]['name'] = 'a/b'"), "variable"),
        (
            array(
                "out['variables'] += [{'name': 'x', 'unit': '1', 'dims': ['n'], 'kind': 'complex', 're': [1, 2, 3], \
                 'im': [1, 2, 3]}, {'name': 'x_real', 'unit': '1', 'dims': ['n'], 'kind': 'real', \
                 'values': [1, 2, 3]}]",
            ),
            "x_real",
        ),
    ];
    for (changed, named) in cases {
        let project = project(&changed);
        let output = project.run(&RUN);
        let said = all(&output);
        let named = named.replace("\\\"", "\"").replace("\\\\", "\\");
        assert_eq!(output.status.code(), Some(1), "{named}: {said}");
        assert!(said.contains("the plugin `mine`") && said.contains("one"), "{named}: {said}");
        assert!(said.contains(&named), "{named}: {said}");
        assert!(!project.folder().join("out.h5").exists(), "{named}");
        let kept = project.json(&["show", "out.failed.h5", "--json"]);
        assert_eq!(kept["unfinished"][0]["id"], "one", "{named}: {kept}");
        project.stdout(&["show", "out.failed.h5", "data"]);
    }
}

#[test]
fn odd_names_that_can_be_stored_and_warnings_with_a_nul_are_kept() {
    let made = "table['attributes'] = {'afmid_shape': 1, 'signal': 2, 'afmid_attribute_signal': 3, 'a/b': 4, '': 5}";
    let project = project(&table(&format!("table['columns'].append(column('a b.c')); {made}")));
    let output = project.run(&RUN);
    assert!(output.status.success() && all(&output).contains("a\u{fffd}b"), "{}", all(&output));
    let shown = project.stdout(&["show", "out.h5", "one", "--json"]);
    assert!(shown.contains("a b.c"), "{shown}");
}

#[test]
fn names_of_a_description_are_looked_at_before_anything_runs() {
    for (changed, named) in [
        ("DESCRIPTION['outputs'][0]['name'] = '../x'", "output `../x`"),
        ("DESCRIPTION['outputs'][0]['tag'] = 'a\\0'", "tag"),
        ("DESCRIPTION['parameters']['properties'] = {'': {'type': 'number', 'default': 1}}", "property \"\""),
        ("DESCRIPTION['parameters']['properties'] = {'a\\0': {'type': 'number', 'default': 1}}", "property"),
    ] {
        let project = project(&format!("{changed}\n"));
        let output = project.run(&RUN);
        let said = all(&output);
        assert_eq!(output.status.code(), Some(2), "{changed}: {said}");
        assert!(said.contains("mine") && said.contains(named), "{changed}: {said}");
    }
}
