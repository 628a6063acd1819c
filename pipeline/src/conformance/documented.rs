//! A stage is documented, once, in its own source.

use crate::reference::{HEADINGS, Sections, parameters, params_schema};
use crate::stage::Entry;

/// Headings that only some stages need: not every stage assumes a signal model.
const OPTIONAL: [&str; 1] = ["Model"];

/// Checks names, summary, headings of the doc comment in their order, and that every port and parameter is documented.
pub fn documented(entry: &Entry) -> Vec<String> {
    let spec = entry.spec;
    let mut violations = Vec::new();
    if !is_name(spec.name) {
        violations.push(format!("the name `{}` is not `domain.noun` in lowercase", spec.name));
    }
    if spec.summary.is_empty() || spec.summary.contains('\n') {
        violations.push("the summary is not one line".to_owned());
    }
    let (schema, _) = params_schema(entry);
    let doc = Sections::of(schema["description"].as_str().unwrap_or_default());
    if doc.intro.is_empty() {
        violations.push("the doc comment does not begin with what the stage does".to_owned());
    }
    headings(&doc, spec.source, &mut violations);
    for port in spec.inputs.iter().chain(spec.outputs).filter(|port| port.doc.is_empty()) {
        violations.push(format!("port `{}` is not documented", port.name));
    }
    for parameter in parameters(entry).iter().filter(|parameter| parameter.doc.trim().is_empty()) {
        violations.push(format!("parameter `{}` is not documented", parameter.name));
    }
    violations
}

fn headings(doc: &Sections, source: &str, violations: &mut Vec<String>) {
    let found: Vec<&str> = doc.sections.iter().map(|(heading, _)| *heading).collect();
    let rank = |heading: &&str| HEADINGS.iter().position(|known| known == heading);
    if !found.windows(2).all(|pair| rank(&pair[0]) < rank(&pair[1])) {
        violations.push(format!("the headings are {}, their order is {}", found.join(", "), HEADINGS.join(", ")));
    }
    for heading in HEADINGS.into_iter().filter(|heading| !OPTIONAL.contains(heading)) {
        let given = heading == "Source" && !source.is_empty();
        if doc.get(heading).is_none_or(str::is_empty) && !given {
            violations.push(format!("the doc comment lacks the heading {heading}"));
        }
    }
}

fn is_name(name: &str) -> bool {
    let part = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_lowercase())
            && part.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, '-' | '_'))
    };
    name.split_once('.').is_some_and(|(domain, noun)| part(domain) && part(noun))
}
