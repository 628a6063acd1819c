//! `afmid stages`: the registry's own documentation.

use afmid_pipeline::config::nearest;
use afmid_pipeline::reference::{Examples, page};
use afmid_pipeline::{Entry, Registry};

use crate::failure::Failure;
use crate::output::print;

/// Lists all stages, or prints the page of one.
pub fn run(name: Option<&str>, registry: &Registry) -> Result<(), Failure> {
    let Some(name) = name else {
        let width = registry.entries().iter().map(|entry| entry.spec.name.len()).max().unwrap_or(0);
        let line = |entry: &Entry| format!("{:width$}  {}\n", entry.spec.name, entry.spec.summary);
        return print(&registry.entries().iter().map(line).collect::<String>());
    };
    let Some(entry) = registry.find(name) else {
        let nearest = nearest(name, registry.entries().iter().map(|entry| entry.spec.name));
        let help =
            nearest.map_or("`afmid stages` lists all".to_owned(), |nearest| format!("did you mean `{nearest}`?"));
        return Err(Failure::usage(format!("there is no stage named `{name}`"), Some(help)));
    };
    print(&page(entry, Examples::Shown).map_err(|error| Failure::failed(error, None))?)
}
