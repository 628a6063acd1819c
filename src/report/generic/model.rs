//! State-space models as facts and a Bode plot.

use afmid_pipeline::StateSpace;

use super::attribute_facts;
use crate::report::estimates::{Bode, BodeCurve, bode_figure, model_curve};
use crate::report::figure::{Colour, Figure, Stroke};
use crate::report::number::{number, quantity};
use crate::report::view::{ArtifactView, Fact};

pub(super) fn model_view(id: &str, model: &StateSpace) -> (ArtifactView, Option<Figure>) {
    let mut facts = vec![
        Fact::new("order", model.order().to_string()),
        Fact::new("inputs, outputs", format!("{}, {}", model.b.columns, model.c.rows)),
        Fact::new("sample time", quantity(model.sample_time_s, f64::NAN, "s")),
        Fact::new("innovation variance", number(model.innovation_variance)),
        Fact::new("free parameters", model.parameters.len().to_string()),
    ];
    facts.extend(attribute_facts(&model.attributes));
    let figure = model_curve(model, None).map(|(frequency_hz, transfer)| {
        let curve =
            BodeCurve::new("first input to first output", &frequency_hz, &transfer, Stroke::solid(Colour::Ink, 1.4));
        Figure { column_px: 1.0, ..bode_figure(id, "Frequency response", "", &Bode::new(vec![curve])) }
    });
    (ArtifactView { facts, ..ArtifactView::default() }, figure)
}
