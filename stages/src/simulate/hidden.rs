//! The parameter `hidden`: causes by name, with values by name.

use std::collections::BTreeMap;

use afmid_pipeline::StageError;
use afmid_pipeline::config::nearest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::causes::{About, Cause, catalogue, find, releases_have, within_limits};
use afmid_kernels::effects::Effects;

/// One value of a hidden cause.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Setting {
    /// A parameter's value.
    Number(f64),
    /// The cause's id.
    Text(String),
}

/// A cause to hide: `cause` is its id, the rest are its parameters (`afmid causes ID`), all of them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Hidden(pub BTreeMap<String, Setting>);

const CAUSE: &str = "cause";

impl Hidden {
    /// A cause with its values, in the order of its parameters.
    pub fn new(about: &About, values: &[f64]) -> Self {
        let mut settings = BTreeMap::from([(CAUSE.to_owned(), Setting::Text(about.id.to_owned()))]);
        let named = about.parameters.iter().zip(values);
        settings.extend(named.map(|(parameter, value)| (parameter.name.to_owned(), Setting::Number(*value))));
        Self(settings)
    }

    /// The cause and its values in the order of its parameters.
    ///
    /// # Errors
    /// No cause, an unknown one, one of another kind of data; a parameter that is unknown, missing, no number or out of
    /// its limits.
    pub fn resolve(&self) -> Result<(&'static dyn Cause, Vec<f64>), StageError> {
        let id = match self.0.get(CAUSE) {
            Some(Setting::Text(id)) => id,
            Some(Setting::Number(number)) => {
                return Err(StageError::new(format!("`hidden`: `cause` is {number}, wanted the id of a cause")));
            }
            None => {
                let example = "hidden = [{ cause = \"quadratic-detector\", a2 = 0.012 }]";
                return Err(StageError::new("`hidden`: an entry names no `cause`").help(format!("as in `{example}`")));
            }
        };
        let Some(cause) = find(id) else {
            let help = nearest(id, catalogue().iter().map(|cause| cause.about().id))
                .map_or("`afmid causes` lists all".to_owned(), |nearest| format!("did you mean `{nearest}`?"));
            return Err(StageError::new(format!("`hidden`: there is no cause named `{id}`")).help(help));
        };
        let about = cause.about();
        if !about.is_met(releases_have) {
            let message = format!("`hidden`: `{id}` acts on a measured input, which force curves do not have");
            return Err(StageError::new(message).help("`afmid causes` says what each cause needs"));
        }
        let values = self.values(about)?;
        within_limits(about, &values).map_err(|(name, found, low, high)| {
            StageError::new(format!("`hidden`: `{name}` of `{id}` is {found}, wanted {low} to {high}"))
        })?;
        let mut effects = Effects::default();
        cause.add(&values, &mut effects);
        if effects.have_paths() {
            let message =
                format!("`hidden`: `{id}` remembers what came before, which force curves are simulated without");
            return Err(StageError::new(message).help("hide it in runs of a system of your own"));
        }
        Ok((cause, values))
    }

    fn values(&self, about: &About) -> Result<Vec<f64>, StageError> {
        let id = about.id;
        let names = || about.parameters.iter().map(|parameter| parameter.name);
        for name in self.0.keys().filter(|name| *name != CAUSE) {
            if !names().any(|known| known == name) {
                let help = nearest(name, names()).map_or_else(
                    || format!("it has {}", names().collect::<Vec<_>>().join(", ")),
                    |nearest| format!("did you mean `{nearest}`?"),
                );
                return Err(StageError::new(format!("`hidden`: `{id}` has no parameter `{name}`")).help(help));
            }
        }
        let value = |parameter: &crate::causes::Parameter| match self.0.get(parameter.name) {
            Some(Setting::Number(value)) => Ok(*value),
            Some(Setting::Text(text)) => Err(StageError::new(format!(
                "`hidden`: `{}` of `{id}` is \"{text}\", wanted a number in {}",
                parameter.name, parameter.unit
            ))),
            None => Err(StageError::new(format!(
                "`hidden`: `{id}` lacks `{}` ({}, {} to {} {})",
                parameter.name, parameter.meaning, parameter.low, parameter.high, parameter.unit
            ))),
        };
        about.parameters.iter().map(value).collect()
    }
}

/// What all entries add to a simulation.
pub fn effects(hidden: &[Hidden]) -> Result<Effects, StageError> {
    let mut effects = Effects::default();
    for entry in hidden {
        let (cause, values) = entry.resolve()?;
        cause.add(&values, &mut effects);
    }
    Ok(effects)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(toml: &str) -> (String, String) {
        #[derive(Deserialize)]
        struct Table {
            hidden: Vec<Hidden>,
        }
        let table: Table = afmid_pipeline::toml::from_str(toml).unwrap();
        let error = effects(&table.hidden).unwrap_err();
        (error.to_string(), error.help.unwrap_or_default())
    }

    #[test]
    fn a_wrong_entry_is_refused_with_what_to_change() {
        let (message, help) = refused("hidden = [{ cause = 'quadratic-detektor', a2 = 0.01 }]");
        assert!(message.contains("no cause named `quadratic-detektor`"), "{message}");
        assert_eq!(help, "did you mean `quadratic-detector`?");
        let (message, help) = refused("hidden = [{ cause = 'quadratic-detector', a3 = 0.01 }]");
        assert!(message.contains("no parameter `a3`"), "{message}");
        assert!(help.contains("a2"), "{help}");
        let (message, _) = refused("hidden = [{ cause = 'quadratic-detector', a2 = 3 }]");
        assert!(message.contains("`a2` of `quadratic-detector` is 3, wanted -0.5 to 0.5"), "{message}");
        let (message, _) = refused("hidden = [{ cause = 'tether-tail', fraction = 0.1 }]");
        assert!(message.contains("lacks `tau_s`"), "{message}");
        let (message, _) = refused("hidden = [{ cause = 'tether-tail', fraction = 0.1, tau_s = 'long' }]");
        assert!(message.contains("wanted a number in s"), "{message}");
        let (message, _) = refused("hidden = [{ a2 = 0.01 }]");
        assert!(message.contains("names no `cause`"), "{message}");
    }

    #[test]
    fn entries_add_up() {
        let entry = |id: &str, values: &[f64]| Hidden::new(find(id).unwrap().about(), values);
        let both = effects(&[entry("quadratic-detector", &[0.1]), entry("tether-tail", &[0.05, 1e-4])]).unwrap();
        assert!((both.seen(2.0) - 2.4).abs() < 1e-15);
        assert!((both.load(0.0) - 0.05).abs() < 1e-15);
    }
}
