use busbar_link::Cause;

use super::*;
use crate::api::types::{PointValue, Quality as Shown, ValueView};
use crate::testing::{
    answered, at, device, failed, outage, profile, refusal, silence, site_device, timeout, ts,
};

/// At rest, OFF, 0 s, -, 230.2 V, 21.5 degC, -, hours 12.34, no alarms.
const FAST: [u16; 12] = [0, 1, 0, 0, 2302, 0, 215, 0, 1234, 0, 0, 0];

fn with(changes: &[(usize, u16)]) -> [u16; 12] {
    let mut registers = FAST;
    for (index, value) in changes {
        registers[*index] = *value;
    }
    registers
}

/// A device whose every point was read at second 0.
fn running() -> Device {
    let mut device = device();
    device.finish(answered(Rate::Once, &[(130, &[2; 16]), (146, &[2; 5])]), at(0), ts(0));
    device.finish(answered(Rate::Slow, &[(108, &[1234, 0]), (126, &[9, 0])]), at(0), ts(0));
    device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(0), ts(0));
    device
}

fn value(device: &Device, id: &str) -> ValueView {
    device.value(profile().point_index(id).unwrap())
}

fn changed(changes: &Changes) -> Vec<&'static str> {
    changes.values.iter().map(|index| profile().points[*index].id.as_str()).collect()
}

fn number(number: f64) -> PointValue {
    PointValue::Number(busbar_profile::Number::from_f64(number, 4).unwrap())
}

#[test]
fn before_the_first_round_nothing_is_claimed() {
    let device = device();
    let view = device.view();
    assert_eq!((view.online, view.fault, view.state, view.model), (false, None, None, None));
    let voltage = value(&device, "voltage");
    assert_eq!(
        (voltage.value, voltage.quality, voltage.ts, voltage.raw),
        (PointValue::None, Shown::Stale, None, None)
    );
    assert!(!device.shows(device.site().profile.point_index("picture").unwrap()), "read on demand only");
}

#[test]
fn a_mode_may_be_a_bit_of_its_own() {
    let profile = busbar_profile::builtin("datakom-dkg705").unwrap();
    let mut device = Device::new(SiteDevice { profile, ..site_device("dkg") }, "w1".to_owned());
    let mode = profile.signal("mode").unwrap();
    let mut read = |registers: u16| {
        device.finish(answered(Rate::Fast, &[(mode.address, &[registers])]), at(0), ts(0));
        device.view().mode
    };
    let auto = read(1 << 4).unwrap();
    assert_eq!((auto.code, auto.label.as_str()), (4, mode.bit_label(4).as_ref()));
    assert_eq!(auto.canonical.as_deref(), Some("auto"));
    assert_eq!(read(1 << 5).unwrap().code, 5);
    assert_eq!(read(0), None);
}

#[test]
fn a_clear_bit_may_be_a_mode() {
    let profile = busbar_profile::builtin("smartgen-hat821si").unwrap();
    let mut device = Device::new(SiteDevice { profile, ..site_device("hat") }, "w1".to_owned());
    for (word, label, canonical) in
        [(1 << 8, "Auto mode", "auto"), (0, "Manual mode", "manual"), (!(1 << 8), "Manual mode", "manual")]
    {
        device.finish(answered(Rate::Fast, &[(500, &[word])]), at(0), ts(0));
        let mode = device.view().mode.unwrap();
        assert_eq!((mode.code, mode.label.as_str()), (8, label), "{word:04X}h");
        assert_eq!(mode.canonical.as_deref(), Some(canonical), "{word:04X}h");
    }
}

#[test]
fn a_first_round_brings_values() {
    let mut device = device();
    let changes = device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(0), ts(0));
    assert_eq!(
        changed(&changes),
        // The hours lay on the way and are taken along.
        ["status", "mode", "timer", "voltage", "temperature", "hours", "shutdowns", "warnings"]
    );
    assert!(changes.device);
    assert!(!changes.alarms);
    let voltage = value(&device, "voltage");
    assert_eq!((voltage.value, voltage.quality, voltage.ts), (number(230.2), Shown::Good, Some(ts(0))));
    assert_eq!(voltage.raw, Some(vec![2302, 0]));
}

#[test]
fn only_what_changed_is_told() {
    let mut device = running();
    let changes = device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(1), ts(1));
    assert_eq!(changes, Changes::default());
    assert_eq!(value(&device, "voltage").ts, Some(ts(1)), "but it was read");

    let changes = device.finish(answered(Rate::Fast, &[(100, &with(&[(4, 2310)]))]), at(2), ts(2));
    assert_eq!((changed(&changes), changes.device), (vec!["voltage"], false));
}

#[test]
fn the_view_says_what_the_device_is_doing() {
    let mut device = running();
    let view = device.view();
    assert_eq!(view.model.as_deref(), Some("T-2"));
    assert_eq!(view.last_seen, Some(ts(0)));
    assert_eq!(view.state.unwrap().timer_s, None, "nothing is counted at rest");

    let changes =
        device.finish(answered(Rate::Fast, &[(100, &with(&[(0, 5), (1, 2), (2, 7)]))]), at(1), ts(1));
    assert!(changes.device);
    let view = device.view();
    let state = view.state.unwrap();
    assert_eq!((state.code, state.label.as_str(), state.timer_s), (5, "Cranking", Some(7.into())));
    assert_eq!(state.canonical.as_deref(), Some("cranking"));
    assert_eq!(view.mode.unwrap().label, "RUN", "as this model calls it");
}

#[test]
fn another_model_gives_other_names() {
    let mut device = running();
    device.finish(answered(Rate::Fast, &[(100, &with(&[(1, 2)]))]), at(1), ts(1));
    assert_eq!(value(&device, "mode").value, PointValue::Text("RUN".to_owned()));
    let changes = device.finish(answered(Rate::Once, &[(130, &[1])]), at(2), ts(2));
    assert_eq!((changed(&changes), changes.device), (vec!["mode", "identity"], true));
    assert_eq!(device.view().model.as_deref(), Some("T-1"));
    assert_eq!(value(&device, "mode").value, PointValue::Text("MANUAL / RUN".to_owned()));

    device.finish(answered(Rate::Once, &[(130, &[99])]), at(3), ts(3));
    assert_eq!(device.view().model, None, "a model the profile does not know is no error");
}

#[test]
fn a_code_without_a_name_is_shown_as_it_is() {
    let mut device = running();
    device.finish(answered(Rate::Fast, &[(100, &with(&[(0, 26)]))]), at(1), ts(1));
    let state = device.view().state.unwrap();
    assert_eq!((state.label.as_str(), state.canonical), ("unknown (26)", None));
}

#[test]
fn a_sentinel_is_invalid_and_no_number() {
    let mut device = running();
    let changes = device.finish(answered(Rate::Fast, &[(100, &with(&[(6, 0x7FFF)]))]), at(1), ts(1));
    assert_eq!(changed(&changes), ["temperature"]);
    let temperature = value(&device, "temperature");
    assert_eq!((temperature.value, temperature.quality), (PointValue::None, Shown::Invalid));
    assert_eq!((temperature.ts, temperature.raw), (Some(ts(1)), Some(vec![0x7FFF])));
}

#[test]
fn an_exception_is_bad_and_keeps_the_last_good_value() {
    let mut device = running();
    let mut round = answered(Rate::Fast, &[(100, &[0, 1, 0])]);
    round.failures = failed(Rate::Fast, 104, 8, refusal(10)).failures;
    let changes = device.finish(round, at(1), ts(1));
    assert_eq!(changed(&changes), ["voltage", "temperature", "shutdowns", "warnings"]);
    let voltage = value(&device, "voltage");
    assert_eq!((voltage.value, voltage.quality, voltage.ts), (number(230.2), Shown::Bad, Some(ts(0))));
    assert_eq!(voltage.error.as_deref(), Some("the device answered exception 10 (write protection)"));
    assert_eq!(value(&device, "mode").quality, Shown::Good);
    let view = device.view();
    assert!(view.online && view.fault.is_none(), "it answers");

    // Said once, not each round.
    let mut round = answered(Rate::Fast, &[(100, &[0, 1, 0])]);
    round.failures = failed(Rate::Fast, 104, 8, refusal(10)).failures;
    assert_eq!(device.finish(round, at(2), ts(2)), Changes::default());

    // The same registers again: nothing to decode, but good news all the same.
    let changes = device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(3), ts(3));
    assert_eq!(changed(&changes), ["voltage", "temperature", "shutdowns", "warnings"]);
    assert_eq!((value(&device, "voltage").quality, value(&device, "voltage").error), (Shown::Good, None));
}

#[test]
fn a_device_that_refuses_everything_is_online_with_a_fault() {
    let mut device = device();
    device.finish(failed(Rate::Fast, 100, 12, refusal(4)), at(0), ts(0));
    let view = device.view();
    assert!(view.online);
    assert_eq!(
        view.fault.as_deref(),
        Some(
            "Genset 1 answers, but refuses what it is asked: the device answered exception 4 (server device failure); check that it is what its profile is for"
        )
    );
    let voltage = value(&device, "voltage");
    assert_eq!((voltage.value, voltage.quality, voltage.ts), (PointValue::None, Shown::Bad, None));
}

#[test]
fn a_device_that_refuses_only_what_is_read_rarely_has_no_fault() {
    let mut device = running();
    for (rate, address) in [(Rate::Slow, 126), (Rate::Once, 130), (Rate::OnDemand, 152)] {
        device.finish(failed(rate, address, 2, refusal(2)), at(1), ts(1));
        assert_eq!(device.view().fault, None, "{rate:?}");
    }
    assert_eq!(
        (value(&device, "starts").quality, value(&device, "picture").quality),
        (Shown::Bad, Shown::Bad)
    );
}

#[test]
fn silence_makes_every_rate_bad_and_takes_no_alarm_away() {
    let mut device = running();
    device.finish(answered(Rate::Fast, &[(100, &with(&[(10, 1)]))]), at(1), ts(1));
    let changes = device.finish(silence(), at(2), ts(2));
    assert!(changes.device && !changes.alarms);
    assert_eq!(changes.values.len(), 11, "fast, slow and once: {:?}", changed(&changes));
    let view = device.view();
    assert_eq!((view.online, view.state, view.mode), (false, None, None));
    assert!(view.fault.unwrap().starts_with("Genset 1 cannot be read: unit 1 did not answer within"));
    assert_eq!(view.last_seen, Some(ts(1)));
    assert_eq!(view.alarms.shutdown, 1, "nobody said that it is over");
    assert_eq!(value(&device, "hours").quality, Shown::Bad);

    assert_eq!(device.finish(silence(), at(4), ts(4)), Changes::default());
    // The wire gave up on it: another sentence for the same silence.
    let mut given_up = silence();
    given_up.silence = Some(outage(Cause::Silent { requests: 3 }));
    assert_eq!(device.finish(given_up, at(4), ts(4)), Changes::default());

    let changes = device.finish(answered(Rate::Fast, &[(100, &with(&[(10, 1)]))]), at(5), ts(5));
    assert!(changes.device && !changes.alarms);
    assert_eq!(device.alarm_views()[0].since, ts(1), "it was active all along");
    assert_eq!(value(&device, "voltage").quality, Shown::Good);
    assert_eq!(value(&device, "starts").quality, Shown::Bad, "not read again yet");
}

#[test]
fn a_new_reason_for_not_being_reached_is_told() {
    let mut device = running();
    device.finish(silence(), at(2), ts(2));
    let mut down = silence();
    down.silence = Some(outage(Cause::Refused));
    let changes = device.finish(down, at(3), ts(3));
    assert!(changes.device && changes.values.len() == 11);
    assert!(device.view().fault.unwrap().contains("connection refused"));
}

#[test]
fn alarms_come_and_go_with_their_bits() {
    let mut device = running();
    let changes =
        device.finish(answered(Rate::Fast, &[(100, &with(&[(10, 1), (11, 0b1001)]))]), at(1), ts(1));
    assert!(changes.alarms && changes.device);
    let counts = device.view().alarms;
    assert_eq!((counts.shutdown, counts.warning), (1, 1));
    assert_eq!(value(&device, "warnings").set, Some(vec![0, 3]));

    let changes = device.finish(answered(Rate::Fast, &[(100, &with(&[(11, 0b1000)]))]), at(2), ts(2));
    assert!(changes.alarms);
    assert_eq!(device.alarm_views(), []);
}

#[test]
fn values_grow_stale_by_rate() {
    let mut device = running();
    assert_eq!(device.expire(at(5)), [], "three rounds, five seconds at least");
    let expired = device.expire(at(6));
    assert_eq!(expired.len(), 1);
    let (rate, changes) = &expired[0];
    assert_eq!((*rate, changed(changes).len(), changes.device), (Rate::Fast, 7, true));
    let voltage = value(&device, "voltage");
    assert_eq!((voltage.value, voltage.quality, voltage.error), (number(230.2), Shown::Stale, None));
    assert_eq!(device.view().state, None, "who knows what it is doing now");
    assert_eq!(device.expire(at(7)), [], "told once");
    assert_eq!(value(&device, "hours").quality, Shown::Good);

    let expired = device.expire(at(31));
    assert_eq!(expired.iter().map(|(rate, _)| *rate).collect::<Vec<_>>(), [Rate::Slow]);
    assert_eq!(device.expire(at(1_000_000)), [], "what is read once does not age");

    let changes = device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(32), ts(32));
    assert!(changed(&changes).contains(&"voltage"));
    assert_eq!(value(&device, "voltage").quality, Shown::Good);
}

#[test]
fn half_a_number_is_no_number() {
    let mut device = running();
    // Only the lower half of the voltage came, and it changed.
    let mut round = answered(Rate::Fast, &[(100, &[0, 1, 0, 0, 999])]);
    round.failures = failed(Rate::Fast, 104, 8, Failure::Short { got: 1, wanted: 8 }).failures;
    device.finish(round, at(1), ts(1));
    let voltage = value(&device, "voltage");
    assert_eq!((voltage.value, voltage.quality), (number(230.2), Shown::Bad));
    assert_eq!(voltage.error.as_deref(), Some("the device answered only 1 of 8 registers"));
}

#[test]
fn a_long_point_comes_in_parts() {
    let mut device = device();
    device.finish(answered(Rate::Once, &[(130, &[2; 16])]), at(0), ts(0));
    assert_eq!(value(&device, "curve").ts, None);
    device.finish(answered(Rate::Once, &[(130, &[2; 16]), (146, &[2; 5])]), at(1), ts(1));
    assert_eq!(value(&device, "curve").ts, Some(ts(1)));
}

#[test]
fn one_read_without_an_answer_touches_only_its_own_points() {
    let mut device = running();
    let mut round = answered(Rate::Slow, &[(126, &[10, 0])]);
    round.failures = failed(Rate::Slow, 108, 2, timeout()).failures;
    let changes = device.finish(round, at(10), ts(10));
    assert_eq!(changed(&changes), ["hours", "starts"]);
    assert!(!changes.device);
    assert_eq!(
        (value(&device, "hours").quality, value(&device, "starts").quality),
        (Shown::Bad, Shown::Good)
    );
}

#[test]
fn points_are_listed_in_groups_without_what_cannot_be_read() {
    let view = points_view(profile());
    let groups: Vec<_> = view.groups.iter().map(|group| (group.id.as_str(), group.points.len())).collect();
    assert_eq!(groups, [("state", 7), ("service", 2), ("identity", 2), ("display", 1)]);
    let voltage = view.groups[0].points.iter().find(|point| point.id == "voltage").unwrap();
    assert_eq!((voltage.plc, voltage.registers, voltage.page), (40_105, 2, Some(1)));
}

#[test]
fn a_round_in_which_nothing_was_asked_says_nothing() {
    let mut device = device();
    assert_eq!(device.finish(answered(Rate::Fast, &[]), at(0), ts(0)), Changes::default());
    assert!(!device.view().online);
    device.finish(silence(), at(1), ts(1));
    assert_eq!(device.finish(answered(Rate::Fast, &[]), at(2), ts(2)), Changes::default());
    assert!(device.view().fault.is_some());
}

#[test]
fn alarms_that_are_not_known_are_not_called_none() {
    let mut device = device();
    assert_eq!(device.view().alarms_fault.as_deref(), Some("shutdowns: not read yet"));

    // It never had that array.
    let mut round = answered(Rate::Fast, &[(100, &FAST[..10]), (111, &[0])]);
    round.failures = failed(Rate::Fast, 110, 1, refusal(2)).failures;
    device.finish(round, at(0), ts(0));
    let view = device.view();
    assert!(view.online && view.fault.is_none());
    assert_eq!(
        view.alarms_fault.as_deref(),
        Some("shutdowns: the device answered exception 2 (illegal data address)")
    );

    assert!(device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(1), ts(1)).device);
    assert_eq!(device.view().alarms_fault, None);

    // It had one, and lost it while an alarm was active.
    device.finish(answered(Rate::Fast, &[(100, &with(&[(11, 1)]))]), at(2), ts(2));
    let changes = device.finish(failed(Rate::Fast, 111, 1, timeout()), at(3), ts(3));
    assert!(changes.device || device.view().alarms_fault.is_some());
    let view = device.view();
    assert_eq!(view.alarms.warning, 1, "nobody said that it is over");
    assert!(view.alarms_fault.is_some_and(|fault| fault.starts_with("warnings: ")));
}

#[test]
fn alarms_grow_old_too() {
    let mut device = running();
    assert!(device.expire(at(6))[0].1.device);
    assert_eq!(device.view().alarms_fault.as_deref(), Some("shutdowns: not read for too long"));
}

#[test]
fn a_round_of_two_rates_fails_the_points_of_both() {
    let mut device = running();
    let both = crate::rates::Rates::from_iter([Rate::Fast, Rate::Slow]);
    let mut round = answered(both, &[(126, &[9, 0])]);
    round.failures = failed(both, 100, 12, refusal(4)).failures;
    let changes = device.finish(round, at(1), ts(1));
    assert!(changed(&changes).contains(&"hours") && changed(&changes).contains(&"voltage"));
    assert_eq!(
        (value(&device, "hours").quality, value(&device, "starts").quality),
        (Shown::Bad, Shown::Good)
    );
    assert_eq!(value(&device, "starts").ts, Some(ts(1)));
    assert_eq!((device.last_round(Rate::Slow), device.last_round(Rate::Once)), (Some(ts(1)), Some(ts(0))));
}

#[test]
fn what_comes_along_is_read_but_its_absence_is_no_failure() {
    let mut device = running();
    device.finish(answered(Rate::Fast, &[(100, &with(&[(8, 2000)]))]), at(1), ts(1));
    let hours = value(&device, "hours");
    assert_eq!((hours.value, hours.ts), (number(20.0), Some(ts(1))));
    assert_eq!(device.last_round(Rate::Slow), Some(ts(0)), "that was no round of the slow points");

    device.finish(failed(Rate::Fast, 100, 12, refusal(4)), at(2), ts(2));
    assert_eq!(value(&device, "hours").quality, Shown::Good, "it was not due");
}

fn wrong() -> Round {
    let known = Known {
        verdict: Identity::Wrong,
        detail: "it says that it is a T-2, and the site file wants a T-1".to_owned(),
        model: Some("T-2"),
    };
    Round { rates: crate::rates::POLLED.into_iter().collect(), identity: Some(known), ..Round::default() }
}

#[test]
fn of_another_device_nothing_is_taken_and_nothing_kept() {
    let mut device = running();
    device.finish(answered(Rate::Fast, &[(100, &with(&[(10, 1)]))]), at(1), ts(1));
    let changes = device.finish(wrong(), at(2), ts(2));
    assert!(changes.alarms && changes.device);
    assert_eq!(changes.values.len(), 11, "{:?}", changed(&changes));
    for index in (0..profile().points.len()).filter(|index| device.shows(*index)) {
        let value = device.value(index);
        assert_eq!((&value.value, value.quality), (&PointValue::None, Shown::Bad), "{value:?}");
        assert_eq!((value.raw, value.ts), (None, None));
        assert!(value.error.unwrap().starts_with("another device answers in its place: it says that"));
    }
    let view = device.view();
    assert_eq!((view.online, view.identity.verdict, view.alarms.shutdown), (true, Identity::Wrong, 0));
    assert_eq!((view.identity.checked, view.last_seen), (Some(ts(2)), Some(ts(2))));
    assert!(
        view.fault.unwrap().starts_with("Genset 1 is not what the site file says: it says that it is a T-2")
    );
    assert!(view.alarms_fault.unwrap().contains("another device"));

    // Said once.
    assert_eq!(device.finish(wrong(), at(5), ts(5)), Changes::default());
    assert_eq!(device.view().identity.checked, Some(ts(5)));
    assert_eq!(device.expire(at(1_000)), [], "there is nothing that could grow old");

    // Silent, it may be anybody.
    device.finish(silence(), at(6), ts(6));
    let view = device.view();
    assert_eq!((view.identity.verdict, view.online), (Identity::Unknown, false));
    assert!(view.fault.unwrap().contains("cannot be read"));

    // And the right one is believed from its first round on.
    device.finish(wrong(), at(7), ts(7));
    let right = Known { verdict: Identity::Confirmed, detail: "it is".to_owned(), model: Some("T-1") };
    let round = Round { identity: Some(right), ..answered(Rate::Fast, &[(100, &FAST)]) };
    let changes = device.finish(round, at(8), ts(8));
    assert!(changes.device && changed(&changes).contains(&"voltage"));
    let view = device.view();
    assert_eq!(
        (view.identity.verdict, view.fault, view.model.as_deref()),
        (Identity::Confirmed, None, Some("T-1"))
    );
    assert_eq!(value(&device, "voltage").quality, Shown::Good);
}

#[test]
fn a_device_may_say_in_any_round_that_it_is_another_model() {
    let mut device = device();
    device.site.model = Some("T-1".to_owned());
    device.finish(answered(Rate::Once, &[(130, &[1])]), at(0), ts(0));
    assert_eq!(device.view().identity.verdict, Identity::Confirmed);
    let changes = device.finish(answered(Rate::Once, &[(130, &[2])]), at(1), ts(1));
    assert!(changes.device && device.is_wrong());
    assert_eq!(value(&device, "identity").quality, Shown::Bad);
}

#[test]
fn desired_and_actual_are_told_apart() {
    let mut device = device();
    assert_eq!(device.view().desired, None, "the site file asks for nothing");
    device.site.desired_mode = Some("manual".to_owned());
    let met = |device: &Device| device.view().desired.unwrap().met;
    assert_eq!(met(&device), None, "not read yet");
    device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(0), ts(0));
    assert_eq!(met(&device), Some(false), "it is off");
    let changes = device.finish(answered(Rate::Fast, &[(100, &with(&[(1, 2)]))]), at(1), ts(1));
    assert_eq!((met(&device), changes.device), (Some(true), true));
    device.finish(answered(Rate::Fast, &[(100, &with(&[(1, 9)]))]), at(2), ts(2));
    assert_eq!(met(&device), None, "nobody knows what that mode is");
    device.finish(answered(Rate::Fast, &[(100, &with(&[(1, 2)]))]), at(3), ts(3));
    device.finish(silence(), at(4), ts(4));
    assert_eq!(met(&device), None);
}

#[test]
fn half_of_a_long_point_leaves_the_other_half_alone() {
    let mut device = running();
    let whole: &[(u16, &[u16])] = &[(130, &[2; 16]), (146, &[2; 5])];
    device.finish(answered(Rate::Once, whole), at(1), ts(1));
    let mut round = answered(Rate::Once, &[(130, &[1; 16])]);
    round.failures = failed(Rate::Once, 146, 5, timeout()).failures;
    device.finish(round, at(2), ts(2));
    let curve = value(&device, "curve");
    assert_eq!((curve.quality, curve.raw), (Shown::Bad, Some(vec![2; 20])), "not the half of each");
    assert_eq!(device.view().model.as_deref(), Some("T-1"), "what lies beside it is taken");
}

#[test]
fn what_was_read_on_demand_grows_old_as_it_took_long() {
    let mut device = running();
    let picture = |took| Round { took, ..answered(Rate::OnDemand, &[(152, &[1; 8])]) };
    let changes = device.finish(picture(at(1)), at(1), ts(1));
    assert_eq!((changed(&changes), device.last_round(Rate::OnDemand)), (vec!["picture"], Some(ts(1))));
    let ages = |device: &mut Device, second| {
        device.finish(answered(Rate::Fast, &[(100, &FAST)]), at(second), ts(0));
        device.expire(at(second)).into_iter().any(|(rate, _)| rate == Rate::OnDemand)
    };
    assert!(!ages(&mut device, 6) && ages(&mut device, 7));
    assert_eq!(value(&device, "picture").quality, Shown::Stale);
    // On a slow wire a picture takes long, and is as good as any until three more could have come.
    device.finish(picture(at(40)), at(50), ts(50));
    assert!(!ages(&mut device, 170) && ages(&mut device, 171));
    device.finish(silence(), at(172), ts(172));
    assert_eq!(value(&device, "picture").quality, Shown::Bad);
}
