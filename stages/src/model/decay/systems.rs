//! Hits by the linear systems that they are of, as a table and in words.

use afmid_pipeline::{StageError, Table};
use serde_json::{Value, json};

use super::course::digits;
use crate::artifacts::Decays;
use afmid_kernels::ringdown::{ChannelOptions, ChannelRingdown, Estimate, HitSystems, ModeEstimate, hit_systems};

/// Hits that a warning names of each system.
const MOST_NAMED: usize = 5;
/// Systems that a warning names.
const MOST_SYSTEMS: usize = 6;

/// The systems of several hits; one of a single hit.
pub(super) struct Systems {
    found: HitSystems,
    /// Number of each hit, from 0.
    numbers: Vec<usize>,
}

struct SystemRow {
    hit: usize,
    system: usize,
    mode: Option<ModeEstimate>,
}

impl Systems {
    pub fn of(decays: &Decays<'_>, options: &ChannelOptions) -> Self {
        let options = ChannelOptions { missing: decays.missing(), ..options.clone() };
        let found = match decays.hits.len() {
            1 => HitSystems { strongest: Vec::new(), systems: vec![vec![0]], joint: None },
            _ => hit_systems(&decays.hits, &decays.quiet, 1.0 / decays.sample_rate_hz, &options),
        };
        Self { found, numbers: decays.numbers.clone() }
    }

    /// Leaves the hits of a system, counted from 1. Errors: there are fewer.
    pub fn choose(&self, system: usize, decays: &mut Decays<'_>) -> Result<(), StageError> {
        let hits = system.checked_sub(1).and_then(|place| self.found.systems.get(place)).ok_or_else(|| {
            let count = self.found.systems.len();
            StageError::new(format!("`system = {system}`: the hits are of {count}")).help(format!("give 1 to {count}"))
        })?;
        decays.keep(hits);
        Ok(())
    }

    /// Fit of all hits together, where they are of one system.
    pub fn joint(&self) -> Option<&ChannelRingdown> {
        self.found.joint.as_ref()
    }

    /// What to say of several systems.
    pub fn warning(&self, chosen: usize) -> Option<String> {
        let systems = &self.found.systems;
        let hits = self.found.strongest.len();
        let other = if chosen == 1 { 2 } else { 1 };
        (systems.len() > 1).then(|| {
            format!(
                "the {hits} hits are of {} unlike linear systems: {}; modes are those of system {chosen}, `systems` \
                 lists all hits, `system = {other}` gives the modes of another",
                systems.len(),
                self.named()
            )
        })
    }

    /// Each system with its hits and the strongest mode of one of them.
    fn named(&self) -> String {
        let one = |(place, hits): (usize, &Vec<usize>)| {
            let all: Vec<String> = hits.iter().take(MOST_NAMED).map(|&hit| self.number(hit).to_string()).collect();
            let more = if hits.len() > MOST_NAMED { ", ..." } else { "" };
            let mode = hits.iter().find_map(|&hit| self.found.strongest.get(hit).copied().flatten());
            let mode = mode.map_or_else(String::new, |mode| {
                format!(", {} Hz at {} %", digits(mode.frequency_hz, 1.0), digits(mode.damping_ratio(), 100.0))
            });
            format!("{} ({} hits: {}{more}{mode})", place + 1, hits.len(), all.join(", "))
        };
        let mut all: Vec<String> = self.found.systems.iter().enumerate().take(MOST_SYSTEMS).map(one).collect();
        if self.found.systems.len() > MOST_SYSTEMS {
            all.push("...".to_owned());
        }
        all.join("; ")
    }

    fn number(&self, hit: usize) -> usize {
        self.numbers.get(hit).map_or(0, |number| number + 1)
    }

    /// Hits of each system, by number.
    pub fn document(&self) -> Value {
        let own = |hits: &Vec<usize>| hits.iter().map(|&hit| self.number(hit)).collect::<Vec<usize>>();
        json!(self.found.systems.iter().map(own).collect::<Vec<_>>())
    }

    pub fn table(&self) -> Table {
        let system = |hit: usize| self.found.systems.iter().position(|hits| hits.contains(&hit)).map_or(0, |s| s + 1);
        let row = |(hit, mode): (usize, &Option<ModeEstimate>)| SystemRow {
            hit: self.number(hit),
            system: system(hit),
            mode: *mode,
        };
        let rows: Vec<SystemRow> = self.found.strongest.iter().enumerate().map(row).collect();
        let of = |row: &SystemRow, value: fn(&ModeEstimate) -> Estimate| {
            row.mode.as_ref().map_or(Estimate { value: f64::NAN, std: f64::NAN }, value)
        };
        Table::of(&rows)
            .with("hit", "1", "number of the hit", |row| row.hit)
            .with("system", "1", "number of its system, that of most hits first", |row| row.system)
            .with_std(["frequency_hz", "frequency_std_hz"], "Hz", "frequency of its strongest mode", |row| {
                of(row, |mode| mode.frequency_hz)
            })
            .with_std(["damping_ratio", "damping_ratio_std"], "1", "its damping ratio", |row| {
                of(row, ModeEstimate::damping_ratio)
            })
            .table()
    }
}
