use std::sync::Arc;

use busbar_profile::Rate;

use super::*;
use crate::device::Device;
use crate::rates::Rates;
use crate::site::SiteDevice;
use crate::stop;
use crate::table::{Slot, Table};
use crate::testing::{answered, hub, refusal, silence, site_device, table};

const FAST: [u16; 12] = [5, 1, 40, 0, 2302, 0, 215, 0, 1234, 0, 1, 0];

fn lines(hub: &Hub) -> Vec<String> {
    text(hub).unwrap().lines().map(str::to_owned).collect()
}

#[track_caller]
fn has(lines: &[String], line: &str) {
    assert!(lines.iter().any(|known| known == line), "{line} is not in\n{}", lines.join("\n"));
}

fn of<'a>(lines: &'a [String], name: &str) -> Vec<&'a String> {
    lines.iter().filter(|line| line.starts_with(name)).collect()
}

#[test]
fn good_values_are_told_by_signal_and_device() {
    let hub = hub(&["gen1", "gen2"], stop::channel().1);
    hub.finish(&hub.table().devices[0], answered(Rate::Fast, &[(100, &FAST)]));
    let lines = lines(&hub);
    for line in [
        "# TYPE busbar_genset_l1_voltage_v gauge",
        "# UNIT busbar_genset_l1_voltage_v v",
        "busbar_genset_l1_voltage_v{device=\"gen1\"} 230.2",
        "busbar_state_engine{device=\"gen1\",state=\"cranking\"} 1",
        "busbar_state_engine{device=\"gen1\",state=\"loaded\"} 0",
        "busbar_mode{device=\"gen1\",state=\"off\"} 1",
        "busbar_device_online{device=\"gen1\"} 1",
        "busbar_device_online{device=\"gen2\"} 0",
        "busbar_device_identity{device=\"gen2\",verdict=\"unknown\"} 1",
        "busbar_device_alarms{device=\"gen1\",class=\"shutdown\"} 1",
        "busbar_device_alarms_known{device=\"gen2\"} 0",
        "busbar_site_revision 1",
        "# EOF",
    ] {
        has(&lines, line);
    }
    assert_eq!(of(&lines, "busbar_genset_l1_voltage_v{").len(), 1, "the other one has none");
    assert_eq!(of(&lines, "busbar_device_alarms{").len(), 5, "nor does it have no alarms");
    assert_eq!(of(&lines, "busbar_device_age_seconds{").len(), 1);
    assert_eq!(lines.last().unwrap(), "# EOF");
}

#[test]
fn what_is_not_good_is_no_number() {
    let hub = hub(&["gen1"], stop::channel().1);
    let slot = Arc::clone(&hub.table().devices[0]);
    hub.finish(&slot, answered(Rate::Fast, &[(100, &FAST)]));
    let voltage = |hub: &Hub| of(&lines(hub), "busbar_genset_l1_voltage_v{").len();
    assert_eq!(voltage(&hub), 1);
    hub.finish(&slot, crate::testing::failed(Rate::Fast, 100, 12, refusal(2)));
    assert_eq!(voltage(&hub), 0, "an exception");
    hub.finish(&slot, answered(Rate::Fast, &[(100, &FAST)]));
    assert_eq!(voltage(&hub), 1);
    hub.finish(&slot, silence());
    assert_eq!(voltage(&hub), 0, "a time-out");
    let lines = lines(&hub);
    has(&lines, "busbar_device_online{device=\"gen1\"} 0");
    assert!(of(&lines, "busbar_state_engine{").is_empty() && of(&lines, "busbar_mode{").is_empty());
    assert!(of(&lines, "busbar_device_alarms{").is_empty(), "nobody knows");
}

#[test]
fn a_device_decides_nothing_about_the_series() {
    let series = |registers: &[u16]| {
        let hub = hub(&["gen1"], stop::channel().1);
        hub.finish(&hub.table().devices[0], answered(Rate::Fast, &[(100, registers)]));
        let lines = lines(&hub);
        let names = lines.iter().filter(|line| !line.starts_with('#'));
        names.map(|line| line.rsplit_once(' ').unwrap().0.to_owned()).collect::<Vec<_>>()
    };
    let known = series(&FAST);
    let mut unknown = FAST;
    (unknown[0], unknown[10], unknown[11]) = (4_711, 0xFFFF, 0xFFFF);
    assert_eq!(series(&unknown), known);
}

/// Prints what it takes: `cargo test -p busbar-gateway thousand -- --nocapture`.
#[test]
fn a_scrape_of_a_thousand_controllers_copies_and_lets_go() {
    let profile = busbar_profile::builtin("datakom-d").unwrap();
    let zeros: Vec<(u16, Vec<u16>)> = profile
        .wire
        .readable
        .iter()
        .map(|(first, last)| (*first, vec![0; usize::from(last - first) + 1]))
        .collect();
    let zeros: Vec<(u16, &[u16])> = zeros.iter().map(|(at, registers)| (*at, registers.as_slice())).collect();
    let slot = |index: usize| {
        let site = SiteDevice { profile, ..site_device(&format!("gen{index}")) };
        Arc::new(Slot::new(Device::new(site, "w1".to_owned())))
    };
    let hub = Hub::new(Table { devices: (0..1_000).map(slot).collect(), ..table(&[]) }, stop::channel().1);
    let rates = Rates::from_iter([Rate::Fast, Rate::Slow, Rate::Once]);
    for slot in &hub.table().devices {
        hub.finish(slot, answered(rates, &zeros));
    }
    let begun = std::time::Instant::now();
    let scrape = Scrape::of(&hub);
    let copied = begun.elapsed();
    // From here on every device may be locked by whoever likes.
    let table = hub.table();
    let _locked: Vec<_> = table.devices.iter().map(|slot| slot.lock()).collect();
    let mut registry = Registry::with_prefix(PREFIX);
    registry.register_collector(Box::new(scrape));
    let mut text = String::new();
    text::encode(&mut text, &registry).unwrap();
    println!("1,000 D-500: copied in {copied:?}, {} bytes in {:?}", text.len(), begun.elapsed());
    assert_eq!(text.lines().filter(|line| line.starts_with("busbar_genset_frequency_hz{")).count(), 1_000);
}

#[test]
fn an_empty_site_has_its_own_numbers() {
    let hub = Hub::new(table(&[]), stop::channel().1);
    let text = text(&hub).unwrap();
    assert!(text.contains("busbar_build_info{version=\"") && text.ends_with("# EOF\n"), "{text}");
    assert!(!text.contains("{device"), "{text}");
}
