//! All sections of paper figures, in reading order.

use afmid_pipeline::RunResult;

use super::{checks, coupling, force_curve, frequency_response, modal_table, pole_zero, stabilisation};
use crate::report::figure::Figure;
use crate::report::view::{Fact, StoryView, TableView};

/// A section before its figures are drawn.
#[derive(Debug, Clone, Default)]
pub(crate) struct Drawn {
    pub id: &'static str,
    pub title: &'static str,
    /// What it says in words, above everything else.
    pub stories: Vec<StoryView>,
    pub figures: Vec<Figure>,
    pub tables: Vec<TableView>,
    /// Numbers under a name.
    pub groups: Vec<(String, Vec<Fact>)>,
    /// What the run lacks, if the section is empty.
    pub missing: &'static str,
}

impl Drawn {
    /// Whether there is anything to show.
    pub fn is_empty(&self) -> bool {
        self.stories.is_empty() && self.figures.is_empty() && self.tables.is_empty() && self.groups.is_empty()
    }
}

/// The sections of the paper's figures and checks; empty ones say what is missing.
pub(crate) fn sections(run: &RunResult) -> Vec<Drawn> {
    let mut sections = vec![
        Drawn {
            id: "modes",
            title: "Modes",
            tables: modal_table::tables(run),
            missing: "no stage lists modes",
            ..Drawn::default()
        },
        Drawn {
            id: "fig-2",
            title: "Fig. 2 · The events",
            figures: force_curve::figure(run).into_iter().collect(),
            missing: "no stage extracts events",
            ..Drawn::default()
        },
        Drawn {
            id: "fig-3",
            title: "Fig. 3 · Transfer function of the free lever",
            figures: frequency_response::free(run).into_iter().collect(),
            missing: "no frequency response of a snap-off",
            ..Drawn::default()
        },
        Drawn {
            id: "fig-4",
            title: "Fig. 4 · The surface-coupled lever",
            figures: frequency_response::coupled(run).into_iter().collect(),
            tables: coupling::tables(run),
            missing: "no frequency response of a snap to contact",
            ..Drawn::default()
        },
        Drawn {
            id: "fig-5",
            title: "Fig. 5 · Poles and zeros",
            figures: pole_zero::figures(run),
            missing: "no stage lists poles and zeros",
            ..Drawn::default()
        },
        checks::residuals(run),
        checks::alignment(run),
        checks::drift(run),
        checks::spectra(run),
        checks::calibration(run),
    ];
    // the paper has none: a run without one lacks nothing
    let figures = stabilisation::figures(run);
    if !figures.is_empty() {
        sections.push(Drawn { id: "stabilisation", title: "Stabilisation diagram", figures, ..Drawn::default() });
    }
    sections
}
