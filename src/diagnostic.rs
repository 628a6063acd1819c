//! Problems of configs, with the source, a caret and help.

use std::borrow::Cow;
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::Arc;

use afmid_pipeline::Problem;
use afmid_pipeline::config::Origin;
use miette::{
    GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteDiagnostic, MietteError, MietteSpanContents,
    NamedSource, Report, SourceCode, SourceSpan, SpanContents,
};

use crate::printable::{one_line, printable};

/// More problems are counted: who mends a hundred checks again.
pub const MOST_PROBLEMS: usize = 100;

/// Renders the first hundred problems of a config for stderr, printable, in colour if a person looks at it and nothing
/// in the config acts on the terminal.
pub fn render(file: &str, text: &str, problems: &[Problem]) -> String {
    let file = &one_line(file);
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
    let lines = Lines::of(text);
    for problem in problems.iter().take(MOST_PROBLEMS) {
        let report = report(file, &lines, problem);
        if handler.render_report(&mut out, report.as_ref()).is_err() {
            // a source that cannot be shown: the message alone
            let _ = writeln!(out, "error: {}", one_line(&problem.to_string()));
        }
        out.push('\n');
    }
    if let Some(more) = problems.len().checked_sub(MOST_PROBLEMS).filter(|more| *more > 0) {
        let _ = writeln!(out, "and {more} more\n");
    }
    let count = if problems.len() == 1 { "1 problem".to_owned() } else { format!("{} problems", problems.len()) };
    // writing to a String cannot fail
    let _ = writeln!(out, "{file}: {count}");
    out
}

fn report(file: &str, lines: &Lines, problem: &Problem) -> Report {
    let label = LabeledSpan::new_with_span(Some(problem.label.clone()), problem.span.clone());
    let mut diagnostic = MietteDiagnostic::new(problem.message.clone()).with_label(label);
    diagnostic.help.clone_from(&problem.help);
    let (name, lines) = match &problem.origin {
        Origin::Config => (file, lines.clone()),
        Origin::Argument(argument) => ("--set", Lines::of(argument)),
    };
    Report::new(diagnostic).with_source_code(NamedSource::new(name, lines))
}

/// A text whose lines are found without counting from the beginning. Cloning is cheap.
#[derive(Debug, Clone)]
struct Lines {
    text: Arc<str>,
    /// First byte of each line.
    starts: Arc<[usize]>,
}

impl Lines {
    fn of(text: &str) -> Self {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(place, _)| place + 1);
        Self { text: text.into(), starts: std::iter::once(0).chain(ends).collect() }
    }

    /// The line that a byte lies in, from 0.
    fn line(&self, byte: usize) -> usize {
        self.starts.partition_point(|start| *start <= byte).saturating_sub(1)
    }
}

impl SourceCode for Lines {
    /// What the whole text would give, from the lines around the span alone.
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let end = span.offset().checked_add(span.len()).ok_or(MietteError::OutOfBounds)?;
        // one line more at each side: where a line ends is for the text's own reader to say
        let (first, last) = (self.line(span.offset()).saturating_sub(before + 1), self.line(end) + after + 2);
        let from = self.starts.get(first).copied().unwrap_or(0);
        let to = self.starts.get(last).copied().unwrap_or(self.text.len());
        let part = self.text.get(from..to).ok_or(MietteError::OutOfBounds)?;
        let offset = span.offset().checked_sub(from).ok_or(MietteError::OutOfBounds)?;
        let contents = part.read_span(&SourceSpan::new(offset.into(), span.len()), before, after)?;
        let there = SourceSpan::new((contents.span().offset() + from).into(), contents.span().len());
        let data = self.text.as_bytes().get(there.offset()..there.offset() + there.len());
        Ok(Box::new(MietteSpanContents::new(
            data.ok_or(MietteError::OutOfBounds)?,
            there,
            contents.line() + first,
            contents.column(),
            contents.line_count(),
        )))
    }
}

#[cfg(test)]
mod tests;
