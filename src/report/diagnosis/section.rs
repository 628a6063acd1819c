//! The section of the page.

use afmid_pipeline::RunResult;

use super::diagnosed::{Diagnosed, diagnoses};
use super::{ladder, modes, overlay, telling, tiles, words};
use crate::report::drawn::Drawn;

/// All diagnoses of a run; none where no stage diagnoses.
pub(crate) fn section(run: &RunResult) -> Option<Drawn> {
    let mut section = Drawn { id: "diagnosis", title: "Diagnosis", ..Drawn::default() };
    let found = diagnoses(run);
    for diagnosed in &found {
        add(&mut section, diagnosed, found.len() > 1);
    }
    (!found.is_empty()).then_some(section)
}

fn add(section: &mut Drawn, diagnosed: &Diagnosed<'_>, several: bool) {
    let mut story = words::words(&diagnosed.answer);
    if several {
        story.headline = format!("{}: {}", diagnosed.stage.id, story.headline);
    }
    section.stories.push(story);
    let figures =
        [overlay::figure(diagnosed), telling::figure(diagnosed), telling::parts(diagnosed), tiles::figure(diagnosed)];
    section.figures.extend(figures.into_iter().flatten());
    let tables =
        [ladder::ladder(&diagnosed.answer), ladder::validation(&diagnosed.answer), modes::modes(&diagnosed.answer)];
    for mut table in tables.into_iter().flatten() {
        if several {
            table.caption = format!("{}: {}", diagnosed.stage.id, table.caption);
        }
        section.tables.push(table);
    }
}
