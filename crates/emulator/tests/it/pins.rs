//! Pinned values: what can be pinned stays, what cannot is refused by name.

use busbar_emulator::{Config, Device, PinProblem, StartError};

use crate::site::Site;

fn pinned(pins: &[(&str, &str)]) -> Config {
    let pins = pins.iter().map(|(point, value)| ((*point).to_owned(), (*value).to_owned())).collect();
    Config { pins, story: true, ..Config::default() }
}

fn refusal(point: &str, value: &str) -> (PinProblem, String) {
    match Device::new(&pinned(&[(point, value)])) {
        Err(StartError::Pin(error)) => (error.problem.clone(), error.to_string()),
        other => panic!("{point}={value}: {other:?}"),
    }
}

#[test]
fn pinned_values_stay_whatever_the_plant_does() {
    let mut site = Site::new(&pinned(&[
        ("genset_l1_voltage", "12.3"),
        ("engine_temperature", "-5"),
        ("ambient_temperature", "absent"),
        ("unit_mode", "TEST"),
        ("operation_status", "26"),
        ("shutdown_alarms", "low_oil_pressure, 57"),
        ("warning_alarms", "none"),
        ("mac_address", "020000000001"),
        ("onboard_inputs", "3,2,1,0,0,0,0,0,0,0,0,0,0,0,0,1"),
    ]));
    for _ in 0..2 {
        assert_eq!(site.number("genset_l1_voltage"), 12.3);
        assert_eq!(site.number("engine_temperature"), -5.0);
        assert_eq!(site.decode("ambient_temperature").value, None);
        assert_eq!(site.code("unit_mode"), 8);
        assert_eq!(site.code("operation_status"), 26);
        assert_eq!(site.bits("shutdown_alarms").iter().collect::<Vec<_>>(), [54, 57]);
        assert!(site.bits("warning_alarms").is_empty());
        assert_eq!(site.codes("onboard_inputs")[..3], [3, 2, 1]);
        // Derived bits follow the pinned arrays.
        assert!(site.flag(50) && site.flag(53) && site.flag(54));
        assert!(!site.flag(51) && !site.flag(52));
        assert_eq!(site.codes("leds")[..3], [1, 0, 0]);
        site.pass_seconds(100);
    }
}

#[test]
fn each_alarm_array_has_its_flags_and_its_led() {
    for (array, flags, led) in [
        ("shutdown_alarms", [true, false, false, true, true], [1, 0, 0]),
        ("load_dump_alarms", [false, true, false, true, true], [0, 1, 0]),
        ("warning_alarms", [false, false, true, false, true], [0, 0, 1]),
    ] {
        let site = Site::new(&pinned(&[(array, "over_load")]));
        assert_eq!([50, 51, 52, 53, 54].map(|flag| site.flag(flag)), flags, "{array}");
        assert_eq!(site.codes("leds")[..3], led, "{array}");
        let tripped = flags[3];
        assert_eq!(site.flag(41), !tripped, "{array}: ready for AUTO");
    }
}

#[test]
fn a_service_is_due_when_its_hours_or_its_days_are_used_up() {
    for (pins, due) in [
        (vec![], [false; 3]),
        (vec![("service_1_hours_left", "-2")], [true, false, false]),
        (vec![("service_2_days_left", "0")], [false, true, false]),
        (vec![("service_2_hours_left", "0.01"), ("service_3_days_left", "-700")], [false, false, true]),
    ] {
        let site = Site::new(&pinned(&pins));
        assert_eq!([36, 37, 38].map(|flag| site.flag(flag)), due, "{pins:?}");
        let warning = site.bits("warning_alarms");
        assert_eq!([118, 119, 120].map(|bit| warning.contains(bit)), due, "{pins:?}");
        let any = due.contains(&true);
        assert_eq!((site.flag(52), site.codes("leds")[2]), (any, any.into()), "{pins:?}");
    }
}

#[test]
fn refusals_name_the_point_and_what_is_allowed() {
    let (problem, text) = refusal("fuel_level", "7000");
    assert!(matches!(problem, PinProblem::Range { .. }));
    assert_eq!(text, "cannot set fuel_level to `7000`: choose a number from 0 to 6553.5 %");

    let (_, text) = refusal("engine_temperature", "hot");
    assert!(text.contains("engine_temperature") && text.contains("from -3276.8 to"), "{text}");

    let (problem, text) = refusal("unit_mode", "FAST");
    assert!(matches!(problem, PinProblem::Choice { .. }));
    assert!(text.contains("STOP") && text.contains("AUTO"), "{text}");

    let (problem, text) = refusal("warning_alarms", "low_fuel");
    assert!(matches!(problem, PinProblem::Bit { .. }));
    assert!(text.contains("`low_fuel`") && text.contains("low_fuel_level"), "{text}");

    assert_eq!(refusal("no_such_point", "1").0, PinProblem::UnknownPoint { nearest: None });
    let near = |name| PinProblem::UnknownPoint { nearest: Some(String::from(name)) };
    assert_eq!(refusal("fuel_levle", "1").0, near("fuel_level"));
    assert_eq!(refusal("crank_tiem", "1").0, near("crank_time"), "a setting can be set too");
    assert_eq!(refusal("push_buttons", "1").0, PinProblem::WriteOnly);
    assert_eq!(refusal("fuel_level", "absent").0, PinProblem::NeverAbsent);
    assert_eq!(refusal("leds", "1,2").0, PinProblem::Codes { count: 32 });
    assert_eq!(refusal("leds", "9").0, PinProblem::Codes { count: 32 });
    assert_eq!(refusal("mac_address", "02").0, PinProblem::Hex { bytes: 6 });
    assert_eq!(refusal("mac_address", "zz0000000001").0, PinProblem::Hex { bytes: 6 });
    assert_eq!(refusal("scope", "1,2,3").0, PinProblem::Samples { count: 100 });
}

#[test]
fn other_impossible_configurations_are_refused_by_name() {
    let unknown = Device::new(&Config { profile: "datakom-x".into(), ..Config::default() });
    assert!(matches!(unknown, Err(StartError::UnknownProfile { .. })), "{unknown:?}");

    let model = Device::new(&Config { model: Some("D-900".into()), ..Config::default() }).unwrap_err();
    assert_eq!(
        model.to_string(),
        "`D-900` is not a model of this controller; its models are D-300, D-500, D-545, D-700"
    );

    for unit in [0, 241] {
        let error = Device::new(&Config { unit, ..Config::default() }).unwrap_err();
        assert_eq!(error, StartError::Unit { unit, min: 1, max: 240 });
    }
}
