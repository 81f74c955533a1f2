//! Every remote command: from a state that is not yet what it asks for, until its proof shows.

use busbar_profile::Command;
use busbar_profile::command::{Condition, Evidence, Subject, Test};

use super::{OFF, ON, bit, positions, quiet, send, set, with_story};
use crate::site::{Site, TENTH};

const AUTO: u16 = 15004;
const S1_MASTER: u16 = 15005;
const S2_MASTER: u16 = 15006;

/// A site where the command has something to do.
fn site_for(command: &str) -> Site {
    let mut site = quiet();
    match command {
        "auto" => send(&mut site, AUTO, OFF),
        "s1_master" => send(&mut site, S1_MASTER, OFF),
        "s2_master" => send(&mut site, S2_MASTER, OFF),
        "alarm_reset" => {
            site = with_story(1);
            site.pass_seconds(160);
        }
        "genset_stop" => {
            set(&mut site, "genset_start");
            site.pass_seconds(5);
        }
        "window_confirm" | "window_cancel" => site = with_window(),
        id if id.starts_with("load_") && id.ends_with("_close") => {
            set(&mut site, &id.replace("close", "open"));
            site.pass_seconds(2);
        }
        _ => {}
    }
    site
}

/// Manual mode, and both sections back after a time without voltage.
fn with_window() -> Site {
    let mut site = quiet();
    send(&mut site, AUTO, OFF);
    set(&mut site, "transfer_000");
    site.pass_seconds(4);
    assert!(site.bits("load_1_closed").is_empty() && site.bits("load_2_closed").is_empty());
    assert!(!bit(&site, "controls_and_inhibits", 6));
    set(&mut site, "transfer_101");
    site.pass_seconds(4);
    site
}

fn is_met(site: &Site, condition: &Condition) -> bool {
    let Subject::Point { point, bit } = condition.subject else { panic!("{condition:?}") };
    let Test::Equals(expected) = condition.test else { panic!("{condition:?}") };
    let id = &site.device.profile().points[point].id;
    let now = match bit {
        Some(bit) => site.bits(id).contains(bit).into(),
        None => site.code(id),
    };
    now == expected
}

fn proofs(command: &Command) -> Vec<(Condition, u16)> {
    let steps = command.proof.steps().iter();
    steps
        .map(|step| match &step.what {
            Evidence::Point(condition) => (condition.clone(), step.within_s),
            other => panic!("{other:?}"),
        })
        .collect()
}

#[test]
fn every_command_has_the_effect_that_proves_it() {
    let commands = &quiet().device.profile().commands;
    assert_eq!(commands.len(), 76);
    for command in commands {
        let mut site = site_for(&command.id);
        assert!(command.require.iter().all(|condition| is_met(&site, condition)), "{}", command.id);
        let proofs = proofs(command);
        let proven = |site: &Site| proofs.iter().all(|(condition, _)| is_met(site, condition));
        assert!(proofs.is_empty() || !proven(&site), "{} has nothing to do", command.id);
        for step in &command.steps {
            send(&mut site, step.write.address, step.write.value.resolve(|_| None).unwrap());
        }
        let patience = proofs.iter().map(|(_, within)| *within).max().unwrap_or(0);
        let mut waited = 0;
        while !proven(&site) {
            assert!(waited < 10 * patience, "{} was not proven", command.id);
            site.pass(TENTH);
            waited += 1;
        }
        site.pass_seconds(10);
        assert!(proven(&site), "{} did not last", command.id);
        assert_eq!(site.device.misfits(), 0);
    }
}

#[test]
fn the_digits_of_a_transfer_are_qs1_qtie_and_qs2() {
    let mut site = quiet();
    for mode in [ON, OFF] {
        send(&mut site, AUTO, mode);
        let codes = [[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 0], [0, 0, 1], [0, 0, 0], [1, 0, 1]];
        for digits in codes {
            let [qs1, qtie, qs2] = digits;
            set(&mut site, &format!("transfer_{qs1}{qtie}{qs2}"));
            for _ in 0..120 {
                site.pass(TENTH);
                assert_ne!(positions(&site), [1; 3]);
            }
            assert_eq!(positions(&site), digits, "mode {mode:04X}");
            let dead = [qs1 == 0 && (qtie == 0 || qs2 == 0), qs2 == 0 && (qtie == 0 || qs1 == 0)];
            for (side, dead) in [(1, dead[0]), (2, dead[1])] {
                let closed = site.bits(&format!("load_{side}_closed"));
                assert!(!dead || closed.is_empty(), "{digits:?}: side {side}");
            }
        }
    }
}

#[test]
fn a_source_that_is_not_master_stands_by() {
    let mut site = quiet();
    send(&mut site, S1_MASTER, OFF);
    site.pass_seconds(5);
    assert_eq!(positions(&site), [0, 1, 1]);
    send(&mut site, S2_MASTER, OFF);
    site.pass_seconds(5);
    assert_eq!(positions(&site), [1, 0, 1]);
    send(&mut site, S1_MASTER, ON);
    site.pass_seconds(5);
    assert_eq!(positions(&site), [1, 1, 0]);
    site.pass_seconds(20);
    assert!(site.number("s1_active_power") > 2500.0);
    assert_eq!(site.number("s2_active_power"), 0.0);
    send(&mut site, AUTO, OFF);
    send(&mut site, S2_MASTER, ON);
    site.pass_seconds(5);
    assert_eq!(positions(&site), [1, 1, 0], "in manual mode nothing moves by itself");
}

#[test]
fn load_switches_carry_their_share_and_move_alone() {
    let mut site = quiet();
    let before = site.number("s2_active_power");
    set(&mut site, "load_2_11_open");
    assert_eq!(site.bits("load_2_opening_outputs").iter().collect::<Vec<_>>(), [10]);
    assert!(bit(&site, "load_2_closed", 10), "it takes its time");
    site.pass_seconds(1);
    assert!(!bit(&site, "load_2_closed", 10) && site.bits("load_2_opening_outputs").is_empty());
    assert_eq!(site.number("load_2_act_number"), 11.0);
    assert_eq!(site.bits("load_2_closed").len() + site.bits("load_1_closed").len(), 23);
    assert!(before - site.number("s2_active_power") > 80.0);
    set(&mut site, "load_2_11_close");
    site.pass_seconds(1);
    assert!(bit(&site, "load_2_closed", 10));
}

#[test]
fn load_switches_come_back_one_by_one_in_automatic_mode() {
    let mut site = quiet();
    set(&mut site, "transfer_000");
    site.pass_seconds(5);
    set(&mut site, "transfer_101");
    site.pass_seconds(2);
    let mut counts = vec![site.bits("load_1_closed").len()];
    for _ in 0..160 {
        site.pass(TENTH);
        counts.push(site.bits("load_1_closed").len());
        counts.dedup();
        let status = site.code("ats_status");
        assert_eq!(status == 26, site.bits("load_1_closed").len() < 12, "status {status}");
    }
    assert_eq!(counts, (counts[0]..=12).collect::<Vec<_>>());
    assert_eq!(site.code("ats_status"), 24);
}

#[test]
fn the_window_asks_in_manual_mode_and_takes_either_answer() {
    let mut site = with_window();
    assert!(bit(&site, "controls_and_inhibits", 6) && site.bits("load_1_closed").is_empty());
    set(&mut site, "window_confirm");
    assert!(!bit(&site, "controls_and_inhibits", 6), "at once");
    site.pass_seconds(20);
    assert_eq!(site.bits("load_1_closed").len() + site.bits("load_2_closed").len(), 24);

    let mut site = with_window();
    set(&mut site, "window_cancel");
    site.pass_seconds(20);
    assert!(!bit(&site, "controls_and_inhibits", 6));
    assert!(site.bits("load_1_closed").is_empty() && site.bits("load_2_closed").is_empty());
    set(&mut site, "load_1_4_close");
    site.pass_seconds(1);
    assert_eq!(site.bits("load_1_closed").iter().collect::<Vec<_>>(), [3]);
}

#[test]
fn the_genset_starts_and_stops_after_its_delays() {
    let mut site = quiet();
    set(&mut site, "genset_start");
    site.pass(TENTH);
    assert_eq!((site.code("genset_status"), site.number("genset_delay")), (0, 3.0));
    assert!(!bit(&site, "common_status", 15) && bit(&site, "switches", 13));
    site.pass_seconds(4);
    assert_eq!((site.code("genset_status"), site.number("genset_delay")), (8, 0.0));
    set(&mut site, "genset_stop");
    site.pass(TENTH);
    assert_eq!((site.code("genset_status"), site.number("genset_delay")), (1, 5.0));
    assert!(bit(&site, "common_status", 15) && !bit(&site, "switches", 13));
    site.pass_seconds(6);
    assert_eq!(site.code("genset_status"), 9);
    assert_eq!(positions(&site), [1, 0, 1], "it feeds nothing while the mains are there");
}

#[test]
fn remote_outputs_are_levels_on_the_first_output_module() {
    let mut site = quiet();
    for output in 0..13 {
        send(&mut site, 15012 + output, ON);
    }
    assert_eq!(site.bits("output_module_1").iter().collect::<Vec<_>>(), (0..13).collect::<Vec<_>>());
    send(&mut site, 15015, OFF);
    assert!(!bit(&site, "output_module_1", 3) && bit(&site, "output_module_1", 4));
}

#[test]
fn zero_to_a_key_does_nothing() {
    let mut site = with_window();
    let before = site.image();
    for coil in (15007..=15009).chain(15030..=15037).chain(15040..=15087) {
        send(&mut site, coil, OFF);
        assert_eq!(site.image(), before, "coil {coil}");
    }
    let mut twin = with_window();
    for site in [&mut site, &mut twin] {
        site.pass_seconds(20);
    }
    assert_eq!(site.image(), twin.image(), "nothing shows later either");
}

/// In the story somebody stands at the controller from second 185 to 200 and has set it to local.
#[test]
fn set_to_local_it_echoes_and_ignores() {
    let mut site = with_story(4);
    let mut twin = with_story(4);
    for site in [&mut site, &mut twin] {
        site.pass_seconds(186);
    }
    let commands = &site.device.profile().commands;
    assert!(commands.iter().all(|command| !command.require.iter().all(|it| is_met(&site, it))));
    let coils = &site.device.profile().coils;
    for coil in coils {
        for value in [OFF, ON] {
            send(&mut site, coil.address, value);
        }
    }
    assert_eq!(site.image(), twin.image());
    for site in [&mut site, &mut twin] {
        site.pass_seconds(20);
    }
    assert_eq!(site.image(), twin.image(), "nothing was kept for later");
    send(&mut site, AUTO, OFF);
    assert!(!bit(&site, "common_status", 8), "remote again");
}

#[test]
fn a_load_switch_that_opens_shows_its_number_and_its_status() {
    for (coil, status, side, number) in [("load_1_3_open", 27, 1, 3.0), ("load_2_12_open", 29, 2, 12.0)] {
        let mut site = quiet();
        set(&mut site, coil);
        site.pass(TENTH);
        assert_eq!(site.code("ats_status"), status, "{coil}");
        assert_eq!(site.number(&format!("load_{side}_act_number")), number, "{coil}");
        site.pass_seconds(1);
        assert_eq!(site.code("ats_status"), 24, "{coil}");
    }
}
