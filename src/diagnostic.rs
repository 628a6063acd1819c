//! Problems of configs, with the source, a caret and help.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::IsTerminal;

use afmid_pipeline::Problem;
use afmid_pipeline::config::Origin;
use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, NamedSource, Report};

use crate::printable::printable;

/// Renders all problems of a config for stderr, printable, in colour if a person looks at it and nothing in the config acts on the terminal.
pub fn render(file: &str, text: &str, problems: &[Problem]) -> String {
    let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let plain = render_with(file, text, problems, GraphicalTheme::unicode_nocolor());
    match printable(&plain) {
        Cow::Borrowed(_) if colour => render_with(file, text, problems, GraphicalTheme::unicode()),
        shown => shown.into_owned(),
    }
}

fn render_with(file: &str, text: &str, problems: &[Problem], theme: GraphicalTheme) -> String {
    let handler = GraphicalReportHandler::new_themed(theme).with_width(110).with_links(false).with_context_lines(1);
    let mut out = String::new();
    for problem in problems {
        let report = report(file, text, problem);
        if handler.render_report(&mut out, report.as_ref()).is_err() {
            // a source that cannot be shown: the message alone
            let _ = writeln!(out, "error: {problem}");
        }
        out.push('\n');
    }
    let count = if problems.len() == 1 { "1 problem".to_owned() } else { format!("{} problems", problems.len()) };
    // writing to a String cannot fail
    let _ = writeln!(out, "{file}: {count}");
    out
}

fn report(file: &str, text: &str, problem: &Problem) -> Report {
    let label = LabeledSpan::new_with_span(Some(problem.label.clone()), problem.span.clone());
    let mut diagnostic = MietteDiagnostic::new(problem.message.clone()).with_label(label);
    diagnostic.help.clone_from(&problem.help);
    let (name, source) = match &problem.origin {
        Origin::Config => (file, text),
        Origin::Argument(argument) => ("--set", argument.as_str()),
    };
    Report::new(diagnostic).with_source_code(NamedSource::new(name, source.to_owned()))
}

#[cfg(test)]
mod tests;
