//! The section of the page.

use afmid_pipeline::RunResult;

use super::told::{Told, told};
use super::{ladder, modes, overlay, telling, tiles, words};
use crate::report::drawn::Drawn;

/// All diagnoses of a run; none where no stage diagnoses.
pub(crate) fn section(run: &RunResult) -> Option<Drawn> {
    let mut section = Drawn { id: "diagnosis", title: "Diagnosis", ..Drawn::default() };
    let found = told(run);
    for told in &found {
        add(&mut section, told, found.len() > 1);
    }
    (!found.is_empty()).then_some(section)
}

fn add(section: &mut Drawn, told: &Told<'_>, several: bool) {
    let mut story = words::words(&told.answer);
    if several {
        story.headline = format!("{}: {}", told.stage.id, story.headline);
    }
    section.stories.push(story);
    let figures = [overlay::figure(told), telling::figure(told), telling::parts(told), tiles::figure(told)];
    section.figures.extend(figures.into_iter().flatten());
    let tables = [ladder::ladder(&told.answer), ladder::validation(&told.answer), modes::modes(&told.answer)];
    for mut table in tables.into_iter().flatten() {
        if several {
            table.caption = format!("{}: {}", told.stage.id, table.caption);
        }
        section.tables.push(table);
    }
}
