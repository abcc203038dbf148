//! Tables for people that fit where they are shown: columns without anything in them are left out, and
//! of the others as many as there is room for, the important ones first.

/// Spaces between two columns.
const GAP: usize = 2;
/// Signs of the first column below which it is not shortened.
const LEAST: usize = 16;

/// A column.
pub(super) struct Column {
    head: String,
    /// The smaller, the longer it stays where there is little room; 0 stays always.
    rank: u8,
    cells: Vec<String>,
}

impl Column {
    /// A column of one cell a row.
    pub(super) fn new(head: impl Into<String>, rank: u8, cells: Vec<String>) -> Self {
        Self { head: head.into(), rank, cells }
    }

    fn is_empty(&self) -> bool {
        self.cells.iter().all(String::is_empty)
    }

    fn width(&self) -> usize {
        let cells = self.cells.iter().map(|cell| length(cell));
        cells.max().unwrap_or(0).max(length(&self.head))
    }
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// The columns as lines of at most `width` signs, if that can be: the first to the left, the others to
/// the right. The first is shortened from its beginning before a column of rank 0 or 1 is left out.
pub(super) fn fit(mut columns: Vec<Column>, width: usize) -> String {
    columns.retain(|column| column.rank == 0 || !column.is_empty());
    let Some(first) = columns.first().map(Column::width) else { return String::new() };
    let needed: usize =
        columns[1..].iter().filter(|own| own.rank <= 1).map(|own| own.width() + GAP).sum();
    let first = first.min(width.saturating_sub(needed).max(LEAST));
    let mut left = width.saturating_sub(first);
    let mut order: Vec<usize> = (1..columns.len()).collect();
    order.sort_by_key(|&at| columns[at].rank);
    let mut is_shown = vec![false; columns.len()];
    is_shown[0] = true;
    for at in order {
        let taken = columns[at].width() + GAP;
        if columns[at].rank > 0 && taken > left {
            break;
        }
        is_shown[at] = true;
        left = left.saturating_sub(taken);
    }
    let shown: Vec<&Column> =
        columns.iter().zip(is_shown).filter_map(|(own, is)| is.then_some(own)).collect();
    let line = |cell: &dyn Fn(&Column) -> String| {
        let mut line = format!("{:<first$}", shorten(&cell(shown[0]), first));
        for column in &shown[1..] {
            line += &format!("{:>1$}", cell(column), column.width() + GAP);
        }
        line.trim_end().to_owned() + "\n"
    };
    let head = line(&|column| column.head.clone());
    let rows = (0..shown[0].cells.len()).map(|row| line(&|column| column.cells[row].clone()));
    std::iter::once(head).chain(rows).collect()
}

/// The end of a text, which tells more of a path than its beginning.
fn shorten(text: &str, most: usize) -> String {
    let length = length(text);
    if length <= most {
        return text.to_owned();
    }
    std::iter::once('…').chain(text.chars().skip(length + 1 - most)).collect()
}

/// A text in lines of at most `width` signs, all but the first indented.
pub(super) fn wrap(text: &str, width: usize) -> String {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last().map_or(0, |line| length(line));
        if line > GAP && line + 1 + length(word) > width {
            lines.push(" ".repeat(GAP) + word);
        } else if let Some(line) = lines.last_mut() {
            *line += if line.is_empty() { "" } else { " " };
            *line += word;
        }
    }
    lines.join("\n") + "\n"
}

/// A size of files.
pub(super) fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.2} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::super::ticks::grouped;
    use super::*;

    fn columns() -> Vec<Column> {
        let cells = |own: &[&str]| own.iter().map(|cell| (*cell).to_owned()).collect::<Vec<_>>();
        vec![
            Column::new("file", 0, cells(&["a/long/path/to/helmet.glb", "b.glb"])),
            Column::new("triangles", 0, cells(&["1,200", "7"])),
            Column::new("nothing", 1, cells(&["", ""])),
            Column::new("detail", 2, cells(&["12345678901234567890", "1"])),
            Column::new("SSIM", 1, cells(&["0.99", "0.5"])),
        ]
    }

    #[test]
    fn columns_that_matter_least_go_first_and_empty_ones_always() {
        let wide = fit(columns(), 100);
        assert!(wide.starts_with("file                       triangles                "), "{wide}");
        assert!(!wide.contains("nothing") && wide.contains("detail"));
        let narrow = fit(columns(), 44);
        let expected = "file                       triangles  SSIM\n\
            a/long/path/to/helmet.glb      1,200  0.99\n\
            b.glb                              7   0.5\n";
        assert_eq!(narrow, expected);
        let least = fit(columns(), 30);
        assert!(least.contains("h/to/helmet.glb") && !least.contains("long"), "{least}");
        for width in 34..120 {
            let text = fit(columns(), width);
            assert!(text.lines().all(|line| length(line) <= width), "{width}: {text}");
        }
    }

    #[test]
    fn figures_are_read_at_a_glance() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
        assert_eq!([12, 81_234, 2_949_000].map(size), ["12 B", "81 kB", "2.9 MB"]);
        assert_eq!(wrap("one two three four", 9), "one two\n  three\n  four\n");
    }
}
