//! `afmid causes`: what a simulation can get wrong, as the catalogue documents it.

use afmid_pipeline::config::nearest;
use afmid_stages::causes::{as_json, catalogue, find, page};

use crate::failure::Failure;
use crate::output::print;
use crate::show::pretty;

/// Lists all causes, or prints the page of one.
pub fn run(name: Option<&str>, json: bool) -> Result<(), Failure> {
    let Some(name) = name else {
        return print(&if json { pretty(&catalogue().into_iter().map(as_json).collect::<Vec<_>>())? } else { list() });
    };
    let Some(cause) = find(name) else {
        let nearest = nearest(name, catalogue().iter().map(|cause| cause.about().id));
        let help =
            nearest.map_or("`afmid causes` lists all".to_owned(), |nearest| format!("did you mean `{nearest}`?"));
        return Err(Failure::usage(format!("there is no cause named `{name}`"), Some(help)));
    };
    print(&if json { pretty(&as_json(cause))? } else { page(cause) })
}

fn list() -> String {
    let all = catalogue();
    let width = all.iter().map(|cause| cause.about().id.len()).max().unwrap_or(0);
    all.iter().map(|cause| cause.about()).map(|about| format!("{:width$}  {}\n", about.id, about.physics)).collect()
}
