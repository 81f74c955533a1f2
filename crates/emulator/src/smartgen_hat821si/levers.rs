//! What can be made to happen to the switchgear, by the grid, by wear and by people on site.

use crate::levers::{Lever, Position, Word};

use super::Hat821si;
use super::inputs::Input;
use super::plant::{Condition, Health, Mains};
use super::switches::{FEEDERS, Switch};

const MAINS: &[Word] = &[
    Word::new("normal", "All phases are there"),
    Word::new("failed", "No voltage on any phase"),
    Word::new("sagging", "All phases at two thirds"),
    Word::new("swelling", "All phases far too high"),
    Word::new("l1_lost", "Phase A is missing"),
    Word::new("l2_lost", "Phase B is missing"),
    Word::new("l3_lost", "Phase C is missing"),
    Word::new("reversed", "Two phases are swapped"),
    Word::new("flickering", "Short dips that follow each other"),
];
const GRID: &[Word] =
    &[Word::new("normal", "It feeds both"), Word::new("failed", "Neither source has voltage from it")];
const NORMAL: &[Word] = &[Word::new("normal", "As it is by itself")];
const WILL_NOT_CLOSE: Word = Word::new("will_not_close", "It stays open when it is to close");
const WILL_NOT_OPEN: Word = Word::new("will_not_open", "It stays closed, whoever is to open it");
const TRIPS: Word = Word::new("trips", "Its release opens it and keeps it open");
const SWITCH: &[Word] = &[
    Word::new("normal", "It does as it is told"),
    WILL_NOT_CLOSE,
    Word::new("closes_at_second", "Of its closing pulses the first one does nothing"),
    WILL_NOT_OPEN,
    TRIPS,
];
const FEEDER: &[Word] = &[Word::new("normal", "It does as it is told"), WILL_NOT_CLOSE, WILL_NOT_OPEN, TRIPS];
const POSITION: &[Word] =
    &[Word::new("work", "In its place"), Word::new("test", "Drawn out: it moves, and carries nothing")];
const WIRE: &[Word] = &[
    Word::new("normal", "All wires of the voltage transformer are whole"),
    Word::new("l1_broken", "That of phase A is broken"),
    Word::new("l2_broken", "That of phase B is broken"),
    Word::new("l3_broken", "That of phase C is broken"),
];
const GENSET: &[Word] = &[
    Word::new("normal", "It starts and runs"),
    Word::new("will_not_start", "At rest it stays at rest"),
    Word::new("fails", "It stops, and stays at rest"),
];
const VARIES: &[Word] = &[Word::new("varies", "Consumers come and go")];
const NONE: &[Word] = &[Word::new("none", "There is none")];
const SHORT_CIRCUIT: &[Word] =
    &[Word::new("none", "There is none"), Word::new("present", "The bus bars are short-circuited")];
const CONTACT: &[Word] = &[Word::new("off", "Open"), Word::new("on", "Closed")];
const MODULE: &[Word] = &[Word::new("normal", "It answers"), Word::new("silent", "Its line is cut")];
const FRONT: &[Word] = &[
    Word::new("remote", "Commands come over the wire"),
    Word::new("local", "Somebody stands there: commands over the wire are ignored"),
];

/// Those that are listed, and those of the load switches of each side.
macro_rules! levers {
    ($($lever:expr,)* ; $($side:literal: $($number:literal)*;)*) => {
        &[
            $($lever,)*
            $($(
                Lever::of_words(
                    concat!("switch.l", $side, "_", $number),
                    concat!("Load switch ", $side, "-", $number),
                    FEEDER,
                ),
                Lever::of_words(
                    concat!("switch.l", $side, "_", $number, ".position"),
                    concat!("Drawer of load switch ", $side, "-", $number),
                    POSITION,
                ),
            )*)*
        ]
    };
}

/// In the order in which people are shown them.
pub(super) const LEVERS: &[Lever] = levers! {
    Lever::of_words("grid", "Grid behind both sources", GRID),
    Lever::of_words("src1", "Mains of source 1", MAINS),
    Lever::of_numbers("src1.voltage", "Source 1, phase to neutral", NORMAL, (0.0, 9000.0), "V"),
    Lever::of_numbers("src1.frequency", "Source 1, frequency", NORMAL, (40.0, 60.0), "Hz"),
    Lever::of_words("src1.pt", "Source 1, wires of the voltage transformer", WIRE),
    Lever::of_words("src2", "Mains of source 2", MAINS),
    Lever::of_numbers("src2.voltage", "Source 2, phase to neutral", NORMAL, (0.0, 9000.0), "V"),
    Lever::of_numbers("src2.frequency", "Source 2, frequency", NORMAL, (40.0, 60.0), "Hz"),
    Lever::of_numbers("src2.angle", "Source 2, ahead of where it would be", NORMAL, (-180.0, 180.0), "deg"),
    Lever::of_words("src2.pt", "Source 2, wires of the voltage transformer", WIRE),
    Lever::of_words("genset", "Genset behind source 2", GENSET),
    Lever::of_words("genset1", "Genset behind source 1, where there is one", GENSET),
    Lever::of_words("switch.qs1", "QS1, of source 1", SWITCH),
    Lever::of_words("switch.qs1.position", "Drawer of QS1", POSITION),
    Lever::of_words("switch.qs2", "QS2, of source 2", SWITCH),
    Lever::of_words("switch.qs2.position", "Drawer of QS2", POSITION),
    Lever::of_words("switch.qtie", "QTIE, between the sections", SWITCH),
    Lever::of_words("switch.qtie.position", "Drawer of QTIE", POSITION),
    Lever::of_numbers("load1", "Consumers of section 1", VARIES, (0.0, 6000.0), "kW"),
    Lever::of_numbers("load1.power_factor", "Consumers of section 1, power factor", VARIES, (0.5, 1.0), ""),
    Lever::of_numbers("load2", "Consumers of section 2", VARIES, (0.0, 6000.0), "kW"),
    Lever::of_numbers("load2.power_factor", "Consumers of section 2, power factor", VARIES, (0.5, 1.0), ""),
    Lever::of_numbers("infeed1", "Solar park on section 1", NONE, (0.0, 6000.0), "kW"),
    Lever::of_numbers("infeed2", "Solar park on section 2", NONE, (0.0, 6000.0), "kW"),
    Lever::of_numbers("earth_fault1", "From phase A of section 1 to earth", NONE, (0.0, 400.0), "A"),
    Lever::of_numbers("earth_fault2", "From phase A of section 2 to earth", NONE, (0.0, 400.0), "A"),
    Lever::of_words("short_circuit1", "Short circuit on section 1", SHORT_CIRCUIT),
    Lever::of_words("short_circuit2", "Short circuit on section 2", SHORT_CIRCUIT),
    Lever::of_words("front", "Key on the front of the controller", FRONT),
    Lever::of_words("input.forced_open", "Contact: everything open", CONTACT),
    Lever::of_words("input.remote_start_on_load", "Contact: start the genset and let it carry load", CONTACT),
    Lever::of_words("input.remote_start_off_load", "Contact: start the genset", CONTACT),
    Lever::of_words("input.start_inhibit", "Contact: no start", CONTACT),
    Lever::of_words("input.remote_inhibit", "Contact: no remote commands", CONTACT),
    Lever::of_words("input.auto_restore", "Contact: restore by itself, whatever is set", CONTACT),
    Lever::of_words("input.s1_close_inhibit", "Contact: QS1 may not close", CONTACT),
    Lever::of_words("input.s2_close_inhibit", "Contact: QS2 may not close", CONTACT),
    Lever::of_words("input.qtie_close_inhibit", "Contact: QTIE may not close", CONTACT),
    Lever::of_words("input.s1_supply_qtie_inhibit", "Contact: source 1 may not supply over QTIE", CONTACT),
    Lever::of_words("input.s2_supply_qtie_inhibit", "Contact: source 2 may not supply over QTIE", CONTACT),
    Lever::of_words("input.qs1_qtie_close_inhibit", "Contact: neither QS1 nor QTIE may close", CONTACT),
    Lever::of_words("input.qs2_qtie_close_inhibit", "Contact: neither QS2 nor QTIE may close", CONTACT),
    Lever::of_words("module.input_1", "Expansion input module 1", MODULE),
    Lever::of_words("module.input_2", "Expansion input module 2", MODULE),
    Lever::of_words("module.input_3", "Expansion input module 3", MODULE),
    Lever::of_words("module.input_4", "Expansion input module 4", MODULE),
    Lever::of_words("module.input_5", "Expansion input module 5", MODULE),
    Lever::of_words("module.input_6", "Expansion input module 6", MODULE),
    Lever::of_words("module.output_1", "Expansion output module 1", MODULE),
    Lever::of_words("module.output_2", "Expansion output module 2", MODULE),
    Lever::of_words("module.output_3", "Expansion output module 3", MODULE),
    Lever::of_words("module.output_4", "Expansion output module 4", MODULE),
    ;
    1: 1 2 3 4 5 6 7 8 9 10 11 12;
    2: 1 2 3 4 5 6 7 8 9 10 11 12;
};

/// What a lever acts upon. Sources, sides and modules count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Handle {
    Grid,
    Mains(usize),
    Voltage(usize),
    Frequency(usize),
    Angle(usize),
    Wire(usize),
    Genset(usize),
    Switch(usize),
    Drawer(usize),
    Feeder(usize, usize),
    FeederDrawer(usize, usize),
    Load(usize),
    PowerFactor(usize),
    Infeed(usize),
    EarthFault(usize),
    ShortCircuit(usize),
    Front,
    Contact(Input),
    InputModule(usize),
    OutputModule(usize),
}

impl Handle {
    fn of(id: &str) -> Option<Self> {
        let (first, rest) = id.split_once('.').unwrap_or((id, ""));
        match first {
            "switch" => Self::of_switch(rest),
            "input" => contact(rest).map(Self::Contact),
            "module" => Self::of_module(rest),
            "front" => Some(Self::Front),
            "grid" => Some(Self::Grid),
            "genset" => Some(Self::Genset(1)),
            "genset1" => Some(Self::Genset(0)),
            _ => Self::of_side(first, rest),
        }
    }

    /// Of what there is once for each source or section.
    fn of_side(first: &str, rest: &str) -> Option<Self> {
        let side = match first.as_bytes().last() {
            Some(b'1') => 0,
            Some(b'2') => 1,
            _ => return None,
        };
        match (first.trim_end_matches(['1', '2']), rest) {
            ("src", "") => Some(Self::Mains(side)),
            ("src", "voltage") => Some(Self::Voltage(side)),
            ("src", "frequency") => Some(Self::Frequency(side)),
            ("src", "angle") => Some(Self::Angle(side)),
            ("src", "pt") => Some(Self::Wire(side)),
            ("load", "") => Some(Self::Load(side)),
            ("load", "power_factor") => Some(Self::PowerFactor(side)),
            ("infeed", "") => Some(Self::Infeed(side)),
            ("earth_fault", "") => Some(Self::EarthFault(side)),
            ("short_circuit", "") => Some(Self::ShortCircuit(side)),
            _ => None,
        }
    }

    fn of_switch(rest: &str) -> Option<Self> {
        let (switch, drawer) = match rest.strip_suffix(".position") {
            Some(switch) => (switch, true),
            None => (rest, false),
        };
        let main = match switch {
            "qs1" => Some(Switch::Qs1),
            "qtie" => Some(Switch::Qtie),
            "qs2" => Some(Switch::Qs2),
            _ => None,
        };
        if let Some(switch) = main {
            let index = switch as usize;
            return Some(if drawer { Self::Drawer(index) } else { Self::Switch(index) });
        }
        let (side, number) = switch.strip_prefix('l')?.split_once('_')?;
        let side = side.parse::<usize>().ok()?.checked_sub(1).filter(|side| *side < 2)?;
        let feeder = number.parse::<usize>().ok()?.checked_sub(1).filter(|feeder| *feeder < FEEDERS)?;
        Some(if drawer { Self::FeederDrawer(side, feeder) } else { Self::Feeder(side, feeder) })
    }

    fn of_module(rest: &str) -> Option<Self> {
        let (kind, number) = rest.split_once('_')?;
        let module = number.parse::<usize>().ok()?.checked_sub(1)?;
        match kind {
            "input" => Some(Self::InputModule(module)),
            "output" => Some(Self::OutputModule(module)),
            _ => None,
        }
    }
}

fn contact(name: &str) -> Option<Input> {
    Some(match name {
        "forced_open" => Input::ForcedOpen,
        "remote_start_on_load" => Input::StartOnLoad,
        "remote_start_off_load" => Input::StartOffLoad,
        "start_inhibit" => Input::StartInhibit,
        "remote_inhibit" => Input::RemoteInhibit,
        "auto_restore" => Input::AutoRestore,
        "s1_close_inhibit" => Input::S1CloseInhibit,
        "s2_close_inhibit" => Input::S2CloseInhibit,
        "qtie_close_inhibit" => Input::QtieCloseInhibit,
        "s1_supply_qtie_inhibit" => Input::S1SupplyQtieInhibit,
        "s2_supply_qtie_inhibit" => Input::S2SupplyQtieInhibit,
        "qs1_qtie_close_inhibit" => Input::Qs1QtieInhibit,
        "qs2_qtie_close_inhibit" => Input::Qs2QtieInhibit,
        _ => return None,
    })
}

impl Hat821si {
    /// Where a lever stands.
    pub(super) fn position_of(&self, id: &str) -> Option<Position> {
        let plant = &self.plant;
        let or = |number: Option<f64>, word| number.map_or(Position::Word(word), Position::Number);
        let more = |number: f64, word| or(Some(number).filter(|number| *number != 0.0), word);
        let either = |is_so: bool, [no, yes]: [&'static str; 2]| Position::Word(if is_so { yes } else { no });
        Some(match Handle::of(id)? {
            Handle::Grid => either(plant.grid.failed, ["normal", "failed"]),
            Handle::Mains(source) => Position::Word(mains_word(plant.sources[source].mains)),
            Handle::Voltage(source) => or(plant.sources[source].set_voltage, "normal"),
            Handle::Frequency(source) => or(plant.sources[source].set_frequency, "normal"),
            Handle::Angle(source) => more(plant.sources[source].shift, "normal"),
            Handle::Wire(source) => Position::Word(match plant.sources[source].broken_wire {
                None => "normal",
                Some(0) => "l1_broken",
                Some(1) => "l2_broken",
                Some(_) => "l3_broken",
            }),
            Handle::Genset(source) => Position::Word(match plant.engines[source].health {
                Health::Normal => "normal",
                Health::WillNotStart => "will_not_start",
                Health::Fails => "fails",
            }),
            Handle::Switch(index) => Position::Word(switch_word(plant.switches[index].condition())),
            Handle::Drawer(index) => either(plant.switches[index].is_in_work(), ["test", "work"]),
            Handle::Feeder(side, feeder) => {
                Position::Word(switch_word(plant.feeders[side][feeder].condition()))
            }
            Handle::FeederDrawer(side, feeder) => {
                either(plant.feeders[side][feeder].is_in_work(), ["test", "work"])
            }
            Handle::Load(side) => or(plant.sections[side].load, "varies"),
            Handle::PowerFactor(side) => or(plant.sections[side].power_factor, "varies"),
            Handle::Infeed(side) => more(plant.sections[side].infeed, "none"),
            Handle::EarthFault(side) => more(plant.sections[side].earth_fault, "none"),
            Handle::ShortCircuit(side) => either(plant.sections[side].short_circuit, ["none", "present"]),
            Handle::Front => either(self.local, ["remote", "local"]),
            Handle::Contact(input) => either(self.inputs.is_set(input), ["off", "on"]),
            Handle::InputModule(module) => {
                either(*self.inputs.input_modules_cut.get(module)?, ["normal", "silent"])
            }
            Handle::OutputModule(module) => {
                either(*self.inputs.output_modules_cut.get(module)?, ["normal", "silent"])
            }
        })
    }

    /// Pulls a lever to a position that it has.
    pub(super) fn pull_to(&mut self, id: &str, to: Position) {
        let Some(handle) = Handle::of(id) else { return };
        match to {
            Position::Number(number) => self.set_number(handle, Some(number)),
            Position::Word(word) => {
                self.set_number(handle, None);
                self.set_word(handle, word);
            }
        }
    }

    /// A number, or what it is by itself.
    fn set_number(&mut self, handle: Handle, number: Option<f64>) {
        let plant = &mut self.plant;
        match handle {
            Handle::Voltage(source) => plant.sources[source].set_voltage = number,
            Handle::Frequency(source) => plant.sources[source].set_frequency = number,
            Handle::Angle(source) => plant.sources[source].shift = number.unwrap_or(0.0),
            Handle::Load(side) => plant.sections[side].load = number,
            Handle::PowerFactor(side) => plant.sections[side].power_factor = number,
            Handle::Infeed(side) => plant.sections[side].infeed = number.unwrap_or(0.0),
            Handle::EarthFault(side) => plant.sections[side].earth_fault = number.unwrap_or(0.0),
            _ => {}
        }
    }

    fn set_word(&mut self, handle: Handle, word: &str) {
        let plant = &mut self.plant;
        match handle {
            Handle::Grid => plant.grid.failed = word == "failed",
            Handle::Mains(source) => plant.sources[source].mains = mains(word),
            Handle::Wire(source) => {
                plant.sources[source].broken_wire =
                    ["l1_broken", "l2_broken", "l3_broken"].iter().position(|broken| *broken == word);
            }
            Handle::Genset(source) => {
                plant.engines[source].health = match word {
                    "will_not_start" => Health::WillNotStart,
                    "fails" => Health::Fails,
                    _ => Health::Normal,
                };
            }
            Handle::Switch(index) => plant.switches[index].set_condition(condition(word)),
            Handle::Drawer(index) => plant.switches[index].set_in_work(word == "work"),
            Handle::Feeder(side, feeder) => plant.feeders[side][feeder].set_condition(condition(word)),
            Handle::FeederDrawer(side, feeder) => plant.feeders[side][feeder].set_in_work(word == "work"),
            Handle::ShortCircuit(side) => plant.sections[side].short_circuit = word == "present",
            Handle::Front => self.local = word == "local",
            Handle::Contact(input) => self.inputs.set(input, word == "on"),
            Handle::InputModule(module) => {
                if let Some(cut) = self.inputs.input_modules_cut.get_mut(module) {
                    *cut = word == "silent";
                }
            }
            Handle::OutputModule(module) => {
                if let Some(cut) = self.inputs.output_modules_cut.get_mut(module) {
                    *cut = word == "silent";
                }
            }
            _ => {}
        }
    }
}

fn mains(word: &str) -> Mains {
    match word {
        "failed" => Mains::Failed,
        "sagging" => Mains::Sagging,
        "swelling" => Mains::Swelling,
        "l1_lost" => Mains::Lost(0),
        "l2_lost" => Mains::Lost(1),
        "l3_lost" => Mains::Lost(2),
        "reversed" => Mains::Reversed,
        "flickering" => Mains::Flickering,
        _ => Mains::Normal,
    }
}

fn mains_word(mains: Mains) -> &'static str {
    match mains {
        Mains::Normal => "normal",
        Mains::Failed => "failed",
        Mains::Sagging => "sagging",
        Mains::Swelling => "swelling",
        Mains::Lost(0) => "l1_lost",
        Mains::Lost(1) => "l2_lost",
        Mains::Lost(_) => "l3_lost",
        Mains::Reversed => "reversed",
        Mains::Flickering => "flickering",
    }
}

fn condition(word: &str) -> Condition {
    match word {
        "will_not_close" => Condition::WillNotClose,
        "closes_at_second" => Condition::ClosesAtSecond,
        "will_not_open" => Condition::WillNotOpen,
        "trips" => Condition::Trips,
        _ => Condition::Normal,
    }
}

fn switch_word(condition: Condition) -> &'static str {
    match condition {
        Condition::Normal => "normal",
        Condition::WillNotClose => "will_not_close",
        Condition::ClosesAtSecond => "closes_at_second",
        Condition::WillNotOpen => "will_not_open",
        Condition::Trips => "trips",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panel::Panel;

    #[test]
    fn every_lever_stands_where_it_was_pulled_to_and_moves_no_other() {
        let mut unit = super::super::tests::quiet();
        let all = |unit: &Hat821si| -> Vec<_> {
            LEVERS
                .iter()
                .map(|lever| unit.lever(lever.id).unwrap_or_else(|| panic!("{}", lever.id)))
                .collect()
        };
        let healthy: Vec<_> = LEVERS.iter().map(|lever| Position::Word(lever.words[0].id)).collect();
        assert_eq!(all(&unit), healthy);
        for (place, lever) in LEVERS.iter().enumerate() {
            let words = lever.words.iter().map(|word| Position::Word(word.id));
            let numbers = lever.numbers.map(|numbers| Position::Number(numbers.max));
            for position in words.chain(numbers).rev() {
                unit.pull(lever.id, position);
                let mut expected = healthy.clone();
                expected[place] = position;
                assert_eq!(all(&unit), expected, "{}", lever.id);
            }
        }
    }

    #[test]
    fn no_two_levers_have_one_name() {
        for (place, lever) in LEVERS.iter().enumerate() {
            assert!(LEVERS[..place].iter().all(|other| other.id != lever.id && other.name != lever.name));
        }
        assert_eq!(LEVERS.len(), 52 + 48);
    }
}
