//! The page about this plant, `docs/imitation/genset.md`, held against its levers.

use super::*;

const MARKS: [&str; 2] = ["<!-- levers -->\n", "<!-- end of levers -->\n"];

/// A row a position.
fn table() -> String {
    let mut rows = "| lever | what it is | position | what it does |\n| --- | --- | --- | --- |\n".to_owned();
    for lever in LEVERS {
        let words = lever.words.iter().map(|word| (format!("`{}`", word.id), word.meaning));
        let range = lever.numbers.map(|range| {
            let range = format!("{} to {} {}", range.min, range.max, range.unit);
            let meaning = match lever.id {
                "ignition" => "The first attempt at which it fires",
                "tank" => "Filled or drained to it",
                "busbar.gensets" => "So many run with this one",
                _ => "Held at it",
            };
            (range.trim_end().to_owned(), meaning)
        });
        for (row, (position, meaning)) in words.chain(range).enumerate() {
            // A lever is named once.
            let (id, name) =
                if row == 0 { (format!("`{}`", lever.id), lever.name) } else { Default::default() };
            rows += &format!("| {id} | {name} | {position} | {meaning} |\n");
        }
    }
    rows
}

#[test]
fn the_page_lists_the_levers() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/imitation/genset.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(MARKS[0]).unwrap();
    let (_, after) = rest.split_once(MARKS[1]).unwrap();
    let wanted = [before, MARKS[0], &table(), MARKS[1], after].concat();
    if std::env::var_os("UPDATE").is_some() {
        std::fs::write(&path, wanted).unwrap();
        return;
    }
    assert!(
        page == wanted,
        "docs/imitation/genset.md has drifted from the levers: UPDATE=1 cargo test -p busbar-emulator lists_the_levers"
    );
}
