//! One imitated device without a wire: simulated time and requests in, responses out.

use std::time::Duration;

use busbar_modbus::{ExceptionCode, Registers, Request, Response};
use busbar_profile::Profile;

use crate::bank::Bank;
use crate::config::Config;
use crate::datakom_d::DatakomD;
use crate::datakom_dkg705::DatakomDkg705;
use crate::error::StartError;
use crate::panel::Panel;
use crate::pins;
use crate::rules::{COIL_OFF, COIL_ON, Permitted, Refusals, permit};

/// The plant and the panel move in steps of this much simulated time, whatever the speed: so the same inputs at
/// the same simulated times give the same registers.
pub const STEP: Duration = Duration::from_millis(100);

const IMITATED: [&str; 2] = ["datakom-d", "datakom-dkg705"];

/// A controller with its plant, its registers and the wire rules of its manual.
///
/// Reads are answered from a register image that [`advance`](Self::advance) and accepted writes refresh.
#[derive(Debug)]
pub struct Device {
    unit: u8,
    bank: Bank,
    refusals: Refusals,
    panel: Box<dyn Panel>,
    clock: Duration,
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
        let panel = panel(profile, config)?;
        let mut bank = Bank::new(profile);
        for (point, text) in &config.pins {
            let (index, registers) = pins::parse(profile, point, text)?;
            bank.pin(index, &registers);
        }
        panel.render(&mut bank);
        Ok(Self { unit: config.unit, bank, refusals: panel.refusals(), panel, clock: Duration::ZERO })
    }

    /// Lets the plant live until `now`, simulated time since power-on, and refreshes the registers.
    pub fn advance(&mut self, now: Duration) {
        let mut moved = false;
        while self.clock + STEP <= now {
            self.panel.step(STEP);
            self.clock += STEP;
            moved = true;
        }
        if moved {
            self.panel.render(&mut self.bank);
        }
    }

    /// Answers one request, or stays silent: to another unit, to unit 0, and while it restarts.
    pub fn answer(&mut self, unit: u8, request: &Request<'_>) -> Option<Response<'_>> {
        if unit != self.unit || self.panel.is_silent() {
            return None;
        }
        let wire = &self.bank.profile().wire;
        let function = request.function();
        if matches!(request, Request::Other { .. }) && wire.functions.contains(&function) {
            // A function it knows with a body that does not fit: the manual has no exception for that.
            return None;
        }
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
                self.panel.render(&mut self.bank);
                Response::WriteSingleCoil { address, value: if on { COIL_ON } else { COIL_OFF } }
            }
            Ok(Permitted::WriteSeveral { address, registers }) => {
                self.write(address, registers);
                Response::WriteMultipleRegisters { address, count: registers.len() as u16 }
            }
        })
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

    /// The profile that it follows.
    pub fn profile(&self) -> &'static Profile {
        self.bank.profile()
    }

    /// How many values of the panel its profile could not hold since power-on; anything but 0 is our fault.
    pub fn misfits(&self) -> u64 {
        self.bank.refused()
    }

    fn write(&mut self, address: u16, registers: Registers<'_>) {
        for (register, value) in (address..).zip(registers.iter()) {
            self.panel.write(register, value);
        }
        // Whoever reads back at once sees what he wrote.
        self.panel.render(&mut self.bank);
    }
}

fn panel(profile: &Profile, config: &Config) -> Result<Box<dyn Panel>, StartError> {
    match profile.key.as_str() {
        "datakom-d" => datakom_d(profile, config),
        "datakom-dkg705" => {
            only_model(profile, config)?;
            Ok(Box::new(DatakomDkg705::new(config.seed, config.story)))
        }
        key => Err(StartError::NotImitated { key: key.to_owned(), imitated: IMITATED.to_vec() }),
    }
}

/// A model may be named for families without an identity register too, if it is one of theirs.
fn only_model(profile: &Profile, config: &Config) -> Result<(), StartError> {
    let Some(wanted) = config.model.as_deref() else { return Ok(()) };
    match profile.models.iter().any(|model| model.eq_ignore_ascii_case(wanted)) {
        true => Ok(()),
        false => Err(StartError::UnknownModel { model: wanted.to_owned(), allowed: profile.models.clone() }),
    }
}

fn datakom_d(profile: &Profile, config: &Config) -> Result<Box<dyn Panel>, StartError> {
    let wanted = config.model.as_deref().unwrap_or("D-500");
    // Every unit that its identity tells apart, with those the manual's title does not name.
    let known = profile.identity.as_ref().map_or(&[][..], |identity| &identity.models);
    let Some(known) = known.iter().find(|known| known.model.eq_ignore_ascii_case(wanted)) else {
        let allowed = known.iter().map(|known| known.model.clone()).collect();
        return Err(StartError::UnknownModel { model: wanted.to_owned(), allowed });
    };
    Ok(Box::new(DatakomD::new(&known.model, known.value, config.seed, config.story)))
}
