//! Which status may follow which: the table behind the diagrams in `docs/imitation/datakom-d.md`. What the sequence
//! does is held against it by chance, and the page is held against it word for word.

use std::fs;
use std::ops::RangeInclusive;
use std::path::Path;

use super::operation::Operation::{self, *};

/// A status, one that may follow it, and what brings it about.
pub(super) type Transition = (Operation, Operation, &'static str);

/// Every change of status that the unit can make.
pub(super) const TRANSITIONS: &[Transition] = &[
    (AtRest, WaitBeforeFuel, "the engine is wanted, and nothing has tripped"),
    (AtRest, Stopping, "the engine turns, after a hard reset or by itself"),
    (WaitBeforeFuel, AtRest, "no longer wanted"),
    (WaitBeforeFuel, Preheat, "timer"),
    (Preheat, AtRest, "no longer wanted"),
    (Preheat, WaitOilFlashOff, "timer"),
    (WaitOilFlashOff, AtRest, "no longer wanted"),
    (WaitOilFlashOff, Cranking, "timer"),
    (Cranking, IdleSpeed, "the engine fires"),
    (Cranking, CrankRest, "timer, attempts left"),
    (Cranking, Stopping, "the last attempt ends and the start has failed, or no longer wanted"),
    (CrankRest, Cranking, "timer, and the engine stands"),
    (CrankRest, IdleSpeed, "the engine fires as it rolls out"),
    (CrankRest, Stopping, "no longer wanted"),
    (IdleSpeed, Heating, "timer"),
    (IdleSpeed, CrankRest, "the engine dies, attempts left"),
    (IdleSpeed, Stopping, "the engine dies in its last attempt and the start has failed"),
    (IdleSpeed, StopWithCooldown, "no longer wanted"),
    (Heating, OffLoad, "timer"),
    (Heating, CrankRest, "the engine dies, attempts left"),
    (Heating, Stopping, "the engine dies in its last attempt and the start has failed"),
    (Heating, StopWithCooldown, "no longer wanted"),
    (OffLoad, Synchronizing, "to take load beside live mains"),
    (OffLoad, GensetBreakerTimer, "to take the load, mains breaker open"),
    (OffLoad, StopWithCooldown, "no longer wanted"),
    (OffLoad, Stopping, "the engine stands"),
    (Synchronizing, GensetBreakerActivation, "in step with the mains"),
    (
        Synchronizing,
        OffLoad,
        "the timer ends and synchronization has failed, or the mains fail, or the load is to stay",
    ),
    (Synchronizing, StopWithCooldown, "no longer wanted"),
    (GensetBreakerTimer, GensetBreakerActivation, "timer"),
    (GensetBreakerTimer, MainsBreakerTimer, "the load is to go back"),
    (GensetBreakerTimer, OffLoad, "the load is no longer to move, or the genset is outside its limits"),
    (GensetBreakerTimer, StopWithCooldown, "no longer wanted"),
    (GensetBreakerActivation, OnLoad, "genset breaker closed"),
    (GensetBreakerActivation, SlaveOnLoad, "genset breaker closed, the unit is a slave"),
    (GensetBreakerActivation, TransferToGenset, "genset breaker closed beside the mains, soft transfer"),
    (GensetBreakerActivation, PeakLopping, "genset breaker closed beside the mains, to lop peaks"),
    (GensetBreakerActivation, Exporting, "genset breaker closed beside the mains, to export"),
    (GensetBreakerActivation, GensetBreakerTimer, "the mains fail before the breaker has closed"),
    (GensetBreakerActivation, MainsBreakerTimer, "the load is to go back"),
    (GensetBreakerActivation, OffLoad, "the load is no longer to move"),
    (GensetBreakerActivation, StopWithCooldown, "no longer wanted"),
    (TransferToGenset, OnLoad, "mains breaker open"),
    (TransferToGenset, SlaveOnLoad, "mains breaker open, the unit is a slave"),
    (TransferToGenset, TransferToMains, "the load is to go back"),
    (TransferToGenset, PeakLopping, "to lop peaks"),
    (TransferToGenset, Exporting, "to export"),
    (TransferToGenset, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (TransferToGenset, OffLoad, "genset breaker open"),
    (TransferToGenset, StopWithCooldown, "genset breaker open, no longer wanted"),
    (OnLoad, SynchronizingBack, "the load goes back without a break"),
    (OnLoad, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (OnLoad, OffLoad, "genset breaker open, nobody to take over"),
    (OnLoad, StopWithCooldown, "genset breaker open, nobody to take over, no longer wanted"),
    (SlaveOnLoad, SynchronizingBack, "the load goes back without a break"),
    (SlaveOnLoad, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (SlaveOnLoad, OffLoad, "genset breaker open, nobody to take over"),
    (SlaveOnLoad, StopWithCooldown, "genset breaker open, nobody to take over, no longer wanted"),
    (PeakLopping, Exporting, "to export"),
    (PeakLopping, TransferToGenset, "to take the whole load softly"),
    (PeakLopping, TransferToMains, "the load is to go back"),
    (PeakLopping, OnLoad, "the mains fail, or the genset is to take the whole load"),
    (PeakLopping, SlaveOnLoad, "the same, the unit is a slave"),
    (PeakLopping, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (PeakLopping, OffLoad, "genset breaker open"),
    (PeakLopping, StopWithCooldown, "genset breaker open, no longer wanted"),
    (Exporting, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (Exporting, OffLoad, "genset breaker open"),
    (Exporting, StopWithCooldown, "genset breaker open, no longer wanted"),
    (Exporting, PeakLopping, "to lop peaks"),
    (Exporting, TransferToGenset, "to take the whole load softly"),
    (Exporting, TransferToMains, "the load is to go back"),
    (Exporting, OnLoad, "the mains fail, or the genset is to take the whole load"),
    (Exporting, SlaveOnLoad, "the same, the unit is a slave"),
    (SynchronizingBack, TransferToMains, "mains breaker closed, soft transfer"),
    (SynchronizingBack, PeakLopping, "mains breaker closed, to lop peaks"),
    (SynchronizingBack, Exporting, "mains breaker closed, to export"),
    (SynchronizingBack, TransferToGenset, "mains breaker closed, the genset is to keep the load"),
    (SynchronizingBack, OffLoad, "mains breaker closed, or genset breaker open"),
    (SynchronizingBack, StopWithCooldown, "the same, no longer wanted"),
    (SynchronizingBack, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (
        SynchronizingBack,
        OnLoad,
        "the timer ends and synchronization has failed, or the mains fail, or the genset is to keep the load",
    ),
    (SynchronizingBack, SlaveOnLoad, "the same, the unit is a slave"),
    (TransferToMains, OffLoad, "genset breaker open"),
    (TransferToMains, StopWithCooldown, "genset breaker open, no longer wanted"),
    (TransferToMains, TransferToGenset, "the genset is to take the load again"),
    (TransferToMains, PeakLopping, "to lop peaks"),
    (TransferToMains, Exporting, "to export"),
    (TransferToMains, OnLoad, "the mains fail"),
    (TransferToMains, SlaveOnLoad, "the mains fail, the unit is a slave"),
    (MainsBreakerTimer, MainsBreakerActivation, "timer"),
    (MainsBreakerTimer, GensetBreakerTimer, "the genset is to take the load again"),
    (MainsBreakerTimer, OffLoad, "nobody is to take the load, or the mains fail"),
    (MainsBreakerTimer, StopWithCooldown, "the same, no longer wanted"),
    (
        MainsBreakerActivation,
        OffLoad,
        "mains breaker closed, or nobody is to take the load, or the mains fail",
    ),
    (MainsBreakerActivation, StopWithCooldown, "the same, no longer wanted"),
    (MainsBreakerActivation, GensetBreakerTimer, "the genset is to take the load again"),
    (StopWithCooldown, CoolingDown, "timer"),
    (StopWithCooldown, OffLoad, "wanted again"),
    (StopWithCooldown, Stopping, "the engine dies"),
    (CoolingDown, IdleBeforeStop, "timer"),
    (CoolingDown, OffLoad, "wanted again"),
    (CoolingDown, Stopping, "the engine dies"),
    (IdleBeforeStop, Stopping, "timer, or the engine dies"),
    (ImmediateStop, Stopping, "timer"),
    (Stopping, AtRest, "timer, and the engine stands"),
];

/// The diagrams of the page: a title, and the statuses whose ways out it shows.
const DIAGRAMS: [(&str, &[RangeInclusive<Operation>]); 4] = [
    ("Start", &[AtRest..=Heating]),
    ("To the genset", &[OffLoad..=GensetBreakerTimer]),
    ("On load and back", &[OnLoad..=MainsBreakerTimer]),
    ("Stop", &[StopWithCooldown..=Stopping]),
];

/// One of them as the page has it.
fn diagram(from: &[RangeInclusive<Operation>]) -> String {
    let shown: Vec<_> =
        TRANSITIONS.iter().filter(|(status, ..)| from.iter().any(|range| range.contains(status))).collect();
    let mut statuses: Vec<_> = shown.iter().flat_map(|(from, to, _)| [*from, *to]).collect();
    statuses.sort_unstable();
    statuses.dedup();
    let profile = busbar_profile::builtin("datakom-d").unwrap();
    let mut lines = vec!["```mermaid".to_owned(), "stateDiagram-v2".to_owned()];
    for status in statuses {
        let code = status as u8;
        let choice = profile.point("operation_status").and_then(|point| point.choice(code.into())).unwrap();
        lines.push(format!("    s{code} : {code} {}", choice.label));
    }
    for (from, to, why) in shown {
        lines.push(format!("    s{} --> s{} : {why}", *from as u8, *to as u8));
    }
    lines.push("```".to_owned());
    lines.join("\n")
}

#[test]
fn the_page_has_the_diagrams_of_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/imitation/datakom-d.md");
    let page = fs::read_to_string(path).unwrap();
    let expected: Vec<_> =
        DIAGRAMS.iter().map(|(title, from)| format!("### {title}\n\n{}\n", diagram(from))).collect();
    for part in &expected {
        assert!(page.contains(part.as_str()), "the page lacks this:\n\n{part}");
    }
    assert_eq!(page.matches("```mermaid").count(), expected.len());
}

#[test]
fn no_diagram_leaves_a_transition_out_and_none_is_listed_twice() {
    for (number, (from, to, why)) in TRANSITIONS.iter().enumerate() {
        let shown = DIAGRAMS.iter().filter(|(_, ranges)| ranges.iter().any(|range| range.contains(from)));
        assert_eq!(shown.count(), 1, "{from:?}");
        assert!(TRANSITIONS[..number].iter().all(|(a, b, _)| (a, b) != (from, to)), "{from:?} {to:?}");
        // A colon would end the label in the diagram.
        assert!(!why.contains(':') && !why.contains(';'), "{why}");
    }
}
