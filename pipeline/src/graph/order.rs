//! The order in which stages can run.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::wiring::Wire;
use crate::config::{Problem, StageDecl};

/// Kahn's algorithm, stable: among the stages that are ready, the first in the text comes first. Nothing, and a problem
/// for each cycle, if there is one.
pub(super) fn topological(decls: &[StageDecl], wires: &[Vec<Wire>], problems: &mut Vec<Problem>) -> Option<Vec<usize>> {
    let mut kahn = Kahn::new(wires);
    let mut cyclic = false;
    while kahn.order.len() < wires.len() {
        match kahn.ready.pop() {
            Some(Reverse(next)) => kahn.take(next),
            None => {
                let cycle = kahn.cycle()?;
                problems.push(describe(decls, &cycle));
                cyclic = true;
                cycle.iter().for_each(|wire| kahn.take(wire.node));
            }
        }
    }
    (!cyclic).then_some(kahn.order)
}

struct Kahn<'a> {
    wires: &'a [Vec<Wire>],
    /// The stages that each one feeds, once per wire.
    feeds: Vec<Vec<usize>>,
    /// Wires of each stage whose source is not done.
    waiting: Vec<usize>,
    /// The first in the text first.
    ready: BinaryHeap<Reverse<usize>>,
    done: Vec<bool>,
    order: Vec<usize>,
    /// All before it are done.
    begin: usize,
    /// Where a search for a cycle met a stage: the number of the search and the place in its path.
    met: Vec<(usize, usize)>,
    searches: usize,
}

impl<'a> Kahn<'a> {
    fn new(wires: &'a [Vec<Wire>]) -> Self {
        let mut feeds = vec![Vec::new(); wires.len()];
        for (stage, wires) in wires.iter().enumerate() {
            wires.iter().for_each(|wire| feeds[wire.node].push(stage));
        }
        let waiting: Vec<usize> = wires.iter().map(Vec::len).collect();
        let ready = waiting.iter().enumerate().filter(|(_, count)| **count == 0).map(|(stage, _)| Reverse(stage));
        Self {
            wires,
            feeds,
            ready: ready.collect(),
            done: vec![false; waiting.len()],
            order: Vec::with_capacity(waiting.len()),
            begin: 0,
            met: vec![(0, 0); waiting.len()],
            searches: 0,
            waiting,
        }
    }

    fn take(&mut self, stage: usize) {
        if std::mem::replace(&mut self.done[stage], true) {
            return;
        }
        self.order.push(stage);
        for &fed in &self.feeds[stage] {
            self.waiting[fed] -= 1;
            if self.waiting[fed] == 0 && !self.done[fed] {
                self.ready.push(Reverse(fed));
            }
        }
    }

    /// A cycle among the stages that are not done, as its wires: each is made by `node` and read by the node before it.
    fn cycle(&mut self) -> Option<Vec<&'a Wire>> {
        self.begin += self.done[self.begin..].iter().position(|&done| !done)?;
        self.searches += 1;
        let (mut path, mut here): (Vec<&Wire>, usize) = (Vec::new(), self.begin);
        loop {
            // every stage that is left waits for another one that is left
            let wire = self.wires[here].iter().find(|wire| !self.done[wire.node])?;
            let (search, place) = self.met[wire.node];
            if search == self.searches {
                let mut cycle = path.split_off(place + 1);
                cycle.push(wire);
                return Some(cycle);
            }
            self.met[wire.node] = (self.searches, path.len());
            path.push(wire);
            here = wire.node;
        }
    }
}

fn describe(decls: &[StageDecl], cycle: &[&Wire]) -> Problem {
    // data flows against the order in which the cycle was found; begin with the stage that the text names first
    let mut nodes: Vec<usize> = cycle.iter().rev().map(|wire| wire.node).collect();
    let first = nodes.iter().enumerate().min_by_key(|&(_, &node)| node).map_or(0, |(place, _)| place);
    nodes.rotate_left(first);
    let ids: Vec<&str> = nodes.iter().chain(nodes.first()).map(|&node| decls[node].id.as_str()).collect();
    let span = cycle.iter().map(|wire| wire.span.clone()).min_by_key(|span| span.start).unwrap_or_default();
    Problem::new(format!("the stages wait for each other: {}", ids.join(" -> ")), span, "part of the cycle")
        .help("remove one of these wires")
}
