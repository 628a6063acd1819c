//! Answers held against what was hidden.

use std::collections::BTreeMap;
use std::fmt::Write;

use afmid_kernels::causes::built_in;
use afmid_kernels::diagnosis::verdict::{Diagnosis, Verdict};
use afmid_kernels::statistics::clopper_pearson;

use super::draw::Hidden;
use super::system::System;

/// What is asked for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// The name of a hidden cause.
    One,
    /// Nothing is hidden.
    Clean,
    /// The cause's class may not be named.
    LeftOut,
}

impl Asked {
    pub fn of(word: &str) -> Option<Self> {
        match word {
            "one" => Some(Self::One),
            "clean" => Some(Self::Clean),
            "left-out" => Some(Self::LeftOut),
            _ => None,
        }
    }
}

/// One system's answer.
pub struct Sat {
    id: &'static str,
    right: bool,
    /// Whether nothing else was named.
    alone: bool,
    /// Error of the main parameter in its standard errors, where the id was named.
    sigmas: Option<f64>,
    seconds: f64,
    line: String,
}

impl Sat {
    pub fn new(
        seed: u64,
        system: &System,
        hidden: Option<&Hidden>,
        asked: Asked,
        diagnosis: Result<Diagnosis, String>,
        seconds: f64,
    ) -> Self {
        let id = hidden.map_or("nothing", Hidden::id);
        let (modes, channels, runs) = (system.modes.len(), system.channels(), system.runs.len());
        let mut line = format!(
            "{seed}: {modes} modes, {channels} channels, {runs} runs, {:?}, noise {:.1e}; {id}",
            system.sensed, system.noise[0]
        );
        if let Some(hidden) = hidden {
            let _ = write!(line, " of {:?} {:.3?} at {:.1} limits", hidden.modes, hidden.values, hidden.times_limit);
        }
        let (right, alone, sigmas) = match &diagnosis {
            Err(_) => (false, false, None),
            Ok(found) => {
                let of_class = |named: &str| {
                    let class = |id: &str| built_in(id).map_or(&[][..], |cause| cause.about().class);
                    class(id).contains(&named) || class(named).contains(&id)
                };
                let right = match asked {
                    Asked::One => found.causes.iter().any(|cause| cause.class.iter().any(|named| of_class(named))),
                    Asked::Clean => found.verdict == Verdict::Clean,
                    Asked::LeftOut => found.verdict == Verdict::Unexplained,
                };
                (right, found.causes.len() < 2, hidden.and_then(|hidden| sigmas(hidden, found)))
            }
        };
        let said = diagnosis.as_ref().map_or_else(Clone::clone, |found| {
            let named: Vec<&str> = found.causes.iter().map(|cause| &cause.id[..]).collect();
            let order = found.baseline.order.unwrap_or(0);
            let why = if right { String::new() } else { found.evidence.join("; ") };
            format!("{:?} {named:?}, order {order}, {seconds:.1} s; {why}", found.verdict)
        });
        let mark = if right { "right" } else { "WRONG" };
        let _ = write!(line, " -> {said} ({mark}{})", sigmas.map_or(String::new(), |s| format!(", {s:.1} sigma")));
        Self { id, right, alone, sigmas, seconds, line }
    }

    pub fn line(&self) -> &str {
        &self.line
    }
}

/// The main parameter's error in standard errors; its sign means nothing where it is an amplitude with a phase.
fn sigmas(hidden: &Hidden, found: &Diagnosis) -> Option<f64> {
    let about = hidden.cause.about();
    let name = about.parameters.first()?.name;
    let with = |id: &str| found.causes.iter().filter(|cause| cause.id == id).count();
    let cause = found.causes.iter().find(|cause| cause.id == about.id).filter(|_| with(about.id) == 1)?;
    let value = cause.parameters.get(name)?;
    let (value, std, truth) = (value.value?, value.std?, hidden.values[0]);
    let (value, truth) = if about.id == "spurious-line" { (value.abs(), truth.abs()) } else { (value, truth) };
    Some((value - truth).abs() / std)
}

/// The answers as rows of a table.
pub fn table(asked: Asked, sat: &[Sat]) -> String {
    let row = |name: &str, hits: usize, of: usize| {
        format!(
            "| {name} | {hits} of {of} ({:.1} %) | {:.1} % |\n",
            100.0 * hits as f64 / of.max(1) as f64,
            100.0 * clopper_pearson(hits, of, 0.95).0
        )
    };
    let what = match asked {
        Asked::One => "the right class among the names",
        Asked::Clean => "`clean`",
        Asked::LeftOut => "`unexplained`",
    };
    let mut text = "| asked | reached | at least, 95 % |\n|---|---|---|\n".to_owned();
    text += &row(what, sat.iter().filter(|one| one.right).count(), sat.len());
    if asked == Asked::One {
        text += &row("the same, and no other name", sat.iter().filter(|one| one.right && one.alone).count(), sat.len());
        let errors: Vec<f64> = sat.iter().filter_map(|one| one.sigmas).collect();
        text += &row(
            "main parameter within 3 of its standard errors",
            errors.iter().filter(|s| **s < 3.0).count(),
            errors.len(),
        );
    }
    let mut ids: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for one in sat {
        let entry = ids.entry(one.id).or_default();
        *entry = (entry.0 + usize::from(one.right), entry.1 + 1);
    }
    text += "\n";
    for (id, (hits, of)) in ids {
        let _ = writeln!(text, "{id}: {hits} of {of}");
    }
    let mut seconds: Vec<f64> = sat.iter().map(|one| one.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |part: f64| seconds.get(((seconds.len() as f64 - 1.0) * part).max(0.0) as usize).copied().unwrap_or(0.0);
    let _ = write!(text, "\n{:.1} s a diagnosis (median), {:.1} s at most, several at a time", at(0.5), at(1.0));
    text
}
