//! What comes into the controller over its own inputs and its expansion modules, and what the site does there.
//!
//! Own inputs 1 to 3 are the positions of QS1, QS2 and QTIE, 4 a genset that runs. The input modules are wired to the
//! load switches with their first twelve inputs: 1 and 2 closed, 3 and 4 tripped, 5 and 6 in work position; what is left
//! of modules 3 to 5 has the inhibits of the tie and the switches that are ready. A module that is silent leaves its
//! inputs as they were heard last, and its outputs off.

use busbar_profile::BitSet;

use super::plant::{Condition, Mechanism, Plant};
use super::switches::{FEEDERS, Positions, Switch};

/// Contacts of the site, in the order of [`Inputs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Input {
    ForcedOpen,
    StartOnLoad,
    StartOffLoad,
    StartInhibit,
    RemoteInhibit,
    AutoRestore,
    S1CloseInhibit,
    S2CloseInhibit,
    QtieCloseInhibit,
    S1SupplyQtieInhibit,
    S2SupplyQtieInhibit,
    Qs1QtieInhibit,
    Qs2QtieInhibit,
}

impl Input {
    pub(super) const ALL: [Self; 13] = [
        Self::ForcedOpen,
        Self::StartOnLoad,
        Self::StartOffLoad,
        Self::StartInhibit,
        Self::RemoteInhibit,
        Self::AutoRestore,
        Self::S1CloseInhibit,
        Self::S2CloseInhibit,
        Self::QtieCloseInhibit,
        Self::S1SupplyQtieInhibit,
        Self::S2SupplyQtieInhibit,
        Self::Qs1QtieInhibit,
        Self::Qs2QtieInhibit,
    ];

    /// Where its contact ends: an own input, or an input of a module from 0 on.
    fn wire(self) -> Wire {
        match self {
            Self::ForcedOpen => Wire::Own(4),
            Self::StartOnLoad => Wire::Own(5),
            Self::StartOffLoad => Wire::Own(6),
            Self::StartInhibit => Wire::Own(7),
            Self::RemoteInhibit => Wire::Own(8),
            Self::AutoRestore => Wire::Own(9),
            Self::S1CloseInhibit => Wire::Own(10),
            Self::S2CloseInhibit => Wire::Own(11),
            Self::QtieCloseInhibit => Wire::Module(2, 12),
            Self::S1SupplyQtieInhibit => Wire::Module(2, 13),
            Self::S2SupplyQtieInhibit => Wire::Module(2, 14),
            Self::Qs1QtieInhibit => Wire::Module(3, 12),
            Self::Qs2QtieInhibit => Wire::Module(3, 13),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Wire {
    Own(u16),
    Module(usize, u16),
}

/// Module and input of the contact with which QS1, QTIE and QS2 say that they are ready.
const READY: [(usize, u16); 3] = [(4, 12), (4, 13), (4, 14)];
pub(super) const INPUT_MODULES: usize = 6;
pub(super) const OUTPUT_MODULES: usize = 4;
/// Load switches of a side whose opening outputs hang on the module of their closing outputs.
pub(super) const OWN_OPENING: usize = 4;

/// The contacts of the site and what the controller hears of everything.
#[derive(Clone, Debug, Default)]
pub(super) struct Inputs {
    contacts: [bool; Input::ALL.len()],
    /// Modules whose line is cut.
    pub(super) input_modules_cut: [bool; INPUT_MODULES],
    pub(super) output_modules_cut: [bool; OUTPUT_MODULES],
    own: BitSet,
    modules: [BitSet; INPUT_MODULES],
}

impl Inputs {
    pub(super) fn set(&mut self, input: Input, on: bool) {
        self.contacts[input as usize] = on;
    }

    pub(super) fn is_set(&self, input: Input) -> bool {
        self.contacts[input as usize]
    }

    /// Hears anew what the modules tell that are not silent.
    pub(super) fn hear(&mut self, plant: &Plant) {
        let positions = plant.positions();
        let feedback = [Switch::Qs1, Switch::Qs2, Switch::Qtie].map(|switch| positions.is_closed(switch));
        let runs = plant.engines.iter().any(|engine| engine.has_voltage());
        self.own = (0..).zip(feedback).chain([(3, runs)]).filter(|(_, on)| *on).map(|(bit, _)| bit).collect();
        let mut modules: [BitSet; INPUT_MODULES] = std::array::from_fn(|module| {
            let feeders = &plant.feeders[module % 2];
            let tells = |feeder: &Mechanism| match module / 2 {
                0 => feeder.is_closed(),
                1 => feeder.condition() == Condition::Trips,
                _ => feeder.is_in_work(),
            };
            (0..).zip(feeders).filter(|(_, feeder)| tells(feeder)).map(|(bit, _)| bit).collect()
        });
        for (switch, (module, bit)) in plant.switches.iter().zip(READY) {
            modules[module].set(bit, switch.is_in_work() && switch.condition() != Condition::Trips);
        }
        for input in Input::ALL {
            let on = self.contacts[input as usize];
            match input.wire() {
                Wire::Own(bit) => self.own.set(bit, on),
                Wire::Module(module, bit) => modules[module].set(bit, on),
            }
        }
        for (heard, (told, cut)) in
            self.modules.iter_mut().zip(modules.into_iter().zip(self.input_modules_cut))
        {
            if !cut {
                *heard = told;
            }
        }
    }

    /// Word 505.
    pub(super) fn own(&self) -> BitSet {
        self.own
    }

    /// Words 514 to 519.
    pub(super) fn modules(&self) -> [BitSet; INPUT_MODULES] {
        self.modules
    }

    /// Whether a contact is heard to be closed.
    pub(super) fn has(&self, input: Input) -> bool {
        match input.wire() {
            Wire::Own(bit) => self.own.contains(bit),
            Wire::Module(module, bit) => self.modules[module].contains(bit),
        }
    }

    /// Which of QS1, QTIE and QS2 say that they are ready to be closed.
    pub(super) fn ready(&self) -> Positions {
        Positions::by(|switch| {
            let (module, bit) = READY[switch as usize];
            self.modules[module].contains(bit)
        })
    }

    /// What is heard of the load switches of a side, 0 or 1.
    pub(super) fn feeders(&self, side: usize) -> Heard {
        let twelve = |module: usize| -> [bool; FEEDERS] {
            std::array::from_fn(|feeder| self.modules[module].contains(feeder as u16))
        };
        Heard { closed: twelve(side), tripped: twelve(2 + side), in_work: twelve(4 + side) }
    }
}

/// What is heard of the load switches of one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heard {
    pub(super) closed: [bool; FEEDERS],
    pub(super) tripped: [bool; FEEDERS],
    pub(super) in_work: [bool; FEEDERS],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_contacts_share_a_wire() {
        let mut wires: Vec<Wire> = Input::ALL.map(Input::wire).to_vec();
        wires.extend(READY.map(|(module, bit)| Wire::Module(module, bit)));
        wires.extend([0, 1, 2, 3].map(Wire::Own));
        for (place, wire) in wires.iter().enumerate() {
            assert!(!wires[..place].contains(wire), "{wire:?}");
            assert!(!matches!(wire, Wire::Module(_, bit) if usize::from(*bit) < FEEDERS), "{wire:?}");
        }
    }

    #[test]
    fn a_silent_module_tells_nothing_new() {
        let mut plant = Plant::new(1, Positions::of(1, 0, 1));
        let mut inputs = Inputs::default();
        inputs.hear(&plant);
        assert_eq!(inputs.feeders(1).closed, [true; FEEDERS]);
        inputs.input_modules_cut[1] = true;
        for side in 0..2 {
            plant.feeders[side][2].set_in_work(false);
        }
        inputs.hear(&plant);
        assert!(inputs.feeders(1).closed[2] && !inputs.feeders(1).in_work[2]);
        assert!(!inputs.feeders(0).closed[2]);
        inputs.set(Input::ForcedOpen, true);
        inputs.hear(&plant);
        assert!(inputs.has(Input::ForcedOpen) && inputs.own().contains(4));
    }
}
