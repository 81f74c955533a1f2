//! A device of two thousand points is planned, read, decoded and shown like any other.

use std::fmt::Write;

use busbar_profile::plan::Cost;
use busbar_profile::{Profile, Rate};

use super::*;
use crate::api::types::{PointValue, Quality as Shown};
use crate::api::{PointsQuery, ValuesQuery};
use crate::hub::Hub;
use crate::poll_plan::PollPlan;
use crate::rates::Rates;
use crate::stop;
use crate::table::Slot;
use crate::testing::{at, site_device, table, ts};

const POINTS: u16 = 2_000;
const A_GROUP: u16 = 50;

/// Words, 32-bit numbers, choices and alarm bits in turn, fast and slow.
fn profile() -> &'static Profile {
    static LARGE: std::sync::LazyLock<Profile> = std::sync::LazyLock::new(|| {
        let mut text = String::from(
            r#"
format = 1
key = "large"
vendor = "Acme"
models = ["L-1"]
kind = "genset"
manual = { title = "Large" }
[wire]
transports = ["tcp"]
unit = { min = 1, max = 10, default = 1 }
functions = [3]
max_read = 16
over_read = "truncate"
spacing_ms = 0
answer_delay_ms = 0
timeout_ms = 1000
word_order = "low-first"
serial = { baud = [9600], parity = ["none"], stop = [1] }
readable = [[20000, 23999]]
[choices.step]
values = [{ value = 0, id = "none", label = "None" }, { value = 1, id = "one", label = "One" }]
[bits.alarms]
bits = [{ bit = 0, id = "first", label = "First" }]
"#,
        );
        for group in 0..POINTS / A_GROUP {
            let rate = if group % 2 == 0 { "fast" } else { "slow" };
            write!(
                text,
                "[[groups]]\nid = \"g{group}\"\ntitle = \"{group}\"\nrate = \"{rate}\"\npoints = [\n"
            )
            .unwrap();
            for point in group * A_GROUP..(group + 1) * A_GROUP {
                let kind = match point % 4 {
                    0 => "type = \"u16\", coeff = 10, unit = \"V\"",
                    1 => "type = \"u32\", coeff = 10, unit = \"kWh\"",
                    2 => "type = \"choice\", choices = \"step\"",
                    _ => "type = \"bits\", size = 16, bits = \"alarms\", class = \"warning\"",
                };
                let address = 20_000 + 2 * point;
                writeln!(text, "{{ at = {address}, id = \"p{point}\", {kind}, name = \"Point {point}\" }},")
                    .unwrap();
            }
            text.push_str("]\n");
        }
        Profile::parse("large.toml", &text).unwrap_or_else(|findings| panic!("{findings}"))
    });
    &LARGE
}

/// All that is due, every register holding the same.
fn round(plan: &mut PollPlan, rates: Rates, holds: u16) -> Round {
    let reads = plan.reads(rates, at(0));
    let answers = reads.iter().map(|read| (read.address, vec![holds; read.count.into()])).collect();
    Round { rates, answers, ..Round::default() }
}

#[test]
fn two_thousand_points_are_planned_read_and_shown() {
    let mut plan = PollPlan::new(profile(), Cost::rtu(9600, 10, Duration::ZERO));
    let all: Rates = [Rate::Fast, Rate::Slow].into_iter().collect();
    assert!(plan.reads(all, at(0)).len() >= 250, "no more than 16 registers a read");

    let device = Device::new(SiteDevice { profile: profile(), ..site_device("large") }, "w1".to_owned());
    let slot = Arc::new(Slot::new(device));
    let mut table = table(&["gen1"]);
    table.devices.push(Arc::clone(&slot));
    let hub = Hub::new(table, stop::channel().1);
    hub.finish(&slot, round(&mut plan, all, 1));
    hub.finish(&slot, round(&mut plan, Rate::Fast.into(), 0));
    // Rounds that change half of everything.
    for number in 0..20 {
        let mut live = slot.lock();
        let changes = live.device.finish(round(&mut plan, Rate::Fast.into(), number % 2 + 1), at(1), ts(1));
        assert!(changes.values.len() >= 500, "{}", changes.values.len());
    }

    let values = hub.values("large", &ValuesQuery::default()).unwrap();
    assert_eq!(values.len(), usize::from(POINTS));
    let of = |id: &str| values.iter().find(|value| value.id == id).unwrap();
    assert_eq!(of("p0").value, PointValue::Number("0.2".parse().unwrap()));
    assert_eq!(of("p1999").set, Some(vec![0]), "a slow one, read in the first round");
    assert!(values.iter().all(|value| value.quality == Shown::Good));
    let points = hub.points("large", &PointsQuery::default()).unwrap();
    assert_eq!(points.groups.iter().map(|group| group.points.len()).sum::<usize>(), usize::from(POINTS));
    let view = hub.device_view("large").unwrap();
    assert_eq!((view.online, view.alarms.warning > 200), (true, true));
    assert!(serde_json::to_string(&values).unwrap().len() > 100_000);
}
