//! The planner against exhaustive search, and its promises: inside the map, whole items, nothing left out.

use busbar_profile::plan::{Cost, Planner, Read};
use proptest::prelude::*;

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
    maps().prop_flat_map(|map| items(map.clone()).prop_map(move |items| Wanted { map: map.clone(), items }))
}

#[derive(Clone, Debug)]
struct Wanted {
    map: Vec<(u16, u16)>,
    items: Vec<(u16, u16)>,
}

fn items(ranges: Vec<(u16, u16)>) -> impl Strategy<Value = Vec<(u16, u16)>> {
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
        for (address, registers) in &items {
            prop_assert!(reads.iter().any(|read| read.covers(*address, *registers)), "an item is cut or left out");
        }
        for read in &reads {
            prop_assert!(read.count >= 1 && read.count <= limit);
            prop_assert!(map.iter().any(|(start, end)| read.address >= *start && read.address + read.count - 1 <= *end));
        }
    }

    #[test]
    fn nothing_is_read_across_a_split(
        Wanted { map, items } in wanted(),
        split in 1_u16..60,
    ) {
        let mut planner = Planner::over(&map, 8, Cost { read: 30, register: 1 });
        planner.split_at(split);
        for read in planner.reads(items.iter().copied()) {
            prop_assert!(!(read.address < split && split < read.address + read.count));
        }
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
    let cost = Cost::rtu(9600, 10, std::time::Duration::ZERO);
    assert_eq!(cost.of(16) / 10_000, (45 * 1_041_666 + 2 * 3_645_831) / 10_000);
    // Above 19200 baud the silence is 1.75 ms.
    let fast = Cost::rtu(38_400, 10, std::time::Duration::from_micros(4_300));
    assert_eq!(fast.read, 13 * 260_416 + 1_750_000 + 4_300_000);
}
