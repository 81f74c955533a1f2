//! The ways of a state machine: what its code asserts, what its page in `docs/imitation/` draws.

/// One way from a state to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<S: 'static> {
    pub(super) from: S,
    pub(super) to: S,
    /// What leads there.
    pub(super) cause: &'static str,
}

impl<S: Copy + PartialEq> Edge<S> {
    pub(super) const fn new(from: S, to: S, cause: &'static str) -> Self {
        Self { from, to, cause }
    }

    /// What leads from one state to another; none where nothing does.
    pub(super) fn cause(edges: &[Self], from: S, to: S) -> Option<&'static str> {
        edges.iter().find(|edge| edge.from == from && edge.to == to).map(|edge| edge.cause)
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;

    use super::super::genset::State;
    use super::super::supervision::Judgement;
    use super::super::transfer::Stage;
    use super::super::{levers, tests};
    use super::*;

    const PAGE: &str = include_str!("../../../../docs/imitation/smartgen-hat821si.md");

    /// A state diagram; each state with its codes and its name, the first one being that of power-on.
    fn draw<S: Copy + PartialEq + Debug>(states: &[(S, &str)], edges: &[Edge<S>]) -> String {
        let named = |state: S| states.iter().any(|(known, _)| *known == state);
        assert!(edges.iter().all(|edge| named(edge.from) && named(edge.to)));
        let mut lines = vec!["```mermaid".to_owned(), "stateDiagram-v2".to_owned()];
        lines.push(format!("    [*] --> {:?}", states[0].0));
        lines.extend(states.iter().map(|(state, name)| format!("    state \"{name}\" as {state:?}")));
        lines.extend(
            edges.iter().map(|edge| format!("    {:?} --> {:?}: {}", edge.from, edge.to, edge.cause)),
        );
        lines.push("```".to_owned());
        lines.join("\n")
    }

    fn has(part: &str) {
        assert!(PAGE.contains(part), "docs/imitation/smartgen-hat821si.md has to hold this:\n{part}");
    }

    #[test]
    fn the_page_draws_what_the_code_asserts() {
        let stages = [
            (Stage::Still, "16 to 18, 22 to 25 what is closed"),
            (Stage::Ready, "0 Ready to transfer"),
            (Stage::Elevator, "15 Elevator control delay"),
            (Stage::Opening, "2, 4, 21 Opening"),
            (Stage::Rest, "5 Transfer rest"),
            (Stage::WaitPosition, "13, 14, 19 Wait PF"),
            (Stage::Closing, "1, 3, 20 Closing"),
            (Stage::WaitSync, "10 Wait for synchronization"),
            (Stage::SyncClosing, "9, 11, 12 Synchronized close"),
            (Stage::Parallel, "30 Loop closing running"),
        ];
        has(&draw(&stages, Stage::WAYS));
        let judgements = [
            (Judgement::Good, "2 Voltage normal"),
            (Judgement::Doubted, "1 Unavailable, delay"),
            (Judgement::Bad, "3 to 10 what is wrong"),
            (Judgement::Returning, "0 Available, delay"),
        ];
        has(&draw(&judgements, Judgement::WAYS));
        let states = [
            (State::Standby, "9 Standby, 2 Scheduled not run"),
            (State::StartDelay, "0 Start delay"),
            (State::Started, "8 Genset start, 3 Scheduled run"),
            (State::StopDelay, "1 Stop delay"),
        ];
        has(&draw(&states, State::WAYS));
    }

    #[test]
    fn the_page_lists_every_lever_and_every_setting() {
        for lever in levers::LEVERS.iter().filter(|lever| !lever.id.starts_with("switch.l")) {
            has(&format!("`{}`", lever.id));
        }
        for (setting, _) in tests::settings().iter().filter(|(setting, _)| !setting.id.ends_with("_priority"))
        {
            has(&format!("`{}`", setting.id));
        }
    }
}
