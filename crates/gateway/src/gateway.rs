//! Starts a site and ends it in good order.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use busbar_link::OpenError;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval, timeout};

use crate::events;
use crate::hub::Hub;
use crate::running::{Running, Unopened};
use crate::server::{self, Limits};
use crate::site::Site;
use crate::stop::{self, Announcer};
use crate::table::Tally;

/// How often values are looked at for their age.
const AGEING: Duration = Duration::from_secs(1);

/// What the caller decides, not the site file.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Where to listen, in place of what the site file says.
    pub listen: Option<SocketAddr>,
    /// What clients may ask of the server; none: what suits this process.
    pub limits: Option<Limits>,
    /// What is served beside the API and the page.
    pub beside: Vec<Beside>,
}

/// Something that is served beside the API and the page, and that the gateway knows nothing of but where it is.
#[derive(Debug, Clone)]
pub struct Beside {
    /// The folder that it is served below, such as `imitation`; none of the gateway's own, `api` and `assets`.
    pub folder: String,
    /// What the page calls the link to it.
    pub name: String,
    /// Its routes, which see addresses without the folder. Hosts and connections are guarded as the gateway's own.
    pub routes: Router,
}

/// Why a gateway did not start. Nothing of it runs then.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StartError {
    /// Something listens there already, perhaps another gateway. The caller chooses another port.
    #[error("{address} is in use by another program: stop it, or listen elsewhere")]
    AddressInUse {
        /// The address asked for.
        address: SocketAddr,
    },
    /// This machine does not have that address, or ports below 1024 are not for this user.
    #[error("cannot listen on {address}: {reason}")]
    Listen {
        /// The address asked for.
        address: SocketAddr,
        /// The class of the system's error.
        kind: io::ErrorKind,
        /// Why not and what to do, or the system's own words.
        reason: String,
    },
    /// A wire that this build cannot speak.
    #[error("wire {wire}: {source}")]
    Wire {
        /// Id of the wire.
        wire: String,
        /// Why not.
        source: OpenError,
    },
}

/// A running gateway. Dropped, it ends at once; [`Self::shutdown`] ends it in good order.
#[derive(Debug)]
pub struct Gateway {
    address: SocketAddr,
    /// Where the site file said to listen when it started.
    asked: SocketAddr,
    stop: Announcer,
    tasks: JoinSet<()>,
    hub: Arc<Hub>,
    running: Running,
}

/// Starts the gateway of a site: opens its wires, polls its devices, and serves the API and the page.
///
/// A device or host that cannot be reached does not keep it from starting; the API shows the fault.
///
/// # Errors
///
/// The address cannot be listened on, or a wire is of a kind that this build does not speak.
pub async fn start(site: Site, options: Options) -> Result<Gateway, StartError> {
    let listener = listen(options.listen.unwrap_or(site.listen)).await?;
    let address = listener.local_addr().map_err(|error| refused(site.listen, &error))?;
    let mut running = Running::default().next(&site)?;
    warn(&site);

    let (stop, stopped) = stop::channel();
    let hub = Hub::new(running.table(&site), stopped).beside(&options.beside);
    let hub = Arc::new(hub);
    let mut tasks = JoinSet::new();
    running.poll(Running::default(), &hub, &mut tasks);
    tasks.spawn(age(Arc::clone(&hub)));
    tasks.spawn(events::beat(Arc::clone(&hub)));
    let service = server::Service { listener, address, limits: options.limits, beside: options.beside };
    tasks.spawn(server::serve(service, Arc::clone(&hub)));
    tracing::info!(%address, devices = site.devices.len(), "gateway started");
    Ok(Gateway { address, asked: site.listen, stop, tasks, hub, running })
}

impl Gateway {
    /// Where it listens; with the port that the system chose when port 0 was asked for.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// How the devices fare.
    pub fn tally(&self) -> Tally {
        self.hub.table().tally()
    }

    /// When the age of every value was last looked at, in milliseconds since the start: each second, and it stands
    /// still when that, or any device, hangs.
    pub fn heartbeat(&self) -> u64 {
        self.hub.health().last_beat()
    }

    /// Goes on with another site file. A wire that it did not change stays open, a device that it did not change keeps
    /// its values. Where the gateway listens stays as it is until it is started anew.
    ///
    /// # Errors
    ///
    /// [`StartError::Wire`]; the site before goes on as it was.
    pub fn reload(&mut self, site: Site) -> Result<(), StartError> {
        let mut next = self.running.next(&site)?;
        warn(&site);
        if site.listen != self.asked {
            tracing::warn!(
                "the site file says to listen on {}, which takes a restart; the gateway goes on at {}",
                site.listen,
                self.address
            );
        }
        self.hub.exchange(next.table(&site));
        let before = std::mem::take(&mut self.running);
        next.poll(before, &self.hub, &mut self.tasks);
        self.running = next;
        while self.tasks.try_join_next().is_some() {}
        tracing::info!(devices = site.devices.len(), "the site file was read again");
        Ok(())
    }

    /// Tells everybody that a newer site file was refused, and why; the one before it goes on.
    pub fn refuse(&self, reason: impl Into<String>) {
        self.hub.refuse(reason.into());
    }

    /// Ends polling, tells every reader of the event stream, and returns when nothing of the gateway runs any more.
    pub async fn shutdown(mut self) {
        self.stop.announce();
        self.running = Running::default();
        let ended = async { while self.tasks.join_next().await.is_some() {} };
        if timeout(server::FAREWELL + Duration::from_secs(1), ended).await.is_err() {
            tracing::warn!("some tasks did not end in time and were cut off");
        }
        self.tasks.shutdown().await;
    }
}

fn warn(site: &Site) {
    for warning in &site.warnings {
        tracing::warn!("{warning}");
    }
}

impl From<Unopened> for StartError {
    fn from(Unopened { wire, source }: Unopened) -> Self {
        Self::Wire { wire, source }
    }
}

async fn listen(address: SocketAddr) -> Result<TcpListener, StartError> {
    TcpListener::bind(address).await.map_err(|error| refused(address, &error))
}

fn refused(address: SocketAddr, error: &io::Error) -> StartError {
    match error.kind() {
        io::ErrorKind::AddrInUse => StartError::AddressInUse { address },
        kind => {
            let reason = match kind {
                io::ErrorKind::PermissionDenied => {
                    "this user may not use that port; choose one above 1023".to_owned()
                }
                io::ErrorKind::AddrNotAvailable => {
                    "this machine does not have that address; write one of its own, or 0.0.0.0 for all of them"
                        .to_owned()
                }
                _ => error.to_string(),
            };
            StartError::Listen { address, kind, reason }
        }
    }
}

/// Looks at the age of every value.
async fn age(hub: Arc<Hub>) {
    let mut stop = hub.stop();
    let mut ticks = interval(AGEING);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = stop.requested() => return,
            _ = ticks.tick() => hub.expire(),
        }
    }
}
