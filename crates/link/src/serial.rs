//! A serial port: opened for us alone, set raw, and every way this fails has its own sentence.

use std::fs::File;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll};

use serial2_tokio::{CharSize, KeepSettings, Settings};
use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::endpoint::{Parity, Serial, StopBits};

/// A serial port that nobody else has open.
///
/// Eight data bits, no flow control, raw. It serves either side of a line. What is written leaves at the pace of the
/// line, after the write has returned.
#[derive(Debug)]
pub struct SerialPort {
    port: serial2_tokio::SerialPort,
    /// Dropped after the port, so that the next one finds it closed.
    claim: Claim,
}

impl SerialPort {
    /// Opens and sets a device, `/dev/ttyUSB0` or `COM3`, and throws away what it had received before.
    ///
    /// May block for some milliseconds, and needs a tokio runtime.
    ///
    /// # Errors
    /// Any [`SerialError`].
    pub fn open(path: &str, serial: &Serial) -> Result<Self, SerialError> {
        let claim = Claim::new(path)?;
        let port =
            serial2_tokio::SerialPort::open(path, KeepSettings).map_err(|error| SerialError::from(&error))?;
        // From here on it is dropped as a whole.
        let mut port = Self { port, claim };
        port.set(serial)?;
        port.claim.keep_others_out();
        port.port.discard_input_buffer().map_err(|error| SerialError::from(&error))?;
        Ok(port)
    }

    /// Whether it is the near end of a pseudo-terminal, which passes every byte on at once.
    pub fn is_pseudo_terminal(&self) -> bool {
        self.claim.is_pseudo()
    }

    /// One setting after the other, so that the one that is refused can be named.
    fn set(&mut self, serial: &Serial) -> Result<(), SerialError> {
        let port = &mut self.port;
        let mut settings = port.get_configuration().map_err(|error| SerialError::from(&error))?;
        settings.set_raw();
        settings.set_char_size(CharSize::Bits8);
        port.set_configuration(&settings).map_err(|error| SerialError::from(&error))?;
        self.claim.ignore_modem_lines().map_err(|error| SerialError::from(&error))?;

        let mut settings = port.get_configuration().map_err(|error| SerialError::from(&error))?;
        let mut apply = |refused: SerialError, change: &dyn Fn(&mut Settings) -> io::Result<()>| {
            let applied = change(&mut settings).and_then(|()| port.set_configuration(&settings));
            applied.map_err(|error| match SerialError::from_gone(&error) {
                Some(gone) => gone,
                None => refused,
            })
        };
        apply(SerialError::Baud { baud: serial.baud }, &|settings| settings.set_baud_rate(serial.baud))?;
        apply(SerialError::Parity { parity: serial.parity }, &|settings| {
            settings.set_parity(match serial.parity {
                Parity::None => serial2_tokio::Parity::None,
                Parity::Even => serial2_tokio::Parity::Even,
                Parity::Odd => serial2_tokio::Parity::Odd,
            });
            Ok(())
        })?;
        apply(SerialError::Stop { stop: serial.stop }, &|settings| {
            settings.set_stop_bits(match serial.stop {
                StopBits::One => serial2_tokio::StopBits::One,
                StopBits::Two => serial2_tokio::StopBits::Two,
            });
            Ok(())
        })?;
        if serial.rs485 {
            direction_by_kernel(port)?;
        }
        Ok(())
    }
}

/// Closing a port waits until everything has left, which a dead line may never let happen: what has not is dropped.
impl Drop for SerialPort {
    fn drop(&mut self) {
        let _ = self.port.discard_buffers();
        self.claim.let_others_in();
    }
}

impl AsyncRead for SerialPort {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        space: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.port).poll_read(cx, space)
    }
}

impl AsyncWrite for SerialPort {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.port).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.port).poll_flush(cx)
    }

    /// A line has no end to announce.
    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

/// Why a serial device cannot be used, and what to do. It does not name the device: who reports it puts the endpoint
/// in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SerialError {
    /// There is no such device.
    #[error(
        "there is no such device: check that the adapter is plugged in and that the path is right, `ls /dev/serial/by-id` lists the adapters"
    )]
    Missing,
    /// The device is there, and its driver says that the hardware is not.
    #[error("the device does not answer its driver: unplug the adapter and plug it in again")]
    Gone,
    /// This user may not open it.
    #[error(
        "this user may not use the device: add the user to its group, with `sudo usermod -aG dialout USER` on most systems, and log in anew"
    )]
    NotAllowed,
    /// Somebody else has it open.
    #[error(
        "another program has the device open: close it, a serial line has one client (`sudo fuser -v DEVICE` names the program)"
    )]
    Busy,
    /// The path leads to something else.
    #[error("this is not a serial device: check the path, `ls /dev/serial/by-id` lists the adapters")]
    NotSerial,
    /// The driver does not have the baud rate.
    #[error("the device does not take {baud} baud: use a rate that both the adapter and the controller have")]
    Baud {
        /// Bits a second.
        baud: u32,
    },
    /// The driver does not have the parity.
    #[error("the device does not take parity {parity}: use another parity or another adapter")]
    Parity {
        /// The parity.
        parity: Parity,
    },
    /// The driver does not have the number of stop bits.
    #[error("the device does not take {stop} stop bits: use another number or another adapter")]
    Stop {
        /// The stop bits.
        stop: StopBits,
    },
    /// The driver does not switch the direction of an RS-485 line.
    #[error(
        "the driver of this device does not switch an RS-485 line: leave rs485=on out, most adapters switch by themselves"
    )]
    NoRs485,
    /// Anything else the operating system says.
    #[error("{}", crate::error::io_sentence(*kind, *code))]
    Io {
        /// The class of error.
        kind: io::ErrorKind,
        /// The system's own number for it.
        code: Option<i32>,
    },
}

impl SerialError {
    /// What the system says when the hardware was pulled out.
    fn from_gone(error: &io::Error) -> Option<Self> {
        matches!(error.raw_os_error(), Some(EIO | ENXIO | ENODEV)).then_some(Self::Gone)
    }
}

// One set of numbers on every Unix; Windows has others, and they fall to `Io` there.
const EIO: i32 = 5;
const ENXIO: i32 = 6;
const EBUSY: i32 = 16;
const ENODEV: i32 = 19;
const EISDIR: i32 = 21;
const ENOTTY: i32 = 25;

/// What the operating system said, sorted.
impl From<&io::Error> for SerialError {
    fn from(error: &io::Error) -> Self {
        match (error.raw_os_error(), error.kind()) {
            (_, io::ErrorKind::NotFound) => Self::Missing,
            (_, io::ErrorKind::PermissionDenied) => Self::NotAllowed,
            (Some(EBUSY), _) => Self::Busy,
            (Some(ENOTTY | EISDIR), _) => Self::NotSerial,
            (code, kind) => Self::from_gone(error).unwrap_or(Self::Io { kind, code }),
        }
    }
}

/// Lets the kernel drive RTS around each frame, where the driver can.
#[cfg(target_os = "linux")]
fn direction_by_kernel(port: &serial2_tokio::SerialPort) -> Result<(), SerialError> {
    let mode = serial2_tokio::rs4xx::Rs485Config::new();
    port.set_rs4xx_mode(mode).map_err(|error| SerialError::from_gone(&error).unwrap_or(SerialError::NoRs485))
}

#[cfg(not(target_os = "linux"))]
fn direction_by_kernel(_: &serial2_tokio::SerialPort) -> Result<(), SerialError> {
    Err(SerialError::NoRs485)
}

/// Holds a device against other programs.
///
/// The lock keeps out whoever asks for it, as most serial programs do; the kernel's exclusive mode keeps out the rest,
/// root excepted.
#[cfg(unix)]
#[derive(Debug)]
struct Claim {
    file: File,
    pseudo: bool,
}

#[cfg(unix)]
impl Claim {
    fn new(path: &str) -> Result<Self, SerialError> {
        use std::fs::TryLockError;
        use std::os::unix::fs::{FileTypeExt, MetadataExt, OpenOptionsExt};

        use rustix::fs::OFlags;

        let metadata = std::fs::metadata(path).map_err(|error| SerialError::from(&error))?;
        if !metadata.file_type().is_char_device() {
            return Err(SerialError::NotSerial);
        }
        // Without the first, a line without carrier would hold us here; without the second it could become our
        // terminal and its hang-up end us.
        let flags = (OFlags::NONBLOCK | OFlags::NOCTTY).bits();
        let file = File::options()
            .read(true)
            .write(true)
            .custom_flags(flags.cast_signed())
            .open(path)
            .map_err(|error| SerialError::from(&error))?;
        if !rustix::termios::isatty(&file) {
            return Err(SerialError::NotSerial);
        }
        match file.try_lock() {
            Ok(()) => Ok(Self { file, pseudo: is_pseudo(metadata.rdev()) }),
            Err(TryLockError::WouldBlock) => Err(SerialError::Busy),
            Err(TryLockError::Error(error)) => Err(SerialError::from(&error)),
        }
    }

    fn is_pseudo(&self) -> bool {
        self.pseudo
    }

    /// Carrier detect and the like are often not wired and float.
    fn ignore_modem_lines(&self) -> io::Result<()> {
        use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};

        let mut termios = tcgetattr(&self.file)?;
        termios.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
        Ok(tcsetattr(&self.file, OptionalActions::Now, &termios)?)
    }

    /// A pseudo-terminal would stay exclusive after a crash, for as long as its other end is open.
    fn keep_others_out(&self) {
        if !self.pseudo {
            // A driver that cannot do this still has the lock.
            let _ = rustix::termios::ioctl_tiocexcl(&self.file);
        }
    }

    fn let_others_in(&self) {
        if !self.pseudo {
            let _ = rustix::termios::ioctl_tiocnxcl(&self.file);
        }
    }
}

/// Whether a device is the near end of a Linux pseudo-terminal; elsewhere no harm is known.
#[cfg(unix)]
fn is_pseudo(device: u64) -> bool {
    const PSEUDO: std::ops::RangeInclusive<u32> = 136..=143;
    cfg!(target_os = "linux") && PSEUDO.contains(&rustix::fs::major(device))
}

/// Elsewhere the system opens serial ports for one program only.
#[cfg(not(unix))]
#[derive(Debug)]
struct Claim;

#[cfg(not(unix))]
impl Claim {
    fn new(_: &str) -> Result<Self, SerialError> {
        Ok(Self)
    }

    fn is_pseudo(&self) -> bool {
        false
    }

    fn ignore_modem_lines(&self) -> io::Result<()> {
        Ok(())
    }

    fn keep_others_out(&self) {}

    fn let_others_in(&self) {}
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn error(path: &str) -> SerialError {
        SerialPort::open(path, &Serial::default()).unwrap_err()
    }

    #[test]
    fn says_what_a_path_is_not() {
        assert_eq!(error("/dev/busbar-has-no-such-device"), SerialError::Missing);
        assert_eq!(error("/dev/null"), SerialError::NotSerial);
        assert_eq!(error("/dev"), SerialError::NotSerial);
        let file = std::env::temp_dir().join(format!("busbar-serial-{}", std::process::id()));
        fs::write(&file, "").unwrap();
        assert_eq!(error(file.to_str().unwrap()), SerialError::NotSerial);
        fs::remove_file(&file).unwrap();
    }

    #[test]
    fn sorts_what_the_system_says() {
        for (code, expected) in [
            (2, SerialError::Missing),
            (5, SerialError::Gone),
            (6, SerialError::Gone),
            (13, SerialError::NotAllowed),
            (16, SerialError::Busy),
            (19, SerialError::Gone),
            (25, SerialError::NotSerial),
        ] {
            assert_eq!(SerialError::from(&io::Error::from_raw_os_error(code)), expected, "{code}");
        }
        let full = SerialError::from(&io::Error::from_raw_os_error(24));
        assert!(full.to_string().contains("os error 24"), "{full}");
    }

    /// A new pseudo-terminal: its far end, and the path of its near end.
    #[cfg(target_os = "linux")]
    fn pseudo_terminal() -> (File, String) {
        use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&far).unwrap();
        unlockpt(&far).unwrap();
        let path = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
        (far.into(), path)
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn carries_every_byte_both_ways_and_nothing_from_before() {
        use std::io::{Read, Write};

        use tokio::io::{AsyncReadExt, AsyncWriteExt};

        let (mut far, path) = pseudo_terminal();
        // A new terminal echoes what it gets; this one is raw from here on.
        drop(SerialPort::open(&path, &Serial::default()).unwrap());
        far.write_all(b"from before").unwrap();
        let mut port = SerialPort::open(&path, &Serial::default()).unwrap();

        let every: Vec<u8> = (0..=255).collect();
        let mut received = vec![0; every.len()];
        port.write_all(&every).await.unwrap();
        far.read_exact(&mut received).unwrap();
        assert_eq!(received, every);

        received.fill(0);
        far.write_all(&every).unwrap();
        port.read_exact(&mut received).await.unwrap();
        assert_eq!(received, every);
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn a_device_is_ours_alone_until_it_is_closed() {
        let (_far, path) = pseudo_terminal();
        let port = SerialPort::open(&path, &Serial::default()).unwrap();
        assert_eq!(error(&path), SerialError::Busy);
        drop(port);
        SerialPort::open(&path, &Serial::default()).unwrap();
    }

    #[cfg(target_os = "linux")]
    #[tokio::test]
    async fn names_the_setting_that_is_refused() {
        let (_far, path) = pseudo_terminal();
        let even = Serial { parity: Parity::Even, ..Serial::default() };
        let refused = SerialPort::open(&path, &even).unwrap_err();
        assert_eq!(refused, SerialError::Parity { parity: Parity::Even });
        assert!(refused.to_string().contains("does not take parity even:"), "{refused}");

        let switched = Serial { rs485: true, ..Serial::default() };
        assert_eq!(SerialPort::open(&path, &switched).unwrap_err(), SerialError::NoRs485);

        let others = Serial { baud: 19_200, stop: StopBits::Two, ..Serial::default() };
        SerialPort::open(&path, &others).unwrap();
    }
}
