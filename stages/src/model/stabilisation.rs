//! The stage `model.stabilisation`.

use afmid_pipeline::{Context, Document, Example, Faults, Port, Ports, Spec, Stage, StageError, Table};
use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::era::free_decay;
use super::pem::PAIR;
use crate::artifacts::{DataSet, Pair, PairSeries};
use afmid_kernels::model::ModelError;
use afmid_kernels::pem::Experiment;
use afmid_kernels::stabilisation::{OrderedPole, PhysicalMode, Stabilisation, StabilisationCriteria, stabilisation};
use afmid_kernels::subspace::{Subspace, Weight};

/// Shows which poles stay where they are as the order grows, and names the modes and the order.
///
/// Model: a physical mode has one pole at every order that can hold it; a pole that noise needs moves as the order
/// changes.
/// Method: one Hankel matrix and one singular value decomposition; the poles of every order from it by shift
/// invariance. A pole is stable if the next lower order has one within `frequency` and `damping`. Stable poles of at
/// least `min_quality_factor` are grouped around the frequencies at which most orders agree; a group of enough orders,
/// whose damping agrees, is a mode if it rings: all of them are fitted to the record together, and those with an
/// amplitude below `min_significance` standard errors are dropped, since one record's noise is the same at every order
/// and has poles that stay, too. The proposed order is the least at which all of them are there and stay.
/// Shapes: `poles`: one row per order and pair; `modes`: one row per mode.
/// Units: Hz; damping is 1 / 2Q.
/// Accuracy: on the paper's lever in noise exactly its 3 or 4 modes over 12 seeds (test). Median and spread over orders
/// are no estimate with an error: noise that all orders share is in no spread. Use `model.pem` or `model.ringdown` at
/// the order that this stage proposes.
/// Errors: too few samples for the block rows, values that are missing or not finite.
/// Source: H. Van der Auweraer and B. Peeters, Smart Struct. Syst. 1 (2004) 1; B. Peeters and G. De Roeck, J. Dyn.
/// Syst. Meas. Control 123 (2001) 659.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct StabilisationDiagram {
    /// Where the poles come from: `era` (the free decay), `release` (subspace without instruments), `n4sid`, `moesp` or
    /// `cva` (inputs that excite). Why: as the events here decay freely.
    pub method: PoleMethod,
    /// Lowest order. Why: one mode.
    #[schemars(range(min = 1))]
    pub from_order: usize,
    /// Highest order, above the lowest. Why: noise needs room beyond the lever's 11.
    #[schemars(range(min = 2, max = 100))]
    pub to_order: usize,
    /// From one order to the next.
    #[schemars(range(min = 1, max = 10))]
    pub step: usize,
    /// Which data: `all`, `identification` or `verification`.
    pub set: DataSet,
    /// Rows of the Hankel matrix, more than the highest order. Why: as in `model.era`.
    #[schemars(range(min = 2, max = 1000))]
    pub block_rows: usize,
    /// Least amplitude of a mode's ringing over its standard error. Why: as in `model.modes`.
    #[schemars(range(min = 0.0))]
    pub min_significance: f64,
    /// What counts as stable, and as a mode.
    #[serde(flatten)]
    pub criteria: StabilisationCriteria,
}

/// Where the poles come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PoleMethod {
    /// Eigensystem realization of the free decay.
    Era,
    /// Subspace without instruments.
    Release,
    /// Subspace, oblique projection.
    N4sid,
    /// Subspace, orthogonal projection.
    Moesp,
    /// Subspace, canonical variates.
    Cva,
}

impl Default for StabilisationDiagram {
    fn default() -> Self {
        Self {
            method: PoleMethod::Era,
            from_order: 2,
            to_order: 40,
            step: 1,
            set: DataSet::All,
            block_rows: 300,
            min_significance: 6.0,
            criteria: StabilisationCriteria::default(),
        }
    }
}

pub(super) const POLES: Port<Table> =
    Port::new("poles", "ordered-poles", "poles of every order, and whether they are stable");
pub(super) const MODES: Port<Table> = Port::new("modes", "stable-modes", "physical modes, ascending");
pub(super) const SUMMARY: Port<Document> = Port::new("summary", "summary", "how many modes, and the proposed order");

impl Stage for StabilisationDiagram {
    const HAS_KERNEL_OPTIONS: bool = true;
    const SPEC: Spec = Spec {
        name: "model.stabilisation",
        version: 6,
        summary: "shows which poles stay as the order grows, and names the modes and the order",
        inputs: &[PAIR.spec()],
        outputs: &[POLES.spec(), MODES.spec(), SUMMARY.spec()],
        source: "H. Van der Auweraer and B. Peeters, Smart Struct. Syst. 1 (2004) 1",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        let (from, to, rows) = (self.from_order, self.to_order, self.block_rows);
        faults.require(to.saturating_sub(from) >= self.step, || {
            let next = from.saturating_add(self.step);
            format!("`to_order` is {to}, wanted {next} (the next after `from_order`) or more")
        });
        faults.require(rows > to, || format!("`block_rows` is {rows}, wanted more than `to_order`, {to}"));
    }

    fn run(&self, inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let series = Pair::new(inputs.get(&PAIR)?).series(self.set, 0)?;
        let candidates = self.candidates(&series).map_err(|error| {
            StageError::from_error(error)
                .help("fewer `block_rows`, or a record that goes on longer after the force's last change")
        })?;
        let (experiment, interval_s) = (Experiment { input: &series.input, output: &series.output }, 1.0 / series.rate);
        let found = stabilisation(&candidates, interval_s, &self.criteria)
            .and_then(|found| found.established(experiment, interval_s, self.min_significance))
            .map_err(StageError::from_error)?;
        if found.modes.is_empty() {
            cx.warn("no pole is stable over enough orders and rings: raise `to_order`, or `frequency` and `damping`");
        }
        let summary = Document::new(&json!({
            "modes_seen": found.modes.len(),
            "proposed_order": found.order,
            "orders": { "from": self.from_order, "to": self.to_order, "step": self.step },
            "modes": found.modes.iter().map(mode_document).collect::<Vec<Value>>(),
        }))?;
        let (poles, modes) = (pole_table(&found), mode_table(&found.modes));
        Ok(Ports::new().with(&POLES, poles).with(&MODES, modes).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::stabilisation()
    }
}

impl StabilisationDiagram {
    /// Poles of each order, from one decomposition.
    fn candidates(&self, series: &PairSeries) -> Result<Vec<(usize, Vec<c64>)>, ModelError> {
        let (u, y, rows) = (&series.input, &series.output, self.block_rows);
        let subspace = match self.method {
            PoleMethod::Era => Subspace::of_decay(&free_decay(series, 0.0), rows),
            PoleMethod::Release => Subspace::new(u, y, rows),
            PoleMethod::N4sid => Subspace::with_instruments(u, y, rows, Weight::N4sid),
            PoleMethod::Moesp => Subspace::with_instruments(u, y, rows, Weight::Moesp),
            PoleMethod::Cva => Subspace::with_instruments(u, y, rows, Weight::Cva),
        }?;
        let orders = (self.from_order..=self.to_order).step_by(self.step);
        orders.map(|order| Ok((order, subspace.poles(order)?))).collect()
    }
}

fn mode_document(mode: &PhysicalMode) -> Value {
    json!({
        "frequency_hz": mode.frequency_hz,
        "frequency_spread_hz": mode.frequency_spread_hz,
        "quality_factor": mode.quality_factor(),
        "quality_factor_spread": mode.quality_factor_spread(),
        "orders": mode.count,
        "first_order": mode.first_order,
        "significance": mode.significance,
    })
}

/// Poles by order.
pub(super) fn pole_table(found: &Stabilisation) -> Table {
    let mut table = Table::of(&found.poles)
        .with("order", "1", "order of the model", |p| p.order)
        .with("frequency_hz", "Hz", "magnitude of s over 2 pi", |p| p.frequency_hz)
        .with("damping", "1", "one over twice the quality factor", |p| p.damping)
        .with("quality_factor", "1", "quality factor", OrderedPole::quality_factor)
        .with("frequency_stable", "", "the next lower order has it here", |p| p.frequency_stable)
        .with("damping_stable", "", "and with this damping", |p| p.damping_stable)
        .with("mode", "1", "number of the physical mode; 0: none", |p| p.mode.map_or(0, |mode| mode + 1))
        .table();
    if let Some(order) = found.order {
        table = table.attribute("proposed_order", order);
    }
    table
}

fn mode_table(modes: &[PhysicalMode]) -> Table {
    Table::of(modes)
        .with("frequency_hz", "Hz", "median frequency over the orders", |m| m.frequency_hz)
        .with("frequency_spread_hz", "Hz", "spread between orders", |m| m.frequency_spread_hz)
        .with("quality_factor", "1", "median quality factor", PhysicalMode::quality_factor)
        .with("quality_factor_spread", "1", "spread between orders", PhysicalMode::quality_factor_spread)
        .with("orders", "1", "orders at which it is stable", |m| m.count)
        .with("first_order", "1", "the lowest of them", |m| m.first_order)
        .with("significance", "1", "ringing amplitude over its standard error", |m| m.significance)
        .table()
}
