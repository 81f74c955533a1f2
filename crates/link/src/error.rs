//! What can go wrong on a wire, who is at fault, and what to do about it.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use busbar_modbus::{ExceptionCode, StartError};
use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::heard::Heard;
use crate::serial::SerialError;

/// Why a request has no result.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LinkError {
    /// The device refused: it is alive, but will not do this.
    #[error("unit {unit} answered function {function} with exception {code}")]
    Exception {
        /// Unit id asked.
        unit: u8,
        /// Function asked, without the exception bit.
        function: u8,
        /// The code, as the device sent it.
        code: ExceptionCode,
    },
    /// No answer to a read, however often it was asked. The usual cause: a wrong unit id, or the
    /// device is off.
    #[error("unit {unit} did not answer within {after:?}, asked {}: {heard}", times(*tries))]
    Timeout {
        /// Unit id asked.
        unit: u8,
        /// How long each try waited.
        after: Duration,
        /// How often the request was sent.
        tries: u8,
        /// What came instead the last time.
        heard: Heard,
    },
    /// A unit that has not answered for several times is polled only now and then, so that others on its wire keep
    /// their pace; this poll was answered at once, and nothing was sent.
    #[error(
        "unit {unit} has not answered lately and is polled again in {next_probe:?}: check the unit id and that the device is on"
    )]
    Silent {
        /// Unit id asked.
        unit: u8,
        /// How long until the next poll goes through, in whole milliseconds.
        next_probe: Duration,
    },
    /// A serial line was never silent for long enough to ask anything. A write that ends so was not sent.
    #[error(
        "nothing was sent to unit {unit}, for the line was not silent within {after:?}; check that no other client asks on this line, baud rate and parity, and the terminators"
    )]
    NeverSilent {
        /// Unit id asked.
        unit: u8,
        /// How long a silence was waited for.
        after: Duration,
    },
    /// There is no connection. A write that ends so was not sent.
    #[error("{reason}")]
    Down {
        /// Why not.
        reason: Outage,
    },
    /// A write left and its answer never came: it may have taken effect or not. Find out by
    /// reading; never send it again.
    #[error(
        "the answer to a write to unit {unit} was lost ({loss}); it may have taken effect: read the state before anything else"
    )]
    Lost {
        /// Unit id written to.
        unit: u8,
        /// What became of the answer.
        loss: Loss,
    },
    /// More requests wait than the wire takes. The caller asks faster than the wire can answer.
    #[error("{waiting} requests wait for this wire already: ask less often")]
    QueueFull {
        /// How many wait in the same class of priority.
        waiting: usize,
    },
    /// Only functions 3 and 4 read registers.
    #[error("function {function} does not read registers: use 3 (holding) or 4 (input)")]
    NotARead {
        /// The function the caller gave.
        function: u8,
    },
    /// The protocol has no frame for this request, for example because of its count; nothing was sent.
    #[error("not sent: {0}")]
    NotSent(#[from] StartError),
    /// The wire's task has ended; a write that ends so was not sent.
    #[error("this wire has been closed")]
    Closed,
}

impl LinkError {
    /// Whether a write that ended so may have taken effect, or may still do: then find out by reading, and never send it
    /// again. After any other error it has not.
    ///
    /// Exceptions are judged by what the standard says of them (V1.1b3, 7); a code that it does not have may mean
    /// anything, except 10, which some makers use for write protection.
    pub fn may_have_taken_effect(&self) -> bool {
        match self {
            Self::Lost { .. } => true,
            Self::Exception { function, code, .. } => {
                let is_read = matches!(function, 0x01..=0x04);
                !is_read && !matches!(code.0, 1 | 2 | 3 | 6 | 10)
            }
            _ => false,
        }
    }

    /// Whose fault it is, for a first guess at where to look.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Exception { .. } => Fault::Device,
            Self::Timeout { .. } | Self::Silent { .. } | Self::NeverSilent { .. } | Self::Lost { .. } => {
                Fault::Wire
            }
            Self::Down { reason } => match reason.cause {
                Cause::Garbage | Cause::Closed => Fault::Peer,
                _ => Fault::Wire,
            },
            Self::QueueFull { .. } | Self::NotARead { .. } | Self::NotSent(_) => Fault::Caller,
            Self::Closed => Fault::Us,
        }
    }
}

/// Who is at fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The controller, which works but refuses.
    Device,
    /// Cable, network, address, or a device that is off.
    Wire,
    /// The program or converter at the other end breaks the protocol.
    Peer,
    /// Who asked.
    Caller,
    /// This program.
    Us,
}

/// What became of the answer to a write.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Loss {
    /// It did not come in time.
    #[error("none within {after:?}: {heard}")]
    TimedOut {
        /// How long it was waited for.
        after: Duration,
        /// What came instead.
        heard: Heard,
    },
    /// The connection dropped first.
    #[error("{0}")]
    Dropped(Outage),
    /// The wire was closed first, as when the program ends.
    #[error("the wire was closed")]
    Closed,
}

/// Why an endpoint cannot be opened at all.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// This version reads such endpoints but has no transport for them.
    #[error("{endpoint}: this version does not speak {} yet, use a tcp:// endpoint", endpoint.scheme())]
    NotSpoken {
        /// The endpoint asked for.
        endpoint: Endpoint,
    },
    /// Port 0 lets the system choose where to listen; there is no connecting to it.
    #[error("{endpoint}: a device has no port 0; write the port that it listens on, 502 for most")]
    NoPort {
        /// The endpoint asked for.
        endpoint: Endpoint,
    },
    /// There is no tokio runtime to run the wire's task in.
    #[error("a wire is opened inside a tokio runtime, and there is none")]
    NoRuntime,
}

/// Why a wire is down, as one sentence that names the endpoint.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{endpoint}: {cause}")]
pub struct Outage {
    /// The other end of the wire.
    pub endpoint: Arc<Endpoint>,
    /// What happened.
    pub cause: Cause,
}

/// What takes a wire down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Cause {
    /// The host is there, but nothing listens on the port.
    #[error("connection refused: check the port, and that the device is on and takes Modbus connections")]
    Refused,
    /// No way to the host.
    #[error("the host cannot be reached: check cable, address and network settings")]
    Unreachable,
    /// The host's name means nothing.
    #[error("the host name is not known: check its spelling, or use the address")]
    UnknownHost,
    /// Nobody answered the attempt to connect.
    #[error("nobody answered within {after:?}: check the address, and that the device is on")]
    ConnectTimedOut {
        /// How long it was tried.
        after: Duration,
    },
    /// The connection was not there yet when the request's time was up.
    #[error("not connected within {after:?}: check the address, and that the device is on")]
    StillConnecting {
        /// The time-out of the request.
        after: Duration,
    },
    /// The peer ended the connection in good order.
    #[error("the peer closed the connection: it may take fewer connections than are open")]
    Closed,
    /// The peer tore the connection down, or something between did.
    #[error("the connection was reset: the peer restarted, or something between cut it")]
    Reset,
    /// Several requests in a row had no answer.
    #[error("{requests} requests in a row had no answer: check that the device is on")]
    Silent {
        /// How many.
        requests: u32,
    },
    /// The peer does not even take the bytes of a request.
    #[error("the peer takes no more bytes: check that the device is on")]
    Stuck,
    /// Bytes came that are no Modbus TCP, and there is no telling where the next frame starts.
    #[error("the peer sent bytes that are no Modbus TCP: check that the port is the right one")]
    Garbage,
    /// A serial device cannot be opened or set.
    #[error("{0}")]
    Serial(SerialError),
    /// A serial device that was in use is gone. It is opened again when it is back.
    #[error(
        "the serial device is gone: check that the adapter is plugged in; it is opened again when it is back"
    )]
    Vanished,
    /// Anything else the operating system says.
    #[error("{}", io_sentence(*kind, *code))]
    Io {
        /// The class of error.
        kind: io::ErrorKind,
        /// The system's own number for it.
        code: Option<i32>,
    },
}

/// What the operating system said, sorted.
impl From<&io::Error> for Cause {
    fn from(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::ConnectionRefused => Self::Refused,
            io::ErrorKind::HostUnreachable | io::ErrorKind::NetworkUnreachable => Self::Unreachable,
            io::ErrorKind::ConnectionReset | io::ErrorKind::ConnectionAborted | io::ErrorKind::BrokenPipe => {
                Self::Reset
            }
            kind => Self::Io { kind, code: error.raw_os_error() },
        }
    }
}

fn times(tries: u8) -> String {
    match tries {
        1 => "once".to_owned(),
        tries => format!("{tries} times"),
    }
}

pub(crate) fn io_sentence(kind: io::ErrorKind, code: Option<i32>) -> String {
    match code {
        Some(code) => io::Error::from_raw_os_error(code).to_string(),
        None => kind.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outage(cause: Cause) -> Outage {
        Outage { endpoint: Arc::new("tcp://10.0.0.7".parse().unwrap()), cause }
    }

    #[test]
    fn says_what_where_and_what_to_do() {
        for (error, fault, sentence) in [
            (
                LinkError::Exception { unit: 1, function: 3, code: ExceptionCode(2) },
                Fault::Device,
                "unit 1 answered function 3 with exception 2 (illegal data address)",
            ),
            (
                LinkError::Timeout {
                    unit: 7,
                    after: Duration::from_millis(1500),
                    tries: 2,
                    heard: Heard::Nothing { serial: false },
                },
                Fault::Wire,
                "unit 7 did not answer within 1.5s, asked 2 times: check the unit id and that the device is on",
            ),
            (
                LinkError::Silent { unit: 7, next_probe: Duration::from_millis(3500) },
                Fault::Wire,
                "unit 7 has not answered lately and is polled again in 3.5s: check the unit id and that the device is on",
            ),
            (
                LinkError::Timeout {
                    unit: 7,
                    after: Duration::from_millis(300),
                    tries: 1,
                    heard: Heard::Noise { bytes: 5 },
                },
                Fault::Wire,
                "unit 7 did not answer within 300ms, asked once: 5 bytes came that make no frame; check baud rate and parity, the terminators, and that no two devices have one unit id",
            ),
            (
                LinkError::NeverSilent { unit: 7, after: Duration::from_secs(1) },
                Fault::Wire,
                "nothing was sent to unit 7, for the line was not silent within 1s; check that no other client asks on this line, baud rate and parity, and the terminators",
            ),
            (
                LinkError::Down { reason: outage(Cause::Refused) },
                Fault::Wire,
                "tcp://10.0.0.7:502: connection refused: check the port, and that the device is on and takes Modbus connections",
            ),
            (
                LinkError::Down { reason: outage(Cause::Garbage) },
                Fault::Peer,
                "tcp://10.0.0.7:502: the peer sent bytes that are no Modbus TCP: check that the port is the right one",
            ),
            (
                LinkError::Lost {
                    unit: 1,
                    loss: Loss::TimedOut { after: Duration::from_secs(1), heard: Heard::BadCrc },
                },
                Fault::Wire,
                "the answer to a write to unit 1 was lost (none within 1s: a frame came with a wrong check sum; check baud rate and parity, the terminators, and that no two devices have one unit id); it may have taken effect: read the state before anything else",
            ),
            (
                LinkError::NotARead { function: 6 },
                Fault::Caller,
                "function 6 does not read registers: use 3 (holding) or 4 (input)",
            ),
        ] {
            assert_eq!(error.to_string(), sentence);
            assert_eq!(error.fault(), fault, "{sentence}");
        }
    }

    #[test]
    fn tells_which_writes_may_have_taken_effect() {
        let exception =
            |function, code| LinkError::Exception { unit: 1, function, code: ExceptionCode(code) };
        for code in 0..=255 {
            let nothing_done = [1, 2, 3, 6, 10].contains(&code);
            assert_eq!(exception(6, code).may_have_taken_effect(), !nothing_done, "exception {code}");
            assert!(!exception(3, code).may_have_taken_effect(), "a read changes nothing");
        }
        let heard = Heard::Nothing { serial: false };
        let loss = Loss::TimedOut { after: Duration::from_secs(1), heard };
        let lost = LinkError::Lost { unit: 1, loss };
        assert!(lost.may_have_taken_effect());
        for error in [
            LinkError::Down { reason: outage(Cause::Refused) },
            LinkError::QueueFull { waiting: 64 },
            LinkError::NeverSilent { unit: 1, after: Duration::from_secs(1) },
            LinkError::NotSent(StartError::Busy),
            LinkError::Closed,
        ] {
            assert!(!error.may_have_taken_effect(), "{error}");
        }
    }

    #[test]
    fn sorts_what_the_system_says() {
        for (kind, cause) in [
            (io::ErrorKind::ConnectionRefused, Cause::Refused),
            (io::ErrorKind::NetworkUnreachable, Cause::Unreachable),
            (io::ErrorKind::BrokenPipe, Cause::Reset),
            (
                io::ErrorKind::AddrNotAvailable,
                Cause::Io { kind: io::ErrorKind::AddrNotAvailable, code: None },
            ),
        ] {
            assert_eq!(Cause::from(&io::Error::from(kind)), cause);
        }
        let full = Cause::from(&io::Error::from_raw_os_error(24));
        assert!(full.to_string().contains("os error 24"), "{full}");
    }
}
