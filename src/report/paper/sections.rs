//! All sections of paper figures, in reading order.

use afmid_pipeline::RunResult;

use super::{coupling, force_curve, frequency_response};
use crate::report::drawn::Drawn;
use crate::report::estimates::{checks, modal_tables, pole_zero_figure, stabilisation_figures};
use crate::report::origin::{COUPLED, FREE};

/// The sections of the paper's figures and checks; empty ones say what is missing.
pub(crate) fn sections(run: &RunResult) -> Vec<Drawn> {
    let mut sections = vec![
        Drawn {
            id: "modes",
            title: "Modes",
            tables: modal_tables(run),
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
            figures: [FREE, COUPLED].into_iter().filter_map(|origin| pole_zero_figure(run, origin)).collect(),
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
    let figures = stabilisation_figures(run);
    if !figures.is_empty() {
        sections.push(Drawn { id: "stabilisation", title: "Stabilisation diagram", figures, ..Drawn::default() });
    }
    sections
}
