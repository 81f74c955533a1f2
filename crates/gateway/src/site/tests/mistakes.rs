//! One mistake, one sentence: where it stands, what is wrong, and what to write instead.

use super::*;

#[test]
fn every_mistake_has_its_place_and_remedy() {
    for (text, expected) in [
        (
            "",
            "site.toml:1:1: there is nothing in this file; write [site] and name = \"North hospital\", then \
             [[wires]] and [[devices]]",
        ),
        (
            "\u{FEFF} \r\n\t",
            "site.toml:1:1: there is nothing in this file; write [site] and name = \"North hospital\", then \
             [[wires]] and [[devices]]",
        ),
        (
            "# nothing yet\n",
            "site.toml:1:1: `site` is missing in a site file; add `site = { name = \"North hospital\" }`",
        ),
        (
            "\u{FEFF}[site]\r\nname = 5\r\n",
            "site.toml:2:8: `name` has the wrong type (integer); write a text in quotes",
        ),
        ("\u{FEFF}site = 5\r\n", "site.toml:1:8: `site` has the wrong type (integer); write a table"),
        ("[site]\n", "site.toml:1:1: `name` is missing in [site]; add `name = \"North hospital\"`"),
        ("site = 1", "site.toml:1:8: `site` has the wrong type (integer); write a table"),
        ("[site]\nname = 5", "site.toml:2:8: `name` has the wrong type (integer); write a text in quotes"),
        ("[site]\nname = \" \"", "site.toml:2:8: `name` is empty; write 1 to 200 characters"),
        (
            "[site]\nname = \"a\\nb\"",
            "site.toml:2:8: `name` holds U+000A as character 2, which nobody sees; leave it out: names are one line \
             of visible characters",
        ),
        (
            "[site]\nname = \"S\"\nnmae = \"T\"",
            "site.toml:3:1: unknown key `nmae` in [site]; did you mean `name`?",
        ),
        (
            &with("[[devies]]\nid = 1"),
            "site.toml:2:3: unknown key `devies` in a site file; did you mean `devices`?",
        ),
        (
            &with("colour = \"red\""),
            "site.toml:2:1: unknown key `colour` in a site file; write one of: site, server, wires, devices, nodes, \
             connections",
        ),
        (
            &with("server.listen = \"8080\""),
            "site.toml:2:17: `8080` is no address to listen on; write an IP address, a colon and a port, such as \
             \"127.0.0.1:8080\" for this machine only or \"0.0.0.0:8080\" for the network",
        ),
        (
            &with("wires = \"w\""),
            "site.toml:2:9: `wires` has the wrong type (string); write a list of tables, each headed [[wires]]",
        ),
        (
            &with("[[wires]]\nid = \"w\""),
            "site.toml:2:1: `endpoint` is missing in [[wires]]; add `endpoint = \"tcp://192.0.2.20:502\"`",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"10.0.0.1:502\""),
            "site.toml:4:12: `10.0.0.1:502` is no endpoint: no scheme; write tcp://10.0.0.1:502 or another of \
             tcp://HOST:502, rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1 or rtu+tcp://HOST:502",
        ),
        (
            &with("[[wires]]\nid = \"w 1\"\nendpoint = \"tcp://h\""),
            "site.toml:3:6: `w 1` cannot be an id; write 1 to 64 letters a-z or A-Z, digits, - and _; `name` takes \
             any text",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\ntimeout = \"1\""),
            "site.toml:5:11: `1` is no duration; write a number and ms, s, min or h, such as \"500ms\" or \"10s\"",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\ntimeout = \"0s\""),
            "site.toml:5:11: `timeout` is 0s; write a duration from 10ms to 1min",
        ),
        (
            &with(
                "[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\n[[wires]]\nid = \"w\"\nendpoint = \"tcp://i\"",
            ),
            "site.toml:6:6: there is a wire `w` already; give every wire an id of its own",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h:0\""),
            "site.toml:4:12: `tcp://h:0` cannot be connected to: nothing listens on port 0; write the port of the \
             device, or leave it out for the usual one",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tls://h\""),
            "site.toml:4:12: `tls://h:802` cannot be spoken: this version has no TLS; write a tcp:// endpoint; a \
             TLS tunnel in front of the device, such as stunnel, can carry it",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"rtu://pty\""),
            "site.toml:4:12: `rtu://pty?baud=9600&parity=none&stop=1` cannot be connected to: `pty` is no serial \
             device; write the device that the imitation printed, such as \"rtu:///dev/pts/3\"",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\nspacing = \"11s\""),
            "site.toml:5:11: `spacing` is 11s; write a duration from 0s to 10s",
        ),
        (
            &with(
                "[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\n[[wires]]\nid = \"x\"\nendpoint = \"tcp://H:502\"",
            ),
            "site.toml:7:12: `tcp://H:502` is the endpoint of the wire `w` already; put all devices that are \
             reached through it on the wire `w`",
        ),
        (
            &with(
                "[[wires]]\nid = \"w\"\nendpoint = \"rtu:///dev/a?baud=9600\"\n[[wires]]\nid = \"x\"\nendpoint = \
                 \"rtu:///dev/a?baud=19200\"",
            ),
            "site.toml:7:12: `rtu:///dev/a?baud=19200&parity=none&stop=1` is the endpoint of the wire `w` already; \
             put all devices that are reached through it on the wire `w`",
        ),
        (
            &device_with("profile", "profile = \"datakom-x\""),
            "site.toml:7:11: there is no profile `datakom-x`; did you mean `datakom-d`?",
        ),
        (
            &device_with("wire", "wire = \"x\""),
            "site.toml:8:8: the wire `x` is not defined; write one of: w; or define it with [[wires]]",
        ),
        (
            &with("[[devices]]\nid = \"g\"\nprofile = \"datakom-d\"\nwire = \"w\"\nunit = 1"),
            "site.toml:5:8: the wire `w` is not defined; define it: [[wires]] with id = \"w\" and its endpoint",
        ),
        (
            &device_with("unit", "unit = 0"),
            "site.toml:9:8: datakom-d knows no unit 0; write a number from 1 to 240",
        ),
        (
            &device_with("unit", "unit = 241"),
            "site.toml:9:8: datakom-d knows no unit 241; write a number from 1 to 240",
        ),
        (
            &device_with("unit", "unit = 99999999999999999999"),
            "site.toml:9:8: `unit` is too large; write a smaller number",
        ),
        (
            &device_with("unit", "unit = \"1\""),
            "site.toml:9:8: `unit` has the wrong type (string); write a whole number without quotes",
        ),
        (&device_with("unit", ""), "site.toml:5:1: `unit` is missing in [[devices]]; add `unit = 1`"),
        (
            &device_with("word_order", "word_order = \"big\""),
            "site.toml:10:14: `big` is no word order; write \"low-first\" or \"high-first\"",
        ),
        (
            &device_with("poll", "poll = \"1s\""),
            "site.toml:10:8: `poll` has the wrong type (string); write a table",
        ),
        (
            &device_with("poll", "poll = { fst = \"1s\" }"),
            "site.toml:10:10: unknown key `fst` in poll; did you mean `fast`?",
        ),
        (
            &device_with("poll", "poll = { fast = 1 }"),
            "site.toml:10:17: `fast` has the wrong type (integer); write a duration in quotes, such as \"1s\"",
        ),
        (
            &device_with("poll", "poll = { fast = \"2s\", slow = \"1s\" }"),
            "site.toml:10:30: `slow` is shorter than `fast`, which is 2s; make `slow` at least as long as `fast`",
        ),
        (
            &format!(
                "{}[[devices]]\nid = \"h\"\nprofile = \"datakom-d\"\nwire = \"w\"\nunit = 1",
                device_with("", "")
            ),
            "site.toml:14:8: unit 1 on wire w is g already; give every device on a wire a unit id of its own",
        ),
        (
            &format!(
                "{}[[devices]]\nid = \"g\"\nprofile = \"datakom-d\"\nwire = \"w\"\nunit = 2",
                device_with("", "")
            ),
            "site.toml:11:6: there is a device `g` already; give every device an id of its own",
        ),
        (
            "[site]\nname = \"S",
            "site.toml:2:10: this is not TOML: invalid basic string, expected `\"`; mend the syntax; \
             https://toml.io shows it",
        ),
    ] {
        let found = mistakes(text);
        assert_eq!(found.len(), 1, "{text}\n{found:#?}");
        assert_eq!(found[0], expected, "{text}");
    }
}

#[test]
fn what_is_no_toml() {
    for (text, expected) in [
        (
            "x",
            "site.toml:1:2: this is not TOML: key with no value, expected `=`; mend the syntax; https://toml.io \
             shows it",
        ),
        (
            "[site",
            "site.toml:1:6: this is not TOML: unclosed table, expected `]`; mend the syntax; https://toml.io shows \
             it",
        ),
        (
            "[site]\nname = \"a\"\nname = \"b\"",
            "site.toml:3:1: this is not TOML: duplicate key; write every key and every [table] once; the tables of \
             a list are headed [[so]]",
        ),
        ("[site]\nname = North", "site.toml:2:8: this is not TOML: a text without quotes; put it in quotes"),
        ("[site]\nname = South", "site.toml:2:8: this is not TOML: a text without quotes; put it in quotes"),
        (
            "[site]\nname = 1 South",
            "site.toml:2:8: this is not TOML: a number with something behind it; put a text or a duration in quotes; \
             behind a number nothing but a comment may follow",
        ),
        (
            "[site]\nname = ",
            "site.toml:2:8: this is not TOML: string values must be quoted, expected literal string; mend the \
             syntax; https://toml.io shows it",
        ),
        (
            "[site]\nname = “S”",
            "site.toml:2:8: this is not TOML: quotes of a word processor; write straight ones, as in \"North \
             hospital\"",
        ),
        (
            "[site]\nname = \"S\"\n[site]\n",
            "site.toml:3:2: this is not TOML: duplicate key; write every key and every [table] once; the tables of \
             a list are headed [[so]]",
        ),
        (
            "[site]\rname = \"S\"",
            "site.toml:1:8: this is not TOML: carriage return must be followed by newline, expected newline; mend \
             the syntax; https://toml.io shows it",
        ),
        (
            "[site]\nname = \"S\u{1}\"",
            "site.toml:2:10: this is not TOML: invalid basic string, expected non-double-quote visible characters, \
             `\\`; mend the syntax; https://toml.io shows it",
        ),
        (
            "site.name = \"S\"\nsite.name.first = \"S\"",
            "site.toml:2:6: this is not TOML: cannot extend value of type string with a dotted key; mend the \
             syntax; https://toml.io shows it",
        ),
    ] {
        let found = mistakes(text);
        assert_eq!(found, [expected], "{text}");
    }
}

#[test]
fn what_stands_without_quotes_is_told_what_it_was_meant_for() {
    let of_wire = |line: &str| with(&format!("[[wires]]\nid = \"w\"\n{line}"));
    let choice = "a yes or no in other words; write true or false, in small letters";
    let behind = "a number with something behind it; put a text or a duration in quotes; behind a number nothing but a \
                  comment may follow";
    let text = "a text without quotes; put it in quotes";
    for (key, value, expected) in [
        ("trace", "True", choice),
        ("trace", "FALSE", choice),
        ("trace", "yes # please", choice),
        ("trace", "off", choice),
        ("trace", "truely", text),
        ("timeout", "1s", behind),
        ("timeout", "20 ms", behind),
        ("unit", "1;", behind),
        ("endpoint", "tcp://192.0.2.1", text),
    ] {
        assert_eq!(
            mistakes(&of_wire(&format!("{key} = {value}"))),
            [format!("site.toml:4:{}: this is not TOML: {expected}", key.len() + 4)]
        );
    }
}

/// A device of that profile with this in it.
fn device_of(profile: &str, more: &str) -> String {
    device_with("more", more).replace("datakom-d", profile)
}

#[test]
fn what_a_controller_cannot_be_or_do() {
    let (d, dkg, hat, acc) = ("datakom-d", "datakom-dkg705", "smartgen-hat821si", "smartgen-acc1700");
    for (profile, more, expected) in [
        (d, "model = \"d-500\"", "9: datakom-d knows no model `d-500`; did you mean `D-500`?"),
        (
            d,
            "model = \"D-800\"",
            "9: datakom-d knows no model `D-800`; write one of: D-300, D-500, D-700, D-545",
        ),
        (
            dkg,
            "model = \"D-500\"",
            "9: datakom-dkg705 knows no model `D-500`; leave `model` out: datakom-dkg705 is for the DKG-705 alone",
        ),
        (
            acc,
            "model = \"ACC1700CAM\"",
            "9: smartgen-acc1700 knows no model `ACC1700CAM`; did you mean `ACC1700CAN`?",
        ),
        (
            d,
            "desired_mode = \"load_test\"",
            "16: datakom-d shows no mode `load_test`; write one of: off, manual, auto, test",
        ),
        (d, "desired_mode = \"AUTO\"", "16: datakom-d shows no mode `AUTO`; did you mean `auto`?"),
        (
            dkg,
            "desired_mode = \"manual\"",
            "16: datakom-dkg705 shows no mode `manual`; write one of: off, auto, test, load_test",
        ),
        (
            hat,
            "desired_mode = \"off\"",
            "16: smartgen-hat821si shows no mode `off`; write one of: manual, auto",
        ),
        (
            acc,
            "desired_mode = \"auto\"",
            "16: smartgen-acc1700 shows no mode `auto`; write one of: off, manual",
        ),
    ] {
        assert_eq!(mistakes(&device_of(profile, more)), [format!("site.toml:10:{expected}")]);
    }
    for (profile, more) in [
        (dkg, "model = \"DKG-705\"\ndesired_mode = \"load_test\""),
        (hat, "model = \"HAT821SI\"\ndesired_mode = \"manual\"\nnameplate_kw = 630"),
        (acc, "model = \"ACC1700\"\ndesired_mode = \"off\"\ntank_litres = 60\nbattery_volts = 12"),
    ] {
        assert_eq!(warned(&device_of(profile, more)), [""; 0]);
    }
    assert_eq!(
        warned(&device_of(hat, "tank_litres = 5\nbattery_volts = 24")),
        [
            "site.toml:10:15: smartgen-hat821si reads no fuel level, so `tank_litres` shows nothing; leave it out",
            "site.toml:11:17: smartgen-hat821si reads no battery voltage, so `battery_volts` shows nothing; leave \
             it out",
        ]
    );
}

#[test]
fn a_profile_without_models_or_modes_wants_neither() {
    let text = "model = \"X\"\ndesired_mode = \"auto\"";
    let mut profile = busbar_profile::builtin("datakom-dkg705").unwrap().clone();
    profile.models.clear();
    for point in &mut profile.points {
        point.signal = None;
    }
    let mut findings = Collector::new("site.toml", text);
    let at = |span: std::ops::Range<usize>, value: &str| At { value: value.to_owned(), span };
    assert_eq!(devices::model(at(8..11, "X"), &profile, &mut findings), None);
    assert_eq!(devices::mode(at(27..33, "auto"), &profile, &mut findings), None);
    assert_eq!(
        findings.finish().unwrap_err().to_string(),
        "site.toml:1:9: datakom-dkg705 knows no model `X`; leave `model` out: this profile names none\n\
         site.toml:2:16: datakom-dkg705 shows no mode `auto`; leave `desired_mode` out: this controller tells no mode"
    );
}

#[test]
fn a_time_zone_is_one_of_the_database() {
    let zone = |zone: &str| format!("[site]\nname = \"S\"\ntime_zone = \"{zone}\"");
    for (written, read) in [
        ("Europe/Berlin", "Europe/Berlin"),
        ("europe/kyiv", "Europe/Kyiv"),
        ("UTC", "UTC"),
        ("Etc/GMT-2", "Etc/GMT-2"),
        ("America/Argentina/Ushuaia", "America/Argentina/Ushuaia"),
    ] {
        let site = Site::parse("site.toml", &zone(written)).unwrap_or_else(|findings| panic!("{findings}"));
        assert_eq!(site.time_zone.as_deref(), Some(read));
    }
    let usual = "write its name in the IANA database, such as \"Europe/Berlin\" or \"UTC\"";
    for (written, remedy) in [
        ("Berlin", "did you mean \"Europe/Berlin\"?"),
        ("Europe/New York", "did you mean \"America/New_York\"?"),
        ("Europe/Berln", "did you mean \"Europe/Berlin\"?"),
        ("UTC+2", usual),
        ("GMT+2", usual),
        ("Etc/Unknown", usual),
        ("../../etc/passwd", usual),
        ("", usual),
    ] {
        assert_eq!(
            mistakes(&zone(written)),
            [format!("site.toml:3:13: `{written}` is no time zone; {remedy}")]
        );
    }
}

#[test]
fn a_slow_rate_alone_is_held_against_the_usual_fast_one() {
    assert_eq!(
        mistakes(&device_with("poll", "poll = { slow = \"500ms\" }")),
        [
            "site.toml:10:17: `slow` is shorter than `fast`, which is 1s; make `slow` at least as long as `fast`"
        ]
    );
    // Against a wrong one it is held against nothing.
    assert_eq!(
        mistakes(&device_with("poll", "poll = { fast = \"2\", slow = \"500ms\" }")),
        [
            "site.toml:10:17: `2` is no duration; write a number and ms, s, min or h, such as \"500ms\" or \"10s\""
        ]
    );
}

#[test]
fn one_port_is_one_wire_whatever_is_spoken_on_it() {
    let text = with(
        "[[wires]]\nid = \"w\"\nendpoint = \"tcp://192.0.2.1\"\n\
         [[wires]]\nid = \"x\"\nendpoint = \"rtu+tcp://192.0.2.1:502\"",
    );
    assert_eq!(
        mistakes(&text),
        [
            "site.toml:7:12: `rtu+tcp://192.0.2.1:502` is the endpoint of the wire `w` already; put all devices that are \
             reached through it on the wire `w`"
        ]
    );
}

#[test]
fn a_faulty_device_is_on_its_wire_all_the_same() {
    // The second one has no profile, and the unit is taken nevertheless.
    let text = format!(
        "{}[[devices]]\nid = \"h\"\nprofile = \"datakom-y\"\nwire = \"w\"\nunit = 1",
        device_with("profile", "profile = \"datakom-x\"")
    );
    assert_eq!(
        mistakes(&text),
        [
            "site.toml:7:11: there is no profile `datakom-x`; did you mean `datakom-d`?",
            "site.toml:12:11: there is no profile `datakom-y`; did you mean `datakom-d`?",
            "site.toml:14:8: unit 1 on wire w is g already; give every device on a wire a unit id of its own",
        ]
    );
}
