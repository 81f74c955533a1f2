//! What no client can bring about: sources that fail at will, switches that jam, the key on the front.

mod properties;

use super::plant::Mains;
use super::*;

const TENTH: Duration = Duration::from_millis(100);

/// What the profile sets.
pub(super) fn settings() -> Settings {
    Settings::of(busbar_profile::builtin("smartgen-hat821si").unwrap())
}

pub(super) fn quiet() -> Hat821si {
    set(&[])
}

fn set(settings_of_this: &[(&str, &str)]) -> Hat821si {
    let (mut unit, mut settings) = (Hat821si::new(1, false), settings());
    settings_of_this.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
    unit.configure(&settings);
    unit
}

fn pass(unit: &mut Hat821si, seconds: u64) {
    (0..10 * seconds).for_each(|_| unit.step(TENTH));
}

fn digits(unit: &Hat821si) -> [u8; 3] {
    unit.plant.positions().digits()
}

fn fail(unit: &mut Hat821si, source: usize, mains: Mains) {
    unit.plant.sources[source].mains = mains;
}

fn wear(unit: &mut Hat821si, switch: Switch, condition: plant::Condition) {
    unit.plant.switches[switch as usize].set_condition(condition);
}

#[test]
fn a_failed_source_is_replaced_over_the_tie_and_gets_its_section_back() {
    for (source, mains, replaced) in
        [(0, Mains::Failed, [0, 1, 1]), (1, Mains::Lost(1), [1, 1, 0]), (0, Mains::Sagging, [0, 1, 1])]
    {
        let mut unit = quiet();
        fail(&mut unit, source, mains);
        pass(&mut unit, 4);
        assert_eq!(digits(&unit), [1, 0, 1], "{mains:?}: not yet");
        pass(&mut unit, 16);
        assert_eq!(digits(&unit), replaced, "{mains:?}");
        assert_eq!(unit.plant.alive(), [true, true], "{mains:?}");
        fail(&mut unit, source, Mains::Normal);
        pass(&mut unit, 9);
        assert_eq!(digits(&unit), replaced, "{mains:?}: not yet trusted");
        pass(&mut unit, 6);
        assert_eq!(digits(&unit), [1, 0, 1], "{mains:?}");
        assert_eq!(unit.genset.status(), 9, "{mains:?}");
    }
}

#[test]
fn a_dip_shorter_than_the_delay_transfers_nothing() {
    let mut unit = quiet();
    fail(&mut unit, 0, Mains::Sagging);
    pass(&mut unit, 4);
    fail(&mut unit, 0, Mains::Normal);
    for _ in 0..200 {
        unit.step(TENTH);
        assert_eq!(digits(&unit), [1, 0, 1]);
    }
}

#[test]
fn without_any_source_the_genset_feeds_both_sections_until_source_1_is_back() {
    let mut unit = quiet();
    fail(&mut unit, 0, Mains::Failed);
    fail(&mut unit, 1, Mains::Failed);
    pass(&mut unit, 6);
    assert_eq!((unit.genset.status(), digits(&unit)), (0, [1, 0, 1]));
    pass(&mut unit, 30);
    assert_eq!((unit.genset.status(), unit.plant.alive()), (8, [true, true]));
    assert_eq!(digits(&unit), [0, 1, 1]);
    unit.write_coil(GENSET_STOP, true);
    pass(&mut unit, 10);
    assert_eq!(unit.genset.status(), 8, "the automatic start goes on");
    fail(&mut unit, 0, Mains::Normal);
    pass(&mut unit, 30);
    assert_eq!((unit.genset.status(), unit.plant.alive()), (9, [true, true]));
    assert_eq!(digits(&unit), [1, 1, 0]);
}

#[test]
fn in_manual_mode_nothing_is_transferred_by_itself() {
    let mut unit = quiet();
    unit.write_coil(AUTO, false);
    fail(&mut unit, 0, Mains::Failed);
    pass(&mut unit, 30);
    assert_eq!((digits(&unit), unit.plant.alive()), ([1, 0, 1], [false, true]));
    unit.write_coil(TRANSFER_110, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [1, 0, 1], "source 1 is dead");
    unit.write_coil(TRANSFER_011, true);
    pass(&mut unit, 10);
    assert_eq!((digits(&unit), unit.plant.alive()), ([0, 1, 1], [true, true]));
    unit.write_coil(AUTO, true);
    fail(&mut unit, 0, Mains::Normal);
    pass(&mut unit, 20);
    assert_eq!(digits(&unit), [1, 0, 1]);
}

#[test]
fn a_remote_transfer_in_automatic_mode_ends_when_a_source_fails() {
    let mut unit = quiet();
    unit.write_coil(TRANSFER_110, true);
    pass(&mut unit, 30);
    assert_eq!(digits(&unit), [1, 1, 0]);
    fail(&mut unit, 0, Mains::Failed);
    pass(&mut unit, 20);
    assert_eq!(digits(&unit), [0, 1, 1]);
}

#[test]
fn a_tie_that_does_not_close_is_an_alarm_and_leaves_the_rest_to_be_used() {
    let mut unit = quiet();
    wear(&mut unit, Switch::Qtie, plant::Condition::WillNotClose);
    fail(&mut unit, 0, Mains::Failed);
    pass(&mut unit, 20);
    assert!(unit.board.has(Alarm::stuck(Switch::Qtie, Drive::Close)));
    assert!(unit.alarms.len() == 1 && !unit.horn.is_zero());
    unit.write_coil(TRANSFER_110, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [0, 0, 1]);
    fail(&mut unit, 0, Mains::Normal);
    pass(&mut unit, 20);
    assert_eq!(digits(&unit), [1, 0, 1], "QS1 has nothing wrong with it");
    assert_eq!(unit.alarms.len(), 1, "the alarm stays");

    fail(&mut unit, 0, Mains::Failed);
    pass(&mut unit, 10);
    wear(&mut unit, Switch::Qtie, plant::Condition::Normal);
    unit.write_coil(ALARM_RESET, true);
    assert!(unit.horn.is_zero());
    pass(&mut unit, 5);
    assert_eq!((digits(&unit), unit.alarms.len()), ([0, 1, 1], 0));
}

#[test]
fn a_switch_that_does_not_open_holds_off_transfers() {
    let mut unit = quiet();
    wear(&mut unit, Switch::Qs1, plant::Condition::WillNotOpen);
    fail(&mut unit, 0, Mains::Failed);
    pass(&mut unit, 20);
    assert!(unit.board.has(Alarm::stuck(Switch::Qs1, Drive::Open)));
    wear(&mut unit, Switch::Qs1, plant::Condition::Normal);
    unit.write_coil(TRANSFER_000, true);
    pass(&mut unit, 10);
    assert_eq!((digits(&unit), unit.alarms.len()), ([1, 0, 1], 1));
    unit.write_coil(ALARM_RESET, true);
    pass(&mut unit, 5);
    assert_eq!((digits(&unit), unit.alarms.len()), ([0, 1, 1], 0));
}

#[test]
fn what_could_not_be_done_by_hand_is_not_tried_again_by_itself() {
    let mut unit = quiet();
    unit.write_coil(AUTO, false);
    wear(&mut unit, Switch::Qtie, plant::Condition::WillNotClose);
    unit.write_coil(TRANSFER_011, true);
    pass(&mut unit, 12);
    assert_eq!(digits(&unit), [0, 0, 1]);
    wear(&mut unit, Switch::Qtie, plant::Condition::Normal);
    unit.write_coil(ALARM_RESET, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [0, 0, 1]);
}

#[test]
fn every_point_is_stored() {
    let profile = busbar_profile::builtin("smartgen-hat821si").unwrap();
    let images = [0xA5A5, 0x5A5A].map(|word| {
        let mut bank = Bank::new(profile);
        bank.fill(word);
        quiet().render(&mut bank);
        assert_eq!(bank.refused(), 0);
        bank
    });
    let order = profile.wire.word_order;
    for point in profile.points.iter().filter(|point| point.access.is_readable()) {
        let [one, other] = images
            .each_ref()
            .map(|bank| point.decode(bank.read(point.address, point.registers).unwrap(), order));
        assert_eq!(one, other, "{} keeps what was there before", point.id);
    }
}
