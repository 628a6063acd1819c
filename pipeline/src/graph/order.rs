//! The order in which stages can run.

use super::wiring::Wire;
use crate::config::{Problem, StageDecl};

/// Kahn's algorithm, stable: among the stages that are ready, the first in the text comes first. Nothing, and a problem for each
/// cycle, if there is one.
pub(super) fn topological(decls: &[StageDecl], wires: &[Vec<Wire>], problems: &mut Vec<Problem>) -> Option<Vec<usize>> {
    let mut done = vec![false; wires.len()];
    let mut order = Vec::with_capacity(wires.len());
    let mut cyclic = false;
    while order.len() < wires.len() {
        let ready = |index: usize| !done[index] && wires[index].iter().all(|wire| done[wire.node]);
        let next = match (0..wires.len()).find(|&index| ready(index)) {
            Some(next) => vec![next],
            None => {
                let cycle = cycle(wires, &done)?;
                problems.push(describe(decls, &cycle));
                cyclic = true;
                cycle.iter().map(|wire| wire.node).collect()
            }
        };
        for index in next {
            done[index] = true;
            order.push(index);
        }
    }
    (!cyclic).then_some(order)
}

/// A cycle among the stages that are not done, as its wires: each is made by `node` and read by the node before it.
fn cycle<'a>(wires: &'a [Vec<Wire>], done: &[bool]) -> Option<Vec<&'a Wire>> {
    let mut path: Vec<&Wire> = Vec::new();
    let mut here = done.iter().position(|&done| !done)?;
    loop {
        // every stage that is left waits for another one that is left
        let wire = wires[here].iter().find(|wire| !done[wire.node])?;
        if let Some(start) = path.iter().position(|before| before.node == wire.node) {
            let mut cycle = path.split_off(start + 1);
            cycle.push(wire);
            return Some(cycle);
        }
        path.push(wire);
        here = wire.node;
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
