//! Where the three switches shall stand: by themselves in automatic mode, by command in manual mode, and not at all where
//! something forbids it.

use super::switches::{Positions, Switch};

/// Both sources on their own sections.
pub(super) const NORMAL: Positions = Positions::of(1, 0, 1);
const FROM_S1: Positions = Positions::of(1, 1, 0);
const FROM_S2: Positions = Positions::of(0, 1, 1);
const S1_ALONE: Positions = Positions::of(1, 0, 0);
const S2_ALONE: Positions = Positions::of(0, 0, 1);

/// What forbids positions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bars {
    /// Switches that have to be open.
    pub(super) locked: Positions,
    /// Switches that may not be closed, and in automatic mode not stay so.
    pub(super) inhibited: Positions,
    /// Switches that did not close when they were to.
    pub(super) not_closed: Positions,
    /// Switches that are closed now.
    pub(super) now: Positions,
    /// By source: it may not supply the other section over the tie.
    pub(super) no_supply_over_tie: [bool; 2],
}

impl Bars {
    /// Whether a switch can be closed, or stay so.
    fn permits_switch(&self, switch: Switch) -> bool {
        let is = |those: Positions| those.is_closed(switch);
        !is(self.locked) && !is(self.inhibited) && (is(self.now) || !is(self.not_closed))
    }

    /// Whether a position can be taken.
    pub(super) fn permit(&self, position: Positions) -> bool {
        let switches = Switch::ALL.into_iter().filter(|switch| position.is_closed(*switch));
        let supplies = (0..2).filter(|source| position.is_closed(Switch::OF_SOURCES[*source]));
        let over_tie = position.is_closed(Switch::Qtie);
        switches.into_iter().all(|switch| self.permits_switch(switch))
            && !(over_tie && supplies.into_iter().any(|source| self.no_supply_over_tie[source]))
    }

    /// What is left of a position without the switches that have to be open or did not close.
    fn left_of(&self, position: Positions) -> Positions {
        Positions::by(|switch| {
            let fails = !self.now.is_closed(switch) && self.not_closed.is_closed(switch);
            position.is_closed(switch) && !self.locked.is_closed(switch) && !fails
        })
    }
}

/// The wish of the controller for its switches.
#[derive(Clone, Debug)]
pub(super) struct Control {
    target: Positions,
    /// A remote transfer in automatic mode holds while exactly these sources are available.
    held: Option<[bool; 2]>,
    /// Once both sources are back the present position is kept, until somebody asks for another one.
    settled: bool,
}

/// What a wish is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene {
    pub(super) auto: bool,
    pub(super) masters: [bool; 2],
    pub(super) available: [bool; 2],
    /// Those of them with which nothing is wrong at this moment.
    pub(super) faultless: [bool; 2],
    /// Sources that are there only because a genset stands in for their mains.
    pub(super) guests: [bool; 2],
    /// Sources whose genset is to stop when another one has taken its load over.
    pub(super) leaving: [bool; 2],
    pub(super) restores: bool,
    /// Everything has to be open.
    pub(super) forced_open: bool,
    pub(super) bars: Bars,
}

impl Scene {
    /// A source in doubt would be given something that it does not feed yet.
    fn doubts(&self, position: Positions) -> bool {
        let (now, then) = (self.bars.now.feeds(), position.feeds());
        (0..2).any(|source| !self.faultless[source] && (0..2).any(|it| then[it][source] && !now[it][source]))
    }
}

impl Control {
    pub(super) fn new(target: Positions) -> Self {
        Self { target, held: None, settled: false }
    }

    pub(super) fn target(&self) -> Positions {
        self.target
    }

    pub(super) fn step(&mut self, scene: Scene) {
        let bars = &scene.bars;
        if self.held.is_some_and(|then| then != scene.available || !bars.permit(self.target)) {
            self.held = None;
        }
        if scene.forced_open {
            self.held = None;
            self.target = Positions::OPEN;
        } else if !scene.auto {
            // What could not be done by hand is not tried again by itself.
            self.target = bars.left_of(self.target);
        } else if self.held.is_none() {
            self.target = self.automatic(scene);
        }
    }

    /// Where automatic mode wants the switches; nowhere else while there is no source.
    fn automatic(&mut self, scene: Scene) -> Positions {
        let bars = &scene.bars;
        let usable =
            |source: usize| scene.available[source] && bars.permits_switch(Switch::OF_SOURCES[source]);
        let usable = [usable(0), usable(1)];
        let guest = |source: usize| usable[source] && scene.guests[source];
        // A genset is relieved as soon as there are mains, or the set whose turn it is.
        let goes = |source: usize| scene.leaving[source] || guest(source) && !guest(1 - source);
        let chosen = [0, 1].map(|source| usable[source] && !(usable[1 - source] && goes(source)));
        let wishes: &[Positions] = match (chosen, scene.masters) {
            ([true, true], [true, false]) => &[FROM_S1, NORMAL],
            ([true, true], [false, true]) => &[FROM_S2, NORMAL],
            ([true, true], _) => &[NORMAL],
            ([true, false], _) => &[FROM_S1, NORMAL, S1_ALONE],
            ([false, true], _) => &[FROM_S2, NORMAL, S2_ALONE],
            ([false, false], _) => &[],
        };
        let feeds = |position: Positions, source: usize| position.is_closed(Switch::OF_SOURCES[source]);
        let serves = bars.permit(self.target)
            && self.target.feeds().iter().all(|section| section.contains(&true))
            && (0..2).all(|source| chosen[source] || !feeds(self.target, source));
        if self.settled && !scene.restores && serves {
            return self.target;
        }
        let wish = wishes
            .iter()
            .copied()
            .find(|wish| bars.permit(*wish) && (0..2).all(|source| usable[source] || !feeds(*wish, source)));
        // Nothing is closed onto a source that may be given up in a moment.
        let wish = wish.filter(|wish| *wish == self.target || !scene.doubts(*wish));
        self.settled = true;
        wish.unwrap_or_else(|| bars.left_of(self.target))
    }

    /// A command for a position; ignored where a source or a switch does not permit it.
    pub(super) fn transfer(&mut self, to: Positions, scene: Scene) {
        let dead = (0..2).any(|source| to.is_closed(Switch::OF_SOURCES[source]) && !scene.available[source]);
        if dead || scene.doubts(to) || scene.forced_open || !scene.bars.permit(to) {
            return;
        }
        self.target = to;
        self.held = scene.auto.then_some(scene.available);
    }

    /// Somebody has changed the mode or the masters: what is wanted is worked out anew.
    pub(super) fn reconsider(&mut self) {
        (self.held, self.settled) = (None, false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        Scene {
            auto: true,
            masters: [true; 2],
            available: [true; 2],
            faultless: [true; 2],
            guests: [false; 2],
            leaving: [false; 2],
            restores: true,
            forced_open: false,
            bars: Bars::default(),
        }
    }

    fn wish(control: &mut Control, scene: Scene) -> [u8; 3] {
        control.step(scene);
        control.target().digits()
    }

    #[test]
    fn masters_and_sources_decide() {
        for (masters, available, wanted) in [
            ([true, true], [true, true], [1, 0, 1]),
            ([false, false], [true, true], [1, 0, 1]),
            ([true, false], [true, true], [1, 1, 0]),
            ([false, true], [true, true], [0, 1, 1]),
            ([false, true], [true, false], [1, 1, 0]),
            ([true, true], [false, true], [0, 1, 1]),
            ([true, false], [false, true], [0, 1, 1]),
        ] {
            let mut control = Control::new(NORMAL);
            assert_eq!(wish(&mut control, Scene { masters, available, ..scene() }), wanted);
            let nothing = Scene { masters, available: [false; 2], ..scene() };
            assert_eq!(wish(&mut control, nothing), wanted, "it stays where it is");
        }
    }

    #[test]
    fn a_genset_is_relieved_by_mains_where_they_can() {
        let guest = Scene { guests: [false, true], ..scene() };
        let mut control = Control::new(FROM_S2);
        assert_eq!(wish(&mut control, guest), [1, 1, 0]);
        let bars = Bars { inhibited: Positions::of(0, 1, 0), ..Bars::default() };
        assert_eq!(wish(&mut control, Scene { bars, ..guest }), [1, 0, 1], "section 2 has nobody else");
        assert_eq!(wish(&mut control, Scene { guests: [true; 2], ..scene() }), [1, 0, 1]);
        let turn = Scene { guests: [true; 2], leaving: [true, false], ..scene() };
        assert_eq!(wish(&mut control, turn), [0, 1, 1], "the turn of the other set");
        let lazy = Scene { restores: false, ..guest };
        assert_eq!(wish(&mut control, lazy), [1, 1, 0]);
    }

    #[test]
    fn what_is_barred_is_not_wanted() {
        let bars = Bars { now: NORMAL, ..Bars::default() };
        for (name, bars, available, wanted) in [
            ("QS1 locked", Bars { locked: Positions::of(1, 0, 0), ..bars }, [true; 2], [0, 1, 1]),
            ("QS1 and the tie locked", Bars { locked: Positions::of(1, 1, 0), ..bars }, [true; 2], [0, 0, 1]),
            (
                "the tie inhibited",
                Bars { inhibited: Positions::of(0, 1, 0), ..bars },
                [false, true],
                [0, 0, 1],
            ),
            ("QS2 inhibited", Bars { inhibited: Positions::of(0, 0, 1), ..bars }, [true; 2], [1, 1, 0]),
            (
                "not over the tie",
                Bars { no_supply_over_tie: [false, true], ..bars },
                [false, true],
                [0, 0, 1],
            ),
            (
                "the other one may",
                Bars { no_supply_over_tie: [true, false], ..bars },
                [false, true],
                [0, 1, 1],
            ),
            (
                "the tie did not close",
                Bars { not_closed: Positions::of(0, 1, 0), ..bars },
                [false, true],
                [0, 0, 1],
            ),
            (
                "QS1 is closed after all",
                Bars { not_closed: Positions::of(1, 0, 0), ..bars },
                [true; 2],
                [1, 0, 1],
            ),
            ("everything locked", Bars { locked: Positions::ALL_CLOSED, ..bars }, [true; 2], [0, 0, 0]),
        ] {
            let mut control = Control::new(NORMAL);
            assert_eq!(wish(&mut control, Scene { available, bars, ..scene() }), wanted, "{name}");
        }
        let mut control = Control::new(NORMAL);
        assert_eq!(wish(&mut control, Scene { forced_open: true, auto: false, ..scene() }), [0, 0, 0]);
        assert_eq!(
            wish(&mut control, Scene { auto: false, ..scene() }),
            [0, 0, 0],
            "until somebody closes it"
        );
    }

    #[test]
    fn nothing_is_closed_onto_a_source_in_doubt() {
        let bars = Bars { now: NORMAL, ..Bars::default() };
        let lost = Scene { available: [false, true], bars, ..scene() };
        let doubted = Scene { faultless: [false; 2], ..lost };
        let mut control = Control::new(NORMAL);
        assert_eq!(wish(&mut control, doubted), [1, 0, 1], "nor anything opened for it");
        assert_eq!(wish(&mut control, Scene { faultless: [false, true], ..lost }), [0, 1, 1]);
        assert_eq!(wish(&mut control, doubted), [0, 1, 1], "what has begun goes on");

        let mut control = Control::new(NORMAL);
        let doubted = Scene { faultless: [true, false], bars, ..scene() };
        control.transfer(FROM_S2, doubted);
        assert_eq!(control.target(), NORMAL, "a command neither");
        control.transfer(FROM_S1, doubted);
        assert_eq!(control.target(), FROM_S1);
    }

    #[test]
    fn without_restoring_it_stays_until_somebody_asks() {
        let lazy = Scene { restores: false, ..scene() };
        let mut control = Control::new(NORMAL);
        assert_eq!(wish(&mut control, lazy), [1, 0, 1]);
        assert_eq!(wish(&mut control, Scene { available: [false, true], ..lazy }), [0, 1, 1]);
        assert_eq!(wish(&mut control, lazy), [0, 1, 1]);
        assert_eq!(wish(&mut control, Scene { available: [true, false], ..lazy }), [1, 1, 0]);
        control.reconsider();
        assert_eq!(wish(&mut control, lazy), [1, 0, 1]);
    }

    #[test]
    fn commands_are_obeyed_where_they_can_be() {
        let mut control = Control::new(NORMAL);
        control.transfer(FROM_S1, Scene { available: [false, true], ..scene() });
        assert_eq!(control.target(), NORMAL, "source 1 is dead");
        let bars = Bars { inhibited: Positions::of(0, 1, 0), ..Bars::default() };
        control.transfer(FROM_S1, Scene { bars, ..scene() });
        assert_eq!(control.target(), NORMAL, "the tie may not close");
        control.transfer(FROM_S1, scene());
        assert_eq!(wish(&mut control, scene()), [1, 1, 0], "held in automatic mode");
        assert_eq!(wish(&mut control, Scene { available: [true, false], ..scene() }), [1, 1, 0]);
        assert_eq!(wish(&mut control, scene()), [1, 0, 1], "no longer");

        let manual = Scene { auto: false, ..scene() };
        control.transfer(FROM_S2, manual);
        assert_eq!(wish(&mut control, Scene { available: [true, false], ..manual }), [0, 1, 1]);
        let failed = Bars { not_closed: Positions::of(0, 1, 0), ..Bars::default() };
        assert_eq!(wish(&mut control, Scene { bars: failed, ..manual }), [0, 0, 1]);
        assert_eq!(wish(&mut control, manual), [0, 0, 1], "not tried again");
    }
}
