//! Figs. 3 and 4: Bode plots of the free and of the surface-coupled lever.

use afmid_pipeline::RunResult;

use crate::report::estimates::{Bode, bode_figure, curves, mode_rules};
use crate::report::figure::{Colour, Figure, Stroke};
use crate::report::origin::{COUPLED, FREE};

/// Fig. 3: the free lever.
pub(crate) fn free(run: &RunResult) -> Option<Figure> {
    let curves = curves(run, FREE, "");
    if curves.is_empty() {
        return None;
    }
    let bode = Bode { rules: mode_rules(run, FREE), ..Bode::new(curves) };
    let caption =
        "Magnitude is one at rest. Bands: 95 % of the estimate's own error. Dotted: resonances of the modal table.";
    Some(bode_figure("figure-3", "Bode plot of the free lever", caption, &bode))
}

/// Fig. 4: the coupled lever, with the free one for comparison.
pub(crate) fn coupled(run: &RunResult) -> Option<Figure> {
    let own = curves(run, COUPLED, COUPLED.words().prefix);
    if own.is_empty() {
        return None;
    }
    let mut all = vec![];
    // the free lever's best curve: parametric if there is one
    let mut free = curves(run, FREE, FREE.words().prefix);
    if let Some(best) = free.iter().position(|curve| curve.series.contains("parametric")).or(free.len().checked_sub(1))
    {
        let mut best = free.swap_remove(best);
        best.stroke = Stroke::solid(Colour::Muted, 1.4);
        all.push(best.plain());
    }
    all.extend(own);
    let caption =
        "Contact shifts the resonances up; the antiresonances belong to lever and detector and stay where they are.";
    Some(bode_figure("figure-4", "Bode plot of the coupled lever", caption, &Bode::new(all)))
}
