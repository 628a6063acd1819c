//! `afmid stages`: the registry's own documentation.

use afmid_pipeline::Registry;
use afmid_pipeline::config::nearest;
use afmid_pipeline::reference::{Examples, page};

use crate::failure::Failure;

/// Lists all stages, or prints the page of one.
pub fn run(name: Option<&str>, registry: &Registry) -> Result<(), Failure> {
    let Some(name) = name else {
        let width = registry.entries().iter().map(|entry| entry.spec.name.len()).max().unwrap_or(0);
        for entry in registry.entries() {
            println!("{:width$}  {}", entry.spec.name, entry.spec.summary);
        }
        return Ok(());
    };
    let Some(entry) = registry.find(name) else {
        let nearest = nearest(name, registry.entries().iter().map(|entry| entry.spec.name));
        let help =
            nearest.map_or("`afmid stages` lists all".to_owned(), |nearest| format!("did you mean `{nearest}`?"));
        return Err(Failure::usage(format!("there is no stage named `{name}`"), Some(help)));
    };
    print!("{}", page(entry, Examples::Shown).map_err(|error| Failure::failed(error, None))?);
    Ok(())
}
