//! Finds delimiter and decimal sign of a plain table by looking at its first lines.

use super::kind::Kind;
use super::lines::BYTE_ORDER_MARK;
use super::number;
use crate::text::{decode, is_utf16, utf16};
use std::collections::BTreeMap;

/// How fields are set apart and numbers printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Dialect {
    /// Tab, semicolon or comma; a blank stands for any number of blanks and tabs.
    pub(super) delimiter: char,
    pub(super) decimal: char,
}

/// In the order in which they win a draw.
const DIALECTS: [Dialect; 7] = [
    Dialect { delimiter: '\t', decimal: '.' },
    Dialect { delimiter: '\t', decimal: ',' },
    Dialect { delimiter: ';', decimal: '.' },
    Dialect { delimiter: ';', decimal: ',' },
    Dialect { delimiter: ',', decimal: '.' },
    Dialect { delimiter: ' ', decimal: '.' },
    Dialect { delimiter: ' ', decimal: ',' },
];

/// What the first lines show.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Sniffed {
    pub(super) dialect: Dialect,
    /// What most rows hold in each column.
    pub(super) kinds: Vec<Kind>,
    /// The column that every row begins with: the first of numbers or stamps that most rows fill.
    pub(super) leading: usize,
    /// Which of the lines is the first row.
    pub(super) first_row: usize,
    /// Whether `1,2` could as well be one number with a decimal comma.
    pub(super) ambiguous: bool,
}

impl Dialect {
    /// The fields of a row.
    pub(super) fn fields<'a>(&self, line: &'a str) -> Vec<&'a str> {
        if self.delimiter == ' ' { line.split_whitespace().collect() } else { line.split(self.delimiter).collect() }
    }

    /// Fields that are numbers, and such that are text.
    fn count(&self, line: &str) -> (usize, usize) {
        let kinds = self.kinds(line);
        let count = |kind: Kind| kinds.iter().filter(|k| **k == kind).count();
        (count(Kind::Number), count(Kind::Text))
    }

    fn kinds(&self, line: &str) -> Vec<Kind> {
        self.fields(line).into_iter().map(|field| Kind::of(field, self.decimal)).collect()
    }

    fn is_row(&self, line: &str) -> bool {
        let (numbers, others) = self.count(line);
        !is_comment(line) && numbers > 0 && numbers >= others
    }

    /// Numbers in the lines, less the fields of text: a wrong delimiter makes fewer numbers and some text.
    fn score(&self, lines: &[&str]) -> i64 {
        let rows = lines.iter().filter(|line| self.is_row(line));
        rows.map(|line| self.count(line)).map(|(numbers, others)| numbers as i64 - others as i64).sum()
    }
}

/// Whether a line is a comment.
pub(super) fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%'])
}

/// Looks at lines. None if there are no rows of numbers in them.
pub(super) fn sniff(lines: &[&str]) -> Option<Sniffed> {
    let (score, dialect) = DIALECTS.iter().rev().map(|d| (d.score(lines), *d)).max_by_key(|(score, _)| *score)?;
    if score <= 0 {
        return None;
    }
    let rows: Vec<Vec<Kind>> = lines.iter().filter(|line| dialect.is_row(line)).map(|l| dialect.kinds(l)).collect();
    let columns = heaviest(rows.iter().map(|kinds| (kinds.len(), weight(kinds))))?;
    let fitting: Vec<&Vec<Kind>> = rows.iter().filter(|kinds| kinds.len() == columns).collect();
    let kinds: Vec<Kind> = (0..columns).map(|column| kind_of(column, &fitting)).collect();
    let leading = leading(&kinds, &fitting);
    let first_row = first_row(lines, dialect, &kinds, leading)?;
    let comma_pairs = dialect == Dialect { delimiter: ',', decimal: '.' } && columns == 2;
    let pairs = || lines.iter().filter(|line| dialect.is_row(line) && dialect.fields(line).len() == columns);
    let ambiguous = comma_pairs && pairs().all(|line| number::parse(line, ',').is_some());
    // `0,05`: no whole number is printed with a leading 0, so the comma is decimal.
    let leading_zero = |line: &&str| line.split_once(',').is_some_and(|(_, b)| b.len() > 1 && b.starts_with('0'));
    if ambiguous && pairs().any(leading_zero) {
        let dialect = Dialect { delimiter: ' ', decimal: ',' };
        return Some(Sniffed { dialect, kinds: vec![Kind::Number], leading: 0, first_row, ambiguous: false });
    }
    Some(Sniffed { dialect, kinds, leading, first_row, ambiguous })
}

/// How much a line says about what rows are: its numbers less its texts. Headers of a word and a number say nothing,
/// however many there are; a table of such rows says a little.
fn weight(kinds: &[Kind]) -> usize {
    let count = |kind: Kind| kinds.iter().filter(|k| **k == kind).count();
    1 + 1000 * count(Kind::Number).saturating_sub(count(Kind::Text))
}

/// The item with the largest sum of weights; of equal ones the larger.
fn heaviest<T: Ord + Copy>(items: impl Iterator<Item = (T, usize)>) -> Option<T> {
    let mut sums: BTreeMap<T, usize> = BTreeMap::new();
    for (item, weight) in items {
        *sums.entry(item).or_default() += weight;
    }
    sums.into_iter().max_by_key(|&(item, sum)| (sum, item)).map(|(item, _)| item)
}

/// What most rows hold in a column.
fn kind_of(column: usize, rows: &[&Vec<Kind>]) -> Kind {
    let found = rows.iter().filter_map(|kinds| Some((*kinds.get(column)?, weight(kinds))));
    heaviest(found).unwrap_or(Kind::Empty)
}

/// Whether a line labels what stands in its columns of numbers: by a text in front of the first of them, where rows have
/// nothing. A text further in front is the key of a header beside the rows, one behind it a mark in a row.
pub(super) fn is_labelled(found: &[Kind], kinds: &[Kind], leading: usize) -> bool {
    let before = |kinds: &[Kind]| leading.checked_sub(1).and_then(|at| kinds.get(at)).copied();
    before(found) == Some(Kind::Text) && before(kinds) == Some(Kind::Empty)
}

fn leading(kinds: &[Kind], rows: &[&Vec<Kind>]) -> usize {
    let is_value = |kind: Kind| matches!(kind, Kind::Number | Kind::Stamp);
    let filled = |column: usize| rows.iter().filter(|row| row.get(column).is_some_and(|kind| is_value(*kind))).count();
    let leads = |&(column, kind): &(usize, &Kind)| is_value(*kind) && 2 * filled(column) >= rows.len();
    kinds.iter().enumerate().find(leads).map_or(0, |(column, _)| column)
}

/// The first line that is a row: as wide as rows are, without text where they have numbers, and with a first number. A
/// line that fits worse is taken if there is no such line.
fn first_row(lines: &[&str], dialect: Dialect, kinds: &[Kind], lead: usize) -> Option<usize> {
    let nothing_from = |column: usize| {
        let rest = kinds.get(column..).unwrap_or_default();
        column > lead && !rest.is_empty() && rest.iter().all(|kind| *kind == Kind::Empty)
    };
    // columns of nothing at the end may be missing (Rigol's first row has a comma less than the others)
    let as_wide = |found: usize| found == kinds.len() || (dialect.delimiter != ' ' && nothing_from(found));
    let fits = |line: &str| {
        let found = dialect.kinds(line);
        let fits = |(found, wanted): (&Kind, &Kind)| found == wanted || *found == Kind::Empty || is_text(*wanted);
        as_wide(found.len())
            && !is_labelled(&found, kinds, lead)
            && found.iter().zip(kinds).all(fits)
            && found.get(lead) == kinds.get(lead)
    };
    let row = |line: &&str| dialect.is_row(line) && as_wide(dialect.fields(line).len());
    let strict = lines.iter().position(|line| row(line) && fits(line));
    strict.or_else(|| lines.iter().position(row))
}

fn is_text(kind: Kind) -> bool {
    matches!(kind, Kind::Text | Kind::Empty)
}

/// Whether a file's first bytes are text with rows of numbers.
pub(super) fn looks_like_a_table(head: &[u8]) -> bool {
    let head = head.strip_prefix(BYTE_ORDER_MARK).unwrap_or(head);
    let utf8 = is_utf16(head).then(|| utf16(head).into_bytes());
    let head = utf8.as_deref().unwrap_or(head);
    // Control bytes are in no table of text; 0x1A ends some of old programs'.
    let is_text = |&b: &u8| b >= 0x20 || matches!(b, b'\t' | b'\r' | b'\n' | 0x0C | 0x1A);
    if head.is_empty() || !head.iter().all(is_text) {
        return false;
    }
    let text = decode(head);
    let lines: Vec<&str> = text.lines().collect();
    sniff(&lines).is_some()
}
