//! The single-line diagram: what it may say, and each mistake in it.

use super::*;

/// A D-500 `g`, a DKG-705 `k`, a transfer switch `s` and a compressor `a`, and this.
fn drawn(diagram: &str) -> String {
    with(&format!(
        "wires = [{{ id = \"w\", endpoint = \"tcp://h\" }}]\n\
         devices = [\n\
         {{ id = \"g\", profile = \"datakom-d\", wire = \"w\", unit = 1 }},\n\
         {{ id = \"k\", profile = \"datakom-dkg705\", wire = \"w\", unit = 2 }},\n\
         {{ id = \"s\", profile = \"smartgen-hat821si\", wire = \"w\", unit = 3 }},\n\
         {{ id = \"a\", profile = \"smartgen-acc1700\", wire = \"w\", unit = 4 }},\n\
         ]\n{diagram}"
    ))
}

/// Two nodes `m` and `b`, and a line between them with this in it.
fn line_with(more: &str) -> String {
    drawn(&format!(
        "nodes = [{{ id = \"m\", kind = \"mains\" }}, {{ id = \"b\", kind = \"bus\" }}]\n[[connections]]\n{more}"
    ))
}

/// One node with this in it, on a bus.
fn node_with(more: &str) -> String {
    drawn(&format!(
        "connections = [{{ from = \"n\", to = \"b\" }}]\n[[nodes]]\nid = \"b\"\nkind = \"bus\"\n\
         [[nodes]]\nid = \"n\"\n{more}"
    ))
}

#[test]
fn a_node_says_what_describes_it() {
    for (more, expected) in [
        ("kind = \"mains\"", (NodeKind::Mains, "n", None, None)),
        ("kind = \"mains\"\ndevice = \"g\"", (NodeKind::Mains, "n", Some("g"), Some("mains"))),
        ("kind = \"genset\"\ndevice = \"k\"", (NodeKind::Genset, "n", Some("k"), Some("genset"))),
        ("kind = \"compressor\"\ndevice = \"a\"", (NodeKind::Compressor, "n", Some("a"), Some("compressor"))),
        ("kind = \"bus\"\ndevice = \"g\"", (NodeKind::Bus, "n", Some("g"), None)),
        ("kind = \"load\"\ndevice = \"s\"", (NodeKind::Load, "n", Some("s"), None)),
        (
            "kind = \"mains\"\ndevice = \"s\"\nsignals = \"src2\"\nname = \" <i>Grid</i> \"",
            (NodeKind::Mains, "<i>Grid</i>", Some("s"), Some("src2")),
        ),
        (
            "kind = \"bus\"\ndevice = \"g\"\nsignals = \"plant\"",
            (NodeKind::Bus, "n", Some("g"), Some("plant")),
        ),
    ] {
        let site = Site::parse("site.toml", &node_with(more)).unwrap_or_else(|findings| panic!("{findings}"));
        let Node { kind, name, device, signals, .. } = &site.diagram.nodes[1];
        assert_eq!((*kind, name.as_str(), device.as_deref(), signals.as_deref()), expected, "{more}");
        assert!(site.warnings.is_empty(), "{:?}", site.warnings);
    }
}

#[test]
fn a_line_says_where_its_breaker_is_told() {
    let text = line_with("from = \"m\"\nto = \"b\"\ndevice = \"s\"\nbreaker = \"breaker.tie.closed\"");
    let site = Site::parse("site.toml", &text).unwrap();
    let expected = Connection {
        from: "m".to_owned(),
        to: "b".to_owned(),
        device: Some("s".to_owned()),
        breaker: Some("breaker.tie.closed".to_owned()),
    };
    assert_eq!(site.diagram.connections, [expected]);
    assert!(site.warnings.is_empty());
    // Two breakers side by side are two lines.
    let text = format!("{text}\n[[connections]]\nfrom = \"b\"\nto = \"m\"");
    assert_eq!(Site::parse("site.toml", &text).unwrap().diagram.connections.len(), 2);
}

#[test]
fn every_mistake_in_a_node() {
    for (more, expected) in [
        ("", "site.toml:13:1: `kind` is missing in [[nodes]]; add `kind = \"bus\"`"),
        ("kind = \"gensets\"", "site.toml:15:8: `gensets` is no kind of node; did you mean `genset`?"),
        (
            "kind = \"transformer\"",
            "site.toml:15:8: `transformer` is no kind of node; write one of: mains, genset, bus, load, compressor",
        ),
        (
            "kind = \"bus\"\nname = \"\\u202E\"",
            "site.toml:16:8: `name` holds U+202E as character 1, which nobody sees; leave it out: names are one \
             line of visible characters",
        ),
        ("kind = \"mains\"\ndevice = \"G\"", "site.toml:16:10: there is no device `G`; did you mean `g`?"),
        (
            "kind = \"mains\"\ndevice = \"generator\"",
            "site.toml:16:10: there is no device `generator`; write one of: a, g, k, s",
        ),
        (
            "kind = \"mains\"\ndevice = \"s\"",
            "site.toml:16:10: s (smartgen-hat821si) has no signals of `mains`; add `signals` with one of: genset, \
             load1, load2, src1, src2, tie; or leave `device` out",
        ),
        (
            "kind = \"genset\"\ndevice = \"a\"",
            "site.toml:16:10: a (smartgen-acc1700) has no signals of `genset`; add `signals` with one of: \
             compressor, engine; or leave `device` out",
        ),
        (
            "kind = \"compressor\"\ndevice = \"g\"",
            "site.toml:16:10: g (datakom-d) has no signals of `compressor`; add `signals` with one of: engine, \
             genset, mains, plant; or leave `device` out",
        ),
        (
            "kind = \"mains\"\ndevice = \"s\"\nsignals = \"scr1\"",
            "site.toml:17:11: s (smartgen-hat821si) has no signals of `scr1`; did you mean `src1`?",
        ),
        (
            "kind = \"mains\"\ndevice = \"g\"\nsignals = \"alarm\"",
            "site.toml:17:11: g (datakom-d) has no signals of `alarm`; write one of: engine, genset, mains, plant",
        ),
        (
            "kind = \"mains\"\ndevice = \"g\"\nsignals = \"\"",
            "site.toml:17:11: g (datakom-d) has no signals of ``; write one of: engine, genset, mains, plant",
        ),
        (
            "kind = \"mains\"\nsignals = \"mains\"",
            "site.toml:16:11: `signals` needs a device that measures them; add `device`, or leave `signals` out",
        ),
        (
            "kind = \"bus\"\n[[nodes]]\nid = \"b\"\nkind = \"bus\"",
            "site.toml:17:6: there is a node `b` already; give every node an id of its own",
        ),
        (
            "kind = \"bus\"\n[[nodes]]\nid = \"b/c\"\nkind = \"bus\"",
            "site.toml:17:6: `b/c` cannot be an id; write 1 to 64 letters a-z or A-Z, digits, - and _; `name` takes \
             any text",
        ),
    ] {
        assert_eq!(mistakes(&node_with(more)), [expected], "{more}");
    }
    let nobody = with("nodes = [{ id = \"n\", kind = \"mains\", device = \"g\" }]");
    assert_eq!(
        mistakes(&nobody),
        ["site.toml:2:47: there is no device `g`; define it: [[devices]] with that id"]
    );
}

#[test]
fn every_mistake_in_a_connection() {
    let line = "from = \"m\"\nto = \"b\"\n";
    for (more, expected) in [
        ("from = \"m\"".to_owned(), "site.toml:10:1: `to` is missing in [[connections]]; add `to = \"bus\"`"),
        (
            "to = \"m\"".to_owned(),
            "site.toml:10:1: `from` is missing in [[connections]]; add `from = \"mains\"`",
        ),
        (
            "from = \"m\"\nto = \"m\"".to_owned(),
            "site.toml:12:6: `m` is connected to itself; write the node at the other end of the line",
        ),
        (
            "from = \"m\"\nto = \"B\"".to_owned(),
            "site.toml:12:6: the node `B` is not defined; write `b` if you mean that, or define it with [[nodes]]",
        ),
        (
            "from = \"mains\"\nto = \"b\"".to_owned(),
            "site.toml:11:8: the node `mains` is not defined; write one of: b, m; or define it with [[nodes]]",
        ),
        (
            format!("{line}device = \"x1\""),
            "site.toml:13:10: there is no device `x1`; write one of: a, g, k, s",
        ),
        (
            format!("{line}device = \"x1\"\nbreaker = \"breaker.mains.closed\""),
            "site.toml:13:10: there is no device `x1`; write one of: a, g, k, s",
        ),
        (
            format!("{line}breaker = \"breaker.mains.closed\""),
            "site.toml:13:11: `breaker` needs a device that reports it; add `device`, or leave `breaker` out",
        ),
        (
            format!("{line}device = \"g\"\nbreaker = \"breaker.main.closed\""),
            "site.toml:14:11: g (datakom-d) reports no `breaker.main.closed`; did you mean `breaker.mains.closed`?",
        ),
        (
            format!("{line}device = \"s\"\nbreaker = \"breaker.mains.closed\""),
            "site.toml:14:11: s (smartgen-hat821si) reports no `breaker.mains.closed`; write one of: \
             breaker.src1.closed, breaker.src2.closed, breaker.tie.closed",
        ),
        (
            format!("{line}device = \"g\"\nbreaker = \"mains.failed\""),
            "site.toml:14:11: g (datakom-d) reports no `mains.failed`; write one of: breaker.busbar.closed, \
             breaker.genset.closed, breaker.mains.closed",
        ),
        (
            format!("{line}device = \"a\"\nbreaker = \"breaker.mains.closed\""),
            "site.toml:14:11: a (smartgen-acc1700) reports no `breaker.mains.closed`; leave `device` and `breaker` \
             out: this controller reports no breaker",
        ),
        (
            format!("{line}[[connections]]\n{line}"),
            "site.toml:15:6: `m` and `b` are connected already; leave one of the two connections out",
        ),
        (
            format!("{line}[[connections]]\nfrom = \"b\"\nto = \"m\""),
            "site.toml:15:6: `b` and `m` are connected already; leave one of the two connections out",
        ),
    ] {
        assert_eq!(mistakes(&line_with(&more)), [expected], "{more}");
    }
    let nodeless = drawn("connections = [{ from = \"m\", to = \"n\" }]");
    assert_eq!(
        mistakes(&nodeless),
        [
            "site.toml:9:25: the node `m` is not defined; define it: [[nodes]] with id = \"m\" and its kind",
            "site.toml:9:35: the node `n` is not defined; define it: [[nodes]] with id = \"n\" and its kind"
        ]
    );
}

#[test]
fn a_mistake_hides_no_other_and_makes_none() {
    // The device, the node and the wire are there, whatever else is wrong with them.
    let text = drawn(
        "[[nodes]]\nid = \"m\"\nkind = \"maisn\"\ndevice = \"g\"\n\
         [[nodes]]\nid = \"b\"\nkind = \"bus\"\nsignals = \"mains\"\ndevice = \"q\"\n\
         [[connections]]\nfrom = \"m\"\nto = \"b\"\ndevice = \"g\"\nbreaker = \"breaker.mains.close\"\n\
         [[connections]]\nfrom = \"m\"\nto = \"c\"\ndevice = \"k\"\nbreaker = \"breaker.mains.closed\"\n",
    )
    .replace("profile = \"datakom-dkg705\"", "profile = \"datakom-dkg\"")
    .replace("unit = 1", "unit = 0");
    let found = mistakes(&text);
    assert_eq!(
        found,
        [
            "site.toml:4:55: datakom-d knows no unit 0; write a number from 1 to 240",
            "site.toml:5:23: there is no profile `datakom-dkg`; did you mean `datakom-dkg705`?",
            "site.toml:11:8: `maisn` is no kind of node; did you mean `mains`?",
            "site.toml:17:10: there is no device `q`; write one of: a, g, k, s",
            "site.toml:22:11: g (datakom-d) reports no `breaker.mains.close`; did you mean `breaker.mains.closed`?",
            "site.toml:25:6: the node `c` is not defined; write one of: b, m; or define it with [[nodes]]"
        ]
    );
}

#[test]
fn what_deserves_a_look_in_a_diagram() {
    let line = "from = \"m\"\nto = \"b\"\n";
    let breaker = "device = \"g\"\nbreaker = \"breaker.mains.closed\"\n";
    assert_eq!(
        warned(&line_with(&format!("{line}device = \"g\""))),
        [
            "site.toml:13:10: `device` stands here without a breaker, so the line shows no position; add `breaker`, \
             or leave `device` out"
        ]
    );
    let loose = drawn(
        "nodes = [{ id = \"m\", kind = \"mains\" }, { id = \"b\", kind = \"bus\" }, { id = \"l\", kind = \"load\" }]\n\
         connections = [{ from = \"m\", to = \"b\" }]",
    );
    assert_eq!(
        warned(&loose),
        [
            "site.toml:9:75: nothing connects the node `l`; add a [[connections]] with it in `from` or `to`, or \
             leave it out"
        ]
    );
    let twice = line_with(&format!("{line}{breaker}[[connections]]\nfrom = \"c\"\nto = \"b\"\n{breaker}"))
        .replace("kind = \"bus\" }]", "kind = \"bus\" }, { id = \"c\", kind = \"mains\" }]");
    assert_eq!(
        warned(&twice),
        [
            "site.toml:19:11: breaker.mains.closed of g stands between `m` and `b` already; name the breaker in one \
             connection alone: it is in one place"
        ]
    );
}
