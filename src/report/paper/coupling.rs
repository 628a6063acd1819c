//! The coupled lever against the free one in numbers: zeros that stay, resonances that move.

use afmid_pipeline::{RunResult, Table};

use crate::report::find::{Found, all};
use crate::report::number::{UNKNOWN, quantity};
use crate::report::view::{Head, TableView};

/// Tables of zeros side by side, and of resonances before and after contact.
pub(crate) fn tables(run: &RunResult) -> Vec<TableView> {
    all::<Table>(run).filter_map(|found| side_by_side(&found)).collect()
}

fn side_by_side(found: &Found<'_, Table>) -> Option<TableView> {
    let column = |name: &str| found.value.real(name).ok();
    let (free, free_std) = (column("free_hz")?, column("free_std_hz")?);
    let (coupled, coupled_std) = (column("coupled_hz")?, column("coupled_std_hz")?);
    let pairs = free.iter().zip(free_std).zip(coupled.iter().zip(coupled_std));
    let table = match (column("combined_errors"), column("shift_hz"), column("shift_std_hz")) {
        (Some(errors), _, _) => {
            let heads = ["free lever", "coupled lever", "difference", "in combined standard errors"];
            let mut table = TableView::new(
                "Zeros: they belong to lever and detector",
                heads.map(|name| Head::number(name, "")).to_vec(),
            );
            table.rows = pairs
                .zip(errors)
                .map(|(((f, f_std), (c, c_std)), errors)| {
                    let difference = if c.is_finite() {
                        format!("{:+.2} %", 100.0 * (c / f - 1.0)).replace('-', "−")
                    } else {
                        UNKNOWN.to_owned()
                    };
                    let errors = if errors.is_finite() {
                        format!("{errors:+.1}").replace('-', "−")
                    } else {
                        UNKNOWN.to_owned()
                    };
                    vec![quantity(*f, *f_std, "Hz"), quantity(*c, *c_std, "Hz"), difference, errors]
                })
                .collect();
            table
        }
        (None, Some(shift), Some(shift_std)) => {
            let heads = ["free lever", "coupled lever", "shift"];
            let mut table =
                TableView::new("Resonances: contact moves them", heads.map(|name| Head::number(name, "")).to_vec());
            table.rows = pairs
                .zip(shift.iter().zip(shift_std))
                .map(|(((f, f_std), (c, c_std)), (shift, std))| {
                    vec![quantity(*f, *f_std, "Hz"), quantity(*c, *c_std, "Hz"), quantity(*shift, *std, "Hz")]
                })
                .collect();
            table
        }
        _ => return None,
    };
    Some(table)
}
