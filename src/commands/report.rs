//! `afmid report`: a run as one page.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::store::read_result;
use serde_json::json;

use super::open::require_result;
use super::target::{Target, prepare};
use crate::cli::ReportArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::relative::{address, folder_of, relative};
use crate::report::{Painter, figures, report};
use crate::show::pretty;

/// Writes the page, and the figures if asked for, and says where.
pub fn run(args: &ReportArgs) -> Result<(), Failure> {
    require_result(&args.result)?;
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.result));
    prepare(&output, Target::Page, &[("the result file", args.result.clone())])?;
    let run = read_result(&args.result).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let (results, page) = (folder_of(&args.result), folder_of(&output));
    let page = report(&run, &|name| beside(results, page, name)).map_err(|error| Failure::failed(error, None))?;
    write(&output, page.as_bytes())?;
    let mut written = Vec::new();
    if let Some(folder) = &args.figures {
        fs::create_dir_all(folder).map_err(|error| {
            Failure::failed(format!("the folder {} cannot be made: {error}", folder.display()), None)
        })?;
        let painter = args.png.then(Painter::new);
        for (name, text) in figures(&run) {
            let path = folder.join(name);
            write(&path, text.as_bytes())?;
            let picture = path.with_extension("png");
            written.push(path);
            if let Some(painter) = &painter {
                let cannot = |error| Failure::failed(format!("{} cannot be drawn: {error}", picture.display()), None);
                write(&picture, &painter.png(&text).map_err(cannot)?)?;
                written.push(picture);
            }
        }
    }
    let figures: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    if args.json {
        return print(&pretty(&json!({ "page": output.display().to_string(), "figures": figures }))?);
    }
    let all = std::iter::once(output.display().to_string()).chain(figures);
    print(&all.map(|path| path + "\n").collect::<String>())
}

/// The address of a data set's page, if it has one, or else of its result.
fn beside(results: &Path, page: &Path, name: &str) -> String {
    let found =
        ["html", "h5"].map(|ending| results.join(format!("{name}.{ending}"))).into_iter().find(|file| file.is_file());
    found.map(|file| address(&relative(&file, page))).unwrap_or_default()
}

fn default_output(result: &Path) -> PathBuf {
    PathBuf::from(result.file_stem().unwrap_or_default()).with_extension("html")
}

/// Writes under a temporary name beside it and renames: a page is whole or not there.
fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(format!(".{}.tmp", std::process::id()));
    let temporary = PathBuf::from(temporary);
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    written.map_err(|error| {
        // a half-written file is of no use to anybody; if it cannot be removed either, the first error says why
        let _ = fs::remove_file(&temporary);
        Failure::failed(format!("{} cannot be written: {error}", path.display()), None)
    })
}
