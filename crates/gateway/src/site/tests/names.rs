//! Ids and names: any text that is what it looks like, and nothing that only seems so.

use super::*;

/// A site of that name; the name as TOML escapes it.
fn named(escaped: &str) -> Result<String, String> {
    match Site::parse("site.toml", &format!("[site]\nname = \"{escaped}\"")) {
        Ok(site) => Ok(site.name),
        Err(findings) => Err(findings.to_string()),
    }
}

#[test]
fn a_name_is_any_visible_text() {
    for name in [
        "<script>alert(1)</script>",
        "<b>&amp;\u{27}`${x}",
        "Größe 3, Ñandú, 医院, مستشفى, בית חולים",
        "👩‍🔧 Genset ❤️‍🔥",
        "نیم‌فاصله",
        "a",
    ] {
        assert_eq!(named(name), Ok(name.to_owned()));
    }
    assert_eq!(named(" Genset 1\\u00A0"), Ok("Genset 1".to_owned()));
    let longest = "é".repeat(200);
    assert_eq!(named(&longest), Ok(longest));
}

#[test]
fn a_name_hides_nothing() {
    let at = "site.toml:2:8: ";
    for (escaped, expected) in [
        ("", "`name` is empty; write 1 to 200 characters"),
        (" \\u2003 ", "`name` is empty; write 1 to 200 characters"),
        (
            &*"é".repeat(201),
            "`name` has 201 characters; shorten it to 200, so that it fits where names stand",
        ),
        (
            "Genset \\u202E1",
            "`name` holds U+202E as character 8, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
        (
            "a\\nb",
            "`name` holds U+000A as character 2, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
        (
            "a\\u001B[2J",
            "`name` holds U+001B as character 2, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
        (
            "Gen\\u200Dset",
            "`name` holds U+200D as character 4, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
        (
            "\\u3164",
            "`name` holds U+3164 as character 1, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
        (
            "\\U000E0041",
            "`name` holds U+E0041 as character 1, which nobody sees; leave it out: names are one line of visible \
             characters",
        ),
    ] {
        assert_eq!(named(escaped), Err(format!("{at}{expected}")), "{escaped}");
    }
    for c in [
        '\u{AD}', '\u{61C}', '\u{180E}', '\u{200B}', '\u{200E}', '\u{200F}', '\u{2028}', '\u{2029}',
        '\u{202A}', '\u{202D}', '\u{2060}', '\u{2066}', '\u{2069}', '\u{FEFF}', '\u{FFF9}', '\u{7F}',
        '\u{85}', '\u{9B}',
    ] {
        let found = named(&format!("a\\u{:04X}b", u32::from(c)));
        assert!(found.is_err(), "U+{:04X}", u32::from(c));
    }
}

#[test]
fn an_id_fits_into_an_address() {
    for id in ["a", "GEN_1", "-", &"x".repeat(64)] {
        let site = Site::parse("site.toml", &device_with("id", &format!("id = \"{id}\""))).unwrap();
        assert_eq!((site.devices[0].id.as_str(), site.devices[0].name.as_str()), (id, id));
    }
    let long = "x".repeat(65);
    let shown = format!("{}…", "x".repeat(60));
    for (id, shown) in [
        ("", ""),
        ("..", ".."),
        ("../x", "../x"),
        ("a/b", "a/b"),
        ("a\\\\b", "a\\b"),
        ("a%2Fb", "a%2Fb"),
        ("a b", "a b"),
        ("gén", "gén"),
        ("a?b#c", "a?b#c"),
        ("a\\u0000b", "a\\u{0}b"),
        ("a\\u202Eb", "a\\u{202e}b"),
        (&long, &shown),
    ] {
        assert_eq!(
            mistakes(&device_with("id", &format!("id = \"{id}\""))),
            [format!(
                "site.toml:6:6: `{shown}` cannot be an id; write 1 to 64 letters a-z or A-Z, digits, - and _; `name` \
                 takes any text"
            )]
        );
    }
}
