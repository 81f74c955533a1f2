//! What the DKG-705 is set to: every parameter shows in its register and steers what it is for.

use busbar_emulator::Config;

use super::{AUTO, CLOCK, LOAD_TEST, MODE_KEYS, OFF, TEST, config, quiet};
use crate::site::{Site, TENTH};

fn set(settings: &[(&str, &str)]) -> Site {
    let pins = settings.iter().map(|(id, value)| ((*id).to_owned(), (*value).to_owned())).collect();
    Site::new(&Config { pins, ..config() })
}

/// Tenths for which something is so, from the moment on at which it first is.
fn lasts(site: &mut Site, so: impl Fn(&Site) -> bool) -> u32 {
    let begins = (0..6000).any(|_| {
        let now = so(site);
        if !now {
            site.pass(TENTH);
        }
        now
    });
    assert!(begins, "it never was");
    (0..6000)
        .take_while(|_| {
            site.pass(TENTH);
            so(site)
        })
        .count() as u32
        + 1
}

fn status(code: u32) -> impl Fn(&Site) -> bool {
    move |site| site.code("operation_status") == code
}

#[test]
fn a_parameter_is_shown_at_once_and_as_its_register_holds_it() {
    let mut site = quiet();
    for (id, text, shown) in [
        ("crank_timer", "9", 9.0),
        ("cooldown_timer", "31", 32.0),
        ("low_oil_pressure_shutdown_limit", "0.8", 0.8),
        ("overcurrent_load_dump_limit", "144", 140.0),
        ("start_attempts", "5", 5.0),
        ("service_interval_hours", "500", 500.0),
        ("ecu_engine_brand", "7", 7.0),
    ] {
        site.device.set(id, text).unwrap();
        assert_eq!(site.number(id), shown, "{id}");
    }
    assert_eq!(site.number("ecu_engine_model"), 5.0, "the other half of the register");
    assert!(site.device.set("crank_timer", "121").is_err());
    assert!(site.device.set("crank_time", "5").unwrap_err().to_string().contains("crank_timer"));
    assert_eq!(set(&[("crank_timer", "9")]).number("crank_timer"), 9.0, "as `--set` does");
}

#[test]
fn the_words_at_1000h_show_their_bits() {
    let mut site = quiet();
    for (id, point, bit) in [
        ("multi_genset", "multi_genset_options", 0),
        ("single_genset_load", "multi_genset_options", 1),
        ("multi_genset_no_break_transfer", "multi_genset_options", 2),
        ("multi_genset_soft_transfer", "multi_genset_options", 3),
        ("no_break_transfer", "operation_mode_1", 0),
        ("soft_transfer", "operation_mode_1", 1),
        ("governor_control", "operation_mode_1", 2),
        ("avr_control", "operation_mode_1", 3),
        ("governor_reverse_polarity", "operation_mode_1", 4),
        ("avr_reverse_polarity", "operation_mode_1", 5),
        ("ignore_phase_order", "operation_mode_1", 6),
        ("peak_lopping", "operation_mode_1", 7),
        ("rpm_from_genset_frequency", "operation_mode_2", 2),
        ("genset_line_voltage_display", "operation_mode_2", 3),
        ("mains_line_voltage_display", "operation_mode_2", 4),
        ("emergency_backup", "operation_mode_2", 5),
        ("mains_current_transformers", "operation_mode_2", 6),
        ("modem", "operation_mode_2", 7),
        ("exercise_on_load", "operation_mode_3", 2),
        ("sms", "operation_mode_3", 3),
        ("exercise_by_buttons", "operation_mode_3", 4),
        ("modem_call_on_load_transfer", "operation_mode_3", 5),
        ("warning_on_service_request", "operation_mode_3", 6),
        ("internal_modem", "operation_mode_3", 7),
    ] {
        for on in [true, false] {
            site.device.set(id, if on { "1" } else { "0" }).unwrap();
            assert_eq!(site.bits(point).contains(bit), on, "{id}");
        }
    }
    for (coolant, oil, code) in [("0", "0", 0), ("1", "0", 1), ("0", "1", 2), ("1", "1", 3)] {
        site.device.set("heating_by_coolant", coolant).unwrap();
        site.device.set("heating_by_oil", oil).unwrap();
        assert_eq!(site.code("engine_heating"), code);
    }
    for (every, code) in [("0", 0), ("1", 1), ("2", 2)] {
        site.device.set("exercise_every", every).unwrap();
        assert_eq!(site.code("exercise_period"), code);
    }
}

/// What lasts as long as a timer.
enum Span {
    Status(u32),
    Relay(u16),
    Idle,
}

impl Span {
    fn is_now(&self, site: &Site) -> bool {
        match self {
            Self::Status(code) => site.code("operation_status") == *code,
            Self::Relay(bit) => site.bits("relays").contains(*bit),
            Self::Idle => site.bits("relay_functions_2").contains(1),
        }
    }
}

const STARTER: u16 = 2;

#[test]
fn every_timer_of_a_run_is_as_long_as_it_is_set() {
    for (settings, key, span, seconds) in [
        (&[("wait_before_fuel_timer", "7"), ("preheat_timer", "0")][..], TEST, Span::Status(1), 7),
        (&[("wait_before_fuel_timer", "2"), ("preheat_timer", "5")], TEST, Span::Status(1), 7),
        (&[("preheat_timer", "5")], TEST, Span::Relay(1), 5),
        (&[("crank_timer", "3")], TEST, Span::Relay(STARTER), 3),
        (&[("crank_timer", "9")], TEST, Span::Relay(STARTER), 9),
        (&[("engine_heating_timer", "15")], TEST, Span::Status(4), 15),
        (&[("engine_heating_timer", "0"), ("idle_timer", "6")], TEST, Span::Status(4), 6),
        (&[("idle_timer", "6")], TEST, Span::Idle, 6),
        (&[("genset_contactor_timer", "6")], LOAD_TEST, Span::Status(6), 6),
        (&[("cooldown_timer", "10")], OFF, Span::Status(12), 10),
        (&[("stop_timer", "20")], OFF, Span::Status(13), 20),
    ] {
        let mut site = set(settings);
        if matches!(span, Span::Relay(STARTER)) {
            site.device.pull("ignition", "never").unwrap();
        }
        if key == OFF {
            site.write(MODE_KEYS, TEST);
            site.walk_to(4);
        }
        site.write(MODE_KEYS, key);
        let lasted = lasts(&mut site, |site| span.is_now(site));
        assert!((10 * seconds..=10 * seconds + 4).contains(&lasted), "{settings:?}: {lasted} tenths");
    }
}

#[test]
fn the_rest_between_cranks_and_their_number_are_set() {
    let mut site = set(&[("start_attempts", "2"), ("wait_between_starts_timer", "4")]);
    site.device.pull("ignition", "never").unwrap();
    site.write(MODE_KEYS, TEST);
    assert_eq!(site.walk_to(13), [0, 1, 2, 3, 2, 3, 13]);
    let mut site = set(&[("wait_between_starts_timer", "4")]);
    site.device.pull("ignition", "2").unwrap();
    site.write(MODE_KEYS, TEST);
    site.walk_to(3);
    let rest = lasts(&mut site, status(2));
    assert!((40..=42).contains(&rest), "{rest}");
    site.walk_to(4);
}

#[test]
fn the_timers_of_an_outage_are_as_long_as_they_are_set() {
    let settings =
        &[("genset_contactor_timer", "6"), ("mains_waiting_timer", "8"), ("mains_contactor_timer", "5")];
    let mut site = set(&[settings, &[("no_break_transfer", "0")][..]].concat());
    site.device.pull("mains", "failed").unwrap();
    let lasted = lasts(&mut site, status(7));
    assert!((60..=64).contains(&lasted), "{lasted}");
    site.device.pull("mains", "normal").unwrap();
    site.pass_seconds(2);
    assert!((6.0..=8.0).contains(&site.number("operation_timer")), "{}", site.number("operation_timer"));
    let lasted = lasts(&mut site, status(8));
    assert!((50..=90).contains(&lasted), "{lasted}");
    let lasted = lasts(&mut site, status(11));
    assert!((50..=54).contains(&lasted), "{lasted}");
}

#[test]
fn the_engine_heats_until_what_is_asked_for_is_warm() {
    for (settings, warm) in [
        (&[("heating_by_coolant", "1"), ("engine_heating_temperature", "46")][..], "coolant_temperature"),
        (&[("heating_by_oil", "1"), ("engine_heating_temperature", "42")], "oil_temperature"),
    ] {
        let mut site = set(settings);
        site.write(MODE_KEYS, LOAD_TEST);
        let tenths = lasts(&mut site, status(4));
        let wanted = site.number("engine_heating_temperature");
        assert!(tenths > 100 && (wanted..wanted + 1.0).contains(&site.number(warm)), "{tenths} {settings:?}");
    }
}

#[test]
fn a_dip_starts_nothing_as_long_as_the_wait_before_fuel() {
    for (wait, starts) in [("12", false), ("0", true)] {
        let mut site = set(&[("wait_before_fuel_timer", wait)]);
        site.device.pull("mains", "failed").unwrap();
        site.pass_seconds(8);
        site.device.pull("mains", "normal").unwrap();
        site.pass_seconds(10);
        assert_eq!(site.number("ecu_engine_speed") > 0.0, starts, "{wait} s");
    }
}

#[test]
fn the_mains_are_good_inside_the_limits_that_are_set() {
    for (id, volts, limit) in
        [("mains_voltage_low_limit", "200", "210"), ("mains_voltage_high_limit", "250", "240")]
    {
        let mut site = quiet();
        site.device.pull("mains.voltage", volts).unwrap();
        site.pass_seconds(10);
        assert_eq!(site.code("operation_status"), 0);
        site.device.set(id, limit).unwrap();
        site.walk_to(8);
        // Back by less than the hysteresis is not back.
        let back = if id.contains("low") { "215" } else { "235" };
        site.device.pull("mains.voltage", back).unwrap();
        site.pass_seconds(60);
        assert_eq!(site.code("operation_status"), 8, "{id}");
        site.device.set("hysteresis_voltage", "0").unwrap();
        site.walk_to(12);
    }
}

#[test]
fn currents_and_powers_follow_the_ratio_of_the_transformers() {
    let mut usual = quiet();
    let mut half = set(&[("current_transformer_ratio", "100")]);
    let mut none = set(&[("mains_current_transformers", "0")]);
    for site in [&mut usual, &mut half, &mut none] {
        site.pass_seconds(1);
    }
    let of = |site: &Site| [site.number("mains_l1_current"), site.number("mains_active_power")];
    let [amperes, kilowatts] = of(&usual);
    assert!((of(&half)[0] - amperes / 2.0).abs() < 0.11 && (of(&half)[1] - kilowatts / 2.0).abs() < 0.02);
    assert_eq!(of(&none), [0.0, 0.0]);
}

#[test]
fn without_mains_transformers_the_load_moves_hard() {
    let mut site = set(&[("mains_current_transformers", "0")]);
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [0, 1, 2, 3, 4, 5, 6, 8]);
}

#[test]
fn a_test_takes_the_load_of_failed_mains_where_it_may() {
    for (backup, status) in [("1", 8), ("0", 0)] {
        let mut site = set(&[("emergency_backup", backup)]);
        site.write(MODE_KEYS, TEST);
        site.walk_to(4);
        site.pass_seconds(15);
        site.device.pull("mains", "failed").unwrap();
        site.pass_seconds(10);
        assert_eq!(site.code("operation_status"), status, "backup {backup}");
        assert_eq!(site.number("genset_active_power") > 20.0, status == 8);
    }
}

#[test]
fn the_remote_start_contact_is_obeyed_in_auto_alone() {
    let mut site = quiet();
    site.write(MODE_KEYS, OFF);
    site.device.pull("remote_start", "on").unwrap();
    site.pass_seconds(10);
    assert_eq!(site.code("operation_status"), 0);
    site.write(MODE_KEYS, AUTO);
    site.walk_to(8);
    site.device.pull("remote_start", "off").unwrap();
    site.walk_to(12);
}

#[test]
fn mains_of_a_wrong_order_are_good_only_where_nobody_looks() {
    let mut site = quiet();
    site.device.pull("mains", "reversed").unwrap();
    site.walk_to(8);
    assert!(site.bits("mains_phase_order").contains(7) && !site.bits("genset_phase_order").contains(7));
    let mut site = set(&[("ignore_phase_order", "1")]);
    site.device.pull("mains", "reversed").unwrap();
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 0);
    assert!(site.bits("warning_alarms_3").is_empty());
}

#[test]
fn outputs_that_are_off_stand_still() {
    for (id, output, other) in [
        ("governor_control", "governor_output", "avr_output"),
        ("avr_control", "avr_output", "governor_output"),
    ] {
        let mut site = set(&[(id, "0")]);
        site.write(MODE_KEYS, LOAD_TEST);
        site.walk_to(4);
        let mut moved = false;
        for _ in 0..300 {
            site.pass(TENTH);
            assert!((site.number(output) - 50.0).abs() < 0.01, "{id}");
            moved |= (site.number(other) - 50.0).abs() > 0.1;
        }
        assert!(moved, "{other} regulates");
    }
}

#[test]
fn the_outputs_move_the_plant() {
    let mut site = quiet();
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(8);
    site.pass_seconds(20);
    // The droop of a loaded genset is taken back by both.
    assert!((site.number("genset_frequency") - 50.0).abs() < 0.2);
    assert!(site.number("governor_output") > 55.0 && site.number("avr_output") > 55.0);
    let mut free = set(&[("governor_control", "0"), ("avr_control", "0"), ("no_break_transfer", "0")]);
    free.write(MODE_KEYS, LOAD_TEST);
    free.walk_to(8);
    free.pass_seconds(20);
    assert!(free.number("genset_frequency") < 49.5, "{}", free.number("genset_frequency"));
}

#[test]
fn the_synchroscope_turns_until_the_two_are_in_step() {
    let mut site = quiet();
    assert_eq!(site.number("synchroscope_angle"), 0.0, "one of them is dead");
    site.device.pull("mains.frequency", "50.4").unwrap();
    site.pass_seconds(10);
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(4);
    site.pass_seconds(5);
    let mut angles = Vec::new();
    while site.code("operation_status") < 6 {
        angles.push(site.number("synchroscope_angle"));
        site.pass(TENTH);
    }
    assert!(angles.iter().any(|angle| angle.abs() > 60.0), "it turns: {angles:?}");
    assert!(angles.last().unwrap().abs() < 10.0, "{angles:?}");
    site.walk_to(15);
    assert_eq!(site.number("synchroscope_angle"), 0.0, "in parallel");
}

#[test]
fn a_wide_window_joins_sooner_than_a_narrow_one() {
    let tenths = |angle: &str| -> u32 {
        let of = |seed| {
            let pins = vec![("synchronization_angle".to_owned(), angle.to_owned())];
            let mut site = Site::new(&Config { seed, pins, ..config() });
            site.write(MODE_KEYS, LOAD_TEST);
            lasts(&mut site, status(5))
        };
        (1..5).map(of).sum()
    };
    let (wide, narrow) = (tenths("25"), tenths("2"));
    assert!(wide < narrow, "{wide} and {narrow} tenths");
}

#[test]
fn peak_lopping_lets_the_mains_keep_their_part() {
    let mut site = set(&[("peak_lopping", "1")]);
    site.device.pull("load", "58").unwrap();
    site.pass_seconds(30);
    assert_eq!(site.code("operation_status"), 0);
    site.device.pull("load", "100").unwrap();
    assert_eq!(site.walk_to(15), [0, 1, 2, 3, 4, 5, 6, 15]);
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 15);
    let (mains, genset) = (site.number("mains_active_power"), site.number("genset_active_power"));
    assert!((mains - 70.0).abs() < 3.0 && (genset - 30.0).abs() < 3.0, "{mains} and {genset} kW");
    // The genset keeps the load of mains that fail, and joins them when they are back.
    site.device.pull("mains", "failed").unwrap();
    site.device.pull("load", "65").unwrap();
    site.walk_to(8);
    site.device.pull("mains", "normal").unwrap();
    assert_eq!(site.walk_to(15), [8, 9, 10, 15]);
    site.pass_seconds(20);
    site.device.pull("load", "40").unwrap();
    assert_eq!(site.walk_to(12), [15, 14, 12]);
    assert!(site.number("mains_active_power") > 35.0);
}

#[test]
fn peak_lopping_asks_no_more_of_the_genset_than_it_has() {
    let mut site = set(&[("peak_lopping", "1"), ("peak_lopping_mains", "0"), ("load_shedding_high", "0")]);
    site.device.pull("load", "110").unwrap();
    site.walk_to(15);
    site.pass_seconds(60);
    assert_eq!(site.code("operation_status"), 15);
    assert!(
        (site.number("genset_active_power") - 80.0).abs() < 3.0,
        "{}",
        site.number("genset_active_power")
    );
}

#[test]
fn loads_are_shed_between_their_limits() {
    let mut site = quiet();
    let sheds = |site: &Site| site.bits("relay_functions_1").contains(8);
    site.write(MODE_KEYS, LOAD_TEST);
    site.walk_to(8);
    for (load, expected, carried) in
        [("60", false, 60.0), ("75", true, 60.0), ("70", true, 56.0), ("65", false, 65.0)]
    {
        site.device.pull("load", load).unwrap();
        site.pass_seconds(3);
        assert_eq!(sheds(&site), expected, "{load} kW");
        assert!((site.number("genset_active_power") - carried).abs() < 1.0, "a fifth of {load} kW is spared");
    }
    // It would be too much, but for what is shed.
    site.device.pull("load", "100").unwrap();
    site.pass_seconds(30);
    assert!(sheds(&site) && site.bits("load_dump_alarms").is_empty());
    site.write(MODE_KEYS, AUTO);
    site.walk_to(12);
    site.pass_seconds(2);
    assert!(!sheds(&site) && site.number("mains_active_power") > 98.0, "the mains carry all of it");
}

#[test]
fn several_gensets_move_their_load_by_their_own_bits() {
    let both = [("multi_genset", "1"), ("multi_genset_no_break_transfer", "1")];
    let mut site = set(&both);
    site.device.pull("busbar.gensets", "1").unwrap();
    site.write(MODE_KEYS, LOAD_TEST);
    assert_eq!(site.walk_to(8), [0, 1, 2, 3, 4, 5, 6, 8], "no soft transfer");
    assert!(site.bits("relay_functions_1").contains(12), "master");
    site.pass_seconds(20);
    assert!((10.0..30.0).contains(&site.number("genset_active_power")), "they share");
    let words = ["shutdown_alarms_2", "warning_alarms_3"];
    assert!(words.iter().all(|word| site.bits(word).is_empty()));
}

#[test]
fn the_service_is_due_by_hours_or_days_where_they_count() {
    let due = |site: &Site| site.bits("warning_alarms_1").contains(14);
    for (lever, interval) in
        [("service.hours", "service_interval_hours"), ("service.days", "service_interval_days")]
    {
        let mut site = quiet();
        let (passed, limit) = (site.device.lever(lever).unwrap(), site.number(interval));
        assert!(passed.to_string().parse::<f64>().unwrap() < limit && !due(&site));
        site.device.pull(lever, &limit.to_string()).unwrap();
        site.pass(TENTH);
        assert!(due(&site));
        site.device.set("warning_on_service_request", "0").unwrap();
        site.pass(TENTH);
        assert!(!due(&site), "{lever} is no warning");
        site.device.set("warning_on_service_request", "1").unwrap();
        site.device.set(interval, "0").unwrap();
        site.pass(TENTH);
        assert!(!due(&site), "{interval} does not count");
        site.device.set(interval, &limit.to_string()).unwrap();
        site.device.pull(lever, "0").unwrap();
        site.pass(TENTH);
        assert!(!due(&site), "serviced");
    }
}

#[test]
fn the_exerciser_switches_to_a_test_and_back_and_a_key_ends_it() {
    let exercise = [("exercise_duration", "0.1")];
    let mode = |site: &Site| site.bits("operating_mode").iter().next().unwrap();
    let at = |settings: &[(&str, &str)], epoch: &str| {
        let pins = settings.iter().map(|(id, value)| ((*id).to_owned(), (*value).to_owned())).collect();
        Site::new(&Config { pins, epoch: epoch.parse().unwrap(), ..config() })
    };
    let mut site = at(&exercise, "2026-01-05T09:59:58");
    site.pass_seconds(3);
    assert_eq!(mode(&site), 7, "LOAD TEST");
    assert_eq!(site.bits("last_key").iter().next(), Some(4), "nobody pressed a key");
    assert!(site.bits("relay_functions_1").contains(13));
    site.walk_to(8);
    site.pass_seconds(600);
    assert_eq!(mode(&site), 4);
    assert!(!site.bits("relay_functions_1").contains(13));

    let mut site = at(&[("exercise_on_load", "0"), exercise[0]], "2026-01-05T09:59:58");
    site.pass_seconds(3);
    assert_eq!(mode(&site), 6, "TEST");
    site.write(MODE_KEYS, AUTO);
    site.pass_seconds(10);
    assert_eq!((mode(&site), site.code("operation_status")), (4, 0));

    // Whoever sets the clock past the hour misses it.
    let mut site = at(&exercise, "2026-01-05T08:30:00");
    site.write(CLOCK + 3, 10);
    site.pass_seconds(2);
    assert_eq!(mode(&site), 4);
}

#[test]
fn a_test_by_the_buttons_ends_like_an_exercise_where_it_is_one() {
    for (by_buttons, mode) in [("1", 4), ("0", 6)] {
        let mut site = set(&[("exercise_by_buttons", by_buttons), ("exercise_duration", "0.1")]);
        site.write(MODE_KEYS, TEST);
        site.pass_seconds(599);
        assert!(site.bits("operating_mode").contains(6));
        site.pass_seconds(2);
        assert!(site.bits("operating_mode").contains(mode), "{by_buttons}");
    }
}

#[test]
fn without_a_j1939_engine_its_block_is_empty() {
    let mut site = quiet();
    site.device.pull("tank", "10").unwrap();
    site.pass_seconds(1);
    assert!(site.bits("warning_alarms_1").contains(11) && site.number("ecu_warning_1_spn") == 96.0);
    for cut in [true, false] {
        match cut {
            true => site.device.pull("ecu", "cut").unwrap(),
            false => site.device.set("ecu_engine_brand", "0").unwrap(),
        }
        site.pass_seconds(1);
        assert!(site.device.registers(0x60, 0x20).unwrap().iter().all(|word| word & 0xFF == 0));
        assert!(!site.bits("warning_alarms_1").contains(11));
        site.device.pull("ecu", "connected").unwrap();
    }
}

#[test]
fn the_pickup_and_the_frequency_both_know_the_speed() {
    for from_frequency in ["0", "1"] {
        let mut site = set(&[("rpm_from_genset_frequency", from_frequency)]);
        site.write(MODE_KEYS, TEST);
        site.walk_to(4);
        site.pass_seconds(7);
        assert!((site.number("engine_speed") - 1500.0).abs() < 40.0);
        site.device.pull("pickup", "broken").unwrap();
        site.pass(TENTH);
        assert_eq!(site.number("engine_speed") == 0.0, from_frequency == "0");
    }
}

#[test]
fn a_broken_sender_reads_as_an_open_circuit_does_and_the_ecu_knows_better() {
    let mut site = quiet();
    for (lever, point, open, other) in [
        ("sender.oil_pressure", "oil_pressure", 10.0, Some("ecu_oil_pressure")),
        ("sender.temperature", "coolant_temperature", 0.0, Some("ecu_coolant_temperature")),
        ("sender.fuel_level", "fuel_level", 100.0, None),
    ] {
        let before = site.number(point);
        site.device.pull(lever, "broken").unwrap();
        site.pass(TENTH);
        assert_eq!(site.number(point), open, "{lever}");
        if let Some(other) = other {
            assert!((site.number(other) - before).abs() < 1.1, "{other}");
        }
        site.device.pull(lever, "normal").unwrap();
        site.pass(TENTH);
        assert!((site.number(point) - before).abs() < 1.1, "{lever}");
    }
}
