//! The ladder of models: what each cause bought.

use afmid_stages::diagnosis::{Diagnosis, Rung, Validation};

use super::words::{or_nan, signed};
use crate::report::number::rounded;
use crate::report::view::{Head, TableView};

/// Where bars end: errors further apart than this are shown by their logarithms.
const LINEAR: f64 = 10.0;

/// One row per model, with bars for the errors.
pub(super) fn ladder(answer: &Diagnosis) -> Option<TableView> {
    let rungs = &answer.ladder;
    if rungs.is_empty() {
        return None;
    }
    let errors = || rungs.iter().flat_map(|rung| [rung.rms, rung.held_out_rms]).flatten();
    let scale = Scale::of(errors());
    let heads = vec![
        Head::text("model"),
        Head::number("parameters", ""),
        Head::number("rms residual", ""),
        Head::number("held-out rms", ""),
        Head { about: "against the model above".to_owned(), ..Head::number("log-likelihood gain", "") },
    ];
    let caption = format!("The ladder of models, each with one more cause than the one above. {}", scale.words());
    let mut table = TableView::new(&caption, heads);
    for (step, rung) in rungs.iter().enumerate() {
        let name = if step == 0 { rung.added.clone() } else { format!("+ {}", rung.added) };
        table.rows.push(vec![
            name,
            rung.parameters.to_string(),
            error(rung, rung.rms),
            error(rung, rung.held_out_rms),
            if step == 0 { String::new() } else { signed(rung.log_likelihood_gain) },
        ]);
        table.bars.push(vec![0.0, 0.0, scale.bar(rung.rms), scale.bar(rung.held_out_rms), 0.0]);
    }
    Some(table)
}

fn error(rung: &Rung, value: Option<f64>) -> String {
    rounded(or_nan(value), 4, &rung.unit)
}

/// Parts of the record that took no share in the choice.
pub(super) fn validation(answer: &Diagnosis) -> Option<TableView> {
    let parts = &answer.validation;
    if parts.is_empty() {
        return None;
    }
    let scale = Scale::of(parts.iter().flat_map(|part| [part.rms_before, part.rms_after]).flatten());
    let heads = vec![Head::text("part"), Head::number("linear model", ""), Head::number("extended model", "")];
    let caption = format!("Free-run error (rms) on parts that added no name. {}", scale.words());
    let mut table = TableView::new(&caption, heads);
    for part in parts {
        let error = |value: Option<f64>| rounded(or_nan(value), 4, &part.unit);
        table.rows.push(row(part, error));
        table.bars.push(vec![0.0, scale.bar(part.rms_before), scale.bar(part.rms_after)]);
    }
    Some(table)
}

fn row(part: &Validation, error: impl Fn(Option<f64>) -> String) -> Vec<String> {
    vec![part.name.clone(), error(part.rms_before), error(part.rms_after)]
}

/// How long bars are.
struct Scale {
    largest: f64,
    /// Decades down to the power of ten below the smallest; none on a linear scale.
    decades: Option<f64>,
}

impl Scale {
    fn of(errors: impl Iterator<Item = f64>) -> Self {
        let positive = errors.filter(|value| *value > 0.0 && value.is_finite());
        let (low, high) = positive.fold((f64::INFINITY, 0.0_f64), |(l, h), value| (l.min(value), h.max(value)));
        // half a decade below the smallest: no bar vanishes
        let decades = (high > LINEAR * low).then(|| (high / low).log10() + 0.5);
        Self { largest: high, decades }
    }

    fn words(&self) -> &'static str {
        match self.decades {
            Some(_) => "Bars are logarithmic: equal ratios are equally far apart.",
            None => "Bars begin at zero.",
        }
    }

    /// Length in per cent; 0 for what is unknown.
    fn bar(&self, value: Option<f64>) -> f64 {
        let share = or_nan(value) / self.largest;
        let length = self.decades.map_or(share, |decades| 1.0 + share.log10() / decades);
        if length.is_finite() { (1000.0 * length.clamp(0.0, 1.0)).round() / 10.0 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_they_say() {
        let linear = Scale::of([2.0, 1.0].into_iter());
        assert_eq!((linear.bar(Some(2.0)), linear.bar(Some(1.0)), linear.bar(None)), (100.0, 50.0, 0.0));
        let log = Scale::of([100.0, 1.0, f64::NAN].into_iter());
        assert_eq!((log.bar(Some(100.0)), log.bar(Some(10.0)), log.bar(Some(1.0))), (100.0, 60.0, 20.0));
        assert_eq!(Scale::of(std::iter::empty()).bar(Some(1.0)), 0.0);
    }
}
