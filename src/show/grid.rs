//! Aligned columns.

/// Rows of cells as aligned columns, two blanks apart; columns of numbers are aligned to the right. The first row is the header.
pub fn grid(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
    let widths: Vec<usize> = (0..columns)
        .map(|column| rows.iter().map(|row| cell(row, column).chars().count()).max().unwrap_or(0))
        .collect();
    let right: Vec<bool> =
        (0..columns).map(|column| column_is_numeric(rows.iter().skip(1).map(|row| cell(row, column)))).collect();
    let mut text = String::new();
    for row in rows {
        let cells = widths.iter().zip(&right).enumerate().map(|(column, (&width, &right))| {
            let value = cell(row, column);
            if right { format!("{value:>width$}") } else { format!("{value:<width$}") }
        });
        let line = cells.collect::<Vec<_>>().join("  ");
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

fn column_is_numeric(mut cells: impl Iterator<Item = String> + Clone) -> bool {
    cells.clone().any(|cell| !cell.is_empty()) && cells.all(|cell| numeric(&cell))
}

fn numeric(cell: &str) -> bool {
    cell.is_empty() || cell == "-" || cell.trim_start_matches(['-', '|']).starts_with(|c: char| c.is_ascii_digit())
}

#[cfg(test)]
mod tests {
    use super::grid;

    #[test]
    fn words_go_left_and_numbers_right() {
        let rows = [["name", "x"], ["a", "1.5"], ["long one", "-12"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(grid(&rows), "name        x\na         1.5\nlong one  -12\n");
    }
}
