use super::checks::OnWire;
use super::devices::PlacedDevice;
use super::reader::At;
use super::wires::PlacedWire;
use super::*;

mod diagram;
mod documents;
mod large;
mod limits;
mod mistakes;
mod names;

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

/// The warnings of a file without a mistake.
fn warned(text: &str) -> Vec<String> {
    let site = Site::parse("site.toml", text).unwrap_or_else(|findings| panic!("{findings}\n{text}"));
    site.warnings.iter().map(ToString::to_string).collect()
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
    assert_eq!(
        site.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        ["site.toml:19:6: no device is on the wire `converter`; put one on it, or leave the wire out"]
    );
    assert_eq!((site.time_zone.as_deref(), &site.diagram), (None, &Diagram::default()));
    assert!(!site.wires[0].trace);
    let [first, second] = site.devices.as_slice() else { panic!("two devices") };
    assert_eq!((first.name.as_str(), first.wire, first.unit), ("Genset 1", 0, 1));
    assert_eq!(first.word_order, WordOrder::HighFirst);
    assert_eq!(first.poll, Poll { fast: Duration::from_millis(500), slow: Duration::from_secs(60) });
    assert_eq!((second.name.as_str(), second.wire, second.unit), ("gen-2", 1, 16));
    assert_eq!((second.word_order, second.poll), (WordOrder::LowFirst, Poll::default()));
    assert_eq!((&first.model, &first.desired_mode, first.nameplate), (&None, &None, Nameplate::default()));
}

#[test]
fn the_least_site_listens_on_this_machine_only() {
    let site = Site::parse("site.toml", &with("")).unwrap();
    assert_eq!(site.listen.to_string(), "127.0.0.1:8080");
    assert!(site.wires.is_empty() && site.devices.is_empty());
    let nothing = "site.toml:1:1: no device is in this file, so there is nothing to show; add [[wires]] and [[devices]]";
    assert_eq!(warned(&with("")), [nothing]);
    // Wires without devices are not told again one by one.
    assert_eq!(warned(&with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://h\"")), [nothing]);
}

#[test]
fn a_fast_rate_slower_than_the_usual_slow_one_takes_it_along() {
    let site = Site::parse("site.toml", &device_with("poll", "poll = { fast = \"30s\" }")).unwrap();
    assert_eq!(site.devices[0].poll.slow, Duration::from_secs(30));
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
fn what_the_file_wants_of_a_device_and_says_of_its_machine() {
    let more = "model = \"D-545\"\ndesired_mode = \"test\"\nnameplate_kw = 400\ntank_litres = 900.5\nbattery_volts = 0x18";
    let text = device_with("more", more)
        .replace("site.name = \"S\"", "site = { name = \"S\", time_zone = \"europe/berlin\" }")
        .replace("endpoint = \"tcp://h\"", "endpoint = \"tcp://h\"\ntrace = true");
    let site = Site::parse("site.toml", &text).unwrap();
    assert_eq!((site.time_zone.as_deref(), site.wires[0].trace), (Some("Europe/Berlin"), true));
    let device = &site.devices[0];
    assert_eq!((device.model.as_deref(), device.desired_mode.as_deref()), (Some("D-545"), Some("test")));
    let plates = Nameplate { power_kw: Some(400.0), tank_l: Some(900.5), battery_v: Some(24.0) };
    assert_eq!(device.nameplate, plates);
    assert!(site.warnings.is_empty(), "{:?}", site.warnings);
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
                "d1 (datakom-dkg705) cannot be set to 19200 baud; write baud=9600, and set every device on the line \
                 to it",
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
                "d2 (datakom-dkg705) cannot be set to even parity; write parity=none, and set every device on the \
                 line to it",
                "d2 (datakom-dkg705) cannot be set to 2 stop bits; write stop=1, and set every device on the line \
                 to it",
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
    let id = At { value: "w".to_owned(), span: 0..0 };
    let wire = PlacedWire { id, wire: Some(site.wires[0].clone()), endpoint: 0..0 };
    let devices = [place(site.devices[0].clone()), place(fast)];
    let mut findings = Collector::new("site.toml", &text);
    checks::serial(&[OnWire { wire: &wire, devices: devices.iter().collect() }], &mut findings);
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
