//! All sections, in reading order.

use afmid_pipeline::RunResult;

use super::{decays, input_output, oscillation, resonance, responses, shapes, stabilisation, transfer};
use crate::report::drawn::Drawn;
use crate::report::estimates::{checks, modal_tables, pole_zero_figure};
use crate::report::figure::Figure;
use crate::report::origin::Origin;
use crate::report::view::TableView;

/// The sections of what the run holds.
pub(crate) fn sections(run: &RunResult) -> Vec<Drawn> {
    let poles = pole_zero_figure(run, Origin::Measurement).into_iter().collect();
    let all = vec![
        tables("modes", "Modes", modal_tables(run)),
        tables("resonance", "Resonance", resonance::tables(run)),
        tables("oscillation", "Oscillation", oscillation::tables(run)),
        tables("course", "First and last part of the decays", decays::course(run)),
        Drawn { tables: shapes::tables(run), ..figures("shapes", "Mode shapes", shapes::figures(run)) },
        tables("mass", "Shapes at unit modal mass", shapes::normalised(run)),
        figures("responses", "Frequency responses", responses::figures(run)),
        figures("transfer", "Transfer function", transfer::figure(run).into_iter().collect()),
        figures("stabilisation", "Stabilisation diagram", stabilisation::figures(run)),
        figures("decay", "The largest hit", decays::figures(run)),
        figures("input-output", "Measured input and output", input_output::figures(run)),
        figures("roots", "Poles and zeros", poles),
        checks::residuals(run),
        checks::alignment(run),
        checks::drift(run),
        Drawn { id: "spectrum", title: "Spectrum", ..checks::spectra(run) },
        checks::calibration(run),
    ];
    all.into_iter().filter(|section| !section.is_empty()).collect()
}

fn tables(id: &'static str, title: &'static str, tables: Vec<TableView>) -> Drawn {
    Drawn { id, title, tables, ..Drawn::default() }
}

fn figures(id: &'static str, title: &'static str, figures: Vec<Figure>) -> Drawn {
    Drawn { id, title, figures, ..Drawn::default() }
}
