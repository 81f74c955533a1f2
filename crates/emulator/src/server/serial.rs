//! A serial line on a real device or a pseudo-terminal: bytes and time for a [`Line`], which decides everything.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_link::{Endpoint, LineTimer, Serial, SerialPort};
use busbar_modbus::stream::Frame;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{sleep, timeout};

use super::WRITE_PATIENCE;
use super::door::Door;
use super::line::Line;
#[cfg(target_os = "linux")]
use super::pty::Pty;

/// How often a device that went away, such as a USB adapter, is looked for.
const RETRY: Duration = Duration::from_secs(1);

/// What a line ends in on this side.
#[derive(Debug)]
pub(super) enum Port {
    Device(SerialPort),
    #[cfg(target_os = "linux")]
    Pseudo(Pty),
}

impl Port {
    fn line(&self, serial: &Serial) -> Line {
        match self {
            // Somebody else's pseudo-terminal, as socat makes them, has no hardware either.
            Self::Device(port) if port.is_pseudo_terminal() => Line::imitated(serial),
            Self::Device(_) => Line::real(serial),
            #[cfg(target_os = "linux")]
            Self::Pseudo(_) => Line::imitated(serial),
        }
    }

    async fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = match self {
            Self::Device(port) => port.read(buffer).await?,
            #[cfg(target_os = "linux")]
            Self::Pseudo(pty) => pty.read(buffer).await?,
        };
        match count {
            0 => Err(io::ErrorKind::UnexpectedEof.into()),
            _ => Ok(count),
        }
    }

    async fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            Self::Device(port) => timeout(WRITE_PATIENCE, port.write_all(bytes)).await?,
            #[cfg(target_os = "linux")]
            Self::Pseudo(pty) => {
                pty.write(bytes);
                Ok(())
            }
        }
    }
}

/// Serves one line until it is dropped, and again when its device is back.
pub(super) async fn serve(mut port: Port, mut timer: LineTimer, serial: Serial, door: Arc<Door>) {
    loop {
        let Err(error) = attend(&mut port, &mut timer, &serial, &door).await;
        tracing::warn!(%error, endpoint = %door.endpoint, "an imitated controller lost its serial device");
        port = match port {
            Port::Device(gone) => {
                // A device that is held open does not come back.
                drop(gone);
                reopen(&door.endpoint, &serial).await
            }
            #[cfg(target_os = "linux")]
            Port::Pseudo(pty) => {
                sleep(RETRY).await;
                Port::Pseudo(pty)
            }
        };
    }
}

async fn reopen(endpoint: &Endpoint, serial: &Serial) -> Port {
    loop {
        sleep(RETRY).await;
        if let Endpoint::Rtu { path, .. } = endpoint
            && let Ok(port) = SerialPort::open(path, serial)
        {
            tracing::info!(%endpoint, "the serial device is back");
            return Port::Device(port);
        }
    }
}

async fn attend(
    port: &mut Port,
    timer: &mut LineTimer,
    serial: &Serial,
    door: &Door,
) -> io::Result<std::convert::Infallible> {
    let start = Instant::now();
    let mut line = port.line(serial);
    let mut told = Told::default();
    let mut buffer = [0; 512];
    let mut out = Vec::new();
    loop {
        let now = start.elapsed();
        while let Some(arrival) = line.next_request(now) {
            out.clear();
            let frame = Frame { transaction: 0, unit: arrival.unit, pdu: &arrival.pdu };
            if let Some(outcome) = door.answer(&frame, &mut out) {
                if !out.is_empty() {
                    line.answer(&arrival, &out, outcome.delay);
                }
                if outcome.restarting {
                    door.announce_restarts();
                }
            }
        }
        out.clear();
        line.transmit(now, &mut out);
        if !out.is_empty() {
            port.write(&out).await?;
        }
        told.tell(&line, door);

        let deadline = line.deadline().map(|at| start + at);
        tokio::select! {
            biased;
            count = port.read(&mut buffer) => {
                line.receive(start.elapsed(), buffer.get(..count?).unwrap_or_default());
            }
            () = async {
                match deadline {
                    Some(deadline) => timer.until(deadline).await,
                    None => std::future::pending().await,
                }
            } => {}
        }
    }
}

/// What of a line's counts stands in the statistics already.
#[derive(Default)]
struct Told {
    collisions: u64,
    garbage: u64,
}

impl Told {
    fn tell(&mut self, line: &Line, door: &Door) {
        let (collisions, garbage) = (line.collisions(), line.garbage());
        if (collisions, garbage) != (self.collisions, self.garbage) {
            let mut statistics = door.statistics();
            statistics.collisions += collisions - self.collisions;
            statistics.garbage += garbage - self.garbage;
            *self = Self { collisions, garbage };
        }
    }
}
