//! One loop over the catalogue instead of boilerplate per cause.

use std::collections::BTreeSet;

use super::*;

fn scene() -> Scene {
    Scene {
        places: Vec::new(),
        frequency_hz: vec![46.3e3, 247.4e3, 580.8e3, 1051.2e3],
        quality_factor: vec![40.8, 193.2, 358.0, 503.8],
        interval_s: 2e-7,
        window_s: 1.4e-3,
        level_v: 0.87,
        input_level: 0.5,
        noise_v: 3.5e-4,
        residual_peaks_hz: vec![133e3, 92.6e3],
    }
}

#[test]
fn ids_are_unique_and_lower_case_words() {
    let ids: BTreeSet<&str> = CATALOGUE.iter().map(|cause| cause.about().id).collect();
    assert_eq!(ids.len(), CATALOGUE.len());
    for id in ids {
        assert!(id.chars().all(|c| c.is_ascii_lowercase() || c == '-') && find(id).is_some(), "{id}");
    }
}

#[test]
fn everything_is_said() {
    for about in CATALOGUE.iter().map(|cause| cause.about()) {
        for text in [about.physics, about.resembles, about.next_measurement, about.source] {
            assert!(!text.trim().is_empty(), "{}", about.id);
        }
        assert!(about.class.contains(&about.id), "{} is not of its own class", about.id);
        for p in about.parameters {
            assert!(p.low.is_finite() && p.high.is_finite() && p.low < p.high, "{}.{}", about.id, p.name);
            assert!(!p.unit.is_empty() && !p.meaning.is_empty(), "{}.{}", about.id, p.name);
        }
        let no = matches!(about.identifiable, Identifiable::No(_));
        assert!(no || !about.parameters.is_empty(), "{} has no strength", about.id);
    }
}

#[test]
fn trials_lie_within_the_limits_and_add_up() {
    for cause in CATALOGUE {
        let about = cause.about();
        for values in cause.trials(&scene()) {
            assert_eq!(values.len(), about.parameters.len(), "{}", about.id);
            assert_eq!(within_limits(about, &values), Ok(()), "{} {values:?}", about.id);
            let mut effects = Effects::default();
            cause.add(&values, &mut effects);
            let nothing = format!("{:?}", Effects::default());
            assert_ne!(format!("{effects:?}"), nothing, "{} {values:?} adds nothing", about.id);
        }
    }
}

#[test]
fn pages_name_every_parameter() {
    for cause in CATALOGUE {
        let text = page(*cause);
        assert!(cause.about().parameters.iter().all(|p| text.contains(p.name)), "{text}");
        assert!(index(CATALOGUE).contains(cause.about().id));
        assert_eq!(as_json(*cause)["id"], cause.about().id);
    }
}
