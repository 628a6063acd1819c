//! The points of a sweep: every value checked before anything runs, every point a plan of its own.

use std::collections::HashSet;
use std::ops::Range;

use serde_json::Value;

use super::plan::Plan;
use crate::config::{Config, Override, Problem, Ranges, Swept, instantiate, point};
use crate::stage::Entry;

/// Makes every swept stage with every combination of its own parameters. The first one is the config's and was checked
/// with it.
pub(super) fn check(config: &Config, entries: &[Option<Entry>], ranges: &mut Ranges, problems: &mut Vec<Problem>) {
    if config.sweep.is_empty() {
        return;
    }
    let mut reported: Reported =
        problems.iter().map(|problem| (problem.message.clone(), problem.span.clone())).collect();
    for (decl, entry) in config.stages.iter().zip(entries) {
        let own: Vec<&Swept> = config.sweep.iter().filter(|swept| swept.stage() == decl.id).collect();
        let Some(entry) = entry.as_ref().filter(|_| decl.params_read && !own.is_empty()) else { continue };
        let count: usize = own.iter().map(|swept| swept.values.len()).product();
        for index in 1..count {
            let mut alone = Config { stages: vec![decl.clone()], ..Config::default() };
            let values = own.iter().zip(point(own.iter().map(|swept| swept.values.len()), index));
            // a wrong path was reported when the first value was applied
            let applied =
                values.filter_map(|(swept, value)| swept.values.get(value).cloned()).try_for_each(|set| alone.set(set));
            if let (Ok(()), Some(decl)) = (applied, alone.stages.first()) {
                report(instantiate(decl, entry, ranges).err().into_iter().flatten(), &mut reported, problems);
            }
        }
    }
}

/// Messages with their places.
type Reported = HashSet<(String, Range<usize>)>;

/// What is wrong with one value is wrong in all its combinations with others: it is reported once.
fn report(wrong: impl Iterator<Item = Problem>, reported: &mut Reported, problems: &mut Vec<Problem>) {
    for problem in wrong {
        if reported.insert((problem.message.clone(), problem.span.clone())) {
            problems.push(problem);
        }
    }
}

impl Plan {
    /// How many points its sweep has; none without a sweep.
    pub fn points(&self) -> Option<usize> {
        let sweep = &self.config.sweep;
        (!sweep.is_empty()).then(|| sweep.iter().map(|swept| swept.values.len()).product())
    }

    /// The plan of one point, counted from 0, the last parameter running fastest; what is not swept is shared.
    ///
    /// Errors: none for a plan that was checked.
    pub fn point(&self, index: usize) -> Result<Self, Vec<Problem>> {
        let mut plan = self.with(self.chosen(index).map(|(_, set)| set.clone()).collect())?;
        plan.config.sweep.clear();
        Ok(plan)
    }

    /// The swept parameters, `stage.param`, and their values at a point.
    pub fn values(&self, index: usize) -> Vec<(String, Value)> {
        self.chosen(index).map(|(swept, set)| (swept.name.clone(), set.json())).collect()
    }

    fn chosen(&self, index: usize) -> impl Iterator<Item = (&Swept, &Override)> {
        let sweep = &self.config.sweep;
        let place = point(sweep.iter().map(|swept| swept.values.len()), index);
        sweep.iter().zip(place).filter_map(|(swept, value)| Some((swept, swept.values.get(value)?)))
    }

    /// The same plan with values set. Only the stages that they name are made again.
    fn with(&self, sets: Vec<Override>) -> Result<Self, Vec<Problem>> {
        let (mut plan, mut problems, mut ranges) = (self.clone(), Vec::new(), Ranges::default());
        let changed: Vec<String> = sets.iter().filter_map(|set| set.stage().map(str::to_owned)).collect();
        for set in sets {
            let text = set.text().to_owned();
            match plan.config.set(set) {
                Ok(()) => plan.config.overrides.push(text),
                Err(problem) => problems.push(problem),
            }
        }
        for node in plan.nodes.iter_mut().filter(|node| changed.contains(&node.id)) {
            let Some(decl) = plan.config.stages.iter().find(|decl| decl.id == node.id) else { continue };
            match instantiate(decl, &node.entry, &mut ranges) {
                Ok((stage, params)) => (node.stage, node.params) = (stage.into(), params),
                Err(wrong) => problems.extend(wrong),
            }
        }
        if problems.is_empty() { Ok(plan) } else { Err(problems) }
    }
}
