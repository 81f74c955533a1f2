//! A slave on the far end of a pseudo-terminal: a thread that hears requests and does what the test says.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_link::{Backoff, Endpoint, Link, LinkError, Options, Serial, SerialPort, WireState};
use busbar_modbus::rtu;
use rustix::fs::OFlags;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

pub(crate) const UNIT: u8 = 1;
pub(crate) const ADDRESS: u16 = 0x2806;

/// Short enough for tests that wait for it, long enough for a slave on a busy machine.
pub(crate) const QUICK: Duration = Duration::from_millis(300);

/// The far end of a new pseudo-terminal.
pub(crate) struct Line {
    far: File,
    /// Open for as long as the far end, which would otherwise see an end whenever nobody has it open.
    _near: File,
    path: PathBuf,
}

impl Line {
    pub(crate) fn new() -> Self {
        let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&far).unwrap();
        unlockpt(&far).unwrap();
        let path = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
        // Opened once, it is raw, as a line is.
        drop(SerialPort::open(&path, &Serial::default()).unwrap());
        let near = File::options()
            .read(true)
            .write(true)
            .custom_flags(OFlags::NOCTTY.bits().cast_signed())
            .open(&path)
            .unwrap();
        Self { far: far.into(), _near: near, path: path.into() }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn endpoint(&self) -> Endpoint {
        endpoint(&self.path)
    }

    /// The next so many bytes, and when the last of them came.
    pub(crate) fn hear(&mut self, count: usize) -> (Vec<u8>, Instant) {
        let mut bytes = vec![0; count];
        self.far.read_exact(&mut bytes).unwrap();
        (bytes, Instant::now())
    }

    /// A request of 8 bytes.
    pub(crate) fn request(&mut self) -> Vec<u8> {
        self.hear(8).0
    }

    /// Sends bytes, and says when just before they left.
    pub(crate) fn say(&mut self, bytes: &[u8]) -> Instant {
        let at = Instant::now();
        self.far.write_all(bytes).unwrap();
        at
    }

    /// Runs a slave on this line beside the client. It hands the line back, for nothing may vanish early. The client ends
    /// first: it would look for its device again, and the system gives the same path to the next line.
    pub(crate) fn play(self, slave: impl FnOnce(&mut Self) + Send + 'static) -> JoinHandle<Self> {
        std::thread::spawn(move || {
            let mut line = self;
            slave(&mut line);
            line
        })
    }
}

pub(crate) fn endpoint(path: &Path) -> Endpoint {
    format!("rtu://{}?baud=9600", path.display()).parse().unwrap()
}

pub(crate) fn options() -> Options {
    Options {
        timeout: Duration::from_secs(30),
        backoff: Backoff { first: Duration::from_millis(5), max: Duration::from_millis(20) },
        ..Options::default()
    }
}

/// One try, and soon over.
pub(crate) fn quick() -> Options {
    Options { timeout: QUICK, retries: 0, ..options() }
}

/// A link whose wire is up: what is asked of it leaves, and does not spend its short time on connecting.
pub(crate) async fn connected(endpoint: Endpoint, options: Options) -> Link {
    let link = Link::open(endpoint, options).unwrap();
    wait_until(&link, |state| *state == WireState::Connected).await;
    link
}

pub(crate) fn frame(body: &[u8]) -> Vec<u8> {
    [body, &rtu::crc16(body).to_le_bytes()].concat()
}

/// An answer to a read that holds one register.
pub(crate) fn register(request: &[u8], value: u16) -> Vec<u8> {
    let [high, low] = value.to_be_bytes();
    frame(&[request[0], request[1], 2, high, low])
}

pub(crate) async fn read(link: &Link) -> Result<Vec<u16>, LinkError> {
    link.read_registers(UNIT, 3, ADDRESS, 1).await
}

pub(crate) async fn wait_until(link: &Link, wanted: impl Fn(&WireState) -> bool) -> WireState {
    let mut state = link.state();
    let reached = state.wait_for(|state| wanted(state));
    tokio::time::timeout(Duration::from_secs(30), reached).await.unwrap().unwrap().clone()
}
