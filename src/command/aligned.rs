//! Tables for people.

/// `rows` under each other: the columns `left` to the left, the others to the right.
pub fn aligned(rows: &[Vec<String>], left: &[usize]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |c: usize| rows.iter().filter_map(|r| r.get(c)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|c| width(c).unwrap_or(0)).collect();
    let line = |row: &Vec<String>| {
        let cell = |(c, cell): (usize, &String)| match left.contains(&c) {
            true => format!("{cell:<0$}", widths[c]),
            false => format!("{cell:>0$}", widths[c]),
        };
        row.iter().enumerate().map(cell).collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

/// A row of `words`, separated by commas.
pub fn header(words: &str) -> Vec<String> {
    words.split(',').map(str::to_owned).collect()
}
