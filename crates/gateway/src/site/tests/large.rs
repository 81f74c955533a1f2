//! Sites larger than any: read in one go, with mistakes or without.

use std::fmt::Write;

use super::*;

const MANY: usize = 10_000;

/// Wires with 100 devices each, a node a device, and a line to each from one bus.
fn site() -> String {
    let mut text = with("");
    for wire in 0..MANY / 100 {
        writeln!(text, "[[wires]]\nid = \"w{wire}\"\nendpoint = \"tcp://h{wire}\"").unwrap();
    }
    for device in 0..MANY {
        let (wire, unit) = (device / 100, device % 100 + 1);
        writeln!(
            text,
            "[[devices]]\nid = \"d{device}\"\nprofile = \"datakom-d\"\nwire = \"w{wire}\"\nunit = {unit}"
        )
        .unwrap();
    }
    writeln!(text, "[[nodes]]\nid = \"bus\"\nkind = \"bus\"").unwrap();
    for node in 0..MANY {
        writeln!(text, "[[nodes]]\nid = \"n{node}\"\nkind = \"genset\"\ndevice = \"d{node}\"").unwrap();
        writeln!(
            text,
            "[[connections]]\nfrom = \"n{node}\"\nto = \"bus\"\ndevice = \"d{node}\"\n\
             breaker = \"breaker.genset.closed\""
        )
        .unwrap();
    }
    text
}

#[test]
fn ten_thousand_devices() {
    let site = Site::parse("site.toml", &site()).unwrap_or_else(|findings| panic!("{findings}"));
    assert_eq!((site.devices.len(), site.wires.len()), (MANY, MANY / 100));
    assert_eq!((site.diagram.nodes.len(), site.diagram.connections.len()), (MANY + 1, MANY));
    assert!(site.warnings.is_empty(), "{:?}", &site.warnings[..1]);
}

/// Quadratic work in 30,000 mistakes would take minutes.
#[test]
fn ten_thousand_devices_with_mistakes_everywhere() {
    let text = site()
        .replace("wire = \"w", "wire = \"x")
        .replace("from = \"n", "from = \"m")
        .replace("unit", "unti");
    let found = mistakes(&text);
    assert_eq!(found.len(), MANY * 4);
    assert_eq!(
        found[..3],
        [
            "site.toml:302:1: `unit` is missing in [[devices]]; add `unit = 1`",
            "site.toml:305:8: the wire `x0` is not defined; write `w0` if you mean that, or define it with [[wires]]",
            "site.toml:306:1: unknown key `unti` in [[devices]]; did you mean `unit`?",
        ]
    );
    assert_eq!(
        found.last().unwrap(),
        "site.toml:140301:8: the node `m9999` is not defined; write one of: bus, n0, n1, n10, n100, n1000, n1001, \
         n1002, n1003, n1004, n1005, n1006 and 9989 more; or define it with [[nodes]]"
    );
}

#[test]
fn ten_thousand_wires_with_one_device_each() {
    let mut text = with("");
    for wire in 0..MANY {
        writeln!(
            text,
            "[[wires]]\nid = \"w{wire}\"\nendpoint = \"tcp://h{wire}\"\n[[devices]]\nid = \"d{wire}\"\n\
             profile = \"datakom-d\"\nwire = \"w{wire}\"\nunit = 1"
        )
        .unwrap();
    }
    let site = Site::parse("site.toml", &text).unwrap_or_else(|findings| panic!("{findings}"));
    assert_eq!((site.devices.len(), site.devices[MANY - 1].wire), (MANY, MANY - 1));
}
