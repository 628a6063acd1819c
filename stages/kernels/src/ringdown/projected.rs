//! Whitened events, projected: events with the same gaps share their filter and their basis.

use faer::Mat;
use rayon::prelude::*;

use super::compressed::{Compressed, compress, whiten};
use super::modal_form::Exponential;
use super::noise::RingdownNoise;
use super::records::Records;
use super::whitener::Whitener;

/// Events with the same gaps, whitened.
struct Group {
    whitener: Whitener,
    members: Vec<usize>,
    signals: Vec<Vec<f64>>,
}

/// All events, whitened.
pub(super) struct Whitened {
    groups: Vec<Group>,
    interval_s: f64,
}

/// [`Compressed`] for events that need not share their basis.
pub(super) struct Projected {
    /// Upper triangles of the whitened bases.
    triangles: Vec<Mat<f64>>,
    /// Which of them is an event's.
    of: Vec<usize>,
    /// Per event, width numbers.
    pub projections: Vec<Vec<f64>>,
    /// Per event, the whitened energy outside the basis.
    pub rest: Vec<f64>,
}

impl Whitened {
    /// Whitens all events; one filter per pattern of gaps.
    pub fn of(records: &Records<'_>, noise: &RingdownNoise) -> Self {
        let mut patterns: Vec<Vec<usize>> = Vec::new();
        for event in 0..records.events.len() {
            let same = |pattern: &&mut Vec<usize>| records.gaps.mask(pattern[0]) == records.gaps.mask(event);
            match patterns.iter_mut().find(same) {
                Some(pattern) => pattern.push(event),
                None => patterns.push(vec![event]),
            }
        }
        let group = |members: Vec<usize>| {
            let mask = records.gaps.mask(members[0]);
            let whitener = Whitener::new(noise, records.interval_s, records.samples(), mask);
            let mut signals: Vec<Vec<f64>> = members.iter().map(|&event| records.events[event].to_vec()).collect();
            whiten(&whitener, &mut signals);
            Group { whitener, members, signals }
        };
        Self { groups: patterns.into_par_iter().map(group).collect(), interval_s: records.interval_s }
    }

    /// Projects them on the basis round `reference`.
    pub fn projected(&self, reference: &[Exponential]) -> Projected {
        let parts: Vec<Compressed> = self
            .groups
            .par_iter()
            .map(|group| compress(&group.whitener, reference, &group.signals, self.interval_s))
            .collect();
        let count = self.groups.iter().map(|group| group.members.len()).sum();
        let mut out = Projected {
            triangles: Vec::new(),
            of: vec![0; count],
            projections: vec![Vec::new(); count],
            rest: vec![0.0; count],
        };
        for (number, (group, part)) in self.groups.iter().zip(parts).enumerate() {
            for ((&event, projection), rest) in group.members.iter().zip(part.projections).zip(part.rest) {
                out.of[event] = number;
                out.projections[event] = projection;
                out.rest[event] = rest;
            }
            out.triangles.push(part.r);
        }
        out
    }
}

impl Projected {
    /// Upper triangle of an event's whitened basis: width x width.
    pub fn triangle(&self, event: usize) -> &Mat<f64> {
        &self.triangles[self.of[event]]
    }

    /// Some of the events, some of them more than once.
    pub fn chosen(&self, events: &[usize]) -> Self {
        Self {
            triangles: self.triangles.clone(),
            of: events.iter().map(|&event| self.of[event]).collect(),
            projections: events.iter().map(|&event| self.projections[event].clone()).collect(),
            rest: events.iter().map(|&event| self.rest[event]).collect(),
        }
    }
}
