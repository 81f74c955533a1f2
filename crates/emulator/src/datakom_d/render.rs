//! From the unit to its registers, in the manual's order; the addresses are the manual's.

use busbar_profile::BitSet;

use crate::bank::Bank;
use crate::lcd::Canvas;
use crate::plant::{Feed, RATED_KVA, RATED_KW};
use crate::waveform::{Analysis, Shape};

use super::alarms::SERVICE_1_REQUEST;
use super::sequence::Operation;
use super::{DatakomD, Mode};

const SHUTDOWN_ALARMS: u16 = 10504;
const LOAD_DUMP_ALARMS: u16 = 10520;
const WARNING_ALARMS: u16 = 10536;
const OPERATION_STATUS: u16 = 10604;
const UNIT_MODE: u16 = 10605;
const ETHERNET_PACKETS: u16 = 11683;
/// Registers of the hours and days left of each service, with the hours and days between two.
const SERVICES: [([u16; 2], [f64; 2]); 3] =
    [([10634, 10636], [250.0, 180.0]), ([10638, 10640], [500.0, 365.0]), ([10642, 10644], [1000.0, 730.0])];

/// Above this the oil pressure is there, bar.
const OIL_PRESSURE_OK: f64 = 1.2;

/// Stores all of them.
pub(super) fn registers(unit: &DatakomD, bank: &mut Bank) {
    feed(&unit.plant.mains, &MAINS, bank);
    feed(&unit.plant.genset, &GENSET, bank);
    engine(unit, bank);
    batteries(unit, bank);
    analogs(unit, bank);
    analysis(unit, bank);
    state(unit, bank);
    counters(unit, bank);
    identity(unit, bank);
    load_share(unit, bank);
    packets(unit, bank);
    // These follow what the counters and then the alarm arrays show, pinned or not.
    let due = services_due(bank);
    alarms(unit, due, bank);
    let shown = Shown::of(due, bank);
    flags(unit, &shown, bank);
    leds(unit, &shown, bank);
    inputs_and_outputs(unit, bank);
    lcd(unit, &shown, bank);
}

/// Stores the Ethernet packet counter alone.
pub(super) fn packets(unit: &DatakomD, bank: &mut Bank) {
    bank.integer(ETHERNET_PACKETS, unit.packets.into());
}

/// Where a feed's registers stand; phases follow each other, 32 bits apart but for the power factors.
struct FeedRegisters {
    phase_voltage: u16,
    line_voltage: u16,
    current: u16,
    neutral_current: u16,
    active: u16,
    total_active: u16,
    reactive: u16,
    total_reactive: u16,
    apparent: u16,
    total_apparent: u16,
    power_factor: u16,
    total_power_factor: u16,
    frequency: u16,
    average_voltage: u16,
    average_current: u16,
}

const MAINS: FeedRegisters = FeedRegisters {
    phase_voltage: 10240,
    line_voltage: 10252,
    current: 10264,
    neutral_current: 10276,
    active: 10280,
    total_active: 10292,
    reactive: 10296,
    total_reactive: 10308,
    apparent: 10312,
    total_apparent: 10324,
    power_factor: 10328,
    total_power_factor: 10334,
    frequency: 10338,
    average_voltage: 10381,
    average_current: 10383,
};

const GENSET: FeedRegisters = FeedRegisters {
    phase_voltage: 10246,
    line_voltage: 10258,
    current: 10270,
    neutral_current: 10278,
    active: 10286,
    total_active: 10294,
    reactive: 10302,
    total_reactive: 10310,
    apparent: 10318,
    total_apparent: 10326,
    power_factor: 10331,
    total_power_factor: 10335,
    frequency: 10339,
    average_voltage: 10377,
    average_current: 10379,
};

fn feed(feed: &Feed, at: &FeedRegisters, bank: &mut Bank) {
    bank.numbers(at.phase_voltage, 2, feed.voltage);
    bank.numbers(at.line_voltage, 2, feed.line_voltage());
    bank.numbers(at.current, 2, feed.current());
    bank.number(at.neutral_current, feed.neutral_current());
    bank.numbers(at.active, 2, feed.active);
    bank.number(at.total_active, feed.total_active());
    bank.numbers(at.reactive, 2, feed.reactive);
    bank.number(at.total_reactive, feed.total_reactive());
    bank.numbers(at.apparent, 2, feed.apparent());
    bank.number(at.total_apparent, feed.total_apparent());
    bank.numbers(at.power_factor, 1, feed.power_factor());
    bank.number(at.total_power_factor, feed.total_power_factor());
    bank.number(at.frequency, feed.frequency);
    bank.number(at.average_voltage, feed.average_voltage());
    bank.number(at.average_current, feed.average_current());
}

fn engine(unit: &DatakomD, bank: &mut Bank) {
    let plant = &unit.plant;
    let engine = &plant.engine;
    bank.number(10361, engine.oil_pressure);
    bank.number(10362, engine.coolant);
    bank.number(10363, plant.tank.percent());
    bank.number(10364, engine.oil);
    bank.number(10365, plant.canopy);
    bank.number(10366, plant.ambient);
    // No second set of senders is fitted.
    for address in 10367..=10372 {
        bank.absent(address);
    }
    bank.number(10375, engine.speed);
    bank.number(10376, engine.speed);

    // Governor and regulator stand in the middle of their range and answer the load.
    let (governor, regulator) = match engine.is_running() {
        true => (
            35.0 + 40.0 * plant.genset.total_active() / RATED_KW,
            48.0 + 20.0 * plant.genset.total_reactive() / RATED_KVA,
        ),
        false => (0.0, 0.0),
    };
    bank.number(10607, governor);
    bank.number(10608, regulator);
    bank.number(11680, engine.burn);
}

fn batteries(unit: &DatakomD, bank: &mut Bank) {
    let [first, second] = &unit.plant.batteries;
    bank.number(10340, first.charge_input);
    bank.number(10341, first.voltage);
    bank.number(10343, second.charge_input);
    bank.number(10344, second.voltage);
    bank.number(10385, first.cranking_minimum);
    bank.number(11172, second.cranking_minimum);
    bank.number(11173, first.charge_current);
    bank.number(11174, second.charge_current);
}

/// Senders as they are usually fitted: 10-180 ohm for pressure and level, NTC for temperatures.
fn analogs(unit: &DatakomD, bank: &mut Bank) {
    let plant = &unit.plant;
    let ntc = |degc: f64| 287.0 * ((40.0 - degc) / 28.0).exp();
    bank.numbers(
        10345,
        1,
        [
            10.0 + 17.4 * plant.engine.oil_pressure,
            ntc(plant.engine.coolant),
            10.0 + 1.7 * plant.tank.percent(),
            ntc(plant.engine.oil),
            ntc(plant.canopy),
            ntc(plant.ambient),
        ],
    );
    // Nothing is connected to the last two.
    bank.absent(10351);
    bank.absent(10352);
}

fn analysis(unit: &DatakomD, bank: &mut Bank) {
    let Analysis { fundamental, harmonics, distortion, trace } = selected(unit);
    bank.number(10386, distortion);
    bank.number(10387, fundamental);
    bank.numbers(10388, 1, harmonics);
    bank.code(10403, unit.channel);
    bank.trace(10404, &trace);
}

/// The channels 0 to 19 of register 8194.
fn selected(unit: &DatakomD) -> Analysis {
    let (mains, genset) = (&unit.plant.mains, &unit.plant.genset);
    let phase = usize::from(unit.channel % 3);
    let (shape, rms, line_to_line) = match unit.channel {
        0..=2 => (Shape::MainsVoltage, mains.voltage[phase], false),
        3..=5 => (Shape::GensetVoltage, genset.voltage[phase], false),
        6..=8 => (Shape::MainsVoltage, mains.line_voltage()[phase], true),
        9..=11 => (Shape::GensetVoltage, genset.line_voltage()[phase], true),
        12..=14 => (Shape::Current, mains.current()[phase], false),
        15..=17 => (Shape::Current, genset.current()[phase], false),
        18 => (Shape::NeutralCurrent, mains.neutral_current(), false),
        _ => (Shape::NeutralCurrent, genset.neutral_current(), false),
    };
    // A line voltage leads its first phase by a twelfth of a turn, a current lags by its power factor.
    let within = match shape {
        Shape::Current | Shape::NeutralCurrent => 0.075,
        _ if line_to_line => -1.0 / 12.0,
        _ => 0.0,
    };
    unit.distortion.analyse(shape, rms, phase as f64 / 3.0 + within, line_to_line)
}

fn state(unit: &DatakomD, bank: &mut Bank) {
    bank.code(OPERATION_STATUS, unit.sequence.operation() as u16);
    bank.code(UNIT_MODE, unit.mode as u16);
    bank.integer(10606, unit.sequence.seconds_left() as i64);
}

fn counters(unit: &DatakomD, bank: &mut Bank) {
    let plant = &unit.plant;
    bank.integer(10616, unit.sequence.runs.into());
    bank.integer(10618, unit.sequence.cranks.into());
    bank.integer(10620, unit.sequence.loads.into());

    let hours = plant.engine.hours;
    let since_service = hours - unit.hours_at_service;
    let days = unit.days_before + plant.time / 86_400.0;
    bank.number(10622, hours);
    bank.number(10624, since_service);
    bank.number(10626, days);
    let energy = &plant.genset_energy;
    bank.numbers(10628, 2, [energy.active, energy.inductive, energy.capacitive]);
    for ([hours_left, days_left], [interval_hours, interval_days]) in SERVICES {
        bank.number(hours_left, interval_hours - since_service);
        bank.number(days_left, interval_days - days);
    }

    let energy = &plant.mains_energy;
    bank.numbers(11569, 2, [energy.active, energy.inductive, energy.capacitive, energy.exported]);
    bank.number(11577, plant.engine.burned);
}

fn identity(unit: &DatakomD, bank: &mut Bank) {
    let identity = &unit.identity;
    // The manual gives no format: 1/100 000 degree and metres.
    for (address, value) in [(10594, 4_821_000), (10596, 1_637_200), (10598, 186)] {
        bank.integer(address, value);
    }
    bank.code(10609, identity.code);
    bank.integer(10610, 0x0103);
    bank.integer(10611, 0x0506);
    bank.bytes(10646, vec![10, 64, 12, identity.unique[0]]);
    bank.integer(11682, unit.ethernet_resets.into());
    bank.bytes(11684, identity.mac.to_vec());
    bank.bytes(11687, identity.unique.to_vec());
    bank.bytes(11693, identity.imei.to_vec());
}

/// One genset alone on its busbar shares with nobody: the totals are its own.
fn load_share(unit: &DatakomD, bank: &mut Bank) {
    let genset = &unit.plant.genset;
    bank.number(11175, genset.total_active());
    bank.number(11177, genset.total_reactive());
    bank.number(11374, 100.0 * genset.total_active() / RATED_KW);
    bank.number(11375, 100.0 * genset.total_reactive() / (0.6 * RATED_KVA));
    bank.number(11376, genset.total_power_factor());
    bank.number(11377, 0.0);
    bank.number(11378, 0.0);
}

fn services_due(bank: &Bank) -> [bool; SERVICES.len()] {
    let used_up = |register| bank.number_shown(register).is_some_and(|left| left <= 0.0);
    SERVICES.map(|(left, _)| left.into_iter().any(used_up))
}

fn alarms(unit: &DatakomD, due: [bool; SERVICES.len()], bank: &mut Bank) {
    let mut warning = unit.alarms.warning;
    for (bit, due) in (SERVICE_1_REQUEST..).zip(due) {
        warning.set(bit, due);
    }
    bank.bits(SHUTDOWN_ALARMS, unit.alarms.shutdown);
    bank.bits(LOAD_DUMP_ALARMS, unit.alarms.load_dump);
    bank.bits(WARNING_ALARMS, warning);
}

/// Which alarm arrays have a bit set, and which services are due.
struct Shown {
    due: [bool; SERVICES.len()],
    shutdown: bool,
    load_dump: bool,
    warning: bool,
    count: usize,
}

impl Shown {
    fn of(due: [bool; SERVICES.len()], bank: &Bank) -> Self {
        let [shutdown, load_dump, warning] =
            [SHUTDOWN_ALARMS, LOAD_DUMP_ALARMS, WARNING_ALARMS].map(|array| bank.bits_shown(array).len());
        Self {
            due,
            shutdown: shutdown > 0,
            load_dump: load_dump > 0,
            warning: warning > 0,
            count: shutdown + load_dump + warning,
        }
    }
}

/// The function flags, by the manual's numbers; those not named here stay 0.
fn flags(unit: &DatakomD, shown: &Shown, bank: &mut Bank) {
    let set = output_flags(unit).into_iter().chain(state_flags(unit, shown));
    bank.bits(11555, set.filter(|(_, on)| *on).map(|(flag, _)| flag).collect::<BitSet>());
}

fn output_flags(unit: &DatakomD) -> impl IntoIterator<Item = (u16, bool)> {
    use Operation::*;
    let (plant, controls) = (&unit.plant, &unit.controls);
    let operation = unit.sequence.operation();
    let running = plant.engine.is_running();
    let hot = plant.engine.coolant > 85.0;
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
        (10, operation == GensetBreakerActivation),
        (11, plant.genset_breaker.closed && !controls.genset_breaker),
        (12, controls.genset_breaker),
        (13, operation == MainsBreakerActivation),
        (14, plant.mains_breaker.closed && !controls.mains_breaker),
        (15, controls.mains_breaker),
        (18, controls.fuel_pump),
        (20, controls.block_heater),
        (21, running && hot),
        (22, controls.block_heater),
        (23, running && hot),
        (24, running),
        (25, running),
    ]
}

fn state_flags(unit: &DatakomD, shown: &Shown) -> impl IntoIterator<Item = (u16, bool)> {
    use Operation::*;
    let plant = &unit.plant;
    let operation = unit.sequence.operation();
    let running = plant.engine.is_running();
    let genset_healthy = plant.genset_healthy();
    let tripped = shown.shutdown || shown.load_dump;
    [
        (28, running && genset_healthy && !tripped),
        (36, shown.due[0]),
        (37, shown.due[1]),
        (38, shown.due[2]),
        (41, unit.mode == Mode::Auto && !tripped),
        (42, unit.scene.exerciser),
        (43, unit.scene.exerciser && unit.mode == Mode::Auto),
        (44, !plant.mains_healthy()),
        (46, running),
        (47, genset_healthy),
        (48, running && unit.sequence.is_up_to_speed()),
        (49, plant.engine.oil_pressure > OIL_PRESSURE_OK),
        (50, shown.shutdown),
        (51, shown.load_dump),
        (52, shown.warning),
        (53, tripped),
        (54, tripped || shown.warning),
        (55, unit.mode == Mode::Test),
        (56, unit.mode == Mode::Auto),
        (57, unit.mode == Mode::Run),
        (58, unit.mode == Mode::Stop),
        (59, unit.mode != Mode::Auto),
        (60, operation == AtRest),
        (61, operation == WaitBeforeFuel),
        (62, operation == Preheat),
        (63, operation == WaitOilFlashOff),
        (64, operation == Heating),
        (66, matches!(operation, StopWithCooldown | CoolingDown)),
        (67, matches!(operation, IdleBeforeStop | ImmediateStop | Stopping)),
        (78, operation == OnLoad),
        (108, plant.mains_healthy()),
    ]
}

/// Two bits a LED. The manual does not say which is which: alarms, then modes, then sources and breakers.
fn leds(unit: &DatakomD, shown: &Shown, bank: &mut Bank) {
    const QUICK_FLASH: u8 = 2;
    let plant = &unit.plant;
    let on = u8::from;
    // A breaker on its way flashes.
    let breaker = |closed: bool, commanded: bool| if closed == commanded { on(closed) } else { QUICK_FLASH };
    let mut leds = [0; 32];
    leds[..12].copy_from_slice(&[
        on(shown.shutdown),
        on(shown.load_dump),
        on(shown.warning),
        on(unit.mode == Mode::Stop),
        on(unit.mode == Mode::Run),
        on(unit.mode == Mode::Auto),
        on(unit.mode == Mode::Test),
        on(plant.mains_healthy()),
        breaker(plant.mains_breaker.closed, unit.controls.mains_breaker),
        breaker(plant.genset_breaker.closed, unit.controls.genset_breaker),
        on(plant.genset_healthy()),
        on(plant.engine.is_running()),
    ]);
    bank.codes(11160, &leds);
}

/// Wired as a plain AMF panel: feedbacks come in, relays go out. Extension modules are not fitted.
fn inputs_and_outputs(unit: &DatakomD, bank: &mut Bank) {
    let (plant, controls) = (&unit.plant, &unit.controls);
    let mut inputs = [0; 16];
    inputs[0] = u8::from(plant.genset_breaker.closed);
    inputs[1] = u8::from(plant.mains_breaker.closed);
    inputs[2] = u8::from(controls.fuel_pump);
    bank.codes(10373, &inputs);

    let outputs = [
        controls.fuel,
        controls.starter,
        controls.genset_breaker,
        controls.mains_breaker,
        unit.alarms.horn(),
        unit.sequence.operation() == Operation::Preheat,
        controls.block_heater,
        controls.fuel_pump,
    ];
    let outputs = (0..).zip(outputs).filter(|(_, on)| *on).map(|(bit, _)| bit);
    bank.bits(11164, outputs.collect());
    bank.bits(11167, BitSet::EMPTY);
}

fn lcd(unit: &DatakomD, shown: &Shown, bank: &mut Bank) {
    let plant = &unit.plant;
    let mut canvas = Canvas::new();
    let model = unit.identity.model.as_str();
    let label = |point, code: u8| {
        let choice = bank.profile().point(point).and_then(|point| point.choice(code.into()));
        choice.map_or("", |choice| choice.label_for(Some(model)))
    };
    canvas.text(0, 0, model);
    canvas.text_right(0, label("unit_mode", unit.mode as u8));
    canvas.invert(0);
    canvas.text(1, 0, label("operation_status", unit.sequence.operation() as u8));
    if unit.sequence.seconds_left() > 0 {
        canvas.text_right(2, &format!("{} s", unit.sequence.seconds_left()));
    }
    for (line, name, feed) in [(3, "M", &plant.mains), (4, "G", &plant.genset)] {
        let [l1, l2, l3] = feed.voltage;
        canvas.text(line, 0, &format!("{name} {l1:3.0} {l2:3.0} {l3:3.0}V"));
        canvas.text_right(line, &format!("{:4.1}", feed.frequency));
    }
    let load = plant.mains.total_active() + plant.genset.total_active();
    canvas.text(5, 0, &format!("{load:.1} kW  {:.0} rpm", plant.engine.speed));
    canvas.text(6, 0, &format!("Fuel {:.0}%  Bat {:.1}V", plant.tank.percent(), plant.batteries[0].voltage));
    match shown.count {
        0 => canvas.text(7, 0, "No alarms"),
        count => {
            canvas.text(7, 0, &format!("Alarms: {count}"));
            canvas.invert(7);
        }
    }
    bank.bytes(10648, canvas.datakom_bytes());
}
