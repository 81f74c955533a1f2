//! Sockets and a clock for a device; everything that decides anything is in [`Device`].

use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use busbar_link::Endpoint;
use busbar_modbus::pdu::EXCEPTION_BIT;
use busbar_modbus::stream::Frame;
use busbar_modbus::{ExceptionCode, Framing, Losses, Request, Response, ServerDecoder, mbap};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, lookup_host};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout};

use crate::MAX_SPEED;
use crate::config::Config;
use crate::device::{Device, STEP};
use crate::error::StartError;

/// A clock that was held up (a sleeping laptop, a debugger) does not make up for more than this.
const MOST_LAPSE: Duration = Duration::from_secs(2);
/// A client that takes no answers for so long is dropped.
const WRITE_PATIENCE: Duration = Duration::from_secs(10);
/// Far enough away to be never, near enough for a clock to hold.
const LONGEST_IDLE: Duration = Duration::from_secs(365 * 86_400);
/// Bytes of one read: more than 150 requests of a client that does not wait for answers.
const READ_BYTES: usize = 2048;

/// Starts an imitated controller: binds every endpoint or none.
///
/// # Errors
/// The configuration is not possible, or an endpoint cannot be listened on.
pub async fn start(config: Config) -> Result<Emulation, StartError> {
    if !(config.speed > 0.0 && config.speed <= MAX_SPEED) {
        return Err(StartError::Speed { speed: config.speed.to_string() });
    }
    let device = Device::new(&config)?;
    if config.listen.is_empty() {
        return Err(StartError::NoEndpoint);
    }
    let mut urls = Vec::new();
    let mut listeners = Vec::new();
    for endpoint in &config.listen {
        let (url, listener) = bind(endpoint).await?;
        urls.push(url);
        listeners.push(listener);
    }

    let shared = Arc::new(Shared {
        inner: Mutex::new(Inner { device, statistics: Statistics::default() }),
        places: Arc::new(Semaphore::new(config.connections.min(Semaphore::MAX_PERMITS))),
        restarts: watch::Sender::new(()),
        idle: config.idle.min(LONGEST_IDLE),
    });
    let mut tasks = JoinSet::new();
    tasks.spawn(tick(Arc::clone(&shared), config.speed));
    for listener in listeners {
        tasks.spawn(accept(listener, Arc::clone(&shared)));
    }
    Ok(Emulation { urls, shared, tasks })
}

/// A running imitation; dropping it ends it.
#[derive(Debug)]
pub struct Emulation {
    urls: Vec<Endpoint>,
    shared: Arc<Shared>,
    tasks: JoinSet<()>,
}

impl Emulation {
    /// The endpoints listened on, in the order of the configuration, with the ports that the system chose.
    pub fn urls(&self) -> &[Endpoint] {
        &self.urls
    }

    /// What has happened on its wires so far.
    pub fn statistics(&self) -> Statistics {
        self.shared.lock().statistics
    }

    /// Drops every connection and frees the ports.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
    }
}

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
}

#[derive(Debug)]
struct Shared {
    inner: Mutex<Inner>,
    places: Arc<Semaphore>,
    /// Tells when the device restarts, which drops every connection.
    restarts: watch::Sender<()>,
    idle: Duration,
}

#[derive(Debug)]
struct Inner {
    device: Device,
    statistics: Statistics,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        // A panel that panicked would have been caught half-way; registers are still registers.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers everything that has come in; true when the device restarts because of it.
    fn exchange(&self, decoder: &mut ServerDecoder, before: &mut Losses, out: &mut Vec<u8>) -> bool {
        let mut inner = self.lock();
        let Inner { device, statistics } = &mut *inner;
        device.count_packet();
        while let Some(Ok(frame)) = decoder.next_frame() {
            match request(frame.pdu) {
                Some(request) => {
                    statistics.requests += 1;
                    statistics.answers += u64::from(answer(device, &frame, &request, out));
                }
                None => statistics.garbage += 1,
            }
        }
        let losses = *decoder.losses();
        statistics.garbage += dropped(&losses) - dropped(before);
        *before = losses;
        device.is_silent()
    }
}

/// What a client asks; function 0 is none, and gets the answer of any other that a device does not have.
fn request(pdu: &[u8]) -> Option<Request<'_>> {
    match pdu {
        [0, data @ ..] => Some(Request::Other { function: 0, data }),
        _ => Request::decode(pdu).ok(),
    }
}

/// Appends the answer to one frame; false where there is none.
fn answer(device: &mut Device, frame: &Frame<'_>, request: &Request<'_>, out: &mut Vec<u8>) -> bool {
    let (transaction, unit) = (frame.transaction, frame.unit);
    match device.answer(unit, request) {
        // No encoder writes function 0: it is no function.
        Some(Response::Exception { function: 0, code: ExceptionCode(code) }) => {
            let [high, low] = transaction.to_be_bytes();
            out.extend_from_slice(&[high, low, 0, 0, 0, 3, unit, EXCEPTION_BIT, code]);
            true
        }
        Some(response) => mbap::encode_response(transaction, unit, &response, out).is_ok(),
        None => false,
    }
}

fn dropped(losses: &Losses) -> u64 {
    losses.garbage_bytes + losses.crc_errors + losses.wrong_protocol
}

async fn bind(endpoint: &Endpoint) -> Result<(Endpoint, TcpListener), StartError> {
    let Endpoint::Tcp { host, port } = endpoint else {
        return Err(StartError::Transport { endpoint: endpoint.clone() });
    };
    let failed = |kind| StartError::Listen { endpoint: endpoint.clone(), kind };
    let addresses: Vec<_> = match lookup_host((host.as_str(), *port)).await {
        Ok(addresses) => addresses.collect(),
        Err(_) => return Err(StartError::UnknownHost { endpoint: endpoint.clone() }),
    };
    let listener = TcpListener::bind(addresses.as_slice()).await.map_err(|error| failed(error.kind()))?;
    let local = listener.local_addr().map_err(|error| failed(error.kind()))?;
    Ok((Endpoint::Tcp { host: local.ip().to_string(), port: local.port() }, listener))
}

/// The clock of the plant.
async fn tick(shared: Arc<Shared>, speed: f64) {
    let mut interval = interval(STEP);
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut simulated = Duration::ZERO;
    let mut last = Instant::now();
    loop {
        interval.tick().await;
        let now = Instant::now();
        simulated += now.duration_since(last).min(MOST_LAPSE).mul_f64(speed);
        last = now;
        shared.lock().device.advance(simulated);
    }
}

async fn accept(listener: TcpListener, shared: Arc<Shared>) {
    let mut restarts = shared.restarts.subscribe();
    let mut connections = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => admit(stream, &shared, &mut connections),
                // Out of descriptors: others will be closed before long.
                Err(error) => {
                    tracing::warn!(%error, "an imitated controller could not accept a connection");
                    sleep(STEP).await;
                }
            },
            Ok(()) = restarts.changed() => connections.abort_all(),
            Some(_) = connections.join_next() => {}
        }
    }
}

fn admit(stream: TcpStream, shared: &Arc<Shared>, connections: &mut JoinSet<()>) {
    let place = Arc::clone(&shared.places).try_acquire_owned();
    let mut inner = shared.lock();
    match place {
        Ok(place) if !inner.device.is_silent() => {
            inner.statistics.connections += 1;
            connections.spawn(serve(stream, Arc::clone(shared), place));
        }
        _ => {
            inner.statistics.turned_away += 1;
            // A reset, not a farewell: nobody is there to talk to.
            let _ = stream.set_zero_linger();
        }
    }
}

/// One connection: one read and one write for each exchange.
async fn serve(mut stream: TcpStream, shared: Arc<Shared>, _place: OwnedSemaphorePermit) {
    let _ = stream.set_nodelay(true);
    let mut decoder = ServerDecoder::new(Framing::Tcp);
    let mut losses = *decoder.losses();
    let mut buffer = [0; READ_BYTES];
    let mut out = Vec::with_capacity(512);
    // Checked once an idle period instead of being set anew with every request.
    let mut check = pin!(sleep(shared.idle));
    let mut heard = false;
    loop {
        let count = tokio::select! {
            biased;
            read = stream.read(&mut buffer) => match read {
                Ok(count) if count > 0 => count,
                _ => return,
            },
            () = &mut check => {
                if !heard {
                    return;
                }
                heard = false;
                check.as_mut().reset(Instant::now() + shared.idle);
                continue;
            }
        };
        heard = true;
        decoder.push(&buffer[..count]);
        out.clear();
        let restarting = shared.exchange(&mut decoder, &mut losses, &mut out);
        let sent =
            out.is_empty() || matches!(timeout(WRITE_PATIENCE, stream.write_all(&out)).await, Ok(Ok(())));
        if restarting {
            shared.restarts.send_replace(());
        }
        if restarting || !sent || decoder.fault().is_some() {
            return;
        }
    }
}
