//! Aligned tables for people.

use crate::terminal::Style;

/// Between two columns.
const GAP: &str = "  ";

/// On which side of its column a cell stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// How a cell looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Look {
    #[default]
    Plain,
    Dim,
    Alarm,
    Caution,
}

/// One field of a row.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cell {
    text: String,
    look: Look,
}

impl Cell {
    pub(crate) fn new(text: impl Into<String>, look: Look) -> Self {
        Self { text: text.into(), look }
    }

    pub(crate) fn dim(text: impl Into<String>) -> Self {
        Self::new(text, Look::Dim)
    }

    /// What stands in it.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The same behind two blanks.
    pub(crate) fn indented(&self) -> Self {
        Self { text: format!("  {}", self.text), look: self.look }
    }

    /// The same in at most so many columns, with a mark where it was cut.
    pub(crate) fn shortened(self, room: usize) -> Self {
        if self.width() <= room {
            return self;
        }
        let text = self.text.chars().take(room.saturating_sub(1)).chain(['…']).collect();
        Self { text, ..self }
    }

    pub(crate) fn width(&self) -> usize {
        self.text.chars().count()
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::new(text, Look::Plain)
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::new(text, Look::Plain)
    }
}

enum Row {
    Cells(Vec<Cell>),
    /// A line over the rows that follow, with an empty line above it.
    Title(String),
    /// A line of its own that no column is as wide as.
    Line(Cell),
}

/// Rows under a head, every column as wide as its widest cell.
pub(crate) struct Table {
    columns: Vec<(&'static str, Align)>,
    /// Columns that a narrow terminal does without, the first one first.
    optional: Vec<&'static str>,
    rows: Vec<Row>,
}

impl Table {
    pub(crate) fn new<const N: usize>(columns: [(&'static str, Align); N]) -> Self {
        Self { columns: columns.to_vec(), optional: Vec::new(), rows: Vec::new() }
    }

    /// The same table, which leaves out these columns, the first one first, where a terminal is too narrow.
    pub(crate) fn optional(mut self, columns: &[&'static str]) -> Self {
        self.optional = columns.to_vec();
        self
    }

    pub(crate) fn row<const N: usize>(&mut self, cells: [Cell; N]) {
        self.rows.push(Row::Cells(cells.to_vec()));
    }

    pub(crate) fn title(&mut self, title: impl Into<String>) {
        self.rows.push(Row::Title(title.into()));
    }

    pub(crate) fn across(&mut self, cell: Cell) {
        self.rows.push(Row::Line(cell));
    }

    /// The table as lines, without blanks at their ends, on a terminal of that width or none.
    pub(crate) fn render(mut self, style: Style, terminal: Option<usize>) -> String {
        let mut widths = self.widths();
        for column in std::mem::take(&mut self.optional) {
            if terminal.is_some_and(|terminal| Self::line_width(&widths) > terminal) {
                self.leave_out(column);
                widths = self.widths();
            }
        }
        let mut text = String::new();
        let head: Vec<Cell> = self.columns.iter().map(|(title, _)| Cell::dim(*title)).collect();
        self.line(&head, &widths, style, &mut text);
        for row in &self.rows {
            match row {
                Row::Cells(cells) => self.line(cells, &widths, style, &mut text),
                Row::Line(cell) => self.line(std::slice::from_ref(cell), &[0], style, &mut text),
                Row::Title(title) => {
                    text.push('\n');
                    text.push_str(&style.title(title));
                    text.push('\n');
                }
            }
        }
        text
    }

    fn line_width(widths: &[usize]) -> usize {
        widths.iter().sum::<usize>() + GAP.len() * widths.len().saturating_sub(1)
    }

    fn leave_out(&mut self, title: &str) {
        let Some(column) = self.columns.iter().position(|(column, _)| *column == title) else { return };
        self.columns.remove(column);
        for row in &mut self.rows {
            if let Row::Cells(cells) = row
                && column < cells.len()
            {
                cells.remove(column);
            }
        }
    }

    fn widths(&self) -> Vec<usize> {
        let mut widths: Vec<usize> = self.columns.iter().map(|(title, _)| title.chars().count()).collect();
        for row in &self.rows {
            let Row::Cells(cells) = row else { continue };
            for (width, cell) in widths.iter_mut().zip(cells) {
                *width = (*width).max(cell.width());
            }
        }
        widths
    }

    fn line(&self, cells: &[Cell], widths: &[usize], style: Style, text: &mut String) {
        let last = cells.iter().rposition(|cell| !cell.text.is_empty()).unwrap_or_default();
        for (column, cell) in cells.iter().enumerate().take(last + 1) {
            let blanks = " ".repeat(widths.get(column).map_or(0, |width| width.saturating_sub(cell.width())));
            let painted = match cell.look {
                Look::Plain => cell.text.clone(),
                Look::Dim => style.dim(&cell.text),
                Look::Alarm => style.alarm(&cell.text),
                Look::Caution => style.caution(&cell.text),
            };
            match self.columns.get(column) {
                Some((_, Align::Right)) => {
                    text.push_str(&blanks);
                    text.push_str(&painted);
                }
                _ => {
                    text.push_str(&painted);
                    if column < last {
                        text.push_str(&blanks);
                    }
                }
            }
            if column < last {
                text.push_str(GAP);
            }
        }
        text.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aligns_columns() {
        let mut table =
            Table::new([("ADDRESS", Align::Right), ("NAME", Align::Left), ("VALUE", Align::Right)]);
        table.title("Genset");
        table.row(["10246".into(), "Voltage".into(), "230.2".into()]);
        table.row([Cell::default(), "°C counts once".into(), Cell::default()]);
        table.row(["1".into(), Cell::dim("x"), "5".into()]);
        assert_eq!(
            table.render(Style::default(), None),
            "ADDRESS  NAME            VALUE\n\
             \n\
             Genset\n\
             \x20 10246  Voltage         230.2\n\
             \x20        °C counts once\n\
             \x20     1  x                   5\n"
        );
    }

    #[test]
    fn leaves_out_what_does_not_fit() {
        for (terminal, expected) in [
            (31, "10246    230.2 V  08FE  voltage\n"),
            (30, "10246    230.2 V  voltage\n"),
            (25, "10246    230.2 V  voltage\n"),
            (24, "10246    230.2 V\n"),
            (3, "10246    230.2 V\n"),
        ] {
            let columns = ["ADDRESS", "VALUE", "RAW", "POINT"].map(|title| (title, Align::Left));
            let mut table = Table::new(columns).optional(&["RAW", "POINT"]);
            table.row(["10246".into(), "230.2 V".into(), "08FE".into(), "voltage".into()]);
            let text = table.render(Style::default(), Some(terminal));
            assert!(text.ends_with(expected), "{terminal}: {text}");
        }
    }
}
