//! `afmid report`: a run as one page.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::RunResult;
use afmid_pipeline::error::StoreError;
use afmid_pipeline::files::{FilledFolder, replace_with};
use afmid_pipeline::store::read_result;
use serde_json::json;

use super::open::{require_result, summary_of};
use super::target::{Target, make_folder, prepare, text_of};
use crate::cli::ReportArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::one_line;
use crate::relative::{address, folder_of, relative};
use crate::report::{Painter, figures, report};
use crate::show::pretty;

/// Writes the page, and the figures if asked for, and says where.
pub fn run(args: &ReportArgs) -> Result<(), Failure> {
    let result = summary_of(&args.result);
    require_result(&result)?;
    // beside the results of a folder, to which it leads
    let own = if result == args.result { default_output(&result) } else { result.with_extension("html") };
    let output = args.output.clone().unwrap_or(own);
    prepare(&output, Target::Page, &[("the result file", result.clone())])?;
    args.figures.as_deref().map_or(Ok(()), make_folder)?;
    let (run, page) = drawn_page(&result, &output, args.title.as_deref())?;
    let drawn = args.figures.as_ref().map(|folder| Figures::new(folder, &run, args.png)).transpose()?;
    replace_with(&output, |temporary| fs::write(temporary, page.as_bytes())).map_err(|error| failed(&error))?;
    let written = drawn.map(|drawn| drawn.write()).transpose()?.unwrap_or_default();
    let figures: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
    if args.json {
        return print(&pretty(&json!({ "page": output.display().to_string(), "figures": figures }))?);
    }
    let all = std::iter::once(output.display().to_string()).chain(figures);
    print(&all.map(|path| one_line(&path) + "\n").collect::<String>())
}

/// Writes the page of a result, and returns what it is of. Errors: a damaged result; it cannot be written.
pub fn write_page(result: &Path, output: &Path) -> Result<RunResult, Failure> {
    let (run, page) = drawn_page(result, output, None)?;
    replace_with(output, |temporary| fs::write(temporary, page.as_bytes())).map_err(|error| failed(&error))?;
    Ok(run)
}

/// A result and its page. Errors: it is damaged.
fn drawn_page(result: &Path, output: &Path, title: Option<&str>) -> Result<(RunResult, String), Failure> {
    let run = read_result(result).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let (results, page) = (folder_of(result), folder_of(output));
    let page =
        report(&run, &|name| beside(results, page, name), title).map_err(|error| Failure::failed(error, None))?;
    Ok((run, page))
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

fn failed(error: &StoreError) -> Failure {
    Failure::failed(error, error.help.clone())
}

/// The figures as files of their own.
struct Figures {
    folder: FilledFolder,
    /// Names and what they hold; a PNG file after its SVG file.
    files: Vec<(String, Vec<u8>)>,
}

impl Figures {
    /// Draws them; nothing is written yet. Errors: a file of others lies in it.
    fn new(folder: &Path, run: &RunResult, png: bool) -> Result<Self, Failure> {
        let painter = png.then(Painter::new);
        let mut files = Vec::new();
        for (name, text) in figures(run) {
            let picture = painter.as_ref().map(|painter| painter.png(&text)).transpose();
            let picture = picture.map_err(|error| Failure::failed(format!("{name} cannot be drawn: {error}"), None))?;
            let drawn = Path::new(&name).with_extension("png").to_string_lossy().into_owned();
            files.push((name, text.into_bytes()));
            files.extend(picture.map(|picture| (drawn, picture)));
        }
        let folder = FilledFolder::open(folder).map_err(|error| failed(&error))?;
        for (name, _) in &files {
            folder.require_own(name, of_earlier_version).map_err(|error| failed(&error))?;
        }
        Ok(Self { folder, files })
    }

    /// Writes them, and says where.
    fn write(self) -> Result<Vec<PathBuf>, Failure> {
        let write = |(name, bytes): (String, Vec<u8>)| {
            self.folder.write(&name, of_earlier_version, &bytes).map_err(|error| failed(&error))?;
            Ok(self.folder.folder().join(name))
        };
        self.files.into_iter().map(write).collect()
    }
}

/// How every figure begins.
const FIGURE: &[u8] =
    b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"figure\"";

/// A figure that a version without lists wrote.
fn of_earlier_version(path: &Path) -> bool {
    text_of(path).as_bytes().starts_with(FIGURE)
}
