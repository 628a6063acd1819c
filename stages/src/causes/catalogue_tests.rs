//! One loop over the catalogue instead of boilerplate per cause.

use std::collections::BTreeSet;

use super::*;

#[test]
fn ids_are_unique_and_lower_case_words() {
    let ids: BTreeSet<&str> = CATALOGUE.iter().map(|cause| cause.about().id).collect();
    assert_eq!(ids.len(), CATALOGUE.len());
    for id in ids {
        assert!(id.chars().all(|c| c.is_ascii_lowercase() || c == '-') && find(id).is_some(), "{id}");
    }
}

#[test]
fn what_they_say_of_themselves_holds() {
    for cause in CATALOGUE {
        assert_eq!(catalogue::holds(*cause), Ok(()), "{}", cause.about().id);
    }
}

struct Stranger(About);

impl Cause for Stranger {
    fn about(&self) -> &About {
        &self.0
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.feedthrough += values[0];
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.01]]
    }
}

#[test]
fn causes_of_others_are_checked_before_they_are_added() {
    let good = *find("feedthrough").unwrap().about();
    let of = |about: About| -> &'static dyn Cause { Box::leak(Box::new(Stranger(about))) };
    assert_eq!(add(of(good), 1), Err(CauseError::Double("feedthrough")));
    let refused = |about: About| add(of(about), 1).unwrap_err().to_string();
    assert!(refused(About { id: "Of Mine", class: &["Of Mine"], ..good }).contains("lower-case"));
    assert!(refused(About { id: "of-mine", ..good }).contains("class"));
    let mine = About { id: "of-mine", class: &["of-mine"], ..good };
    assert!(refused(About { physics: " ", ..mine }).contains("sentence"));
    assert!(refused(About { parameters: &[], ..mine }).contains("strength"));
    const NARROW: &[Parameter] = &[Parameter { name: "a", unit: "1", meaning: "a", low: 0.1, high: 0.2 }];
    assert!(refused(About { parameters: NARROW, ..mine }).contains("wanted 0.1 to 0.2"));
}

#[test]
fn causes_of_a_thread_are_gone_afterwards() {
    let of = |id: &'static str, class: &'static [&'static str]| -> &'static dyn Cause {
        Box::leak(Box::new(Stranger(About { id, class, ..*find("feedthrough").unwrap().about() })))
    };
    let here = || find("of-a-thread").is_some();
    let cause = of("of-a-thread", &["of-a-thread"]);
    let elsewhere = || std::thread::scope(|scope| scope.spawn(here).join().unwrap());
    assert_eq!(with(vec![(cause, 1)], || (here(), elsewhere(), added().len())), Ok((true, false, 1)));
    assert!(!here());
    assert_eq!(with(vec![(cause, 1), (cause, 1)], here), Err(CauseError::Double("of-a-thread")));
    let refused = with(vec![(of("Of A Thread", &["Of A Thread"]), 1)], here);
    assert!(refused.unwrap_err().to_string().contains("lower-case"));
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
