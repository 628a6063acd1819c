//! Nothing that a file or an argument can hold makes the parser panic, and every problem lies within its text.

use afmid_pipeline::config::Origin;
use afmid_pipeline::graph::load;
use proptest::prelude::*;

use crate::stages;

const SEED: &str = "#:schema x\n[pipeline]\nname = \"test\"\nseed = 7\n\n[[stage]]\nid = \"sine\"\nuses = \"test.sine\"\n\
    params = { samples = 3, start = \"at-peak\", noise = { std_v = 0.5 }, spikes_v = [1.0, 2] }\n\n[[stage]]\nid = \"split\"\n\
    uses = \"test.split\"\ninputs = { signal = \"sine.signal\" }\n\n[[stage]]\nid = \"peaks\"\nuses = \"test.peaks\"\n\
    inputs.signal = \"split.clean\"\n\n[sweep]\nsine.samples = [3, 4]\n\"sine.spikes_v\" = [[], [1.0]]\n";

fn survives(text: &str, arguments: &[String]) -> Result<(), TestCaseError> {
    if let Err(problems) = load("x.toml", text, arguments, &stages::registry()) {
        prop_assert!(!problems.is_empty());
        for problem in problems {
            let whole = match &problem.origin {
                Origin::Config => text,
                Origin::Argument(argument) => argument,
            };
            prop_assert!(whole.get(problem.span.clone()).is_some(), "{problem:?} lies outside {whole:?}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_answered(text in any::<Vec<u8>>()) {
        survives(&String::from_utf8_lossy(&text), &[])?;
    }

    #[test]
    fn any_toml_like_text_is_answered(text in "[\\[\\]{}=\",.#'\\\\ \na-z0-9é-]{0,120}") {
        survives(&text, &[])?;
    }

    #[test]
    fn a_mutated_config_is_answered(cuts in prop::collection::vec((0usize..1000, 0usize..12, "[\\[\\]{}=\",.\\n a-z0-9é]{0,4}"), 1..5)) {
        let mut text: Vec<char> = SEED.chars().collect();
        for (start, length, patch) in cuts {
            let start = start % (text.len() + 1);
            let end = (start + length).min(text.len());
            text.splice(start..end, patch.chars());
        }
        survives(&text.into_iter().collect::<String>(), &[])?;
    }

    #[test]
    fn any_argument_is_answered(argument in prop_oneof![any::<String>(), "(sine|pipeline|x)[.]?(samples|noise|seed|\"é\")?[.=]{0,2}[\\[\\]{}=\",.\\n a-z0-9é]{0,9}"]) {
        survives(SEED, &[argument])?;
    }
}
