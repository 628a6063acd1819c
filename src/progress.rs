//! Progress on stderr: bars for people, lines for logs.

use std::io::IsTerminal;
use std::time::Duration;

use crate::batch::work::Done;
use crate::interrupt;
use crate::output::say;
use crate::printable::{few, one_line};
use afmid_pipeline::runner::Observer;
use afmid_pipeline::stage::{NoProgress, Progress};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// Who watches a run: bars if stderr is a terminal, lines elsewhere.
pub fn observer() -> Box<dyn Observer> {
    if std::io::stderr().is_terminal() { Box::new(Bars { bars: MultiProgress::new() }) } else { Box::new(Lines) }
}

/// Progress of a batch or a sweep: a bar with rate and time left if stderr is a terminal, a line per run elsewhere.
pub struct Sets {
    bar: Option<ProgressBar>,
}

impl Sets {
    /// Of so many data sets, or of what they are called here.
    pub fn new(what: &str, count: usize) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {per_sec} {eta} left");
            let bar = ProgressBar::new(count as u64);
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar.set_prefix(one_line(what));
            bar
        });
        Self { bar }
    }

    /// One has ended; those that were as they should be are not worth a line.
    pub fn ended(&self, done: &Done) {
        let entry = &done.entry;
        let line = done.took.map(|took| {
            let what = if entry.is_done() { "done" } else { "failed" };
            format!("{}: {what}, {:.2} s\n", one_line(&entry.name), took.as_secs_f64())
        });
        match (&self.bar, line) {
            (Some(bar), line) => {
                bar.inc(1);
                line.filter(|_| !entry.is_done()).into_iter().for_each(|line| bar.suspend(|| say(&line)));
            }
            (None, Some(line)) => say(&line),
            (None, None) => {}
        }
    }
}

impl Drop for Sets {
    fn drop(&mut self) {
        self.bar.iter().for_each(ProgressBar::finish_and_clear);
    }
}

struct Lines;

impl Observer for Lines {
    fn is_stopped(&self) -> bool {
        interrupt::caught().is_some()
    }

    fn begin(&self, _id: &str) -> Box<dyn Progress + '_> {
        Box::new(NoProgress)
    }

    fn end(&self, id: &str, cached: bool, took: Duration, warnings: &[String]) {
        say(&lines(id, cached, took, warnings));
    }
}

struct Bars {
    bars: MultiProgress,
}

impl Observer for Bars {
    fn is_stopped(&self) -> bool {
        interrupt::caught().is_some()
    }

    fn begin(&self, id: &str) -> Box<dyn Progress + '_> {
        let bar = self.bars.add(ProgressBar::no_length());
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(one_line(id));
        bar.enable_steady_tick(Duration::from_millis(200));
        Box::new(Bar { bars: &self.bars, bar })
    }

    fn end(&self, id: &str, cached: bool, took: Duration, warnings: &[String]) {
        self.bars.suspend(|| say(&lines(id, cached, took, warnings)));
    }
}

struct Bar<'a> {
    bars: &'a MultiProgress,
    bar: ProgressBar,
}

impl Progress for Bar<'_> {
    fn expect(&self, total: u64) {
        self.bar.inc_length(total);
    }

    fn tick(&self) {
        self.bar.inc(1);
    }
}

impl Drop for Bar<'_> {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        self.bars.remove(&self.bar);
    }
}

fn lines(id: &str, cached: bool, took: Duration, warnings: &[String]) -> String {
    let what = if cached { "reused".to_owned() } else { format!("{:.2} s", took.as_secs_f64()) };
    let warnings: String = few(warnings).iter().map(|warning| format!("  warning: {warning}\n")).collect();
    format!("{}: {what}\n{warnings}", one_line(id))
}
