//! What stands behind an endpoint: which devices answer there, and what has happened.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use busbar_link::Endpoint;
use busbar_modbus::pdu::EXCEPTION_BIT;
use busbar_modbus::stream::Frame;
use busbar_modbus::{ExceptionCode, Framing, Losses, Request, Response, mbap, rtu};
use tokio::sync::{Semaphore, watch};

use super::shared::Shared;
use crate::device::Device;
use crate::faults::{Faults, Mischief, Struck};

/// What has happened on the wires of an imitation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Connections accepted.
    pub connections: u64,
    /// Connections closed at once: too many, or the device was restarting.
    pub turned_away: u64,
    /// Requests that came, whoever they were for.
    pub requests: u64,
    /// Requests that were answered.
    pub answers: u64,
    /// Bytes and frames that were no requests.
    pub garbage: u64,
    /// Serial lines: requests lost because they came while an answer was on its way.
    pub collisions: u64,
}

impl std::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        self.connections += other.connections;
        self.turned_away += other.turned_away;
        self.requests += other.requests;
        self.answers += other.answers;
        self.garbage += other.garbage;
        self.collisions += other.collisions;
    }
}

/// A device that several endpoints may share.
#[derive(Debug)]
pub(super) struct Served {
    device: Shared<Device>,
    /// Tells when the device restarts, which drops the connections of its own Ethernet port.
    pub(super) restarts: watch::Sender<()>,
}

impl Served {
    pub(super) fn new(device: Device) -> Self {
        Self { device: Shared::new(device), restarts: watch::Sender::new(()) }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Device> {
        self.device.lock()
    }

    /// For whoever lets its time pass.
    pub(super) fn hold(&self) -> MutexGuard<'_, Device> {
        self.device.hold()
    }

    pub(super) fn is_wanted(&self) -> bool {
        self.device.is_wanted()
    }
}

/// One endpoint from inside.
#[derive(Debug)]
pub(super) struct Door {
    pub(super) endpoint: Endpoint,
    /// The devices that can be reached, each with its unit id.
    pub(super) devices: Vec<(u8, Arc<Served>)>,
    pub(super) places: Arc<Semaphore>,
    pub(super) idle: Duration,
    statistics: Mutex<Statistics>,
    /// What goes wrong here, if anything does.
    mischief: Option<Mutex<Mischief>>,
}

/// What came of a batch of requests.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcome {
    /// How long the slowest of the devices takes before it answers.
    pub(super) delay: Duration,
    /// A device restarts because of it.
    pub(super) restarting: bool,
    /// The connection ends in place of an answer.
    pub(super) hangs_up: bool,
}

impl Door {
    pub(super) fn new(
        endpoint: Endpoint,
        devices: Vec<(u8, Arc<Served>)>,
        places: Arc<Semaphore>,
        idle: Duration,
        faults: Option<&Faults>,
    ) -> Self {
        let mischief = faults.map(|faults| Mutex::new(Mischief::new(faults)));
        Self { endpoint, devices, places, idle, statistics: Mutex::default(), mischief }
    }

    pub(super) fn framing(&self) -> Framing {
        match self.endpoint {
            Endpoint::Tcp { .. } => Framing::Tcp,
            _ => Framing::Rtu,
        }
    }

    /// The device whose own Ethernet port this is. Behind RTU frames, or beside others, it is reached through a
    /// converter, which outlives its restarts and whose packets it does not see.
    pub(super) fn owner(&self) -> Option<&Arc<Served>> {
        match (&self.endpoint, self.devices.as_slice()) {
            (Endpoint::Tcp { .. }, [(_, device)]) => Some(device),
            _ => None,
        }
    }

    pub(super) fn statistics(&self) -> MutexGuard<'_, Statistics> {
        self.statistics.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends the answer to one frame, if there is one.
    pub(super) fn answer(&self, frame: &Frame<'_>, out: &mut Vec<u8>) -> Option<Outcome> {
        let framing = self.framing();
        let Some(request) = request(frame.pdu) else {
            self.statistics().garbage += 1;
            return None;
        };
        let member = self.devices.iter().find(|(unit, _)| *unit == frame.unit);
        let mut device = member.map(|(_, served)| served.lock());
        if device.as_ref().is_some_and(|device| device.is_malformed(&request)) {
            self.statistics().garbage += 1;
            return None;
        }
        self.statistics().requests += 1;
        let now = match &device {
            Some(device) => device.time(),
            None if self.mischief.is_none() => return None,
            // Adapters echo and converters refuse what nobody answers, too.
            None => self.devices.first().map_or(Duration::ZERO, |(_, served)| served.lock().time()),
        };
        let mut mischief = self.mischief();
        let struck = mischief.as_mut().and_then(|mischief| mischief.strike(frame, now));
        let start = out.len();
        let mut outcome = Outcome {
            delay: struck.map_or(Duration::ZERO, Struck::delay),
            restarting: false,
            hangs_up: struck.is_some_and(Struck::hangs_up),
        };
        if let Some(device) = device.as_mut().filter(|_| struck.is_none_or(Struck::is_heard)) {
            let response = device.answer(frame.unit, &request);
            let obeyed = response.is_some_and(|response| encode(framing, frame, &response, out));
            outcome.delay += device.answer_delay();
            outcome.restarting = obeyed && device.is_silent();
        }
        if struck.is_none() && out.len() == start {
            return None;
        }
        if let Some(mischief) = &mut mischief {
            mischief.spoil(struck, framing, frame, out, start);
        }
        self.statistics().answers += u64::from(out.len() > start);
        Some(outcome)
    }

    fn mischief(&self) -> Option<MutexGuard<'_, Mischief>> {
        self.mischief.as_ref().map(|mischief| mischief.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Tells every connection of the devices that restart.
    pub(super) fn announce_restarts(&self) {
        for (_, served) in &self.devices {
            if served.lock().is_silent() {
                served.restarts.send_replace(());
            }
        }
    }
}

impl Outcome {
    /// The outcome of several requests together.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            delay: self.delay.max(other.delay),
            restarting: self.restarting || other.restarting,
            hangs_up: self.hangs_up || other.hangs_up,
        }
    }
}

/// What a client asks. A device judges the function before the rest: one that it does not have gets its exception
/// whatever follows, function 0 too, which only TCP can carry.
fn request(pdu: &[u8]) -> Option<Request<'_>> {
    let (&function, data) = pdu.split_first()?;
    let odd = (function < EXCEPTION_BIT).then_some(Request::Other { function, data });
    Request::decode(pdu).ok().or(odd)
}

fn encode(framing: Framing, frame: &Frame<'_>, response: &Response<'_>, out: &mut Vec<u8>) -> bool {
    let (transaction, unit) = (frame.transaction, frame.unit);
    match (framing, response) {
        // No encoder writes function 0: it is no function.
        (Framing::Tcp, Response::Exception { function: 0, code: ExceptionCode(code) }) => {
            let [high, low] = transaction.to_be_bytes();
            out.extend_from_slice(&[high, low, 0, 0, 0, 3, unit, EXCEPTION_BIT, *code]);
            true
        }
        (Framing::Tcp, response) => mbap::encode_response(transaction, unit, response, out).is_ok(),
        (Framing::Rtu, response) => rtu::encode_response(unit, response, out).is_ok(),
    }
}

pub(super) fn dropped(losses: &Losses) -> u64 {
    losses.garbage_bytes + losses.crc_errors + losses.wrong_protocol
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    /// What comes of a request to a unit that nobody has.
    fn answer_to_nobody(kind: &str) -> Option<Vec<u8>> {
        let faults = (!kind.is_empty()).then(|| {
            let text = format!("[[faults]]\nkind = {kind}\nevery = 1\n");
            Faults::parse("f.toml", &text).unwrap_or_else(|findings| panic!("{findings}"))
        });
        let served = Arc::new(Served::new(Device::new(&Config::default()).unwrap()));
        let endpoint = "rtu+tcp://127.0.0.1:0".parse().unwrap();
        let places = Arc::new(Semaphore::new(1));
        let door = Door::new(endpoint, vec![(1, served)], places, Duration::ZERO, faults.as_ref());
        let frame = Frame { transaction: 0, unit: 9, pdu: &[6, 0x20, 1, 0, 8] };
        let mut out = Vec::new();
        door.answer(&frame, &mut out).map(|_| out)
    }

    #[test]
    fn a_line_can_be_sick_where_nobody_answers() {
        assert_eq!(answer_to_nobody(""), None);
        for silent in ["\"unanswered\"", "\"garbled\"", "\"twice\"", "\"other_unit\"", "\"cut\""] {
            assert_eq!(answer_to_nobody(silent), Some(Vec::new()), "{silent}");
        }
        assert_eq!(answer_to_nobody("\"echo\""), Some(vec![9, 6, 0x20, 1, 0, 8, 0xD3, 0x44]));
        assert_eq!(answer_to_nobody("\"exception\"\ncode = 11"), Some(vec![9, 0x86, 11, 0x82, 0x65]));
    }
}
