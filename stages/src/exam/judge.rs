//! A verdict held against what was hidden.

use serde::Serialize;
use serde_json::Value;

use super::draw::{Draw, Kind, Planted};

/// What the JSON of a diagnosis says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Said {
    /// `clean`, `named` or `unexplained`; `failed` if there is no verdict.
    pub verdict: String,
    /// Ids of the named causes.
    pub named: Vec<String>,
    /// Probability of so large a sign with nothing wrong, if the diagnosis states one.
    pub p_value: Option<f64>,
}

/// How well one archive was diagnosed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Seed of the draw.
    pub seed: u64,
    /// What was hidden.
    pub kind: Kind,
    /// The hidden causes.
    pub planted: Vec<Planted>,
    /// What was said.
    pub said: Said,
    /// For each hidden cause, whether a member of its class was named.
    pub found: Vec<bool>,
    /// For each hidden cause, the error of its main parameter in its own standard errors, where the same id was named.
    pub sigmas: Vec<Option<f64>>,
    /// Names beyond what was hidden.
    pub invented: Vec<String>,
    /// Sum of the held-out gains of the log likelihood.
    pub gain: Option<f64>,
    /// As it should be: clean, all named and nothing invented, or unexplained.
    pub right: bool,
}

/// Judges the JSON of a diagnosis (`None`: the run failed).
///
/// # Method
/// A hidden cause is found if a named one is of its class, as either of the two declares it; each name serves one
/// hidden cause. A left-out cause asks for `unexplained`. Only the JSON and the draw are looked at.
pub fn judge(draw: &Draw, json: Option<&Value>) -> Judged {
    let nothing = Value::Null;
    let json = json.unwrap_or(&nothing);
    let empty = Vec::new();
    let causes = json["causes"].as_array().unwrap_or(&empty);
    let mut used = vec![false; causes.len()];
    let (mut found, mut sigmas) = (Vec::new(), Vec::new());
    for planted in &draw.planted {
        // its own name before a name of its class
        let exact = (0..causes.len()).find(|&i| !used[i] && id(&causes[i]) == planted.id);
        let any = exact.or_else(|| (0..causes.len()).find(|&i| !used[i] && same_class(planted, &causes[i])));
        if let Some(i) = any {
            used[i] = true;
        }
        found.push(any.is_some());
        sigmas.push(exact.and_then(|i| main_error(planted, &causes[i])));
    }
    let said = Said {
        verdict: json["verdict"].as_str().unwrap_or("failed").to_owned(),
        named: causes.iter().map(|cause| id(cause).to_owned()).collect(),
        p_value: json["p_value"].as_f64(),
    };
    let invented: Vec<String> =
        causes.iter().zip(&used).filter(|(_, used)| !**used).map(|(cause, _)| id(cause).to_owned()).collect();
    let right = match draw.kind {
        Kind::Clean => said.verdict == "clean",
        Kind::One | Kind::Mixture => said.verdict == "named" && found.iter().all(|found| *found) && invented.is_empty(),
        Kind::LeftOut => said.verdict == "unexplained",
    };
    let gains: Vec<f64> = causes.iter().filter_map(|cause| cause["gain"]["log_likelihood"].as_f64()).collect();
    Judged {
        seed: draw.seed,
        kind: draw.kind,
        planted: draw.planted.clone(),
        gain: (!gains.is_empty()).then(|| gains.iter().sum()),
        said,
        found,
        sigmas,
        invented,
        right,
    }
}

fn id(cause: &Value) -> &str {
    cause["id"].as_str().unwrap_or("?")
}

fn same_class(planted: &Planted, cause: &Value) -> bool {
    let declared = cause["class"].as_array().into_iter().flatten().any(|member| member == planted.id.as_str());
    declared || planted.class.iter().any(|member| member == id(cause))
}

/// Error of the main parameter in standard errors.
fn main_error(planted: &Planted, cause: &Value) -> Option<f64> {
    let (name, truth) = planted.parameters.first()?;
    let number = |key: &str| cause["parameters"][name.as_str()][key].as_f64();
    let (value, std) = (number("value")?, number("std")?);
    (std > 0.0).then(|| (value - truth).abs() / std)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::simulate::Afm;
    use serde_json::json;

    pub fn planted(id: &str, class: &[&str], value: f64) -> Planted {
        let class = class.iter().map(|id| (*id).to_owned()).collect();
        Planted { id: id.to_owned(), class, parameters: vec![("x".to_owned(), value)], limit: 0.5 * value }
    }

    pub fn draw_of(kind: Kind, planted: Vec<Planted>) -> Draw {
        let afm = Afm::default();
        Draw { seed: 1, kind, planted, without: Vec::new(), nominal_poles_hz: Vec::new(), afm }
    }

    fn cause(id: &str, value: f64, std: f64) -> Value {
        json!({ "id": id, "class": [id], "parameters": { "x": { "value": value, "std": std, "unit": "1" } },
                "gain": { "log_likelihood": 40.0 } })
    }

    #[test]
    fn a_right_name_counts_with_its_parameter() {
        let draw = draw_of(Kind::One, vec![planted("tail", &["tail", "photo"], 1.0)]);
        let judged = judge(&draw, Some(&json!({ "verdict": "named", "causes": [cause("tail", 1.2, 0.1)] })));
        assert!(judged.right && judged.found == [true] && judged.gain == Some(40.0));
        assert!((judged.sigmas[0].unwrap() - 2.0).abs() < 1e-12);
        // a member of the class is right, but has parameters of its own
        let judged = judge(&draw, Some(&json!({ "verdict": "named", "causes": [cause("photo", 1.2, 0.1)] })));
        assert!(judged.right && judged.sigmas == [None]);
    }

    #[test]
    fn wrong_missing_and_invented_names_are_not_right() {
        let two = vec![planted("a", &["a"], 1.0), planted("b", &["b"], 1.0)];
        let draw = draw_of(Kind::Mixture, two);
        let one = json!({ "verdict": "named", "causes": [cause("a", 1.0, 0.1)] });
        let judged = judge(&draw, Some(&one));
        assert!(!judged.right && judged.found == [true, false]);
        let three =
            json!({ "verdict": "named", "causes": [cause("a", 1.0, 0.1), cause("b", 1.0, 0.1), cause("c", 1.0, 0.1)] });
        let judged = judge(&draw, Some(&three));
        assert!(!judged.right && judged.invented == ["c"]);
        assert!(!judge(&draw, None).right);
        assert_eq!(judge(&draw, None).said.verdict, "failed");
    }

    #[test]
    fn clean_and_left_out_ask_for_their_own_verdicts() {
        let clean = json!({ "verdict": "clean", "causes": [], "p_value": 0.4 });
        let unexplained = json!({ "verdict": "unexplained", "causes": [] });
        assert!(judge(&draw_of(Kind::Clean, Vec::new()), Some(&clean)).right);
        assert!(!judge(&draw_of(Kind::Clean, Vec::new()), Some(&unexplained)).right);
        let left_out = draw_of(Kind::LeftOut, vec![planted("a", &["a"], 1.0)]);
        assert!(judge(&left_out, Some(&unexplained)).right);
        assert!(!judge(&left_out, Some(&clean)).right);
        assert!(!judge(&left_out, Some(&json!({ "verdict": "named", "causes": [cause("c", 1.0, 0.1)] }))).right);
    }
}
