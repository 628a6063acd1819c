//! `afmid explain`: which stages would run, and why.

use afmid_pipeline::Registry;
use afmid_pipeline::runner::{Decision, explain};

use super::load::load;
use super::run::open_cache;
use crate::cli::ExplainArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::show::grid;

/// Says on stdout what a run would do with each stage.
pub fn run(args: &ExplainArgs, registry: &Registry) -> Result<(), Failure> {
    let plan = load(&args.config.config, &args.config.set, registry)?;
    let cache = open_cache(args.cache.as_deref())?;
    let rows = explain(&plan, plan.config.base(), &cache);
    let mut table = vec![["stage", "would", "because", "key"].map(str::to_owned).to_vec()];
    for (id, key, decision) in rows {
        let (would, because) = match decision {
            Decision::Reuse => ("be reused", "its result is in the cache".to_owned()),
            Decision::Run => ("run", "no result lies under its key".to_owned()),
            Decision::Always => ("run", "it runs every time".to_owned()),
            Decision::Unknown(why) => ("be decided later", why),
        };
        let key = key.map_or_else(|| "-".to_owned(), |key| key.chars().take(16).collect());
        table.push(vec![id, would.to_owned(), because, key]);
    }
    print(&grid(&table))
}
