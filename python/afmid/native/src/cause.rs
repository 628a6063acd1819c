//! Causes that are written in Python.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use afmid_stages::causes::{
    About, Binary, Cause, Effects, Formula, Identifiable, ModalForce, Need, Operation, Parameter, Part, Passage, Scene,
    Unary,
};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// Where a cause acts, and what Python is asked there.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    /// `trace(values)`: the operations of a force on a mode.
    Force,
    /// `pass(times, signal, values)`: what the sensor shows of the output.
    Output,
    /// The same of what acts of a measured input.
    Input,
}

/// Forces that were traced are kept up to so many.
const MOST_FORMULAS: usize = 4096;

/// A cause whose law is a Python function. The interpreter's lock is held while that runs, and no longer.
pub struct PythonCause {
    about: About,
    place: Place,
    trials: Vec<Vec<f64>>,
    call: Arc<Py<PyAny>>,
    /// By the bits of the values: models with one cause moved have the others' values.
    formulas: Mutex<HashMap<Vec<u64>, Arc<Formula>>>,
    raised: Raised,
}

/// The first exception that the function raised.
type Raised = Arc<Mutex<Option<PyErr>>>;

fn keep(raised: &Raised, error: PyErr) {
    raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
}

fn has_raised(raised: &Raised) -> bool {
    raised.lock().unwrap_or_else(PoisonError::into_inner).is_some()
}

impl Cause for PythonCause {
    fn about(&self) -> &About {
        &self.about
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        match self.place {
            Place::Force => effects.modal_force.push(self.force(values)),
            Place::Output => effects.optics.push(self.passage(values)),
            Place::Input => effects.input.push(self.passage(values)),
        }
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        self.trials.clone()
    }
}

impl PythonCause {
    /// A force that is no number where the function raises: no fit takes it.
    fn force(&self, values: &[f64]) -> ModalForce {
        let formula = self.formula(values);
        ModalForce::law(move |motion, acceleration| {
            if let (Some(a), Some(q), Some(v), Some(w)) =
                (acceleration.first_mut(), motion.position.first(), motion.velocity.first(), motion.omega.first())
            {
                *a += formula.as_ref().map_or(f64::NAN, |formula| w * w * formula.at(*q, v / w));
            }
        })
    }

    fn formula(&self, values: &[f64]) -> Option<Arc<Formula>> {
        let key: Vec<u64> = values.iter().map(|value| value.to_bits()).collect();
        if let Some(known) = self.lock().get(&key) {
            return Some(Arc::clone(known));
        }
        if has_raised(&self.raised) {
            return None;
        }
        let traced = Python::attach(|py| -> PyResult<Formula> {
            formula_of(&self.call.bind(py).call1((values.to_vec(),))?.extract::<Vec<_>>()?)
        });
        match traced {
            Ok(formula) => {
                let formula = Arc::new(formula);
                let mut known = self.lock();
                if known.len() >= MOST_FORMULAS {
                    known.clear();
                }
                known.insert(key, Arc::clone(&formula));
                Some(formula)
            }
            Err(error) => {
                keep(&self.raised, error);
                None
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<Vec<u64>, Arc<Formula>>> {
        self.formulas.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A change of a whole signal, in one call.
    fn passage(&self, values: &[f64]) -> Passage {
        let (call, raised, values) = (Arc::clone(&self.call), Arc::clone(&self.raised), values.to_vec());
        Passage::path(move |times, signal| {
            if has_raised(&raised) {
                return signal.fill(f64::NAN);
            }
            if let Err(error) = Python::attach(|py| passed(py, &call, times, signal, &values)) {
                keep(&raised, error);
                signal.fill(f64::NAN);
            }
        })
    }
}

/// Errors: the function raises, or returns something else than as many numbers.
fn passed(py: Python<'_>, call: &Py<PyAny>, times: &[f64], signal: &mut [f64], values: &[f64]) -> PyResult<()> {
    let (given_times, given) = (PyArray1::from_slice(py, times), PyArray1::from_slice(py, signal));
    let made = call.bind(py).call1((given_times, given, values.to_vec()))?;
    let made = made.cast::<PyArray1<f64>>()?.readonly();
    let made = made.as_array();
    if made.len() != signal.len() {
        let found = format!("the function returned {} values of {} samples", made.len(), signal.len());
        return Err(PyValueError::new_err(found));
    }
    signal.iter_mut().zip(made).for_each(|(to, value)| *to = *value);
    Ok(())
}

/// Errors: an operation of another name, or of another number of operands.
fn operation((name, operands, value): &(String, Vec<usize>, f64)) -> PyResult<Operation> {
    Ok(match (name.as_str(), operands.as_slice()) {
        ("deflection", []) => Operation::Deflection,
        ("rate", []) => Operation::Rate,
        ("number", []) => Operation::Number(*value),
        ("choose", [a, b, c]) => Operation::Choose(*a, *b, *c),
        (name, [a]) => Operation::Unary(unary(name)?, *a),
        (name, [a, b]) => Operation::Binary(binary(name)?, *a, *b),
        (name, _) => return Err(unknown(name)),
    })
}

fn unknown(name: &str) -> PyErr {
    PyValueError::new_err(format!("there is no operation `{name}` of so many numbers"))
}

fn unary(name: &str) -> PyResult<Unary> {
    Ok(match name {
        "negative" => Unary::Negative,
        "absolute" => Unary::Absolute,
        "sign" => Unary::Sign,
        "sqrt" => Unary::Sqrt,
        "cbrt" => Unary::Cbrt,
        "square" => Unary::Square,
        "reciprocal" => Unary::Reciprocal,
        "exp" => Unary::Exp,
        "expm1" => Unary::Expm1,
        "log" => Unary::Log,
        "log1p" => Unary::Log1p,
        "sin" => Unary::Sin,
        "cos" => Unary::Cos,
        "tan" => Unary::Tan,
        "arcsin" => Unary::Arcsin,
        "arccos" => Unary::Arccos,
        "arctan" => Unary::Arctan,
        "sinh" => Unary::Sinh,
        "cosh" => Unary::Cosh,
        "tanh" => Unary::Tanh,
        "floor" => Unary::Floor,
        "ceil" => Unary::Ceil,
        "not" => Unary::Not,
        name => return Err(unknown(name)),
    })
}

fn binary(name: &str) -> PyResult<Binary> {
    Ok(match name {
        "add" => Binary::Add,
        "subtract" => Binary::Subtract,
        "multiply" => Binary::Multiply,
        "divide" => Binary::Divide,
        "power" => Binary::Power,
        "remainder" => Binary::Remainder,
        "maximum" => Binary::Maximum,
        "minimum" => Binary::Minimum,
        "hypot" => Binary::Hypot,
        "arctan2" => Binary::Arctan2,
        "copysign" => Binary::Copysign,
        "heaviside" => Binary::Heaviside,
        "greater" => Binary::Greater,
        "greater_equal" => Binary::GreaterEqual,
        "less" => Binary::Less,
        "less_equal" => Binary::LessEqual,
        "equal" => Binary::Equal,
        "not_equal" => Binary::NotEqual,
        "and" => Binary::And,
        "or" => Binary::Or,
        name => return Err(unknown(name)),
    })
}

/// A cause for [`crate::stage::run_stage`].
#[pyclass(frozen, name = "Cause", module = "afmid._native")]
pub struct OwnCause(pub &'static PythonCause);

#[pymethods]
impl OwnCause {
    /// From what the cause says of itself (texts, `class`, `parameters` as name, unit, meaning, low, high), its trial
    /// values and the function. It lives as long as the program.
    ///
    /// Errors: a part that is missing, a place of another name.
    #[new]
    fn new(about: &Bound<'_, PyDict>, trials: Vec<Vec<f64>>, call: Py<PyAny>) -> PyResult<Self> {
        let item = |name: &str| about.get_item(name)?.ok_or_else(|| PyValueError::new_err(format!("no `{name}`")));
        let text = |name: &str| -> PyResult<&'static str> { Ok(leaked(item(name)?.extract()?)) };
        let (place, part, needs): (_, _, &[Need]) = match item("on")?.extract::<String>()?.as_str() {
            "force" => (Place::Force, Part::Lever, &[Need::Run, Need::Mode]),
            "output" => (Place::Output, Part::Detector, &[Need::Run, Need::OneChannel]),
            "input" => (Place::Input, Part::Input, &[Need::Run, Need::Input]),
            other => return Err(errors::config(format!("`on` is `{other}`, wanted force, output or input"))),
        };
        let parameter = |(name, unit, meaning, low, high): (String, String, String, f64, f64)| Parameter {
            name: leaked(name),
            unit: leaked(unit),
            meaning: leaked(meaning),
            low,
            high,
        };
        let parameters: Vec<(String, String, String, f64, f64)> = item("parameters")?.extract()?;
        let parameters: Vec<Parameter> = parameters.into_iter().map(parameter).collect();
        let class: Vec<String> = item("class")?.extract()?;
        let class: Vec<&'static str> = class.into_iter().map(leaked).collect();
        let about = About {
            id: text("id")?,
            physics: text("physics")?,
            part,
            needs,
            parameters: Box::leak(parameters.into_boxed_slice()),
            class: Box::leak(class.into_boxed_slice()),
            resembles: text("resembles")?,
            next_measurement: text("next_measurement")?,
            identifiable: Identifiable::Shape,
            source: text("source")?,
        };
        let (formulas, raised) = (Mutex::default(), Arc::default());
        let cause = PythonCause { about, place, trials, call: Arc::new(call), formulas, raised };
        Ok(Self(Box::leak(Box::new(cause))))
    }
}

/// The catalogue holds texts of the program.
fn leaked(text: String) -> &'static str {
    Box::leak(text.into_boxed_str())
}

/// What `work` returns with these causes in the catalogue. Errors: an exception of one of their functions; one that does
/// not hold what the catalogue wants; as `work`.
pub fn with_causes<T>(causes: &[&'static PythonCause], work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    for cause in causes.iter().filter(|cause| cause.place == Place::Force) {
        // what raises at its trial values is known before anything is computed
        cause.trials.iter().for_each(|values| drop(cause.formula(values)));
        raised(cause)?;
    }
    let listed = causes.iter().map(|cause| (*cause as &'static dyn Cause, 1)).collect();
    let done = afmid_stages::causes::with(listed, work);
    causes.iter().try_for_each(|cause| raised(cause))?;
    done.map_err(errors::config)?
}

/// Errors: what its function raised.
fn raised(cause: &PythonCause) -> PyResult<()> {
    cause.raised.lock().unwrap_or_else(PoisonError::into_inner).take().map_or(Ok(()), Err)
}

/// A formula over deflections and rates / omega. Errors: an operation that is none.
#[pyfunction]
pub fn computed<'py>(
    py: Python<'py>,
    formula: Vec<(String, Vec<usize>, f64)>,
    deflection: PyReadonlyArray1<'py, f64>,
    rate: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let formula = formula_of(&formula)?;
    let motion = deflection.as_array();
    let values = motion.iter().zip(rate.as_array()).map(|(q, v)| formula.at(*q, *v));
    Ok(PyArray1::from_iter(py, values))
}

fn formula_of(operations: &[(String, Vec<usize>, f64)]) -> PyResult<Formula> {
    let operations = operations.iter().map(operation).collect::<PyResult<Vec<_>>>()?;
    Formula::new(&operations).map_err(errors::config)
}
