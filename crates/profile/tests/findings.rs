//! Every mistake that a profile file can hold has its own finding: where it is, what is wrong, what to write.
#![cfg(test)]

use std::fmt::Write as _;

use busbar_profile::vocabulary::Vocabulary;
use busbar_profile::{Findings, Profile};

/// A profile that uses every key but those of [`PROCEDURES`], and has no mistake.
const SOUND: &str = include_str!("sound.toml");

/// A profile that uses the keys of procedures and joined signals, and has no mistake.
const PROCEDURES: &str = include_str!("procedures.toml");

fn findings_of(text: &str) -> Result<Profile, Findings> {
    Profile::parse("profile.toml", text)
}

/// The sound profile with one text in it replaced.
fn edited(from: &str, to: &str) -> String {
    edited_of(SOUND, from, to)
}

fn edited_of(sound: &str, from: &str, to: &str) -> String {
    assert_eq!(sound.matches(from).count(), 1, "`{from}` must stand once in the file");
    sound.replacen(from, to, 1)
}

/// What is found in each edit of the sound profile.
fn report(edits: &[(&str, &str)]) -> String {
    report_of(SOUND, edits)
}

fn report_of(sound: &str, edits: &[(&str, &str)]) -> String {
    let mut report = String::new();
    for (from, to) in edits {
        let findings = match findings_of(&edited_of(sound, from, to)) {
            Ok(_) => panic!("nothing is found when `{from}` becomes `{to}`"),
            Err(findings) => findings,
        };
        let to = if to.is_empty() { "(nothing)" } else { to };
        writeln!(report, "{from}\n=> {to}\n{findings}\n").unwrap();
    }
    report
}

/// Compares with the snapshot `name`; the expression would only repeat the test.
fn check(name: &str, text: impl ToString) {
    insta::with_settings!({ omit_expression => true }, {
        insta::assert_snapshot!(name, text.to_string());
    });
}

#[test]
fn the_sound_profile_is_sound() {
    let profile = findings_of(SOUND).unwrap_or_else(|findings| panic!("{findings}"));
    assert_eq!(profile.points.len(), 24);
    assert_eq!(profile.wire.readable, [(0, 200), (300, 1100)]);
}

#[test]
fn text_that_is_no_toml() {
    check(
        "text_that_is_no_toml",
        report(&[
            ("format = 1", "format = "),
            ("vendor = \"Maker\"", "vendor = \"Maker"),
            ("title = \"A manual\"", "title = \"A manual\"\ntitle = \"Another\""),
            ("max_read = 16", "max_read = 016"),
            ("{ at = 20, id = \"lock\", name = \"Lock\" },", "{ at = 20, id = \"lock\", name = \"Lock\", },"),
            (
                "{ at = 20, id = \"lock\", name = \"Lock\" },",
                "{ at = 20,\n    id = \"lock\", name = \"Lock\" },",
            ),
            ("name = \"Lock\"", "name = \"\\x4Cock\""),
        ]),
    );
}

#[test]
fn keys_and_types() {
    check(
        "keys_and_types",
        report(&[
            ("max_read = 16", "max_reed = 16"),
            ("max_read = 16", ""),
            ("kind = \"genset\"", "kind = \"gen_set\""),
            ("over_read = \"refuse\"", "over_read = \"stall\""),
            ("at = 100,", "at = 70000,"),
            ("at = 100,", "at = \"100\","),
            ("at = 100,", "at = 100, colour = 3,"),
            ("count = 100,", "count = -1,"),
            ("[1, 3], [8, 8]", "[1, 3], 8"),
            ("[1, 3], [8, 8]", "[1, 3], [8]"),
            ("ratio = 0.1,", "ratio = \"0.1\","),
            ("ratio = 0.1,", "ratio = inf,"),
            ("hex = true", "hex = 1"),
            ("value = 0xA,", "value = 0x1A000,"),
            ("[manual]", "[handbook]"),
            ("points = [\n  { at = 100", "dots = [\n  { at = 100"),
            ("rate = \"on_demand\"", "rate = \"sometimes\""),
        ]),
    );
}

#[test]
fn settings_of_the_imitation() {
    check(
        "settings_of_the_imitation",
        report(&[
            ("id = \"crank_time\"", "id = \"Crank time\""),
            ("id = \"crank_time\"", "id = \"start_attempts\""),
            // A setting that a register shows.
            ("id = \"crank_time\"", "id = \"status\""),
            ("id = \"crank_time\"", "id = \"voltage\""),
            (
                "id = \"crank_time\", name = \"Crank timer\", value = 6,",
                "id = \"delay\", name = \"Delay\", value = 6.5,",
            ),
            ("name = \"Crank timer\"", "name = \" \""),
            ("value = 6, min", "value = 0, min"),
            ("max = 99, unit", "max = 5, unit"),
            ("max = 99, unit", "max = \"99\", unit"),
            ("settings = [", "timers = ["),
        ]),
    );
}

#[test]
fn several_mistakes_are_found_at_once() {
    let text = edited("type = \"sm24\"", "type = \"sm42\"")
        .replacen("name = \"Brand\"", "nam = \"Brand\"", 1)
        .replacen("bit = 15, id", "bit = -15, id", 1)
        .replacen("timeout_ms = 1000", "timeout = 1000", 1);
    check("several_mistakes_are_found_at_once_1", findings_of(&text).unwrap_err());
    let text = edited("signal = \"genset.l1.voltage\"", "signal = \"genset.l1.voltag\"")
        .replacen("at = 9000, id", "at = 9001, id", 1)
        .replacen("unit = \"bar\"", "unit = \"psi\"", 1)
        .replacen("timer = \"delay\"", "timer = \"dely\"", 1);
    check("several_mistakes_are_found_at_once_2", findings_of(&text).unwrap_err());
}

#[test]
fn head_and_identity() {
    check(
        "head_and_identity",
        report(&[
            ("format = 1", "format = 2"),
            ("key = \"sample\"", "key = \"Sample 1\""),
            ("vendor = \"Maker\"", "vendor = \" \""),
            ("models = [\"A\", \"B\"]", "models = []"),
            ("title = \"A manual\"", "title = \"\""),
            (
                "models = [{ value = 0xA, model = \"A\" }]",
                "models = [{ value = 10, model = \"A\" }, { value = 10, model = \"B\" }]",
            ),
            ("point = \"model_code\"\n", "point = \"modelcode\"\n"),
            ("point = \"model_code\"\n", "point = \"power\"\n"),
        ]),
    );
}

#[test]
fn wire() {
    check(
        "wire",
        report(&[
            ("min = 1, max = 254, default = 1", "min = 0, max = 254"),
            ("min = 1, max = 254, default = 1", "min = 9, max = 4"),
            ("min = 1, max = 254, default = 1", "min = 1, max = 9, default = 10"),
            ("functions = [3, 5, 6]", "functions = [5, 6]"),
            ("functions = [3, 5, 6]", "functions = [3, 5, 6, 200]"),
            ("functions = [3, 5, 6]", "functions = [3, 5, 6, 3]"),
            ("transports = [\"rtu\"]", "transports = []"),
            ("transports = [\"rtu\"]", "transports = [\"rtu\", \"rtu\"]"),
            ("max_read = 16", "max_read = 126"),
            ("max_write = 1\n", "max_write = 0\n"),
            ("max_write = 1\n", ""),
            ("timeout_ms = 1000", "timeout_ms = 0"),
            ("answer_delay_ms = 4.3", "answer_delay_ms = -1"),
            ("stop = [1]", "stop = [3]"),
            ("baud = [9600]", "baud = []"),
            ("parity = [\"none\"]", "parity = [\"none\", \"none\"]"),
            ("[[0, 200], [300, 511], [512, 1100]]", "[]"),
            ("[300, 511], [512, 1100]", "[300, 511], [511, 1100]"),
            ("[300, 511], [512, 1100]", "[300, 511], [1100, 512]"),
            ("code = 10, name", "code = 0, name"),
            ("name = \"write protection\"", "name = \"\""),
        ]),
    );
}

#[test]
fn lists() {
    check(
        "lists",
        report(&[
            ("choices = \"status\"", "choices = \"state\""),
            ("choices = \"status\"", "choices = \"statu\""),
            ("bits = \"alarms\"", "bits = \"faults\""),
            ("[choices.period]", "[choices.peri_od]"),
            ("value = 1, id = \"run\"", "value = 0, id = \"run\""),
            ("value = 1, id = \"run\"", "value = 1, id = \"rest\""),
            ("value = 1, id = \"run\"", "value = 1, id = \"Run\""),
            ("value = 1, id = \"run\"", "value = 70000, id = \"run\""),
            ("value = 0, id = \"day\"", "value = 4, id = \"day\""),
            ("values = [{ value = 0, id = \"day\", label = \"Day\" }]", "values = []"),
            ("reserved = [[4, 7]]", "reserved = [[7, 4]]"),
            ("reserved = [[4, 7]]", "reserved = [[1, 7]]"),
            ("state = \"running\"", "state = \"runing\""),
            ("label = \"Day\"", "label = \"Day\", state = \"running\""),
            ("label = \"Day\"", "label = \"Day \""),
            ("by_model = { A = \"Runs\" }", "by_model = { C = \"Runs\" }"),
            ("bit = 15, id = \"low_oil\"", "bit = 16, id = \"low_oil\""),
            ("bit = 15, id = \"low_oil\"", "bit = 0, id = \"low_oil\""),
            ("bit = 15, id = \"low_oil\"", "bit = 15, id = \"common\""),
            ("reserved = [[1, 3], [8, 8]]", "reserved = [[3, 1]]"),
            ("reserved = [[1, 3], [8, 8]]", "reserved = [[14, 15]]"),
            ("reserved = [[1, 3], [8, 8]]", "reserved = [[16, 900]]"),
            ("class = \"warning\", name", "name"),
            ("signal = \"breaker.genset.closed\"", "signal = \"breaker.gen.closed\""),
            ("signal = \"breaker.genset.closed\"", "signal = \"mode\""),
            ("signal = \"breaker.genset.closed\"", "state = \"running\""),
            ("signal = \"breaker.genset.closed\"", "clear = { label = \"Open \", state = \"stopped\" }"),
            (
                "signal = \"breaker.genset.closed\"",
                "state = \"running\", clear = { label = \"Open\", state = \"running\" }",
            ),
            (
                "label = \"Load test\" },",
                "label = \"Load test\", state = \"running\" },\n  { bit = 4, id = \"other\", label = \"On\", state = \"cranking\", clear = { label = \"Off\", state = \"stopped\" } },",
            ),
        ]),
    );
}

#[test]
fn points() {
    check(
        "points",
        report(&[
            ("id = \"voltage\"", "id = \"1voltage\""),
            ("id = \"voltage\"", "id = \"power\""),
            ("name = \"Voltage\"", "name = \"\""),
            ("name = \"Voltage\"", "name = \"Voltage\", doubt = \" \""),
            ("name = \"Voltage\"", "name = \"Voltage\", size = 16"),
            ("name = \"Voltage\"", "name = \"Voltage\", sentinels = [1, 2, 3, 4, 5]"),
            ("name = \"Voltage\"", "name = \"Voltage\", sentinels = [0x10000]"),
            ("name = \"Voltage\"", "name = \"Voltage\", timer = \"delay\""),
            ("coeff = 10, unit", "coeff = 10, ratio = 0.1, unit"),
            ("coeff = 10, unit", "coeff = 0, unit"),
            ("coeff = 10, unit", "coeff = -10, unit"),
            ("coeff = 10, unit", "coeff = 3, unit"),
            ("coeff = 10, unit", "ratio = 123456789.5, unit"),
            ("coeff = 10, unit = \"V\", signal = \"genset.l1.voltage\"", "unit = \"V\""),
            ("coeff = 10, unit = \"V\", signal = \"genset.l1.voltage\"", "signal = \"genset.l1.voltage\""),
            ("unit = \"V\"", "unit = \"volt\""),
            ("unit = \"degC\"", "unit = \"degc\""),
            ("unit = \"V\"", "unit = \"A\""),
            ("unit = \"bar\"", "unit = \"degC\""),
            ("unit = \"bar\", signal", "signal"),
            ("signal = \"genset.l1.voltage\"", "signal = \"genset.l1.volts\""),
            ("signal = \"genset.l1.voltage\"", "signal = \"state.engine\""),
            ("signal = \"state.engine\"", "signal = \"genset.l1.voltage\""),
            ("type = \"sm24\", coeff = 100", "type = \"bits\""),
            ("type = \"choice\", choices = \"period\", ", "type = \"choice\", "),
            ("type = \"fraction8\"", "type = \"fraction8\", coeff = 1"),
            ("size = 32", "size = 30"),
            ("size = 16, bits", "size = 257, bits"),
            ("size = 16, bits", "size = 0, bits"),
            ("size = 48", "size = 512"),
            ("count = 100,", "count = 0,"),
            ("count = 100,", "count = 102,"),
            ("mask = [15, 8]", "mask = [8, 15]"),
            ("mask = [15, 8]", "mask = [16, 8]"),
            ("mask = [15, 8]", "mask = [15, 7]"),
            ("mask = [15, 8]", "mask = [7, 0]"),
            ("mask = [1, 0]", "mask = [2, 0]"),
            ("mask = [1, 0], ", ""),
            ("at = 8, id", "at = 9, id"),
            ("at = 1, id", "at = 2, id"),
            ("at = 7, id", "at = 250, id"),
            ("at = 22, id", "at = 199, id"),
            ("at = 500, id", "at = 65100, id"),
            ("access = \"w\"", "access = \"rw\""),
            ("type = \"u16\", access = \"w\"", "type = \"u32\", access = \"w\""),
            ("timer = \"delay\"", "timer = \"alarms\""),
            ("timer = \"delay\"", "timer = \"clock\""),
            ("id = \"bulk\"", "id = \"engine\""),
            ("title = \"Bulk\"", "title = \"\""),
            ("sentinels = [0xFE, 0xFF]", "sentinels = []"),
            ("sentinels = [0xFE, 0xFF]", "sentinels = [0x7FFF]"),
        ]),
    );
}

#[test]
fn a_signal_has_one_carrier() {
    let text = edited("unit = \"kW\", name", "unit = \"kW\", signal = \"genset.power.active\", name")
        .replacen(
            "coeff = 1, unit = \"s\", name",
            "coeff = 1, unit = \"kW\", signal = \"genset.power.active\", name",
            1,
        );
    check("a_signal_has_one_carrier", findings_of(&text).unwrap_err());
}

#[test]
fn coils_and_commands() {
    check(
        "coils_and_commands",
        report(&[
            ("at = 20, id = \"lock\"", "at = 3, id = \"lock\""),
            ("at = 20, id = \"lock\"", "at = 20, id = \"load_key\""),
            ("name = \"Load key\"", "name = \"\""),
            ("id = \"key\"", "id = \"load\""),
            ("id = \"key\"", "id = \"Key\""),
            ("risk = \"stops_supply\"", "risk = \"high\""),
            ("function = 5, address = 3", "function = 15, address = 3"),
            ("function = 5, address = 3", "function = 16, address = 3"),
            ("function = 5, address = 3", "function = 5, address = 4"),
            ("value = 0xFF00", "value = 1"),
            ("value = 0xFF00", "value = 0x1FF00"),
            ("address = 9000, value = 4", "address = 9001, value = 4"),
            ("value = 4, arg = \"press\"", "value = 4, arg = \"pres\""),
            (", value = 4, arg = \"press\"", ""),
            ("value_by = {", "value = 1, value_by = {"),
            ("value_by = { point = \"model_code\"", "value_by = { point = \"keys\""),
            ("no_proof = \"nothing shows it\"", ""),
            ("no_proof = \"nothing shows it\"", "no_proof = \"\""),
            ("no_proof = \"nothing shows it\"", "no_proof = \"nothing\"\nproof = []"),
            ("{ point = \"options\", bit = 3, changes = true, within_s = 10 }", ""),
            ("bit = 3, changes = true, within_s = 10", "bit = 3, changes = true, within_s = 0"),
            ("bit = 3, changes = true, within_s = 10", "bit = 3, changes = true"),
            ("bit = 3, changes = true, within_s = 10", "bit = 4, changes = true, within_s = 10"),
            ("bit = 3, changes = true, within_s = 10", "changes = true, within_s = 10"),
            ("bit = 3, changes = true, within_s = 10", "bit = 3, within_s = 10"),
            ("bit = 3, changes = true, within_s = 10", "bit = 3, changes = false, within_s = 10"),
            ("bit = 15, equals = 0", "bit = 15, equals = 2"),
            ("bit = 15, equals = 0", "bit = 15, equals = 0, not_equals = 1"),
            ("bit = 15, equals = 0", "bit = 15, changes = true"),
            ("between = [1, 3]", "between = [3, 1]"),
            ("between = [1, 3]", "bit = 1, between = [1, 3]"),
            ("point = \"status\", between", "point = \"mac\", between"),
            ("point = \"status\", between", "point = \"stats\", between"),
            ("equals_arg = \"channel\"", "equals_arg = \"chanel\""),
            ("{ device = \"silent_then_back\"", "{ point = \"status\", device = \"silent_then_back\""),
            ("{ device = \"silent_then_back\"", "{ equals = 1, device = \"silent_then_back\""),
            (
                "{ id = \"long\", value = 0x4000 }], default = \"short\"",
                "{ id = \"long\", value = 0x4000 }], default = \"shrt\"",
            ),
            ("{ id = \"long\", value = 0x4000 }", "{ id = \"short\", value = 0x4000 }"),
            ("{ id = \"long\", value = 0x4000 }", "{ id = \"long\", value = 0 }"),
            ("max = 19 },", "max = 19, choices = [] },"),
            ("min = 0, max = 19 },", "min = 20, max = 19 },"),
            ("min = 0, max = 19 },", "min = 20 },"),
            ("name = \"channel\", min = 0, max = 19 },", "name = \"press\", min = 0, max = 19 },"),
            ("max = 19, default = \"3\"", "max = 19, default = \"20\""),
        ]),
    );
}

#[test]
fn procedures() {
    let profile = findings_of(PROCEDURES).unwrap_or_else(|findings| panic!("{findings}"));
    assert_eq!(profile.commands.iter().map(|command| command.steps.len()).collect::<Vec<_>>(), [2, 1, 2]);
    let steps = "  { write = { function = 6, address = 14, arg = \"time.minute\" }, proof = [{ point = \"minute\", equals_arg = \"time.minute\", within_s = 2 }] },\n  { write = { function = 6, address = 15, arg = \"time.second\" } },\n";
    let second = "{ arg = \"time.second\", between = [5, 45] }";
    let clock = "{ joined = \"clock\", equals_arg = \"time\", tolerance_s = 2, within_s = 5 }";
    check(
        "procedures",
        report_of(
            PROCEDURES,
            &[
                ("kind = \"time\"", "kind = \"date\""),
                ("kind = \"time\"", "kind = \"time\", min = 0, max = 9"),
                ("default = \"now\"", "default = \"noon\""),
                (steps, ""),
                (
                    "bit = 1, equals = 1 }, { point = \"status\", equals = 1 }], within_s = 300 }\nwrite = {",
                    "bit = 1, equals = 1 }], within_s = 300 }\nrite = {",
                ),
                (
                    "write = { function = 5, address = 0, value = 0xFF00 }\nproof = [{ point = \"status\", between",
                    "proof = [{ point = \"status\", between",
                ),
                (
                    "write = { function = 5, address = 0, value = 0xFF00 }\nproof = [{ point = \"status\", between",
                    "steps = []\nwrite = { function = 5, address = 0, value = 0xFF00 }\nproof = [{ point = \"status\", between",
                ),
                (
                    "  { write = { function = 6, address = 14,",
                    "  { hold = { any = [{ point = \"status\", equals = 1 }], within_s = 9 }, write = { function = 6, address = 14,",
                ),
                ("address = 15, arg = \"time.second\"", "address = 16, arg = \"time.second\""),
                ("address = 15, arg = \"time.second\"", "address = 15, arg = \"time\""),
                ("address = 15, arg = \"time.second\"", "address = 15, arg = \"time.seconds\""),
                ("address = 15, arg = \"time.second\"", "address = 15, arg = \"channel.second\""),
                ("address = 15, arg = \"time.second\"", "address = 15, arg = \"tine.second\""),
                ("equals_arg = \"time.year\"", "equals_arg = \"time\""),
                (second, "{ arg = \"time.second\", between = [5, 70] }"),
                (second, "{ arg = \"time.second\", bit = 1, equals = 1 }"),
                (second, "{ arg = \"time.second\", point = \"status\", equals = 1 }"),
                (second, "{ equals = 1 }"),
                (second, "{ arg = \"time.second\", changes = true }"),
                ("within_s = 300", "within_s = 0"),
                ("within_s = 300", "all = [{ point = \"status\", equals = 1 }], within_s = 300"),
                ("{ all = [{ point = \"status\", equals = 1 }], within_s = 30 }", "{ within_s = 30 }"),
                (clock, "{ joined = \"clock\", equals_arg = \"time\", within_s = 5 }"),
                (clock, "{ joined = \"clock\", tolerance_s = 2, within_s = 5 }"),
                (clock, "{ joined = \"clock\", equals_arg = \"channel\", tolerance_s = 2, within_s = 5 }"),
                (
                    clock,
                    "{ joined = \"engine.hours\", equals_arg = \"time\", tolerance_s = 2, within_s = 5 }",
                ),
                (
                    clock,
                    "{ joined = \"clock\", equals = 5, equals_arg = \"time\", tolerance_s = 2, within_s = 5 }",
                ),
                (clock, "{ point = \"status\", equals = 1, tolerance_s = 2, within_s = 5 }"),
                (clock, "{ device = \"silent_then_back\", equals_arg = \"time\", within_s = 5 }"),
            ],
        ),
    );
}

#[test]
fn joined_signals() {
    check(
        "joined_signals",
        report_of(
            PROCEDURES,
            &[
                ("signal = \"engine.hours\"", "signal = \"engine.ours\""),
                ("signal = \"engine.hours\"", "signal = \"fuel.total\""),
                ("signal = \"engine.hours\"", "signal = \"mode\""),
                ("signal = \"engine.hours\"", "signal = \"clock\""),
                ("signal = \"engine.hours\"", "signal = \"src1.supply.hours\""),
                ("signal = \"engine.hours\"", "signals = \"engine.hours\""),
                ("signal = \"clock\"", "signal = \"engine.run.hours\""),
                ("hours = \"run_hours\"\n", ""),
                ("minutes = \"run_minutes\"\n", ""),
                ("second = \"second\"\n", ""),
                ("second = \"second\"\n", "second = \"second\"\nhours = \"run_hours\"\n"),
                ("seconds = \"run_seconds\"", "seconds = \"run_second\""),
                ("seconds = \"run_seconds\"", "seconds = \"run_minutes\""),
                ("hours = \"run_hours\"", "hours = \"fuel\""),
                ("second = \"second\"\n", "second = \"flags\"\n"),
                (
                    "unit = \"h\", name = \"Hours run\"",
                    "unit = \"h\", signal = \"engine.hours\", name = \"Hours run\"",
                ),
            ],
        ),
    );
}

#[test]
fn vocabulary() {
    let sound = [
        "format = 1",
        "signals = [",
        "  { id = \"a.power\", kind = \"number\", unit = \"kW\", meaning = \"Power\" },",
        "  { id = \"a.state\", kind = \"words\", words = [\"off\", \"on\"], meaning = \"State\" },",
        "]",
    ]
    .join("\n");
    let vocabulary =
        Vocabulary::parse("vocabulary.toml", &sound).unwrap_or_else(|findings| panic!("{findings}"));
    assert_eq!(vocabulary.iter().count(), 2);
    let mut report = String::new();
    for (from, to) in [
        ("format = 1", "format = 0"),
        ("id = \"a.state\"", "id = \"a.power\""),
        ("id = \"a.state\"", "id = \"a..state\""),
        ("unit = \"kW\"", "unit = \"hp\""),
        ("unit = \"kW\", ", "unit = \"kW\", words = [\"off\"], "),
        ("words = [\"off\", \"on\"]", "words = []"),
        ("words = [\"off\", \"on\"]", "words = [\"off\", \"off\"]"),
        ("words = [\"off\", \"on\"]", "words = [\"off\", \"on\"], unit = \"s\""),
        ("meaning = \"State\"", "meaning = \"\""),
        ("meaning = \"State\"", "means = \"State\""),
    ] {
        assert_eq!(sound.matches(from).count(), 1, "{from}");
        let findings = Vocabulary::parse("vocabulary.toml", &sound.replacen(from, to, 1)).unwrap_err();
        writeln!(report, "{from}\n=> {to}\n{findings}\n").unwrap();
    }
    check("vocabulary", report);
}

#[test]
fn deep_nesting_is_refused() {
    for open in ["[", "{ a = ", "[{ a = "] {
        let text = format!("a = {}", open.repeat(100_000));
        assert!(findings_of(&text).is_err());
    }
}
