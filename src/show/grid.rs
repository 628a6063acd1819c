//! Aligned columns.

use crate::printable::one_line;

/// Rows of cells as aligned columns, two blanks apart; columns of numbers are aligned to the right. The first row is
/// the header.
pub fn grid(rows: &[Vec<String>]) -> String {
    aligned(rows, 1)
}

/// As [`grid`]; where that is wider than `most` characters, the names in the header are folded at their underscores.
pub fn narrow_grid(rows: &[Vec<String>], most: usize) -> String {
    let plain = grid(rows);
    let (Some((header, body)), true) = (rows.split_first(), plain.lines().any(|line| line.chars().count() > most))
    else {
        return plain;
    };
    let width = |column: usize| body.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let folded: Vec<Vec<String>> =
        header.iter().enumerate().map(|(column, name)| fold(name, width(column).unwrap_or(0))).collect();
    let height = folded.iter().map(Vec::len).max().unwrap_or(1);
    let line = |k: usize| folded.iter().map(|lines| lines.get(k).cloned().unwrap_or_default()).collect();
    let rows: Vec<Vec<String>> = (0..height).map(line).chain(body.iter().cloned()).collect();
    aligned(&rows, height)
}

/// A name in lines of at most `most` characters where its words allow it, each but the last ending in its underscore.
fn fold(name: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in name.split_inclusive('_') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() <= most => line.push_str(word),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Characters of a table that are few whatever is in its cells.
const FEW: usize = 1 << 20;

/// Aligned columns may take so many times the characters that are in their cells.
const MOST_TIMES: usize = 16;

fn aligned(rows: &[Vec<String>], head: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| one_line(cell)).collect()).collect();
    let (mut widths, mut characters) = (vec![0; columns], 0);
    for row in &rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            let count = cell.chars().count();
            characters += count;
            *width = count.max(*width);
        }
    }
    let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
    let below = |column: usize| rows.iter().skip(head).map(move |row| row.get(column).map_or("", String::as_str));
    let right: Vec<bool> = (0..columns).map(|column| column_is_numeric(below(column))).collect();
    // one very wide cell among many rows: its column would be blanks for the most part
    let area = widths.iter().sum::<usize>().saturating_mul(rows.len());
    if area > FEW.saturating_add(characters.saturating_mul(MOST_TIMES)) {
        widths.fill(0);
    }
    let mut text = String::new();
    for row in &rows {
        let cells = widths.iter().zip(&right).enumerate().map(|(column, (&width, &right))| {
            let value = cell(row, column);
            // no format width: that panics above 65535
            let blanks = " ".repeat(width.saturating_sub(value.chars().count()));
            if right { blanks + &value } else { value + &blanks }
        });
        let line = cells.collect::<Vec<_>>().join("  ");
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

fn column_is_numeric<'a>(mut cells: impl Iterator<Item = &'a str> + Clone) -> bool {
    cells.clone().any(|cell| !cell.is_empty()) && cells.all(numeric)
}

fn numeric(cell: &str) -> bool {
    cell.is_empty() || cell == "-" || cell.trim_start_matches(['-', '|']).starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::{grid, narrow_grid};

    #[test]
    fn long_names_are_folded_where_a_table_is_too_wide() {
        let rows = [["n", "reference_frequency_hz"], ["1", "46300.0(1)"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(narrow_grid(&rows, 100), grid(&rows));
        assert_eq!(narrow_grid(&rows, 20), "n  reference_\n   frequency_\n           hz\n1  46300.0(1)\n");
    }

    #[test]
    fn words_go_left_and_numbers_right() {
        let rows = [["name", "x"], ["a", "1.5"], ["long one", "-12"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(grid(&rows), "name        x\na         1.5\nlong one  -12\n");
    }

    #[test]
    fn cells_of_any_width_are_aligned_where_that_is_no_waste() {
        let wide = "x".repeat(70_000);
        let rows = |count: usize| -> Vec<Vec<String>> {
            let first = std::iter::once(vec![wide.clone(), "1".to_owned()]);
            first.chain((1..count).map(|k| vec![k.to_string(), k.to_string()])).collect()
        };
        let few = grid(&rows(3));
        assert!(few.lines().all(|line| line.chars().count() == 70_003), "{} characters", few.len());
        let many = grid(&rows(100_000));
        assert!(many.len() < 2_000_000 && many.ends_with("\n99999  99999\n"), "{} characters", many.len());
    }
}
