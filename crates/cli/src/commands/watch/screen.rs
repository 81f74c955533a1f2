//! The table on a terminal, drawn anew in its place.
//!
//! The cursor goes back up to the first line and every line is written over. Nothing else is asked of the terminal, so
//! that there is nothing to put back at the end: the last table stays, as any other output does. A window that is too
//! narrow loses columns, then the ends of names, then values stand below their names; one that is too low loses lines, and
//! the last one says how many.

use std::io;

use busbar_profile::Quality;
use jiff::{SignedDuration, Timestamp};

use super::state::{Seen, State};
use crate::{
    people,
    table::{Align, Cell, Look, Table},
    terminal::{self, Style},
};

/// What the size is taken for where the terminal does not tell.
const USUAL: (usize, usize) = (80, 24);

/// Of a narrow window the values have as much as they need, up to so many columns.
const MOST_VALUE: usize = 34;
/// The longest that is said of a value beside it: `* changed`.
const STATE: usize = 9;
/// Between two columns.
const GAP: usize = 2;
/// Where a name has less than so many columns, values stand below their names.
const LEAST_NAME: usize = 20;

/// The table and where it stands.
pub(super) struct Screen {
    title: String,
    /// Lines above the cursor that are ours.
    lines: usize,
    size: (usize, usize),
}

impl Screen {
    pub(super) fn new(title: String) -> Self {
        Self { title, lines: 0, size: (0, 0) }
    }

    /// Draws what is known at this moment.
    pub(super) fn draw(&mut self, state: &State<'_>, now: Timestamp) -> io::Result<()> {
        let size = terminal::size().unwrap_or(USUAL);
        let text = table(state, now, terminal::style(), size.0);
        let head = self.head(state, now, size.0);
        let lines: Vec<String> = head.into_iter().chain(text.lines().map(str::to_owned)).collect();
        let text = self.frame(&lines, size);
        terminal::print(&text)
    }

    /// Leaves the terminal as a command does that has printed a table: the echo of Ctrl-C is wiped away.
    pub(super) fn end(&self) -> io::Result<()> {
        terminal::print("\r\x1b[K")
    }

    fn head(&self, state: &State<'_>, now: Timestamp, width: usize) -> Vec<String> {
        let style = terminal::style();
        let rounds = people::count(usize::try_from(state.rounds()).unwrap_or(usize::MAX), "round");
        let times = format!("Ctrl-C ends it; {rounds}, {}", now.strftime("%Y-%m-%d %H:%M:%S UTC"));
        let mut lines: Vec<String> = wrap(&self.title, width).iter().map(|line| style.title(line)).collect();
        lines.extend(wrap(&times, width).iter().map(|line| style.dim(line)));
        if let Some(reason) = state.reason() {
            lines.extend(wrap(&format!("NO ANSWER: {reason}"), width).iter().map(|line| style.alarm(line)));
        }
        lines.push(String::new());
        lines
    }

    /// What goes to the terminal so that these lines stand where the ones before stood.
    fn frame(&mut self, lines: &[String], size: (usize, usize)) -> String {
        let (width, height) = size;
        let mut text = match self.lines {
            0 => String::new(),
            // Lines that have been folded anew stand nobody knows where.
            _ if size != self.size => "\x1b[H\x1b[2J".to_owned(),
            lines => format!("\x1b[{lines}F"),
        };
        // The cursor rests on a line of its own below.
        let room = height.saturating_sub(1).max(1);
        let shown = if lines.len() > room { room - 1 } else { lines.len() };
        for line in &lines[..shown] {
            text.push_str(&clip(line, width));
            text.push_str("\x1b[K\n");
        }
        if shown < lines.len() {
            let more = people::count(lines.len() - shown, "more line");
            let long = format!("{more}: name fewer POINTs, or make the window higher");
            let line = if long.len() <= width { long } else { format!("{more}: name fewer POINTs") };
            text.push_str(&clip(&line, width));
            text.push_str("\x1b[K\n");
        }
        text.push_str("\x1b[J");
        self.lines = lines.len().min(room);
        self.size = size;
        text
    }
}

/// A point under watch as it is shown.
struct Entry<'a> {
    seen: &'a Seen<'a>,
    name: Cell,
    values: Vec<Cell>,
}

fn table(state: &State<'_>, now: Timestamp, style: Style, width: usize) -> String {
    let profile = state.profile();
    let seen: Vec<Seen<'_>> = state.points().iter().filter_map(|index| state.seen(*index, now)).collect();
    let numbers = people::number_width(seen.iter().map(|seen| (seen.point, &seen.reading)));
    let entries: Vec<Entry<'_>> = seen
        .iter()
        .map(|seen| Entry {
            seen,
            name: seen.point.name.as_str().into(),
            values: people::lines(seen.point, &seen.reading, numbers),
        })
        .collect();
    let widest = entries.iter().flat_map(|entry| &entry.values).map(Cell::width).max().unwrap_or_default();
    // Names give way, then values; what is said of a value beside it never does.
    let name_room = width.saturating_sub(widest.min(MOST_VALUE) + STATE + 2 * GAP);
    let longest = entries.iter().map(|entry| entry.name.width()).max().unwrap_or_default();
    let is_wide = name_room >= LEAST_NAME.min(longest);
    let name_room = name_room.min(longest);
    let mut table = match is_wide {
        true => wide(),
        false => narrow(),
    };
    for group in &profile.groups {
        let mut own =
            entries.iter().filter(|entry| profile.group(entry.seen.point).id == group.id).peekable();
        if own.peek().is_some() {
            table.title(group.title.as_str());
        }
        for entry in own {
            match is_wide {
                true => entry.beside_its_name(&mut table, name_room, width),
                false => entry.below_its_name(&mut table, width),
            }
        }
    }
    table.render(style, Some(width))
}

fn wide() -> Table {
    Table::new([
        ("ADDRESS", Align::Right),
        ("NAME", Align::Left),
        ("VALUE", Align::Left),
        ("STATE", Align::Left),
        ("AGE", Align::Right),
        ("POINT", Align::Left),
    ])
    .optional(&["POINT", "ADDRESS", "AGE"])
}

fn narrow() -> Table {
    Table::new([("  VALUE", Align::Left), ("STATE", Align::Left), ("AGE", Align::Right)]).optional(&["AGE"])
}

impl Entry<'_> {
    fn beside_its_name(&self, table: &mut Table, name_room: usize, width: usize) {
        let name = self.name.clone().shortened(name_room);
        let room = MOST_VALUE.max(width.saturating_sub(name_room + STATE + 2 * GAP));
        let mut lines = self.values.iter().map(|value| value.clone().shortened(room));
        let Seen { point, age, .. } = self.seen;
        table.row([
            Cell::dim(point.address.to_string()),
            name,
            lines.next().unwrap_or_default(),
            note(self.seen),
            Cell::dim(age.map(self::age).unwrap_or_default()),
            Cell::dim(point.id.as_str()),
        ]);
        for line in lines {
            let nothing = Cell::default;
            table.row([nothing(), nothing(), line, nothing(), nothing(), nothing()]);
        }
    }

    fn below_its_name(&self, table: &mut Table, width: usize) {
        table.across(self.name.clone().shortened(width));
        let room = width.saturating_sub(2 + GAP + STATE);
        let mut lines = self.values.iter().map(|value| value.indented().shortened(room + 2));
        let age = Cell::dim(self.seen.age.map(age).unwrap_or_default());
        table.row([lines.next().unwrap_or_default(), note(self.seen), age]);
        for line in lines {
            table.row([line, Cell::default(), Cell::default()]);
        }
    }
}

/// The state in a word, so that nobody needs the colour.
fn note(seen: &Seen<'_>) -> Cell {
    let look = match seen.reading.quality {
        Quality::Good if seen.changed => return Cell::new("* changed", Look::Plain),
        Quality::Bad => Look::Alarm,
        Quality::Stale => Look::Caution,
        _ => Look::Dim,
    };
    Cell::new(seen.note(), look)
}

/// `0.3 s`, `12 s`, `7 min`, `2 h`.
fn age(age: SignedDuration) -> String {
    match age.as_secs() {
        seconds @ ..10 => format!("{seconds}.{} s", age.subsec_millis() / 100),
        seconds @ 10..120 => format!("{seconds} s"),
        seconds @ 120..7200 => format!("{} min", seconds / 60),
        seconds => format!("{} h", seconds / 3600),
    }
}

/// The beginning of a line that has so many columns; colours are taken back where the rest is cut off.
fn clip(line: &str, width: usize) -> String {
    let mut clipped = String::with_capacity(line.len());
    let mut columns = 0;
    let mut letters = line.chars();
    while let Some(letter) = letters.next() {
        if letter == '\x1b' {
            clipped.push(letter);
            for letter in letters.by_ref() {
                clipped.push(letter);
                if letter.is_ascii_alphabetic() {
                    break;
                }
            }
            continue;
        }
        if columns == width {
            if clipped.contains('\x1b') {
                clipped.push_str("\x1b[0m");
            }
            return clipped;
        }
        clipped.push(letter);
        columns += 1;
    }
    clipped
}

/// A sentence in lines of at most so many columns; a word that is longer has a line of its own.
fn wrap(sentence: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in sentence.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(count: usize) -> Vec<String> {
        (1..=count).map(|line| format!("line {line}")).collect()
    }

    #[test]
    fn goes_back_to_its_first_line() {
        let mut screen = Screen::new(String::new());
        assert_eq!(screen.frame(&lines(2), (80, 24)), "line 1\x1b[K\nline 2\x1b[K\n\x1b[J");
        assert_eq!(screen.frame(&lines(1), (80, 24)), "\x1b[2Fline 1\x1b[K\n\x1b[J");
        assert_eq!(screen.frame(&lines(1), (80, 24)), "\x1b[1Fline 1\x1b[K\n\x1b[J");
        assert_eq!(screen.frame(&lines(1), (40, 24)), "\x1b[H\x1b[2Jline 1\x1b[K\n\x1b[J");
    }

    #[test]
    fn a_low_window_says_what_it_leaves_out() {
        let mut screen = Screen::new(String::new());
        let text = screen.frame(&lines(9), (80, 4));
        assert_eq!(
            text,
            "line 1\x1b[K\nline 2\x1b[K\n7 more lines: name fewer POINTs, or make the window higher\x1b[K\n\x1b[J"
        );
        assert!(screen.frame(&lines(9), (80, 4)).starts_with("\x1b[3F"));
        let mut screen = Screen::new(String::new());
        assert!(screen.frame(&lines(2), (80, 1)).starts_with("2 more lines"));
    }

    #[test]
    fn a_narrow_window_cuts_lines_and_not_colours() {
        for (line, width, expected) in [
            ("plain", 9, "plain"),
            ("plain", 3, "pla"),
            ("\x1b[31mtrip\x1b[0m!", 9, "\x1b[31mtrip\x1b[0m!"),
            ("\x1b[31mtrip\x1b[0m!", 2, "\x1b[31mtr\x1b[0m"),
            ("°C°C", 2, "°C"),
        ] {
            assert_eq!(clip(line, width), expected, "{line} {width}");
        }
        assert_eq!(wrap("nobody answers the call", 14), ["nobody answers", "the call"]);
        assert_eq!(wrap("unbreakable word", 4), ["unbreakable", "word"]);
    }

    #[test]
    fn ages_are_short() {
        for (millis, expected) in [
            (0, "0.0 s"),
            (320, "0.3 s"),
            (9_999, "9.9 s"),
            (10_000, "10 s"),
            (120_000, "2 min"),
            (7_200_000, "2 h"),
        ] {
            assert_eq!(age(SignedDuration::from_millis(millis)), expected);
        }
    }
}
