//! What no client can bring about: sources that fail at will, switches that jam, the key on the front.

use super::plant::Trouble;
use super::*;

const TENTH: Duration = Duration::from_millis(100);

fn quiet() -> Hat821si {
    Hat821si::new(1, false)
}

fn pass(unit: &mut Hat821si, seconds: u64) {
    (0..10 * seconds).for_each(|_| unit.step(TENTH));
}

fn digits(unit: &Hat821si) -> [u8; 3] {
    unit.plant.positions().digits()
}

fn fail(unit: &mut Hat821si, source: usize, trouble: Trouble) {
    unit.plant.sources[source].trouble = trouble;
}

#[test]
fn a_failed_source_is_replaced_over_the_tie_and_gets_its_section_back() {
    for (source, trouble, replaced) in
        [(0, Trouble::Blackout, [0, 1, 1]), (1, Trouble::PhaseLost, [1, 1, 0]), (0, Trouble::Sag, [0, 1, 1])]
    {
        let mut unit = quiet();
        fail(&mut unit, source, trouble);
        pass(&mut unit, 4);
        assert_eq!(digits(&unit), [1, 0, 1], "{trouble:?}: not yet");
        pass(&mut unit, 16);
        assert_eq!(digits(&unit), replaced, "{trouble:?}");
        assert_eq!(unit.plant.alive(), [true, true], "{trouble:?}");
        fail(&mut unit, source, Trouble::Nothing);
        pass(&mut unit, 9);
        assert_eq!(digits(&unit), replaced, "{trouble:?}: not yet trusted");
        pass(&mut unit, 6);
        assert_eq!(digits(&unit), [1, 0, 1], "{trouble:?}");
        assert_eq!(unit.genset.status(), 9, "{trouble:?}");
    }
}

#[test]
fn a_dip_shorter_than_the_delay_transfers_nothing() {
    let mut unit = quiet();
    fail(&mut unit, 0, Trouble::Sag);
    pass(&mut unit, 4);
    fail(&mut unit, 0, Trouble::Nothing);
    for _ in 0..200 {
        unit.step(TENTH);
        assert_eq!(digits(&unit), [1, 0, 1]);
    }
}

#[test]
fn without_any_source_the_genset_feeds_both_sections_until_source_1_is_back() {
    let mut unit = quiet();
    fail(&mut unit, 0, Trouble::Blackout);
    fail(&mut unit, 1, Trouble::Blackout);
    pass(&mut unit, 6);
    assert_eq!((unit.genset.status(), digits(&unit)), (0, [1, 0, 1]));
    pass(&mut unit, 30);
    assert_eq!((unit.genset.status(), unit.plant.alive()), (8, [true, true]));
    assert_eq!(digits(&unit), [0, 1, 1]);
    unit.write_coil(GENSET_STOP, true);
    pass(&mut unit, 10);
    assert_eq!(unit.genset.status(), 8, "the automatic start goes on");
    fail(&mut unit, 0, Trouble::Nothing);
    pass(&mut unit, 30);
    assert_eq!((unit.genset.status(), unit.plant.alive()), (9, [true, true]));
    assert_eq!(digits(&unit), [1, 1, 0]);
}

#[test]
fn in_manual_mode_nothing_is_transferred_by_itself() {
    let mut unit = quiet();
    unit.write_coil(AUTO, false);
    fail(&mut unit, 0, Trouble::Blackout);
    pass(&mut unit, 30);
    assert_eq!((digits(&unit), unit.plant.alive()), ([1, 0, 1], [false, true]));
    unit.write_coil(TRANSFER_110, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [1, 0, 1], "source 1 is dead");
    unit.write_coil(TRANSFER_011, true);
    pass(&mut unit, 10);
    assert_eq!((digits(&unit), unit.plant.alive()), ([0, 1, 1], [true, true]));
    unit.write_coil(AUTO, true);
    fail(&mut unit, 0, Trouble::Nothing);
    pass(&mut unit, 20);
    assert_eq!(digits(&unit), [1, 0, 1]);
}

#[test]
fn a_remote_transfer_in_automatic_mode_ends_when_a_source_fails() {
    let mut unit = quiet();
    unit.write_coil(TRANSFER_110, true);
    pass(&mut unit, 30);
    assert_eq!(digits(&unit), [1, 1, 0]);
    fail(&mut unit, 0, Trouble::Blackout);
    pass(&mut unit, 20);
    assert_eq!(digits(&unit), [0, 1, 1]);
}

#[test]
fn a_switch_that_jams_is_an_alarm_and_holds_off_transfers() {
    let mut unit = quiet();
    unit.plant.switches[Switch::Qtie as usize].jammed = true;
    fail(&mut unit, 0, Trouble::Blackout);
    pass(&mut unit, 20);
    assert!(unit.sequence.failed_to(Switch::Qtie, plant::Drive::Close));
    assert!(unit.alarms == 1 && !unit.horn.is_zero());
    unit.write_coil(TRANSFER_000, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [0, 0, 1]);

    unit.plant.switches[Switch::Qtie as usize].jammed = false;
    unit.write_coil(ALARM_RESET, true);
    assert!(unit.horn.is_zero());
    pass(&mut unit, 5);
    assert_eq!((digits(&unit), unit.alarms), ([0, 1, 1], 0));
}

#[test]
fn what_could_not_be_done_by_hand_is_not_tried_again_by_itself() {
    let mut unit = quiet();
    unit.write_coil(AUTO, false);
    unit.plant.switches[Switch::Qs1 as usize].jammed = true;
    unit.write_coil(TRANSFER_011, true);
    pass(&mut unit, 10);
    unit.plant.switches[Switch::Qs1 as usize].jammed = false;
    unit.write_coil(ALARM_RESET, true);
    pass(&mut unit, 10);
    assert_eq!(digits(&unit), [1, 0, 1]);
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
