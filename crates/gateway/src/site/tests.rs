use super::*;

const WHOLE: &str = r#"
[site]
name = "North hospital"

[server]
listen = "[::1]:9090"

[[wires]]
id = "gen1"
endpoint = "tcp://192.0.2.20"
timeout = "500ms"

[[wires]]
id = "bus"
endpoint = "rtu:///dev/ttyUSB0?baud=19200"
spacing = "20ms"

[[wires]]
id = "converter"
endpoint = "rtu+tcp://192.0.2.30:4001"

[[devices]]
id = "gen1"
name = " Genset 1 "
profile = "datakom-d"
wire = "gen1"
unit = 1
word_order = "high-first"
poll = { fast = "500ms", slow = "1min" }

[[devices]]
id = "gen-2"
profile = "datakom-d"
wire = "bus"
unit = 0x10
"#;

/// The least there can be, with a line more.
fn with(more: &str) -> String {
    format!("site.name = \"S\"\n{more}")
}

/// One wire, one device, and `line` in place of the device's line of that key.
fn device_with(key: &str, line: &str) -> String {
    let mut lines = vec!["id = \"g\"", "profile = \"datakom-d\"", "wire = \"w\"", "unit = 1"];
    match lines.iter().position(|known| known.starts_with(&format!("{key} "))) {
        Some(index) => lines[index] = line,
        None => lines.push(line),
    }
    with(&format!(
        "[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\n[[devices]]\n{}\n",
        lines.into_iter().filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
    ))
}

fn mistakes(text: &str) -> Vec<String> {
    match Site::parse("site.toml", text) {
        Ok(site) => panic!("accepted: {site:?}"),
        Err(findings) => findings.iter().map(ToString::to_string).collect(),
    }
}

#[test]
fn a_whole_site_file() {
    let site = Site::parse("site.toml", WHOLE).unwrap();
    assert_eq!((site.name.as_str(), site.listen.to_string().as_str()), ("North hospital", "[::1]:9090"));
    assert_eq!(site.wires[0].endpoint.to_string(), "tcp://192.0.2.20:502");
    assert_eq!(site.wires[0].timeout, Some(Duration::from_millis(500)));
    assert_eq!((site.wires[1].timeout, site.wires[0].spacing), (None, None));
    assert_eq!(site.wires[1].spacing, Some(Duration::from_millis(20)));
    assert!(site.warnings.is_empty());
    let [first, second] = site.devices.as_slice() else { panic!("two devices") };
    assert_eq!((first.name.as_str(), first.wire, first.unit), ("Genset 1", 0, 1));
    assert_eq!(first.word_order, WordOrder::HighFirst);
    assert_eq!(first.poll, Poll { fast: Duration::from_millis(500), slow: Duration::from_secs(60) });
    assert_eq!((second.name.as_str(), second.wire, second.unit), ("gen-2", 1, 16));
    assert_eq!((second.word_order, second.poll), (WordOrder::LowFirst, Poll::default()));
}

#[test]
fn the_least_site_listens_on_this_machine_only() {
    let site = Site::parse("site.toml", &with("")).unwrap();
    assert_eq!(site.listen.to_string(), "127.0.0.1:8080");
    assert!(site.wires.is_empty() && site.devices.is_empty());
}

#[test]
fn a_fast_rate_slower_than_the_usual_slow_one_takes_it_along() {
    let site = Site::parse("site.toml", &device_with("poll", "poll = { fast = \"30s\" }")).unwrap();
    assert_eq!(site.devices[0].poll.slow, Duration::from_secs(30));
}

#[test]
fn every_mistake_has_its_place_and_remedy() {
    for (text, expected) in [
        ("", "site.toml:1:1: `site` is missing in a site file; add `site = { name = \"North hospital\" }`"),
        ("[site]\n", "site.toml:1:1: `name` is missing in [site]; add `name = \"North hospital\"`"),
        ("site = 1", "site.toml:1:8: `site` has the wrong type (integer); write a table"),
        ("[site]\nname = 5", "site.toml:2:8: `name` has the wrong type (integer); write a text in quotes"),
        (
            "[site]\nname = \" \"",
            "site.toml:2:8: this cannot be a name; write 1 to 200 characters on one line",
        ),
        (
            "[site]\nname = \"a\\nb\"",
            "site.toml:2:8: this cannot be a name; write 1 to 200 characters on one line",
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
            "site.toml:2:1: unknown key `colour` in a site file; write one of: site, server, wires, devices",
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
            "site.toml:4:12: `10.0.0.1:502` is no endpoint: no scheme; write tcp://10.0.0.1:502 or",
        ),
        (
            &with("[[wires]]\nid = \"w 1\"\nendpoint = \"tcp://h\""),
            "site.toml:3:6: `w 1` cannot be an id; write 1 to 64 letters a-z, digits, - and _; `name` takes any text",
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
            "site.toml:4:12: `tcp://h:0` cannot be connected to: nothing listens on port 0; write the port of the device",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tls://h\""),
            "site.toml:4:12: `tls://h:802` cannot be spoken: this version has no TLS; write a tcp:// endpoint;",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"rtu://pty\""),
            "site.toml:4:12: `rtu://pty?baud=9600&parity=none&stop=1` cannot be connected to: `pty` is no serial device; \
             write the device that the imitation printed, such as \"rtu:///dev/pts/3\"",
        ),
        (
            &with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\nspacing = \"11s\""),
            "site.toml:5:11: `spacing` is 11s; write a duration from 0s to 10s",
        ),
        (
            &with(
                "[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"\n[[wires]]\nid = \"x\"\nendpoint = \"tcp://H:502\"",
            ),
            "site.toml:7:12: `tcp://H:502` is the endpoint of the wire `w` already; put all devices",
        ),
        (
            &with(
                "[[wires]]\nid = \"w\"\nendpoint = \"rtu:///dev/a?baud=9600\"\n[[wires]]\nid = \"x\"\nendpoint = \"rtu:///dev/a?baud=19200\"",
            ),
            "site.toml:7:12: `rtu:///dev/a?baud=19200",
        ),
        (
            &device_with("profile", "profile = \"datakom-x\""),
            "site.toml:7:11: there is no profile `datakom-x`; write one of: datakom-d",
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
            "site.toml:10:30: `slow` is shorter than `fast`; make `slow` at least as long as `fast`",
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
        ("[site]\nname = \"S", "site.toml:2:10: this is not TOML: invalid basic string"),
    ] {
        let found = mistakes(text);
        assert_eq!(found.len(), 1, "{text}\n{found:#?}");
        assert!(found[0].starts_with(expected), "{text}\nexpected {expected}\nfound    {}", found[0]);
    }
}

#[test]
fn all_mistakes_are_told_at_once() {
    let text = WHOLE
        .replace("listen", "listne")
        .replace("\"datakom-d\"\nwire = \"gen1\"", "\"datakom\"\nwire = \"gen\"")
        .replace("0x10", "0");
    let found = mistakes(&text);
    let lines: Vec<&str> = found.iter().map(|line| line.split(':').nth(1).unwrap()).collect();
    assert_eq!(lines, ["6", "25", "26", "35"], "{found:#?}");
}

#[test]
fn a_wire_with_a_bad_endpoint_is_one_mistake() {
    let text = device_with("", "").replace("tcp://h", "tcp//h");
    assert_eq!(mistakes(&text).len(), 1);
}

/// A wire of this endpoint with devices of these profiles, units 1, 2, 3 and so on.
fn line(endpoint: &str, profiles: &[&str]) -> String {
    let mut text = with(&format!("[[wires]]\nid = \"w\"\nendpoint = \"{endpoint}\"\n"));
    for (index, profile) in profiles.iter().enumerate() {
        let unit = index + 1;
        text +=
            &format!("[[devices]]\nid = \"d{unit}\"\nprofile = \"{profile}\"\nwire = \"w\"\nunit = {unit}\n");
    }
    text
}

#[test]
fn a_line_is_set_as_every_device_on_it_can_be() {
    let (dkg, hat, acc) = ("datakom-dkg705", "smartgen-hat821si", "smartgen-acc1700");
    for (endpoint, profiles, expected) in [
        (
            "rtu:///dev/a?baud=19200",
            &[dkg][..],
            &[
                "d1 (datakom-dkg705) cannot be set to 19200 baud; write baud=9600, and set every device on the line to it",
            ][..],
        ),
        (
            "rtu:///dev/a?baud=2400",
            &[hat, acc],
            &[
                "d2 (smartgen-acc1700) cannot be set to 2400 baud; write one of baud=9600, baud=19200, and set every device \
               on the line to it",
            ],
        ),
        (
            "rtu:///dev/a?baud=1200&parity=even&stop=2",
            &[hat, dkg],
            &[
                "d1 (smartgen-hat821si) and d2 (datakom-dkg705) cannot be set to 1200 baud; write baud=9600, and set every \
                 device on the line to it",
                "d2 (datakom-dkg705) cannot be set to even parity; write parity=none, and set every device on the line to it",
                "d2 (datakom-dkg705) cannot be set to 2 stop bits; write stop=1, and set every device on the line to it",
            ],
        ),
    ] {
        let found = mistakes(&line(endpoint, profiles));
        let expected: Vec<String> = expected.iter().map(|text| format!("site.toml:4:12: {text}")).collect();
        assert_eq!(found, expected);
    }
    for (endpoint, profiles) in [
        ("rtu:///dev/a", &[dkg, hat, acc][..]),
        ("rtu:///dev/a?baud=19200&parity=odd&stop=2", &[hat, acc]),
        ("rtu+tcp://converter:4001", &[dkg, hat]),
        ("tcp://converter", &[dkg, hat]),
    ] {
        let site = Site::parse("site.toml", &line(endpoint, profiles)).unwrap();
        assert!(site.warnings.is_empty(), "{endpoint}: {:?}", site.warnings);
    }
}

#[test]
fn devices_that_have_no_setting_in_common_need_wires_of_their_own() {
    let text = line("rtu:///dev/a", &["datakom-dkg705", "datakom-d"]);
    let site = Site::parse("site.toml", &text).unwrap();
    let mut fast = site.devices[1].profile.clone();
    fast.wire.serial.baud = vec![38_400];
    let place = |device: SiteDevice| PlacedDevice { device, wire: 0..0, unit: 0..0 };
    let fast = SiteDevice { profile: Box::leak(Box::new(fast)), ..site.devices[1].clone() };
    let wires = [PlacedWire { id: "w".to_owned(), wire: Some(site.wires[0].clone()), endpoint: 0..0 }];
    let mut findings = Collector::new("site.toml", &text);
    checks::serial(&wires, &[place(site.devices[0].clone()), place(fast)], &mut findings);
    assert!(
        findings
            .finish()
            .unwrap_err()
            .to_string()
            .contains("; these devices have no such setting in common: give")
    );
}

#[test]
fn what_deserves_a_look_is_no_mistake() {
    let smartgen = |count| vec!["smartgen-acc1700"; count];
    let warned = |text: &str| {
        let site = Site::parse("site.toml", text).unwrap();
        site.warnings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(warned(&line("rtu:///dev/a", &smartgen(32))), [""; 0]);
    assert_eq!(
        warned(&line("rtu:///dev/a", &smartgen(34))),
        [
            "site.toml:168:8: 34 SmartGen units are on the wire `w`, and one RS-485 line carries 32; give the others a line \
          of their own, or put a repeater between"
        ]
    );
    let dkg = |unit| line("rtu:///dev/a", &["datakom-dkg705"]).replace("unit = 1", &format!("unit = {unit}"));
    assert_eq!(warned(&dkg(144)), [""; 0]);
    assert_eq!(
        warned(&dkg(145)),
        [
            "site.toml:9:8: datakom-dkg705 can be set to unit 145, but its manual reaches units only up to 144; should d1 \
          not answer, give it a unit id from 1 to 144"
        ]
    );
    let found = mistakes(&dkg(251));
    assert_eq!(found, ["site.toml:9:8: datakom-dkg705 knows no unit 251; write a number from 1 to 250"]);
}

#[test]
fn the_sample_is_sound() {
    let sample = include_str!("../../../../examples/site.toml");
    let site = Site::parse("examples/site.toml", sample).unwrap_or_else(|findings| panic!("{findings}"));
    assert!(site.warnings.is_empty(), "{:?}", site.warnings);
    let on_the_line = site.devices.iter().filter(|device| site.wires[device.wire].id == "line");
    assert_eq!((on_the_line.count(), site.devices.len()), (3, 4));
    let schemes: Vec<&str> = site.wires.iter().map(|wire| wire.endpoint.scheme()).collect();
    assert_eq!(schemes, ["tcp", "rtu"]);
}
