//! `afmid man`: manual pages.

use std::path::Path;

use afmid_pipeline::files::FilledFolder;
use clap::Command;
use clap_mangen::Man;

use super::target::text_of;
use crate::cli::command;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::shown;

/// Prints the main page, or writes `afmid.1`, `afmid-run.1` and so on into a folder.
pub fn run(folder: Option<&Path>) -> Result<(), Failure> {
    let mut command = command();
    command.build();
    let Some(folder) = folder else { return print(&page(command)?) };
    let failed = |error: std::io::Error| {
        Failure::failed(format!("{}: the manual pages cannot be written: {error}", folder.display()), None)
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    let pages = pages(command, "afmid")?;
    let filled = FilledFolder::open(folder).map_err(|error| Failure::failed(&error, None))?;
    // a page of a version that kept no list
    let earlier = |path: &Path| text_of(path).contains(".TH afmid");
    for (name, text) in &pages {
        let written = filled.write(name, earlier, text.as_bytes());
        written.map_err(|error| Failure::failed(&error, error.help.clone()))?;
    }
    print(&format!("{}: {} pages\n", shown(folder), pages.len()))
}

/// Pages of a command and of all below it: file name and text.
fn pages(command: Command, name: &str) -> Result<Vec<(String, String)>, Failure> {
    let mut all = Vec::new();
    for inner in command.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help") {
        let name = format!("{name}-{}", inner.get_name());
        all.extend(pages(inner.clone(), &name)?);
    }
    all.insert(0, (format!("{name}.1"), page(command)?));
    Ok(all)
}

fn page(command: Command) -> Result<String, Failure> {
    let mut text = Vec::new();
    Man::new(command).render(&mut text).map_err(|error| Failure::failed(error, None))?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}
