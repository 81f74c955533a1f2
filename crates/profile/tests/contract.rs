//! The JSON of the command line, as its contract prints it.
#![cfg(test)]

use busbar_profile::show::{ProfileShow, ProfileSummary};
use busbar_profile::{
    Class, Profile, Quality, WordOrder, builtin, builtins, decode_window, no_reading, reading,
};
use serde_json::{Value as Json, json};

fn datakom() -> &'static Profile {
    builtin("datakom-d").unwrap()
}

fn sample() -> Profile {
    let text = include_str!("sound.toml");
    Profile::parse("sound.toml", text).unwrap_or_else(|findings| panic!("{findings}"))
}

/// What `busbar decode --json` prints.
fn decode(profile: &Profile, address: u16, registers: &[u16]) -> String {
    let readings: Vec<_> = decode_window(profile, address, registers, WordOrder::LowFirst)
        .into_iter()
        .map(|(point, decoded)| {
            serde_json::to_string(&reading(point, &decoded, point.within(address, registers).unwrap(), None))
                .unwrap()
        })
        .collect();
    readings.join("\n")
}

#[test]
fn readings_print_as_the_contract_has_them() {
    let profile = sample();
    for (address, registers, expected) in [
        (
            0,
            &[2302][..],
            r#"{"id":"voltage","address":0,"value":230.2,"unit":"V","quality":"good","raw":[2302]}"#,
        ),
        (0, &[2300], r#"{"id":"voltage","address":0,"value":230,"unit":"V","quality":"good","raw":[2300]}"#),
        (
            1,
            &[0x3039, 0xFF00],
            r#"{"id":"power","address":1,"value":-123.45,"unit":"kW","quality":"good","raw":[12345,65280]}"#,
        ),
        (
            4,
            &[0x12FF],
            r#"{"id":"coolant","address":4,"value":null,"unit":"degC","quality":"invalid","raw":[4863]}"#,
        ),
        (
            6,
            &[1],
            r#"{"id":"status","address":6,"value":"Running","code":1,"unit":null,"quality":"good","raw":[1]}"#,
        ),
        (
            6,
            &[6],
            r#"{"id":"status","address":6,"value":"reserved (6)","code":6,"unit":null,"quality":"good","raw":[6]}"#,
        ),
        (
            6,
            &[26],
            r#"{"id":"status","address":6,"value":"unknown (26)","code":26,"unit":null,"quality":"good","raw":[26]}"#,
        ),
        (
            8,
            &[0b1000_0001_0000_1111 | 0x10],
            r#"{"id":"alarms","address":8,"value":["Common alarm","bit 4","Low oil pressure"],"set":[0,4,15],"unit":null,"quality":"good","raw":[33055]}"#,
        ),
        (
            9,
            &[0xFF0D],
            "{\"id\":\"options\",\"address\":9,\"value\":[\"Load test\",\"Breaker closed\"],\"set\":[2,3],\"unit\":null,\"quality\":\"good\",\"raw\":[65293]}\n\
             {\"id\":\"period\",\"address\":9,\"value\":\"unknown (1)\",\"code\":1,\"unit\":null,\"quality\":\"good\",\"raw\":[65293]}",
        ),
        (
            10,
            &[0x80],
            r#"{"id":"throttle","address":10,"value":50.1961,"unit":"%","quality":"good","raw":[128]}"#,
        ),
        (
            20,
            &[0b11_01, 0],
            r#"{"id":"leds","address":20,"value":[1,3,0,0,0,0,0,0,0,0,0,0,0,0,0,0],"unit":null,"quality":"good","raw":[13,0]}"#,
        ),
        (
            22,
            &[0x00A1, 0xB2C3, 0xD4E5],
            r#"{"id":"mac","address":22,"value":"00a1b2c3d4e5","unit":null,"quality":"good","raw":[161,45763,54501]}"#,
        ),
    ] {
        assert_eq!(decode(&profile, address, registers), expected);
    }
    assert_eq!(decode(&profile, 2, &[0]), "", "half a number is no reading");
    assert_eq!(
        decode(datakom(), 10246, &[2302, 0]),
        r#"{"id":"genset_l1_voltage","address":10246,"value":230.2,"unit":"V","quality":"good","raw":[2302,0]}"#
    );
}

#[test]
fn a_trace_is_a_list_of_numbers() {
    let mut registers = [0; 100];
    registers[0] = 0xFFFF;
    let text = decode(&sample(), 100, &registers);
    assert!(text.starts_with(r#"{"id":"scope","address":100,"value":[-1,0,0,"#), "{text}");
}

#[test]
fn what_could_not_be_read_has_neither_value_nor_registers() {
    let profile = sample();
    let point = profile.point("voltage").unwrap();
    assert_eq!(
        serde_json::to_string(&no_reading(point, Quality::Bad)).unwrap(),
        r#"{"id":"voltage","address":0,"value":null,"unit":"V","quality":"bad","raw":null}"#
    );
}

#[test]
fn labels_follow_the_model_where_it_is_known() {
    let profile = sample();
    let status = profile.point("status").unwrap();
    assert_eq!(status.label(1, None), "Running");
    assert_eq!(status.label(1, Some("A")), "Runs");
    assert_eq!(status.label(1, Some("B")), "Running");
}

#[test]
fn show_has_the_keys_of_the_contract() {
    let shown = serde_json::to_value(ProfileShow::new(&sample())).unwrap();
    let keys = |value: &Json| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ");
    assert_eq!(keys(&shown), "coils commands key kind models points vendor wire");
    assert_eq!(
        keys(&shown["wire"]),
        "answer_delay_ms functions max_read over_read readable serial spacing_ms transports unit word_order"
    );
    assert_eq!(shown["wire"]["unit"], json!({ "min": 1, "max": 254, "default": 1 }));
    assert_eq!(shown["wire"]["answer_delay_ms"], json!(4.3));
    assert_eq!(shown["wire"]["serial"], json!({ "baud": [9600], "parity": ["none"], "stop": [1] }));
    assert_eq!(shown["wire"]["readable"], json!([[0, 200], [300, 1100]]));
    assert_eq!(
        shown["points"][0],
        json!({
            "id": "voltage", "name": "Voltage", "address": 0, "registers": 1, "access": "r", "type": "u16",
            "unit": "V", "scale": { "num": 1, "den": 10, "offset": 0 }, "signal": "genset.l1.voltage",
            "choices": [], "bits": [], "sentinels": [], "doubt": null
        })
    );
    let point = |id: &str| {
        let points = shown["points"].as_array().unwrap();
        points.iter().find(|point| point["id"] == id).unwrap().clone()
    };
    assert_eq!(point("brand")["scale"], Json::Null);
    assert_eq!(point("coolant")["scale"], json!({ "num": 1, "den": 1, "offset": -40 }));
    assert_eq!(point("service")["scale"], json!({ "num": 1, "den": 8, "offset": -0.5 }));
    assert_eq!(point("throttle")["scale"], json!({ "num": 20, "den": 51, "offset": 0 }));
    assert_eq!(point("coolant")["sentinels"], json!([254, 255]));
    assert_eq!(point("status")["choices"][0], json!({ "value": 0, "label": "At rest" }));
    assert_eq!(
        point("alarms")["bits"],
        json!([
            { "bit": 0, "id": "common", "label": "Common alarm", "class": "status" },
            { "bit": 15, "id": "low_oil", "label": "Low oil pressure", "class": "warning" }
        ])
    );
    assert_eq!(point("options")["bits"][0]["class"], Json::Null);
    assert_eq!(shown["coils"][0], json!({ "address": 3, "id": "load_key", "name": "Load key" }));
    assert_eq!(shown["commands"][0], json!({ "id": "load", "name": "Load", "args": [] }));
    assert_eq!(
        shown["commands"][1]["args"],
        json!([
            { "name": "press", "choices": ["short", "long"], "default": "short" },
            { "name": "channel", "min": 0, "max": 19, "default": null }
        ])
    );
    assert_eq!(shown["commands"][2]["args"][0]["default"], json!(3));
}

#[test]
fn a_time_is_shown_by_its_kind() {
    let shown = serde_json::to_value(ProfileShow::new(builtin("datakom-dkg705").unwrap())).unwrap();
    let commands = shown["commands"].as_array().unwrap();
    let command = commands.iter().find(|command| command["id"] == "set_clock").unwrap();
    assert_eq!(command["args"], json!([{ "name": "time", "kind": "time", "default": "now" }]));
}

#[test]
fn the_summary_counts_every_bit_of_every_array() {
    let summary = serde_json::to_value(ProfileSummary::new(&sample())).unwrap();
    assert_eq!(
        summary,
        json!({
            "key": "sample", "vendor": "Maker", "models": ["A", "B"], "kind": "genset",
            "points": 24, "bits": 4, "coils": 2, "commands": 3
        })
    );
}

#[test]
fn the_d_series_reports_unused_flags_and_not_reserved_alarms() {
    let mut registers = [0; 16];
    registers[3] = 1;
    registers[8] = 1 << 13 | 1 << 14;
    let profile = datakom();
    let alarms = decode(profile, 10504, &registers);
    assert!(alarms.contains(r#""set":[48,141],"#), "{alarms}");
    let mut registers = [0; 14];
    registers[12] = 1 << 8;
    let flags = decode(profile, 11555, &registers);
    assert!(flags.contains(r#""value":["bit 200"],"set":[200],"#), "{flags}");
}

#[test]
fn built_in_profiles_keep_the_standing_rules() {
    for profile in builtins() {
        for point in &profile.points {
            let place = format!("{} {}", profile.key, point.id);
            let numeric = point.data_type.is_numeric();
            assert!(point.scale.is_some() || point.unit.is_none(), "{place}");
            assert!(point.scale.is_some() || point.signal.is_none() || !numeric, "{place}");
            let is_alarm = |class: Option<Class>| class.is_some_and(Class::is_alarm);
            let alarms = point.bits.iter().filter(|bit| is_alarm(bit.class)).count();
            assert!(alarms == 0 || point.bits.iter().all(|bit| bit.class.is_some()), "{place}");
            if numeric && point.signal.is_some() {
                let value = busbar_profile::Number::integer(1);
                assert!(point.in_signal_unit(value).is_some(), "{place}");
            }
        }
        assert_eq!(profile.command("no such command"), None);
        assert!(profile.points.iter().all(|point| profile.point(&point.id).is_some()));
        let key = builtin(&profile.key).map(|found| &found.key);
        assert_eq!(key, Some(&profile.key));
    }
}
