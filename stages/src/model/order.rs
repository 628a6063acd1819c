//! The order of a model: given, or found from the data.

use afmid_kernels::pem::Identified;
use afmid_kernels::validation::{Nuisances, OrderChoice, simulate_held_out};
use serde_json::{Value, json};

use super::count::Count;

/// The order of a model: a number, or `"auto"`.
pub type Order = Count<40>;

/// A choice for a stage's summary; unknown numbers are null.
pub(super) fn choice_document(choice: &OrderChoice) -> Value {
    json!({
        "chosen": choice.order,
        "singular_value_gap": choice.gap,
        "candidates": choice.candidates.iter().map(|c| json!({
            "order": c.order, "bic": c.bic, "held_out_percent": c.held_out_percent,
        })).collect::<Vec<Value>>(),
    })
}

/// FIT % of a fit's simulation of the data that it is from; `None` where there is none.
pub(super) fn simulated_percent(fit: &Identified, input: &[f64], output: &[f64], nuisances: Nuisances) -> Option<f64> {
    let simulation = simulate_held_out(&fit.model, &fit.further_inputs, input, output, nuisances);
    simulation.ok().map(|simulation| simulation.fit_percent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_numbers_or_auto() {
        let read = |text: &str| serde_json::from_str::<Order>(text);
        assert_eq!((read("7").unwrap(), read("\"auto\"").unwrap()), (Order::Fixed(7), Order::Auto));
        assert!(read("\"best\"").unwrap_err().to_string().contains("a whole number, or \"auto\""));
        assert_eq!(serde_json::to_string(&Order::Auto).unwrap(), "\"auto\"");
        let refused = |order: Order, max_order: usize| {
            afmid_pipeline::stage::check(&super::super::Pem { order, max_order, ..super::super::Pem::default() })
                .is_err()
        };
        assert!(refused(Order::Fixed(41), 20) && refused(Order::Auto, 0) && !refused(Order::Auto, 40));
    }
}
