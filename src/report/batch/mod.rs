//! The page of a batch: trends, outliers, failures, and links to the data sets' own results.

mod sets;
mod trends;

use afmid_pipeline::{RunResult, StageRecord};

use crate::batch::summary::BATCH;
use crate::report::drawn::Drawn;

/// Where the result of a data set lies, as seen from the page; empty: not known.
pub(crate) type Link<'a> = dyn Fn(&str) -> String + 'a;

/// The sections of a batch's summary; none of any other run.
pub(crate) fn sections(run: &RunResult, link: &Link<'_>) -> Vec<Drawn> {
    let summary = |stage: &&StageRecord| stage.uses == BATCH;
    let Some(stage) = run.stages.iter().find(summary) else { return Vec::new() };
    vec![
        Drawn {
            id: "failures",
            title: "Failures",
            tables: sets::failures(stage, link).into_iter().collect(),
            missing: "no data set failed",
            ..Drawn::default()
        },
        Drawn {
            id: "trends",
            title: "Trends",
            figures: trends::figures(stage),
            tables: trends::table(stage).into_iter().collect(),
            missing: "no data set says when it was recorded, or none has a value with an error",
            ..Drawn::default()
        },
        Drawn {
            id: "outliers",
            title: "Outliers",
            tables: trends::outliers(stage, link).into_iter().collect(),
            missing: "no value lies far off its line",
            ..Drawn::default()
        },
        Drawn {
            id: "sets",
            title: "Data sets",
            tables: sets::all(stage, link).into_iter().collect(),
            missing: "there are none",
            ..Drawn::default()
        },
    ]
}

/// A table of the summary by its port.
fn table_of<'a>(stage: &'a StageRecord, port: &str) -> Option<&'a afmid_pipeline::Table> {
    stage.result.outputs.artifact(port).and_then(afmid_pipeline::Shaped::peek)
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::RunInfo;

    use super::*;
    use crate::batch::harvest::{Harvest, ModeFound};
    use crate::batch::ledger::Entry;
    use crate::batch::summary::{Title, summary};
    use crate::report::report;
    use crate::report::tests::assert_page;

    fn entry(year: i32, frequency_hz: f64) -> Entry {
        let mode = ModeFound {
            frequency_hz: Some(frequency_hz),
            frequency_std_hz: Some(0.5),
            quality_factor: Some(40.0 + f64::from(year % 3)),
            quality_factor_std: Some(0.2),
            ..ModeFound::default()
        };
        let started_at = Some(format!("{year}-03-01T10:00:00Z"));
        Entry::done(
            &format!("set {year} & <more>"),
            "k".into(),
            Harvest { started_at, modes: vec![mode], ..Harvest::default() },
        )
    }

    fn run(entries: &[Entry]) -> RunResult {
        let title = Title { name: "years", seed: 1, config: "[pipeline]\n", program: "afmid" };
        RunResult { info: RunInfo::default(), ..summary(&title, entries) }
    }

    #[test]
    fn trends_outliers_failures_and_links_are_on_one_page() {
        let mut entries: Vec<Entry> = (2001..2021).map(|year| entry(year, 46_000.0 + f64::from(year - 2001))).collect();
        entries.push(entry(2021, 46_120.0));
        entries.push(Entry::failed("bad", None, "error: records: a/x.h5: cut short <here>".into()));
        let page = report(&run(&entries), &|name| format!("there/{}.h5", name.len()), None).expect("a page");
        assert_page(&page);
        for word in
            ["trend-frequency-1", "trend-quality-factor-1", "cut short &lt;here&gt;", "href=\"there&#x2f;3.h5\""]
        {
            assert!(page.contains(word), "{word}");
        }
        let outliers =
            page.split("id=\"outliers\"").nth(1).expect("outliers").split("</section>").next().expect("its end");
        assert!(outliers.contains("set 2021") && !outliers.contains("set 2005"), "{outliers}");
    }

    #[test]
    fn a_batch_without_times_says_what_is_missing() {
        let page = report(&run(&[Entry::failed("a", None, "no".into())]), &|_| String::new(), None).expect("a page");
        assert_page(&page);
        assert!(page.contains("no data set says when it was recorded") && !page.contains("<a href=\"\""));
    }
}
