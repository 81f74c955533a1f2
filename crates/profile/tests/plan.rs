//! The planner against exhaustive search, and its promises: inside the map, whole items, nothing left out.

#![cfg(test)]

use std::time::Duration;

use busbar_profile::plan::{Cost, Planner, Read, items, plan};
use busbar_profile::{Profile, Rate, builtins};
use proptest::prelude::*;
use proptest::sample::{select, subsequence};

/// The least cost of covering every item, found by trying every read on every set of items still uncovered.
fn exhaustive(map: &[(u16, u16)], limit: u16, cost: Cost, items: &[(u16, u16)]) -> u64 {
    let mut reads = Vec::new();
    for (start, end) in map {
        for address in *start..=*end {
            for count in 1..=limit.min(end - address + 1) {
                let read = Read { function: 3, address, count };
                let covered = items
                    .iter()
                    .enumerate()
                    .filter(|(_, (item, registers))| read.covers(*item, *registers))
                    .fold(0_usize, |set, (index, _)| set | 1 << index);
                reads.push((covered, cost.of(count)));
            }
        }
    }
    let mut least = vec![u64::MAX; 1 << items.len()];
    least[0] = 0;
    for set in 0..least.len() {
        if least[set] == u64::MAX {
            continue;
        }
        for (covered, price) in &reads {
            let next = set | covered;
            least[next] = least[next].min(least[set] + price);
        }
    }
    least[least.len() - 1]
}

/// Ascending readable ranges with gaps of at least one address between them.
fn maps() -> impl Strategy<Value = Vec<(u16, u16)>> {
    prop::collection::vec((1_u16..6, 1_u16..14), 1..4).prop_map(|parts| {
        let mut address = 0;
        parts
            .into_iter()
            .map(|(gap, length)| {
                let start = address + gap;
                address = start + length;
                (start, address - 1)
            })
            .collect()
    })
}

/// A map, and up to seven items of one to four registers, each inside a range of it.
fn wanted() -> impl Strategy<Value = Wanted> {
    maps().prop_flat_map(|map| places(map.clone()).prop_map(move |items| Wanted { map: map.clone(), items }))
}

#[derive(Clone, Debug)]
struct Wanted {
    map: Vec<(u16, u16)>,
    items: Vec<(u16, u16)>,
}

fn places(ranges: Vec<(u16, u16)>) -> impl Strategy<Value = Vec<(u16, u16)>> {
    let item = (0..ranges.len(), any::<u16>(), 1_u16..5).prop_map(move |(range, offset, registers)| {
        let (start, end) = ranges[range];
        let registers = registers.min(end - start + 1);
        (start + offset % (end - start + 2 - registers), registers)
    });
    prop::collection::vec(item, 1..8)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3_000))]

    #[test]
    fn plans_cost_the_least_possible(
        Wanted { map, items } in wanted(),
        limit in 4_u16..9,
        read in 1_u64..40,
        register in 1_u64..4,
    ) {
        let cost = Cost { read, register };
        let reads = Planner::over(&map, limit, cost).reads(items.iter().copied());
        let price: u64 = reads.iter().map(|read| cost.of(read.count)).sum();
        prop_assert_eq!(price, exhaustive(&map, limit, cost, &items));
        prop_assert_eq!(price, cost.total(&reads));
        prop_assert_eq!(price, Planner::over(&map, limit, cost).least(items.iter().copied()));
        for (address, registers) in &items {
            prop_assert!(reads.iter().any(|read| read.covers(*address, *registers)), "an item is cut or left out");
        }
        for read in &reads {
            prop_assert!(read.count >= 1 && read.count <= limit);
            prop_assert!(map.iter().any(|(start, end)| read.address >= *start && read.address + read.count - 1 <= *end));
        }
    }

    #[test]
    fn nothing_is_read_across_a_split_but_an_item_that_lies_across_it(
        Wanted { map, items } in wanted(),
        split in 1_u16..60,
    ) {
        let across = |address: u16, count: u16| address < split && split < address + count;
        let mut planner = Planner::over(&map, 8, Cost { read: 30, register: 1 });
        planner.split_at(split);
        let reads = planner.reads(items.iter().copied());
        for read in reads.iter().filter(|read| across(read.address, read.count)) {
            let part = |(address, registers): &&(u16, u16)| read.covers(*address, *registers);
            prop_assert!(items.iter().filter(part).any(|item| across(item.0, item.1)));
        }
        for (address, registers) in &items {
            prop_assert!(reads.iter().any(|read| read.covers(*address, *registers)), "an item is cut or left out");
        }
    }

    /// Numbers and arrays come whole, bulk points in parts, and nothing else is ever asked for.
    #[test]
    fn plans_of_built_in_profiles_keep_the_rules((profile, points) in some_points()) {
        let cost = Cost::rtu(9600, 10, profile.wire.answer_delay());
        let reads = plan(profile, &points);
        let wire = &profile.wire;
        for read in &reads {
            prop_assert!(wire.functions.contains(&read.function));
            prop_assert!(read.count >= 1 && read.count <= wire.max_read, "{:?} is too long", read);
            prop_assert!(wire.is_readable(read.address, read.count), "{:?} leaves the map", read);
        }
        for index in &points {
            let point = &profile.points[*index];
            let (address, registers) = (point.address, point.registers);
            let whole = reads.iter().any(|read| read.covers(address, registers));
            let parts = || (address..=point.last()).all(|register| reads.iter().any(|read| read.covers(register, 1)));
            match (point.access.is_readable(), point.data_type.is_bulk() && registers > wire.max_read) {
                (true, true) => prop_assert!(parts(), "a part of {} is left out", point.id),
                (true, false) => prop_assert!(whole, "{} is cut or left out", point.id),
                (false, _) => prop_assert!(!whole, "{} cannot be read", point.id),
            }
        }
        prop_assert_eq!(cost.total(&reads), Planner::new(profile, cost).least(items(profile, &points)));
    }

    /// One plan for all never costs more than a plan each.
    #[test]
    fn a_shared_plan_is_never_dearer(
        (profile, points) in some_points(),
        shares in prop::collection::vec(0_usize..3, 300),
        tcp in any::<bool>(),
    ) {
        let cost = match tcp {
            true => Cost::tcp(Duration::from_millis(5), 1_000_000),
            false => Cost::rtu(9600, 10, profile.wire.answer_delay()).spaced(spacing(profile)),
        };
        let planner = Planner::new(profile, cost);
        let of = |share| -> Vec<usize> {
            points.iter().copied().filter(|point| shares[point % shares.len()] == share).collect()
        };
        let apart: u64 = (0..3).map(|share| planner.least(items(profile, &of(share)))).sum();
        prop_assert!(planner.least(items(profile, &points)) <= apart);
    }
}

fn spacing(profile: &Profile) -> Duration {
    Duration::from_millis(profile.wire.spacing_ms.into())
}

/// A built-in profile and any of its points.
fn some_points() -> impl Strategy<Value = (&'static Profile, Vec<usize>)> {
    select(builtins().iter().collect::<Vec<_>>()).prop_flat_map(|profile| {
        let points: Vec<usize> = (0..profile.points.len()).collect();
        let all = points.len();
        (Just(profile), subsequence(points, 0..=all))
    })
}

/// Reads, characters and tenths of a millisecond of the cheapest full refresh of each controller at 9600 8N1: all its
/// points but image and trace.
const FULL_REFRESHES: &[(&str, usize, u64, u64)] = &[
    ("datakom-d", 24, 940, 11_542),
    ("datakom-dkg705", 12, 440, 5_537),
    ("smartgen-acc1700", 4, 338, 3_812),
    ("smartgen-hat821si", 4, 496, 5_458),
];

#[test]
fn full_refreshes_take_the_least_wire_time() {
    for profile in builtins() {
        let row = FULL_REFRESHES.iter().find(|row| row.0 == profile.key);
        let (_, reads, characters, tenths) = row.unwrap_or_else(|| panic!("{} has no row", profile.key));
        let points: Vec<usize> =
            (0..profile.points.len()).filter(|index| !profile.points[*index].data_type.is_bulk()).collect();
        let cost = Cost::rtu(9600, 10, profile.wire.answer_delay());
        let plan = plan(profile, &points);
        let all: u64 = plan.iter().map(|read| read.characters()).sum();
        let nanoseconds = cost.total(&plan);
        assert_eq!((plan.len(), all), (*reads, *characters), "{}: {plan:?}", profile.key);
        assert_eq!((nanoseconds + 50_000) / 100_000, *tenths, "{}: {nanoseconds} ns", profile.key);
    }
}

#[test]
fn what_is_due_together_shares_reads() {
    for profile in builtins() {
        let cost = Cost::rtu(9600, 10, profile.wire.answer_delay());
        let planner = Planner::new(profile, cost);
        let both = planner.due(profile, &[Rate::Fast, Rate::Slow]);
        let fast = planner.due(profile, &[Rate::Fast]);
        let slow = planner.due(profile, &[Rate::Slow]);
        let apart = cost.total(&fast.reads) + cost.total(&slow.reads);
        assert!(cost.total(&both.reads) <= apart, "{}", profile.key);
        for (index, point) in profile.points.iter().enumerate() {
            let brought = fast.reads.iter().any(|read| read.covers(point.address, point.registers));
            assert!(brought || point.rate != Rate::Fast || !point.access.is_readable(), "{}", point.id);
            let besides = brought && point.rate != Rate::Fast;
            assert_eq!(fast.besides.contains(&index), besides, "{}", point.id);
        }
        assert!(planner.due(profile, &[]).reads.is_empty());
    }
}

#[test]
fn a_hole_is_bridged_when_that_is_cheaper() {
    let near = Planner::over(&[(0, 99)], 16, Cost { read: 10, register: 1 });
    assert_eq!(near.reads([(0, 2), (10, 2)]), [Read { function: 3, address: 0, count: 12 }]);
    assert_eq!(
        near.reads([(0, 2), (13, 2)]),
        [Read { function: 3, address: 0, count: 2 }, Read { function: 3, address: 13, count: 2 }]
    );
}

#[test]
fn a_number_across_a_split_is_read_alone() {
    let mut planner = Planner::over(&[(0, 99)], 16, Cost { read: 10, register: 1 });
    planner.split_at(5);
    let reads = planner.reads([(2, 2), (4, 2), (6, 1), (7, 1)]);
    let spans: Vec<_> = reads.iter().map(|read| (read.address, read.count)).collect();
    assert_eq!(spans, [(2, 2), (4, 2), (6, 2)]);
}

#[test]
fn a_pause_between_reads_can_count() {
    let cost = Cost::rtu(9600, 10, Duration::ZERO);
    let map = &[(0, 199)];
    let far = [(0, 1), (60, 1)];
    assert_eq!(Planner::over(map, 120, cost).reads(far).len(), 2);
    assert_eq!(Planner::over(map, 120, cost.spaced(Duration::from_millis(500))).reads(far).len(), 1);
}

#[test]
fn the_map_is_never_left() {
    let planner = Planner::over(&[(10, 19), (21, 30)], 16, Cost { read: 1000, register: 1 });
    let reads = planner.reads([(18, 2), (21, 1), (20, 1), (30, 2)]);
    assert_eq!(
        reads,
        [Read { function: 3, address: 18, count: 2 }, Read { function: 3, address: 21, count: 1 }]
    );
}

#[test]
fn an_item_longer_than_a_read_comes_in_parts() {
    let planner = Planner::over(&[(100, 199)], 16, Cost { read: 20, register: 2 });
    let reads = planner.reads([(100, 40)]);
    assert_eq!(reads.iter().map(|read| read.count).sum::<u16>(), 40);
    assert_eq!(reads.len(), 3);
}

#[test]
fn costs_are_those_of_the_wire() {
    // 9600 8N1: 1.0416 ms a character; a read of 16 registers is 45 characters and two silences of 3.646 ms.
    let cost = Cost::rtu(9600, 10, Duration::ZERO);
    assert_eq!(cost.of(16) / 10_000, (45 * 1_041_666 + 2 * 3_645_831) / 10_000);
    // Above 19200 baud the silence is 1.75 ms.
    let fast = Cost::rtu(38_400, 10, Duration::from_micros(4_300));
    assert_eq!(fast.read, 13 * 260_416 + 1_750_000 + 4_300_000);
    let read = Read { function: 3, address: 0, count: 16 };
    assert_eq!((read.characters(), read.tcp_bytes()), (45, 12 + 41));
}
