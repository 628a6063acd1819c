//! Runs the nodes of an acyclic graph, each as soon as what it needs is there.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// What became of a node.
#[derive(Debug)]
pub(super) enum Outcome<T, E> {
    /// It ran.
    Done(T),
    /// It failed.
    Failed(E),
    /// Something that it needs did not run.
    Skipped,
}

/// What nodes have made so far.
pub(super) struct Board<T, E> {
    slots: Vec<OnceLock<Outcome<T, E>>>,
}

impl<T, E> Board<T, E> {
    /// What `node` made, if it ran.
    pub(super) fn done(&self, node: usize) -> Option<&T> {
        match self.slots.get(node)?.get()? {
            Outcome::Done(value) => Some(value),
            Outcome::Failed(_) | Outcome::Skipped => None,
        }
    }
}

/// Runs `work(node, board)` for each node once all nodes in `needs[node]` are done; independent nodes run in parallel
/// on rayon's pool.
///
/// What is ready first runs first: a long node at the head of a short branch is not left to the end by the short nodes
/// of a long one.
/// Model: `needs` is acyclic and refers to smaller indices only (topological order). A node after a failed one is
/// skipped.
/// The results do not depend on the order in which nodes happen to run, as long as `work` does not.
pub(super) fn run_graph<T, E, W>(needs: &[Vec<usize>], work: W) -> Vec<Outcome<T, E>>
where
    T: Send + Sync,
    E: Send + Sync,
    W: Fn(usize, &Board<T, E>) -> Result<T, E> + Sync,
{
    let board = Board { slots: needs.iter().map(|_| OnceLock::new()).collect() };
    let waiting: Vec<AtomicUsize> = needs.iter().map(|nodes| AtomicUsize::new(nodes.len())).collect();
    let mut feeds = vec![Vec::new(); needs.len()];
    for (node, sources) in needs.iter().enumerate() {
        for &source in sources {
            feeds[source].push(node);
        }
    }
    let ready = Mutex::default();
    let graph = Graph { needs, feeds: &feeds, waiting: &waiting, ready: &ready, board: &board, work: &work };
    rayon::scope(|scope| {
        (0..needs.len()).filter(|&node| needs[node].is_empty()).for_each(|node| graph.start(scope, node));
    });
    board.slots.into_iter().map(|slot| slot.into_inner().unwrap_or(Outcome::Skipped)).collect()
}

struct Graph<'a, T, E, W> {
    needs: &'a [Vec<usize>],
    feeds: &'a [Vec<usize>],
    waiting: &'a [AtomicUsize],
    /// In the order in which they became so.
    ready: &'a Mutex<VecDeque<usize>>,
    board: &'a Board<T, E>,
    work: &'a W,
}

impl<T, E, W> Clone for Graph<'_, T, E, W> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T, E, W> Copy for Graph<'_, T, E, W> {}

impl<'a, T, E, W> Graph<'a, T, E, W>
where
    T: Send + Sync,
    E: Send + Sync,
    W: Fn(usize, &Board<T, E>) -> Result<T, E> + Sync,
{
    /// A node is ready: another task for the pool, which takes whichever has been so for longest.
    fn start(self, scope: &rayon::Scope<'a>, node: usize) {
        self.ready.lock().unwrap_or_else(PoisonError::into_inner).push_back(node);
        scope.spawn(move |scope| {
            let next = self.ready.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
            next.into_iter().for_each(|node| self.step(scope, node));
        });
    }

    fn step(self, scope: &rayon::Scope<'a>, node: usize) {
        let outcome = if self.needs[node].iter().all(|&source| self.board.done(source).is_some()) {
            match (self.work)(node, self.board) {
                Ok(value) => Outcome::Done(value),
                Err(error) => Outcome::Failed(error),
            }
        } else {
            Outcome::Skipped
        };
        // each node is stepped once, so the slot is empty
        let _ = self.board.slots[node].set(outcome);
        for &next in &self.feeds[node] {
            // the last source to finish starts the node; AcqRel makes all sources' slots visible to it
            if self.waiting[next].fetch_sub(1, Ordering::AcqRel) == 1 {
                self.start(scope, next);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sums(needs: &[Vec<usize>]) -> Vec<Outcome<usize, String>> {
        run_graph(needs, |node, board| {
            if node == 3 {
                return Err("three fails".to_owned());
            }
            Ok(1 + needs[node].iter().map(|&source| board.done(source).copied().unwrap_or(1000)).sum::<usize>())
        })
    }

    #[test]
    fn every_node_sees_what_it_needs() {
        let outcomes = sums(&[vec![], vec![0], vec![0, 1]]);
        assert!(matches!(outcomes[2], Outcome::Done(4)));
    }

    #[test]
    fn what_is_ready_first_runs_first() {
        // one short branch (1, 3, 4, 5) and one long node (2), both behind node 0
        let needs = [vec![], vec![0], vec![0], vec![1], vec![3], vec![4]];
        let order = Mutex::new(Vec::new());
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        pool.install(|| {
            run_graph(&needs, |node, _| {
                order.lock().expect("nobody panics").push(node);
                Ok::<(), ()>(())
            })
        });
        assert_eq!(order.into_inner().expect("nobody panics"), [0, 1, 2, 3, 4, 5]);
    }

    #[test]
    fn a_node_after_a_failed_one_is_skipped_and_others_run() {
        let outcomes = sums(&[vec![], vec![], vec![0], vec![1], vec![3], vec![2, 4], vec![2]]);
        assert!(matches!(&outcomes[3], Outcome::Failed(why) if why == "three fails"));
        assert!(matches!(outcomes[4], Outcome::Skipped));
        assert!(matches!(outcomes[5], Outcome::Skipped));
        assert!(matches!(outcomes[6], Outcome::Done(3)));
    }
}
