//! One imitated device without a wire: simulated time and requests in, responses out.

use std::time::Duration;

use busbar_modbus::{ExceptionCode, Registers, Request, Response};
use busbar_profile::Profile;

use crate::bank::Bank;
use crate::config::Config;
use crate::datakom_d::DatakomD;
use crate::datakom_dkg705::DatakomDkg705;
use crate::error::{PinError, StartError};
use crate::history::{self, History};
use crate::inject::{self, Alarm, InjectError};
use crate::levers::{Lever, LeverError, Position};
use crate::panel::Panel;
use crate::pins;
use crate::plant::{Plant, Supply};
use crate::random::Random;
use crate::rules::{COIL_OFF, COIL_ON, Permitted, Refusals, permit};
use crate::scenario::{Event, Player, Report};
use crate::settings::{SettingError, Settings};
use crate::smartgen_acc1700::{Acc1700, Model};
use crate::smartgen_hat821si::Hat821si;

/// The plant and the panel move in steps of this much simulated time, whatever the speed: so the same inputs at
/// the same simulated times give the same registers.
pub const STEP: Duration = Duration::from_millis(100);

const IMITATED: [&str; 4] = ["datakom-d", "datakom-dkg705", "smartgen-hat821si", "smartgen-acc1700"];

/// A controller with its plant, its registers and the wire rules of its manual.
///
/// Reads are answered from a register image that [`advance`](Self::advance) and accepted writes refresh.
#[derive(Debug)]
pub struct Device {
    unit: u8,
    bank: Bank,
    refusals: Refusals,
    panel: Box<dyn Panel>,
    settings: Settings,
    /// Alarms that were injected, by point and bit.
    injected: Vec<Alarm>,
    clock: Duration,
    model: String,
    seed: u64,
    answer_delay: Duration,
    player: Option<Player>,
    history: Option<History>,
    /// Levers that stand at a number by themselves, as a level does, and those of them that were pulled, each with where
    /// it stood before.
    levels: Vec<&'static str>,
    moved: Vec<(&'static str, Position)>,
}

impl Device {
    /// A device at power-on; `listen`, `speed`, `connections` and `idle` of the configuration play no part.
    ///
    /// # Errors
    /// The profile, model, unit or a pinned value is not possible.
    pub fn new(config: &Config) -> Result<Self, StartError> {
        let profile = busbar_profile::builtin(&config.profile)
            .ok_or_else(|| StartError::UnknownProfile { key: config.profile.clone() })?;
        let range = &profile.wire.unit;
        if !(range.min..=range.max).contains(&config.unit) {
            return Err(StartError::Unit { unit: config.unit, min: range.min, max: range.max });
        }
        if let Some(scenario) =
            config.scenario.as_ref().filter(|scenario| scenario.controller() != profile.key)
        {
            let (place, controller) = (scenario.place(), scenario.controller());
            return Err(StartError::OtherController { place, controller, key: profile.key.clone() });
        }
        let (mut panel, model) = panel(profile, config)?;
        let (mut bank, mut settings) = (Bank::new(profile), Settings::of(profile));
        for (name, text) in &config.pins {
            if profile.setting(name).is_some() {
                settings.set(name, text)?;
                continue;
            }
            let (index, registers) = pins::parse(profile, name, text)?;
            bank.pin(index, &registers);
        }
        panel.configure(&settings);
        panel.render(&mut bank);
        let answer_delay = profile.wire.answer_delay();
        let (unit, seed, refusals) = (config.unit, config.seed, panel.refusals());
        let mut device = Self {
            unit,
            bank,
            refusals,
            panel,
            settings,
            injected: Vec::new(),
            clock: Duration::ZERO,
            model: model.to_owned(),
            seed,
            answer_delay,
            player: config.scenario.as_ref().map(|scenario| Player::new(scenario, model, seed)),
            history: None,
            levels: Vec::new(),
            moved: Vec::new(),
        };
        let is_level = |lever: &&Lever| matches!(device.lever(lever.id), Some(Position::Number(_)));
        device.levels = device.levers().iter().filter(is_level).map(|lever| lever.id).collect();
        device.stir();
        device.play();
        Ok(device)
    }

    /// Lets the plant live until `now`, simulated time since power-on, and refreshes the registers.
    pub fn advance(&mut self, now: Duration) {
        let mut moved = false;
        while self.is_due(now) {
            self.step();
            moved = true;
        }
        if moved {
            self.settle();
        }
    }

    /// Whether a step of its plant ends by then.
    pub(crate) fn is_due(&self, now: Duration) -> bool {
        self.clock + STEP <= now
    }

    /// Lets its plant move by one step; [`settle`](Self::settle) shows what came of it.
    pub(crate) fn step(&mut self) {
        self.panel.step(STEP);
        self.clock += STEP;
        if self.report().is_some_and(|report| !report.is_over()) {
            self.panel.render(&mut self.bank);
            self.play();
        }
        if History::is_due(self.clock) {
            self.look();
        }
    }

    /// Refreshes the registers after one or more steps.
    pub(crate) fn settle(&mut self) {
        self.panel.render(&mut self.bank);
        self.stir();
    }

    /// The plant of a genset, for what it is joined to.
    pub(crate) fn genset(&mut self) -> Option<&mut Plant> {
        self.panel.genset()
    }

    /// What a bus section of its switchgear gives to whatever hangs on it; sections count from 0.
    pub(crate) fn section(&self, section: usize) -> Option<Supply> {
        self.panel.section(section)
    }

    /// Whether a request has a function that the device knows and a body that does not fit it: the manuals have no
    /// exception for that.
    pub(crate) fn is_malformed(&self, request: &Request<'_>) -> bool {
        matches!(request, Request::Other { function, .. }
            if self.bank.profile().wire.functions.contains(function))
    }

    /// Answers one request, or stays silent: to another unit, to unit 0, to what is malformed, and while it restarts.
    pub fn answer(&mut self, unit: u8, request: &Request<'_>) -> Option<Response<'_>> {
        if unit != self.unit || self.panel.is_silent() || self.is_malformed(request) {
            return None;
        }
        let wire = &self.bank.profile().wire;
        let function = request.function();
        let refuse = |code: ExceptionCode| Response::Exception { function, code };
        Some(match permit(request, wire, self.refusals, &self.bank) {
            Err(code) => refuse(code),
            Ok(Permitted::Read { address, count }) => match self.bank.read(address, count) {
                Some(registers) if function == 0x04 => Response::ReadInputRegisters(registers.into()),
                Some(registers) => Response::ReadHoldingRegisters(registers.into()),
                None => refuse(ExceptionCode::ILLEGAL_DATA_ADDRESS),
            },
            Ok(Permitted::Write { address, value }) => {
                self.write(address, Registers::from(&[value]));
                Response::WriteSingleRegister { address, value }
            }
            Ok(Permitted::WriteCoil { address, on }) => {
                self.panel.write_coil(address, on);
                self.tell_of_write(address, u16::from(on));
                self.panel.render(&mut self.bank);
                Response::WriteSingleCoil { address, value: if on { COIL_ON } else { COIL_OFF } }
            }
            Ok(Permitted::WriteSeveral { address, registers }) => {
                self.write(address, registers);
                Response::WriteMultipleRegisters { address, count: registers.len() as u16 }
            }
        })
    }

    /// The unit id that it answers to.
    pub fn unit(&self) -> u8 {
        self.unit
    }

    /// Its model, as the profile writes it.
    pub fn model(&self) -> &str {
        &self.model
    }

    /// The seed of everything that is left to chance.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// It answers no sooner than this after a request.
    pub fn answer_delay(&self) -> Duration {
        self.answer_delay
    }

    /// Whether it is restarting: whoever carries its connections drops them.
    pub fn is_silent(&self) -> bool {
        self.panel.is_silent()
    }

    /// Counts a packet that came in over Ethernet, for devices that do.
    pub fn count_packet(&mut self) {
        self.panel.count_packet(&mut self.bank);
    }

    /// The registers as a read of any length would see them; `None` where one of them cannot be read.
    pub fn registers(&self, address: u16, count: u16) -> Option<&[u16]> {
        self.bank.read(address, count)
    }

    /// Simulated time since power-on, in whole steps.
    pub fn time(&self) -> Duration {
        self.clock
    }

    /// What can be made to happen to its plant.
    pub fn levers(&self) -> &'static [Lever] {
        self.panel.levers()
    }

    /// Where a lever stands; none where the plant has no such lever.
    pub fn lever(&self, id: &str) -> Option<Position> {
        self.panel.lever(id)
    }

    /// Pulls a lever to a position given as text. What follows from it is seen from the next step on.
    ///
    /// # Errors
    /// The plant has no such lever, or the lever no such position.
    pub fn pull(&mut self, id: &str, to: &str) -> Result<(), LeverError> {
        let levers = self.levers();
        let Some(lever) = levers.iter().find(|lever| lever.id == id) else {
            let known: Vec<_> = levers.iter().map(|lever| lever.id).collect();
            let nearest = busbar_profile::nearest(id, known.iter().copied());
            return Err(LeverError::Unknown { id: id.to_owned(), nearest, known });
        };
        let position = lever.position(to)?;
        if self.levels.contains(&lever.id) && self.moved.iter().all(|(id, _)| *id != lever.id) {
            self.moved.extend(self.lever(lever.id).map(|before| (lever.id, before)));
        }
        self.panel.pull(lever.id, position);
        self.moved.retain(|(id, before)| *id != lever.id || !before.is_about(position));
        let unit = lever.numbers.map_or("", |numbers| numbers.unit);
        self.tell(|| match position {
            Position::Word(word) => format!("{}: {}", lever.name, word.replace('_', " ")),
            Position::Number(number) => format!("{}: {number} {unit}", lever.name).trim_end().to_owned(),
        });
        Ok(())
    }

    /// Where a lever that was pulled goes back to: the word of a healthy plant, or the level that it had before. None
    /// where there is nothing to put back.
    pub fn back(&self, lever: &Lever) -> Option<Position> {
        if self.levels.contains(&lever.id) {
            return self.moved.iter().find(|(id, _)| *id == lever.id).map(|(_, before)| *before);
        }
        let healthy = Position::Word(lever.words.first()?.id);
        self.lever(lever.id).filter(|position| *position != healthy).map(|_| healthy)
    }

    /// Puts a lever back to where [`back`](Self::back) says; nothing happens where there is nothing to put back.
    fn put_back(&mut self, lever: &'static Lever) {
        if let Some(position) = self.back(lever) {
            self.panel.pull(lever.id, position);
            self.moved.retain(|(id, _)| *id != lever.id);
        }
    }

    /// Undoes what was done to the plant and its panel from outside: every lever is put back, injected alarms and pinned
    /// points are let go. Settings stay as they are, and what the panel has latched is to be reset there.
    pub fn restore(&mut self) {
        for lever in self.levers() {
            self.put_back(lever);
        }
        for Alarm { point, bit, .. } in std::mem::take(&mut self.injected) {
            self.panel.inject(point, bit, false);
        }
        for index in self.pinned().collect::<Vec<_>>() {
            self.bank.unpin(index);
        }
        self.panel.render(&mut self.bank);
        self.tell(|| "All back to normal".to_owned());
    }

    /// Every alarm that the controller has.
    pub fn alarms(&self) -> impl Iterator<Item = Alarm> + use<> {
        inject::alarms(self.profile())
    }

    /// The alarms that a client would read as active now.
    pub fn active(&self) -> Vec<Alarm> {
        let profile = self.profile();
        let active = |alarm: &Alarm| {
            let point = profile.point(alarm.point).filter(|_| !self.is_silent())?;
            let registers = self.registers(point.address, point.registers)?;
            let value = point.decode(registers, profile.wire.word_order).value?;
            Some(value.as_bits()?.contains(alarm.bit))
        };
        self.alarms().filter(|alarm| active(alarm) == Some(true)).collect()
    }

    /// Keeps from now on what happens, for [`lately`](Self::lately).
    pub fn remember(&mut self) {
        if self.history.is_none() {
            self.history = Some(History::new(self));
        }
    }

    /// What happened lately, the newest first: what was done, and what a person at the panel would have seen, looked at
    /// once a second of simulated time. Nothing where nobody has asked to [`remember`](Self::remember).
    pub fn lately(&self) -> impl Iterator<Item = &Event> {
        self.history.iter().flat_map(History::events)
    }

    /// The alarms that are injected, in the order in which they were.
    pub fn injected(&self) -> &[Alarm] {
        &self.injected
    }

    /// Makes the panel take an alarm for active whatever the plant says, or no longer. Named by the id of its bit, or by
    /// `point.bit` where several points have one.
    ///
    /// # Errors
    /// There is no such alarm, there are several, or it follows from others.
    pub fn inject(&mut self, name: &str, active: bool) -> Result<(), InjectError> {
        let alarm = inject::find(self.profile(), name)?;
        if !self.panel.inject(alarm.point, alarm.bit, active) {
            return Err(InjectError::Derived { name: name.to_owned() });
        }
        let was = self.injected.contains(&alarm);
        self.injected.retain(|known| *known != alarm);
        if active {
            self.injected.push(alarm);
        }
        if was != active {
            let what = if active { "injected" } else { "let go" };
            self.tell(|| format!("{} alarm {what}: {}", alarm.class, alarm.label));
        }
        Ok(())
    }

    /// Keeps a point at a value given as text, as `--set` does.
    ///
    /// # Errors
    /// The controller has no such point, or the point cannot have that value.
    pub fn pin(&mut self, point: &str, text: &str) -> Result<(), PinError> {
        let (index, registers) = pins::parse(self.profile(), point, text)?;
        self.bank.pin(index, &registers);
        self.panel.render(&mut self.bank);
        self.tell(|| format!("{point} pinned"));
        Ok(())
    }

    /// Lets a point follow the plant again; false where it was not pinned.
    pub fn unpin(&mut self, point: &str) -> bool {
        let unpinned = self.profile().point_index(point).is_some_and(|index| self.bank.unpin(index));
        self.panel.render(&mut self.bank);
        if unpinned {
            self.tell(|| format!("{point} let go"));
        }
        unpinned
    }

    /// The points that are pinned, by index in the profile.
    pub fn pinned(&self) -> impl Iterator<Item = usize> {
        self.bank.pinned()
    }

    /// Timers, thresholds and attempts, each with what it is set to.
    pub fn settings(&self) -> impl Iterator<Item = (&'static busbar_profile::Setting, f64)> {
        self.settings.iter()
    }

    /// Sets one of them, in its unit.
    ///
    /// # Errors
    /// The controller has no such setting, or it cannot be set to that.
    pub fn set(&mut self, id: &str, text: &str) -> Result<(), SettingError> {
        self.settings.set(id, text)?;
        self.panel.configure(&self.settings);
        // Some are shown in registers.
        self.panel.render(&mut self.bank);
        let number = self.settings.number(id);
        self.tell(|| format!("Setting {id}: {number}"));
        Ok(())
    }

    /// What has become of its scenario; none where it has none.
    pub fn report(&self) -> Option<&Report> {
        self.player.as_ref().map(Player::report)
    }

    /// The profile that it follows.
    pub fn profile(&self) -> &'static Profile {
        self.bank.profile()
    }

    /// How many values of the panel its profile could not hold since power-on; anything but 0 is our fault.
    pub fn misfits(&self) -> u64 {
        self.bank.refused()
    }

    /// Lets the scenario go on: what it reads is what a client would read now.
    fn play(&mut self) {
        if let Some(mut player) = self.player.take() {
            player.go_on(self);
            self.player = Some(player);
        }
    }

    /// Looks at the panel, where somebody keeps what happens.
    fn look(&mut self) {
        if let Some(mut history) = self.history.take() {
            self.panel.render(&mut self.bank);
            history.look(self);
            self.history = Some(history);
        }
    }

    /// Notes what was done, where somebody keeps it.
    fn tell(&mut self, what: impl FnOnce() -> String) {
        let now = self.clock;
        if let Some(history) = &mut self.history {
            history.act(now, what());
        }
    }

    fn tell_of_write(&mut self, address: u16, value: u16) {
        let profile = self.profile();
        self.tell(|| history::written(profile, address, value));
    }

    /// Noise that depends on the seed and the time alone, however time was let pass.
    fn stir(&mut self) {
        let ticks = self.clock.as_millis() as u64 / STEP.as_millis() as u64;
        self.bank.stir(&mut Random::new(self.seed.rotate_left(32) ^ ticks));
    }

    fn write(&mut self, address: u16, registers: Registers<'_>) {
        for (register, value) in (address..).zip(registers.iter()) {
            self.panel.write(register, value);
            self.tell_of_write(register, value);
        }
        // Whoever reads back at once sees what he wrote.
        self.panel.render(&mut self.bank);
    }
}

/// The panel of a profile, and the model that it is.
fn panel(profile: &'static Profile, config: &Config) -> Result<(Box<dyn Panel>, &'static str), StartError> {
    match profile.key.as_str() {
        "datakom-d" => datakom_d(profile, config),
        "datakom-dkg705" => {
            // There is one.
            let model = chosen(&profile.models, config, "DKG-705")?;
            let unit = DatakomDkg705::new(config.seed, config.story, &Settings::of(profile));
            Ok((Box::new(unit.starting(config.epoch)), model))
        }
        "smartgen-acc1700" => {
            let model = chosen(&profile.models, config, "ACC1700CAN")?;
            Ok((Box::new(Acc1700::new(profile, Model::of(model), config.seed, config.story)), model))
        }
        "smartgen-hat821si" => {
            let model = chosen(&profile.models, config, "HAT821SI")?;
            Ok((Box::new(Hat821si::new(config.seed, config.story).starting(config.epoch)), model))
        }
        _ => Err(StartError::NotImitated { key: profile.key.clone(), imitated: IMITATED.to_vec() }),
    }
}

/// The model asked for, as the profile writes it.
fn chosen<'a>(models: &'a [String], config: &Config, default: &str) -> Result<&'a str, StartError> {
    let wanted = config.model.as_deref().unwrap_or(default);
    let known = models.iter().find(|model| model.eq_ignore_ascii_case(wanted));
    known
        .map(String::as_str)
        .ok_or_else(|| StartError::UnknownModel { model: wanted.to_owned(), allowed: models.to_vec() })
}

fn datakom_d(
    profile: &'static Profile,
    config: &Config,
) -> Result<(Box<dyn Panel>, &'static str), StartError> {
    let wanted = config.model.as_deref().unwrap_or("D-500");
    // Every unit that its identity tells apart, with those the manual's title does not name.
    let known = profile.identity.as_ref().map_or(&[][..], |identity| &identity.models);
    let Some(known) = known.iter().find(|known| known.model.eq_ignore_ascii_case(wanted)) else {
        let allowed = known.iter().map(|known| known.model.clone()).collect();
        return Err(StartError::UnknownModel { model: wanted.to_owned(), allowed });
    };
    Ok((Box::new(DatakomD::new(&known.model, known.value, config.seed, config.story)), &known.model))
}
