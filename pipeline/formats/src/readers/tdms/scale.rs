//! `NI_Scale` properties: from stored codes to values.
//!
//! Scales are numbered; the last one gives the value. Each names its input: another scale, a DAQmx scaler (a number
//! without a scale type) or the stored value.

use super::property::Properties;

/// The input that stands for the stored value.
const STORED: u32 = u32::MAX;

/// How a channel's values come from its codes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scaling {
    /// Polynomials, ascending powers, in the order in which they are applied.
    pub(super) steps: Vec<Vec<f64>>,
    /// The DAQmx scaler whose values go in.
    pub(super) scaler: Option<u32>,
}

impl Scaling {
    /// Factor and offset if the whole is a straight line.
    pub(super) fn line(&self) -> Option<(f64, f64)> {
        let (mut factor, mut offset) = (1.0, 0.0);
        for (number, step) in self.steps.iter().enumerate() {
            if step.len() > 2 {
                return None;
            }
            let (c0, c1) = (step.first().copied().unwrap_or(0.0), step.get(1).copied().unwrap_or(0.0));
            // The first step exactly as it stands: nothing is rounded for the one scale most files have.
            (factor, offset) = if number == 0 { (c1, c0) } else { (c1 * factor, c1 * offset + c0) };
        }
        Some((factor, offset))
    }

    /// The value of a code.
    pub(super) fn value(&self, code: f64) -> f64 {
        self.steps.iter().fold(code, |x, step| step.iter().rev().fold(0.0, |sum, c| sum * x + c))
    }
}

/// The scaling of a channel: its own properties', else its group's, else the file's. Errors: a reason, naming the scale
/// type.
pub(super) fn scaling(owners: [Option<&Properties>; 3]) -> Result<Scaling, String> {
    let identity = Scaling { steps: Vec::new(), scaler: None };
    let scaled = owners.into_iter().flatten().find_map(|p| Some((p, count(p)?)));
    let Some((properties, count)) = scaled else { return Ok(identity) };
    let mut steps = Vec::new();
    let mut input = count - 1;
    // Each scale at most once: a chain that comes back to itself has no end.
    for _ in 0..count {
        let Some(kind) = properties.text(&format!("NI_Scale[{input}]_Scale_Type")) else {
            steps.reverse();
            return Ok(Scaling { steps, scaler: Some(input) });
        };
        let next = properties.number(&format!("NI_Scale[{input}]_{kind}_Input_Source")).map_or(STORED, |n| n as u32);
        steps.push(step(properties, input, kind)?);
        if next == STORED {
            steps.reverse();
            return Ok(Scaling { steps, scaler: None });
        }
        input = next;
    }
    Err("its NI_Scale chain has no end".to_owned())
}

fn step(properties: &Properties, scale: u32, kind: &str) -> Result<Vec<f64>, String> {
    let number = |name: &str| {
        let name = format!("NI_Scale[{scale}]_{kind}_{name}");
        properties.number(&name).ok_or_else(|| format!("its scale {scale} ({kind}) lacks the property {name}"))
    };
    match kind {
        "Linear" => Ok(vec![number("Y_Intercept")?, number("Slope")?]),
        "Polynomial" => {
            // Without a size there are four, as LabVIEW's first version had it.
            let size = number("Coefficients_Size").unwrap_or(4.0) as u32;
            // Ends at the first that is missing, so a wrong size costs nothing.
            (0..size).map(|power| number(&format!("Coefficients[{power}]"))).collect()
        }
        other => Err(format!(
            "its scale {scale} is of type {other}; Linear and Polynomial scales can be applied: export it scaled from \
             LabVIEW"
        )),
    }
}

/// Number of scales; none if the values are stored scaled or there are none.
fn count(properties: &Properties) -> Option<u32> {
    let stated = properties.number("NI_Number_Of_Scales").map(|n| n as u32);
    let numbered = || properties.names().filter_map(scale_number).max().and_then(|n| n.checked_add(1));
    let already = properties.text("NI_Scaling_Status") == Some("scaled");
    stated.or_else(numbered).filter(|&count| count > 0 && !already)
}

fn scale_number(name: &str) -> Option<u32> {
    name.strip_prefix("NI_Scale[")?.strip_suffix("]_Scale_Type")?.parse().ok()
}
