//! A controller on a real TCP socket that does as it is told, right or wrong. Written out of the standard by hand,
//! so that it shares no mistake with the code under test.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;

/// How the device behaves from now on.
#[derive(Debug, Default)]
pub(crate) struct Behaviour {
    /// Registers that are not 0.
    pub(crate) registers: BTreeMap<u16, u16>,
    /// Says nothing at all.
    pub(crate) silent: bool,
    /// Units that are not there.
    pub(crate) absent: Vec<u8>,
    /// Says nothing to a read of any of these.
    pub(crate) mute: Option<RangeInclusive<u16>>,
    /// Answers every read with this exception.
    pub(crate) exception: Option<u8>,
    /// Answers a read of anything else with exception 2: it is of this profile.
    pub(crate) family: Option<&'static str>,
    /// Answers each read after so long.
    pub(crate) delay: Duration,
    /// Connections so far, and those that are open.
    pub(crate) connections: usize,
    pub(crate) open: usize,
    /// Answers a read of any of these with exception 2.
    pub(crate) unknown: Option<RangeInclusive<u16>>,
    /// Cuts every answer to so many registers.
    pub(crate) cut: Option<u16>,
    /// Answers with its right answer under the wrong unit, transaction, function and length first.
    pub(crate) wrong: bool,
    /// Sends bytes that are no frame and hangs up.
    pub(crate) garbage: bool,
    /// Hangs up after the next answer, once.
    pub(crate) hang_up: bool,
    /// Hangs up after each so many answers.
    pub(crate) answers: Option<usize>,
    /// Every read so far: when it came, and to which unit.
    pub(crate) times: Vec<(Instant, u8)>,
    /// Every read so far: address and count.
    pub(crate) reads: Vec<(u16, u16)>,
}

/// The controller. It ends when it is dropped, connections included.
pub(crate) struct Imitation {
    address: SocketAddr,
    behaviour: Arc<Mutex<Behaviour>>,
    task: Option<JoinHandle<()>>,
}

impl Imitation {
    pub(crate) async fn start() -> Self {
        let device = Self::at(SocketAddr::from(([127, 0, 0, 1], 0))).await;
        device.change(|device| {
            device.registers.extend([(10_246, 2302), (10_605, 4), (10_609, 0xD500), (10_341, 2_640)]);
        });
        device
    }

    /// On a port that something else must know beforehand.
    pub(crate) async fn at(address: SocketAddr) -> Self {
        Self::with(address, |_| {}).await
    }

    /// The same, prepared before it is first asked.
    pub(crate) async fn with(address: SocketAddr, prepare: impl FnOnce(&mut Behaviour)) -> Self {
        let listener = TcpListener::bind(address).await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut behaviour = Behaviour::default();
        prepare(&mut behaviour);
        let behaviour = Arc::new(Mutex::new(behaviour));
        let task = tokio::spawn(serve(listener, Arc::clone(&behaviour)));
        Self { address, behaviour, task: Some(task) }
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Behaviour) -> T) -> T {
        change(&mut self.behaviour.lock().unwrap())
    }

    /// Pulls the plug; the port is free afterwards.
    pub(crate) async fn stop(&mut self) {
        let task = self.task.take().unwrap();
        task.abort();
        let _ = task.await;
    }
}

impl Drop for Imitation {
    fn drop(&mut self) {
        if let Some(task) = &self.task {
            task.abort();
        }
    }
}

async fn serve(listener: TcpListener, behaviour: Arc<Mutex<Behaviour>>) {
    let mut connections = tokio::task::JoinSet::new();
    loop {
        let (stream, _) = listener.accept().await.unwrap();
        let behaviour = Arc::clone(&behaviour);
        {
            let mut behaviour = behaviour.lock().unwrap();
            behaviour.connections += 1;
            behaviour.open += 1;
        }
        connections.spawn(async move {
            connection(stream, Arc::clone(&behaviour)).await;
            behaviour.lock().unwrap().open -= 1;
        });
    }
}

async fn connection(mut stream: TcpStream, behaviour: Arc<Mutex<Behaviour>>) {
    let mut request = [0; 12];
    while stream.read_exact(&mut request).await.is_ok() {
        let out = answer(&mut behaviour.lock().unwrap(), &request);
        let Some(out) = out else { continue };
        let delay = behaviour.lock().unwrap().delay;
        if !delay.is_zero() {
            tokio::time::sleep(delay).await;
        }
        if stream.write_all(&out).await.is_err() {
            return;
        }
        let mut behaviour = behaviour.lock().unwrap();
        if std::mem::take(&mut behaviour.hang_up)
            || behaviour.garbage
            || behaviour.answers.is_some_and(|answers| behaviour.reads.len().is_multiple_of(answers))
        {
            return;
        }
    }
}

/// The bytes that go back; none when the device is silent.
fn answer(device: &mut Behaviour, request: &[u8; 12]) -> Option<Vec<u8>> {
    let address = u16::from_be_bytes([request[8], request[9]]);
    let count = u16::from_be_bytes([request[10], request[11]]);
    assert_eq!((&request[2..6], request[7]), (&[0, 0, 0, 6][..], 3), "only reads are expected");
    assert!(count <= 125, "a read of {count}");
    device.reads.push((address, count));
    device.times.push((Instant::now(), request[6]));
    if device.silent || device.absent.contains(&request[6]) {
        return None;
    }
    if device.garbage {
        return Some(b"HTTP/1.1 400 Bad Request\r\n\r\n".to_vec());
    }
    let touches = |other: &Option<RangeInclusive<u16>>| {
        other.as_ref().is_some_and(|other| *other.start() < address + count && address <= *other.end())
    };
    if touches(&device.mute) {
        return None;
    }
    let foreign = device
        .family
        .is_some_and(|family| !busbar_profile::builtin(family).unwrap().wire.is_readable(address, count));
    let unknown = foreign || touches(&device.unknown);
    if let Some(code) = device.exception.or(unknown.then_some(2)) {
        return Some(frame(request, request[6], &[0x83, code]));
    }
    let sent = count.min(device.cut.unwrap_or(125));
    let mut pdu = vec![3, (sent * 2) as u8];
    for register in address..address + sent {
        pdu.extend(device.registers.get(&register).copied().unwrap_or(0).to_be_bytes());
    }
    let mut out = Vec::new();
    if device.wrong {
        // All carry 0xEEEE where the right answer has its registers.
        let lie = |pdu: &[u8]| {
            pdu.iter().enumerate().map(|(i, b)| if i < 2 { *b } else { 0xEE }).collect::<Vec<_>>()
        };
        let mut other = *request;
        other[1] = request[1].wrapping_sub(1);
        out.extend(frame(&other, request[6], &lie(&pdu)));
        out.extend(frame(request, request[6] + 1, &lie(&pdu)));
        let mut function = lie(&pdu);
        function[0] = 4;
        out.extend(frame(request, request[6], &function));
        let mut length = lie(&pdu);
        length.extend([0xEE; 4]);
        length[1] += 4;
        out.extend(frame(request, request[6], &length));
    }
    out.extend(frame(request, request[6], &pdu));
    Some(out)
}

/// An MBAP frame that answers `request`.
fn frame(request: &[u8; 12], unit: u8, pdu: &[u8]) -> Vec<u8> {
    let mut frame = vec![request[0], request[1], 0, 0];
    frame.extend((pdu.len() as u16 + 1).to_be_bytes());
    frame.push(unit);
    frame.extend(pdu);
    frame
}
