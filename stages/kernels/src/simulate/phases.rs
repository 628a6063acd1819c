//! Start phases of the ramp, so that an archive holds exactly the events it should.

use super::contact::Contact;
use super::error::SimulateError;
use super::motion::Drive;
use super::ramp::TriangleRamp;
use crate::events::EventKind;
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// One record's surface and pull-off forces, before its phase is chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordPlan {
    /// Height of the surface on the ramp's scale, m.
    pub surface_m: f64,
    /// Pull-off force of each cycle, N.
    pub pull_off_n: Vec<f64>,
}

/// What the archive should hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Total number of snap-ins; `None`: whatever comes.
    pub snap_ins: Option<usize>,
    /// Total number of snap-offs.
    pub snap_offs: Option<usize>,
}

/// The fixed part of the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseProblem {
    /// Ramp (its phase is what is sought).
    pub ramp: TriangleRamp,
    /// Contact.
    pub contact: Contact,
    /// Lever stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Length of a record, s.
    pub duration_s: f64,
    /// No event may lie closer than this to either side of either end of a record, s.
    pub margin_s: f64,
}

/// Candidates per record: phases on a grid with a seeded start.
const CANDIDATES: usize = 720;

impl PhaseProblem {
    /// When events happen by the quasi-static rules, from one margin before the record to one after it; `None`
    /// where one comes within the margin of an end.
    ///
    /// A snap-in where the falling base passes surface + gap, a snap-off where the rising one passes the
    /// pull-off height. Thermal motion brings events forward by about 0.1 ms: little
    /// beside a margin.
    pub fn quiet_events(&self, plan: &RecordPlan, phase: f64) -> Option<Vec<(EventKind, f64)>> {
        let ramp = TriangleRamp { phase, ..self.ramp };
        let drive = Drive { ramp, surface_m: plan.surface_m, pull_off_n: &plan.pull_off_n };
        let top = 0.5 * ramp.range_m;
        let (first, last) = (ramp.half_cycle(-self.margin_s), ramp.half_cycle(self.duration_s + self.margin_s));
        let mut events = Vec::new();
        for half in first..=last {
            let (kind, height) = if half.rem_euclid(2) == 0 {
                (EventKind::SnapIn, plan.surface_m + self.contact.snap_in_gap_m)
            } else {
                let pull_off = drive.pull_off_in(half);
                (EventKind::SnapOff, plan.surface_m + self.contact.pull_off_height_m(self.stiffness_n_per_m, pull_off))
            };
            if height.abs() >= top {
                continue;
            }
            let time = ramp.passes_s(half, height);
            let near = |end: f64| (time - end).abs() <= self.margin_s;
            if near(0.0) || near(self.duration_s) {
                return None;
            }
            if time > 0.0 && time < self.duration_s {
                events.push((kind, time));
            }
        }
        Some(events)
    }

    /// Phases of all records, such that the totals are `target`'s.
    ///
    /// # Method
    /// Each record tries a grid of phases from a seeded start and notes the first phase for each attainable pair of
    /// counts; pairs are then assigned greedily in a seeded order of the records, each step staying within what the
    /// remaining records can still make up (exact by dynamic programming over the two totals).
    ///
    /// # Errors
    /// Totals out of reach; a record without any phase that keeps its events off its ends.
    pub fn solve(&self, plans: &[RecordPlan], target: Target, rng: &mut ChaCha8Rng) -> Result<Vec<f64>, SimulateError> {
        let mut options = Vec::with_capacity(plans.len());
        for (record, plan) in plans.iter().enumerate() {
            let found = self.attainable(plan, rng.random::<f64>());
            if found.is_empty() {
                let hint = "every phase puts an event within margin_samples of an end: lower it or lengthen the record";
                return Err(SimulateError::NoPhase { record, snap_ins: 0, snap_offs: 0, hint: hint.to_string() });
            }
            options.push(found);
        }
        let mut order: Vec<usize> = (0..plans.len()).collect();
        order.shuffle(rng);
        let ordered: Vec<&[Attainable]> = order.iter().map(|&record| options[record].as_slice()).collect();
        let chosen = assign(&ordered, target).ok_or_else(|| out_of_reach(&options, target))?;
        let mut phases = vec![0.0; plans.len()];
        for (&record, phase) in order.iter().zip(chosen) {
            phases[record] = phase;
        }
        Ok(phases)
    }

    /// The first phase from `start` on for each pair of counts, in the order found.
    fn attainable(&self, plan: &RecordPlan, start: f64) -> Vec<Attainable> {
        let mut found: Vec<Attainable> = Vec::new();
        for i in 0..CANDIDATES {
            let phase = (start + i as f64 / CANDIDATES as f64).fract();
            let Some(events) = self.quiet_events(plan, phase) else { continue };
            let snap_ins = events.iter().filter(|(kind, _)| *kind == EventKind::SnapIn).count();
            let snap_offs = events.len() - snap_ins;
            if !found.iter().any(|a| a.snap_ins == snap_ins && a.snap_offs == snap_offs) {
                found.push(Attainable { snap_ins, snap_offs, phase });
            }
        }
        found
    }
}

/// A pair of counts and a phase that gives it.
#[derive(Debug, Clone, Copy)]
struct Attainable {
    snap_ins: usize,
    snap_offs: usize,
    phase: f64,
}

/// One phase per record with the wanted totals, or `None`.
fn assign(options: &[&[Attainable]], target: Target) -> Option<Vec<f64>> {
    // reachable[r]: the totals that records r.. can still give, sorted
    let key = |a: &Attainable| {
        (
            if target.snap_ins.is_some() { a.snap_ins } else { 0 },
            if target.snap_offs.is_some() { a.snap_offs } else { 0 },
        )
    };
    let mut reachable = vec![vec![(0, 0)]];
    for record in options.iter().rev() {
        let mut sums: Vec<(usize, usize)> = Vec::new();
        for &(ins, offs) in reachable.last()? {
            sums.extend(record.iter().map(key).map(|(i, o)| (ins + i, offs + o)));
        }
        sums.sort_unstable();
        sums.dedup();
        reachable.push(sums);
    }
    reachable.reverse();
    let mut left = (target.snap_ins.unwrap_or(0), target.snap_offs.unwrap_or(0));
    let mut phases = Vec::with_capacity(options.len());
    for (record, rest) in options.iter().zip(reachable.iter().skip(1)) {
        let (choice, after) = record.iter().find_map(|a| {
            let (ins, offs) = key(a);
            let after = (left.0.checked_sub(ins)?, left.1.checked_sub(offs)?);
            rest.binary_search(&after).ok().map(|_| (a, after))
        })?;
        left = after;
        phases.push(choice.phase);
    }
    Some(phases)
}

fn out_of_reach(options: &[Vec<Attainable>], target: Target) -> SimulateError {
    let range = |count: fn(&Attainable) -> usize| {
        let all = options.iter().flatten().map(count);
        (all.clone().min().unwrap_or(0), all.max().unwrap_or(0))
    };
    let (ins, offs) = (range(|a| a.snap_ins), range(|a| a.snap_offs));
    let records = options.len();
    match target {
        Target { snap_ins: Some(wanted), .. } if wanted < records * ins.0 || wanted > records * ins.1 => {
            SimulateError::Totals { kind: EventKind::SnapIn.name(), wanted, records, fewest: ins.0, most: ins.1 }
        }
        Target { snap_offs, .. } => {
            let wanted = snap_offs.unwrap_or(0);
            SimulateError::Totals { kind: EventKind::SnapOff.name(), wanted, records, fewest: offs.0, most: offs.1 }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::paper::{PAPER_CONTACT, PAPER_RAMP};
    use rand::SeedableRng;

    fn problem() -> PhaseProblem {
        PhaseProblem {
            ramp: PAPER_RAMP,
            contact: PAPER_CONTACT,
            stiffness_n_per_m: 3.8,
            duration_s: 0.6,
            margin_s: 0.004,
        }
    }

    fn plans(records: usize) -> Vec<RecordPlan> {
        (0..records)
            .map(|r| RecordPlan {
                surface_m: -22e-9 + 1e-9 * (r % 5) as f64,
                pull_off_n: (0..5).map(|c| 330e-9 * (1.0 + 0.06 * ((r * 7 + c * 3) % 5) as f64 - 0.12)).collect(),
            })
            .collect()
    }

    #[test]
    fn the_papers_totals_are_met_exactly_for_several_seeds() {
        let (problem, plans) = (problem(), plans(26));
        for seed in 0..5 {
            let target = Target { snap_ins: Some(89), snap_offs: Some(84) };
            let phases = problem.solve(&plans, target, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            let mut counts = (0, 0);
            for (plan, &phase) in plans.iter().zip(&phases) {
                for (kind, time) in problem.quiet_events(plan, phase).unwrap() {
                    assert!(time > problem.margin_s && time < problem.duration_s - problem.margin_s);
                    if kind == EventKind::SnapIn { counts.0 += 1 } else { counts.1 += 1 }
                }
            }
            assert_eq!(counts, (89, 84), "{seed}");
        }
    }

    #[test]
    fn totals_out_of_reach_are_refused_with_what_is_possible() {
        let target = Target { snap_ins: None, snap_offs: Some(200) };
        let error = problem().solve(&plans(26), target, &mut ChaCha8Rng::seed_from_u64(1)).unwrap_err();
        assert_eq!(error, SimulateError::Totals { kind: "snap-off", wanted: 200, records: 26, fewest: 3, most: 4 });
    }
}
