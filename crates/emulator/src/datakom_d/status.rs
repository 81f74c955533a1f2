//! What the unit says about itself: function flags, LEDs, inputs and outputs, each following the others.

use busbar_profile::BitSet;

use crate::bank::Bank;

use super::operation::Operation::*;
use super::render::{LOAD_DUMP_ALARMS, SERVICES, SHUTDOWN_ALARMS, WARNING_ALARMS};
use super::watch::MAINS_PHASE_ORDER;
use super::{DatakomD, Mode};

const FUNCTION_FLAGS: u16 = 11555;
const LEDS: u16 = 11160;
const INPUTS: u16 = 10373;
const OUTPUTS: u16 = 11164;
const EXTENSION_INPUTS: u16 = 11167;

const GENSET_PHASE_ORDER: u16 = 109;
/// Above this the oil pressure is there, bar.
const OIL_PRESSURE_OK: f64 = 1.2;
/// Above this the coolant is cooled, degC.
const COOLING_FROM: f64 = 85.0;

/// Which alarms are shown, pinned or not, and which services are due.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    due: [bool; SERVICES.len()],
    pub(super) shutdown: BitSet,
    pub(super) load_dump: BitSet,
    pub(super) warning: BitSet,
}

impl Shown {
    pub(super) fn of(due: [bool; SERVICES.len()], bank: &Bank) -> Self {
        let [shutdown, load_dump, warning] =
            [SHUTDOWN_ALARMS, LOAD_DUMP_ALARMS, WARNING_ALARMS].map(|array| bank.bits_shown(array));
        Self { due, shutdown, load_dump, warning }
    }

    /// How many alarms there are.
    pub(super) fn count(&self) -> usize {
        self.shutdown.len() + self.load_dump.len() + self.warning.len()
    }

    fn tripped(&self) -> bool {
        !self.shutdown.is_empty() || !self.load_dump.is_empty()
    }

    fn contains(&self, bit: u16) -> bool {
        [self.shutdown, self.load_dump, self.warning].iter().any(|array| array.contains(bit))
    }
}

/// Stores all of it.
pub(super) fn registers(unit: &DatakomD, shown: &Shown, bank: &mut Bank) {
    let set = output_flags(unit, shown).into_iter().chain(state_flags(unit, shown));
    bank.bits(FUNCTION_FLAGS, set.filter(|(_, on)| *on).map(|(flag, _)| flag).collect::<BitSet>());
    bank.codes(LEDS, &leds(unit, shown));
    inputs_and_outputs(unit, bank);
}

/// The flags of what the unit drives, by the manual's numbers; those not named here stay 0.
fn output_flags(unit: &DatakomD, shown: &Shown) -> impl IntoIterator<Item = (u16, bool)> {
    let (plant, controls) = (&unit.plant, &unit.controls);
    let operation = unit.sequence.operation();
    let running = unit.readings.running;
    let hot = plant.engine.coolant > COOLING_FROM;
    let (genset, mains) = (&plant.genset_breaker, &plant.mains_breaker);
    let calls_others = unit.calls_others();
    let (add, shed) = unit.settings.load_shedding;
    let load = unit.readings.genset_active;
    // A second on, a second off.
    let flashing = shown.count() > 0 && plant.time % 2.0 < 1.0;
    [
        (0, controls.fuel),
        (1, unit.alarms.horn()),
        (2, controls.starter),
        (3, matches!(operation, ImmediateStop | Stopping)),
        (4, controls.genset_breaker),
        (5, controls.mains_breaker),
        (6, controls.idle),
        (7, operation == Preheat),
        (9, controls.starter),
        (10, controls.genset_breaker && !genset.closed),
        (11, genset.closed && !controls.genset_breaker),
        (12, controls.genset_breaker),
        (13, controls.mains_breaker && !mains.closed),
        (14, mains.closed && !controls.mains_breaker),
        (15, controls.mains_breaker),
        (16, flashing),
        (18, controls.fuel_pump),
        (20, controls.block_heater),
        (21, running && hot),
        (22, controls.block_heater),
        (23, running && hot),
        (24, running),
        (25, running),
        (27, calls_others),
        (33, unit.shedding),
        (34, genset.closed && load < add),
        (35, genset.closed && load > shed),
    ]
}

fn state_flags(unit: &DatakomD, shown: &Shown) -> impl IntoIterator<Item = (u16, bool)> {
    let operation = unit.sequence.operation();
    let running = unit.readings.running;
    let (genset_healthy, contacts) = (unit.genset_healthy(), unit.contacts);
    let (exercising, mode) = (unit.is_exercising(), unit.mode);
    let tripped = shown.tripped();
    [
        (28, running && genset_healthy && !tripped),
        (36, shown.due[0]),
        (37, shown.due[1]),
        (38, shown.due[2]),
        (39, shown.contains(MAINS_PHASE_ORDER)),
        (40, shown.contains(GENSET_PHASE_ORDER)),
        (41, mode == Mode::Auto && !tripped && !contacts.auto_start_disabled),
        (42, exercising),
        (43, exercising && mode == Mode::Auto),
        (44, !unit.mains.is_healthy()),
        (46, running),
        (47, genset_healthy),
        (48, operation.is_up_to_speed()),
        (49, unit.readings.oil_pressure.is_some_and(|bar| bar > OIL_PRESSURE_OK)),
        (50, !shown.shutdown.is_empty()),
        (51, !shown.load_dump.is_empty()),
        (52, !shown.warning.is_empty()),
        (53, tripped),
        (54, shown.count() > 0),
        (55, mode == Mode::Test),
        (56, mode == Mode::Auto),
        (57, mode == Mode::Run),
        (58, mode == Mode::Stop),
        (59, mode != Mode::Auto),
        (60, operation == AtRest),
        (61, operation == WaitBeforeFuel),
        (62, operation == Preheat),
        (63, operation == WaitOilFlashOff),
        (64, operation == Heating),
        (65, operation.is_synchronizing()),
        (66, matches!(operation, StopWithCooldown | CoolingDown)),
        (67, matches!(operation, IdleBeforeStop | ImmediateStop | Stopping)),
        (68, contacts.protections_disabled),
        (69, unit.readings.remote_start),
        (70, contacts.auto_start_disabled),
        (71, contacts.force_to_start),
        (72, contacts.restore_inhibited),
        (73, contacts.loading_inhibited),
        (78, !unit.settings.slave),
        (79, unit.calls_others()),
        (108, unit.readings.mains_alive),
    ]
}

/// Two bits a LED. The manual does not say which is which: alarms, then modes, then sources and breakers, then the
/// service.
fn leds(unit: &DatakomD, shown: &Shown) -> [u8; 32] {
    const QUICK_FLASH: u8 = 2;
    const SLOW_FLASH: u8 = 3;
    let (plant, readings) = (&unit.plant, &unit.readings);
    let operation = unit.sequence.operation();
    let on = u8::from;
    // A breaker on its way flashes.
    let breaker = |closed: bool, commanded: bool| if closed == commanded { on(closed) } else { QUICK_FLASH };
    let mains = match (unit.mains.is_healthy(), unit.mains.is_failing(), unit.mains.is_trusted()) {
        (false, ..) => 0,
        (true, true, _) => QUICK_FLASH,
        (true, false, false) => SLOW_FLASH,
        (true, false, true) => 1,
    };
    let genset = match (readings.running, unit.genset_healthy()) {
        (true, true) => 1,
        (true, false) => SLOW_FLASH,
        (false, _) => 0,
    };
    let engine = match operation {
        Cranking => QUICK_FLASH,
        WaitBeforeFuel | Preheat | WaitOilFlashOff | CrankRest | Stopping => SLOW_FLASH,
        _ => on(readings.running),
    };
    let mut leds = [0; 32];
    leds[..13].copy_from_slice(&[
        on(!shown.shutdown.is_empty()),
        on(!shown.load_dump.is_empty()),
        on(!shown.warning.is_empty()),
        on(unit.mode == Mode::Stop),
        on(unit.mode == Mode::Run),
        on(unit.mode == Mode::Auto),
        on(unit.mode == Mode::Test),
        mains,
        breaker(plant.mains_breaker.closed, unit.controls.mains_breaker),
        breaker(plant.genset_breaker.closed, unit.controls.genset_breaker),
        genset,
        engine,
        on(shown.due.contains(&true)),
    ]);
    leds
}

/// Wired as a plain AMF panel: feedbacks and contacts come in, relays go out. Extension modules are not fitted.
fn inputs_and_outputs(unit: &DatakomD, bank: &mut Bank) {
    let (plant, controls, readings) = (&unit.plant, &unit.controls, &unit.readings);
    let mut inputs = [0; 16];
    inputs[..5].copy_from_slice(
        &[
            plant.genset_breaker.closed,
            plant.mains_breaker.closed,
            controls.fuel_pump,
            readings.emergency_stop,
            readings.remote_start,
        ]
        .map(u8::from),
    );
    inputs[5..10].copy_from_slice(&unit.contacts.all().map(u8::from));
    bank.codes(INPUTS, &inputs);

    let outputs = [
        controls.fuel,
        controls.starter,
        controls.genset_breaker,
        controls.mains_breaker,
        unit.alarms.horn(),
        unit.sequence.operation() == Preheat,
        controls.block_heater,
        controls.fuel_pump,
    ];
    let outputs = (0..).zip(outputs).filter(|(_, on)| *on).map(|(bit, _)| bit);
    bank.bits(OUTPUTS, outputs.collect());
    bank.bits(EXTENSION_INPUTS, BitSet::EMPTY);
}
