//! What an exam adds up to.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::Serialize;

use super::draw::{Kind, Planted};
use super::judge::Judged;
use super::statistics::uniformity;
use afmid_kernels::statistics::clopper_pearson;

/// So many of so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Share {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
}

/// Results of an exam.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// Archives.
    pub archives: usize,
    /// Runs without a verdict.
    pub failed: usize,
    /// What was hidden (ids joined by `+`; a left-out one as `ID (left out)`) against what was said, and how often.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Single causes found, by strength over the limit: 1 to 2, 2 to 4, 4 to 10, 10 and more.
    pub by_strength: Vec<(String, Share)>,
    /// Single causes at twice the limit or above that were found.
    pub named: Share,
    /// The same by id.
    pub named_by_id: BTreeMap<String, Share>,
    /// Limits: the lowest and the highest drawn for an id.
    pub limits: BTreeMap<String, (f64, f64)>,
    /// Main parameters within 3 of their own standard errors, at twice the limit or above.
    pub parameters: Share,
    /// Mixtures with every cause at twice the limit or above that were fully named.
    pub mixtures: Share,
    /// Left-out causes that were unexplained.
    pub left_out: Share,
    /// Clean archives that were not called clean.
    pub false_alarms: Share,
    /// Its 95 % Clopper-Pearson interval; null without clean archives.
    pub false_alarm_interval: Option<(f64, f64)>,
    /// Distance of the clean archives' p-values from uniform, and the probability of a larger one; null where the
    /// diagnosis states none.
    pub null_p_values: Option<(f64, f64)>,
    /// Archives with names beyond what was hidden.
    pub invented: Share,
    /// Median of the held-out gains of the log likelihood of right answers; null without any.
    pub median_gain: Option<f64>,
    /// Each archive.
    pub judged: Vec<Judged>,
}

/// Named causes are asked for from this many limits on.
const ASKED: f64 = 2.0;
const BINS: [(f64, f64, &str); 4] =
    [(0.0, 2.0, "1 to 2"), (2.0, 4.0, "2 to 4"), (4.0, 10.0, "4 to 10"), (10.0, f64::INFINITY, "10 to 30")];

impl Score {
    /// Adds up.
    pub fn new(judged: Vec<Judged>) -> Self {
        let of = |kind: Kind| judged.iter().filter(move |one| one.kind == kind);
        let strength = |one: &Judged| one.planted.iter().map(Planted::times_limit).fold(f64::INFINITY, f64::min);
        let single = |low: f64, high: f64| {
            share(of(Kind::One).filter(|one| (low..high).contains(&strength(one))).map(|one| one.found == [true]))
        };
        let mut named_by_id: BTreeMap<String, Share> = BTreeMap::new();
        let mut limits: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for one in &judged {
            for planted in &one.planted {
                let range = limits.entry(planted.id.clone()).or_insert((planted.limit, planted.limit));
                *range = (range.0.min(planted.limit), range.1.max(planted.limit));
            }
            if one.kind == Kind::One && strength(one) >= ASKED {
                let entry = named_by_id.entry(one.planted[0].id.clone()).or_default();
                entry.of += 1;
                entry.hits += usize::from(one.found == [true]);
            }
            *confusion.entry(hidden(one)).or_default().entry(said(one)).or_default() += 1;
        }
        let asked = |one: &&Judged| matches!(one.kind, Kind::One | Kind::Mixture);
        let errors = judged.iter().filter(asked).flat_map(|one| one.planted.iter().zip(&one.sigmas));
        let errors = errors.filter(|(planted, _)| planted.times_limit() >= ASKED).filter_map(|(_, sigmas)| *sigmas);
        let false_alarms = share(of(Kind::Clean).map(|one| !one.right));
        let interval = clopper_pearson(false_alarms.hits, false_alarms.of, 0.95);
        let null: Vec<f64> = of(Kind::Clean).filter_map(|one| one.said.p_value).collect();
        let mut gains: Vec<f64> = judged.iter().filter(|one| one.right).filter_map(|one| one.gain).collect();
        gains.sort_by(f64::total_cmp);
        Self {
            archives: judged.len(),
            failed: judged.iter().filter(|one| one.said.verdict == "failed").count(),
            by_strength: BINS.iter().map(|(low, high, name)| ((*name).to_owned(), single(*low, *high))).collect(),
            named: single(ASKED, f64::INFINITY),
            parameters: share(errors.map(|sigmas| sigmas <= 3.0)),
            mixtures: share(of(Kind::Mixture).filter(|one| strength(one) >= ASKED).map(|one| one.right)),
            left_out: share(of(Kind::LeftOut).map(|one| one.right)),
            false_alarm_interval: (false_alarms.of > 0).then_some(interval),
            false_alarms,
            null_p_values: uniformity(&null),
            invented: share(judged.iter().map(|one| !one.invented.is_empty())),
            median_gain: gains.get(gains.len() / 2).copied(),
            named_by_id,
            limits,
            confusion,
            judged,
        }
    }

    /// As text for a terminal.
    pub fn text(&self) -> String {
        let mut text = format!("{} archives, {} without a verdict\n\nhidden -> said\n", self.archives, self.failed);
        for (hidden, answers) in &self.confusion {
            let answers: Vec<String> = answers.iter().map(|(said, count)| format!("{said} {count}")).collect();
            line(&mut text, hidden, &answers.join(", "));
        }
        text.push_str("\nsingle causes found, by strength over the limit\n");
        for (name, share) in &self.by_strength {
            line(&mut text, name, &percent(*share));
        }
        text.push_str("\nat twice the limit or above, and the limits drawn (first parameter)\n");
        for (id, (low, high)) in &self.limits {
            let share = self.named_by_id.get(id).map_or("-".to_owned(), |share| percent(*share));
            line(&mut text, id, &format!("{share:20}  limit {low:.2e} to {high:.2e}"));
        }
        text.push('\n');
        line(&mut text, "right class, 2 x limit", &percent(self.named));
        line(&mut text, "parameter within 3 sigma", &percent(self.parameters));
        line(&mut text, "mixtures fully named", &percent(self.mixtures));
        line(&mut text, "left out: unexplained", &percent(self.left_out));
        line(&mut text, "invented causes", &percent(self.invented));
        let interval = self.false_alarm_interval.map_or(String::new(), |(low, high)| {
            format!(", 95 % interval {:.2} to {:.2} %", 100.0 * low, 100.0 * high)
        });
        line(&mut text, "false alarms", &format!("{}{interval}", percent(self.false_alarms)));
        let uniform = self.null_p_values.map_or("not stated by the diagnosis".to_owned(), |(distance, p)| {
            format!("distance {distance:.3} from uniform, p = {p:.3}")
        });
        line(&mut text, "null p-values", &uniform);
        let gain = self.median_gain.map_or("-".to_owned(), |gain| format!("{gain:.1}"));
        line(&mut text, "median held-out gain", &gain);
        text
    }
}

fn line(text: &mut String, name: &str, value: &str) {
    // writing to a string cannot fail
    let _ = writeln!(text, "  {name:34}  {value}");
}

fn percent(share: Share) -> String {
    match share.of {
        0 => "-".to_owned(),
        of => format!("{}/{of} ({:.1} %)", share.hits, 100.0 * share.hits as f64 / of as f64),
    }
}

fn share(hits: impl Iterator<Item = bool>) -> Share {
    hits.fold(Share::default(), |share, hit| Share { hits: share.hits + usize::from(hit), of: share.of + 1 })
}

fn hidden(one: &Judged) -> String {
    let ids: Vec<&str> = one.planted.iter().map(|planted| planted.id.as_str()).collect();
    match one.kind {
        Kind::Clean => "nothing".to_owned(),
        Kind::LeftOut => format!("{} (left out)", ids.join("+")),
        Kind::One | Kind::Mixture => ids.join("+"),
    }
}

fn said(one: &Judged) -> String {
    if one.said.named.is_empty() { one.said.verdict.clone() } else { one.said.named.join("+") }
}

#[cfg(test)]
mod tests {
    use super::super::judge::judge;
    use super::super::judge::tests::{draw_of, planted};
    use super::*;
    use serde_json::json;

    #[test]
    fn invented_verdicts_add_up() {
        let clean = draw_of(Kind::Clean, Vec::new());
        let one = draw_of(Kind::One, vec![planted("a", &["a"], 1.0)]);
        let said_clean = json!({ "verdict": "clean", "causes": [], "p_value": 0.5 });
        let said_a = json!({ "verdict": "named", "causes": [
            { "id": "a", "class": ["a"], "parameters": { "x": { "value": 1.5, "std": 0.1 } }, "gain": { "log_likelihood": 7.0 } }] });
        let score = Score::new(vec![
            judge(&clean, Some(&said_clean)),
            judge(&clean, Some(&said_a)),
            judge(&one, Some(&said_a)),
            judge(&one, Some(&said_clean)),
            judge(&one, None),
        ]);
        assert_eq!((score.archives, score.failed), (5, 1));
        assert_eq!(score.false_alarms, Share { hits: 1, of: 2 });
        assert_eq!(score.named, Share { hits: 1, of: 3 });
        // five standard errors off
        assert_eq!(score.parameters, Share { hits: 0, of: 1 });
        assert_eq!(score.confusion["a"]["clean"], 1);
        assert_eq!(score.confusion["nothing"]["a"], 1);
        assert_eq!(score.median_gain, Some(7.0));
        assert!(score.text().contains("1/2 (50.0 %), 95 % interval 1.26 to 98.74 %"), "{}", score.text());
    }
}
