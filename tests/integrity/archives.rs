//! What docs/archives.md says of the formats is what their rows say.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use afmid_pipeline::recording::rows;

use super::common::ROOT;

/// The table of formats, a line for each row.
fn table() -> String {
    let mut table =
        "| format (`format =`) | what is read | what is refused or left out | rate and times | unit | described by |\n\
                     |---|---|---|---|---|---|\n"
            .to_owned();
    let or_given = |stated: &'static str, parameter: &'static str| match stated {
        "" => format!("none: `{parameter}`"),
        stated => stated.to_owned(),
    };
    for row in rows() {
        let (clock, unit) = (or_given(row.clock, "sample_rate_hz"), or_given(row.unit, "unit"));
        let _ = writeln!(
            table,
            "| {} (`{}`) | {} | {} | {clock} | {unit} | {} |",
            row.title, row.name, row.reads, row.leaves_out, row.described_by
        );
    }
    table
}

#[test]
fn the_page_of_archives_has_the_rows_of_all_formats() {
    let path = Path::new(ROOT).join("docs/archives.md");
    let page = fs::read_to_string(&path).expect("docs/archives.md");
    let (head, rest) = page.split_once("<!-- formats -->\n").expect("a place for the formats");
    let (there, tail) = rest.split_once("<!-- end of formats -->").expect("its end");
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        fs::write(&path, format!("{head}<!-- formats -->\n{}<!-- end of formats -->{tail}", table())).expect("written");
        return;
    }
    assert!(there == table(), "docs/archives.md differs; UPDATE_EXPECTED=1 writes it:\n{}", table());
}

#[test]
fn every_row_says_what_it_is_and_has_a_name_of_its_own() {
    let mut names: Vec<&str> = rows().map(|row| row.name).collect();
    for row in rows() {
        for text in [row.name, row.title, row.reads, row.leaves_out, row.described_by] {
            assert!(!text.is_empty() && !text.contains(['|', '\n']), "{}: «{text}»", row.name);
        }
    }
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), rows().count());
}
