use std::path::Path;

use afmid_pipeline::Artifact;
use afmid_pipeline::stage::NoProgress;

use super::*;

#[test]
fn the_example_runs_and_reaches_its_truth() {
    for example in Correlation::examples() {
        let stage: Correlation = afmid_pipeline::toml::from_str(example.params).unwrap();
        stage.check().unwrap();
        let context = Context::new(Path::new("."), 1, &NoProgress);
        let outputs = stage.run(&(example.inputs)().unwrap(), &context).unwrap();
        println!("{}", (example.expect)(&outputs).unwrap());
        assert!(context.into_warnings().is_empty());
        let Some(Artifact::Array(ensemble)) = outputs.artifact("ensemble") else { panic!("no ensemble") };
        ensemble.validate().unwrap();
        let Some(Artifact::Table(table)) = outputs.artifact("events") else { panic!("no table") };
        table.validate().unwrap();
        let Some(Artifact::Document(document)) = outputs.artifact("summary") else { panic!("no summary") };
        assert_eq!(document.0["events"]["found"], 3);
        assert_eq!(document.0["events"]["rejected"][0]["record"], "record_2.h5");
        assert_eq!(document.0["events"]["rejected"][0]["reason"], "no rupture");
    }
}
