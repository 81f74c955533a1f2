//! Sockets, lines and a clock for devices; everything that decides anything is in [`Device`] and in `line`.

mod bind;
mod clock;
mod controller;
mod door;
mod group;
mod line;
mod pty;
mod serial;
mod shared;
mod tcp;

#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Duration;

use busbar_link::Endpoint;
use tokio::sync::Semaphore;
use tokio::task::{JoinSet, yield_now};
use tokio::time::{Instant, MissedTickBehavior, interval};

use crate::config::Config;
use crate::device::{Device, STEP};
use crate::error::StartError;
use crate::fleet::{Fleet, Joint};
pub(crate) use bind::NEW_PTY;
use bind::Socket;
use clock::Clock;
pub use clock::{Pace, SpeedError};
pub use controller::Controller;
pub use door::Statistics;
use door::{Door, Served};
use group::{Group, groups};

/// A plant that is faster than the machine gets so much of the machine's time each tick.
const MOST_WORK: Duration = Duration::from_millis(40);
/// A client that takes no answers for so long is dropped.
const WRITE_PATIENCE: Duration = Duration::from_secs(10);
/// Far enough away to be never, near enough for a clock to hold.
const LONGEST_IDLE: Duration = Duration::from_secs(365 * 86_400);

/// Starts an imitated controller: binds every endpoint or none.
///
/// # Errors
/// The configuration is not possible, or an endpoint cannot be listened on.
pub async fn start(config: Config) -> Result<Emulation, StartError> {
    start_together(vec![config], Vec::new()).await
}

/// Starts several imitated controllers that share endpoints, as units of one serial line or behind one converter:
/// binds every endpoint or none.
///
/// Each answers to its own unit id on all of `listen`, and alone on the endpoints of its own configuration. On
/// `listen` the strictest of the limits on connections holds.
///
/// # Errors
/// As [`start`]; and two controllers have the same unit id.
pub async fn start_together(configs: Vec<Config>, listen: Vec<Endpoint>) -> Result<Emulation, StartError> {
    let everybody: Vec<usize> = (0..configs.len()).collect();
    let wires: Vec<_> = listen.into_iter().map(|endpoint| (endpoint, everybody.clone())).collect();
    let devices = devices(&configs, &wires)?;
    serve(&configs, devices, &wires, &[]).await
}

/// Starts the controllers of a fleet on their wires, with their plants joined: binds every wire or none.
///
/// # Errors
/// As [`start_together`]; and a controller's levers are not as the fleet wants them.
pub async fn start_fleet(fleet: Fleet) -> Result<Emulation, StartError> {
    let mut wires: Vec<Wire> = fleet.wires.into_iter().map(|endpoint| (endpoint, Vec::new())).collect();
    for (index, member) in fleet.members.iter().enumerate() {
        if let Some((_, members)) = wires.get_mut(member.wire) {
            members.push(index);
        }
    }
    let (configs, levers): (Vec<_>, Vec<_>) =
        fleet.members.into_iter().map(|member| (member.config, member.levers)).unzip();
    let mut devices = devices(&configs, &wires)?;
    for (device, levers) in devices.iter_mut().zip(levers) {
        for (lever, position) in levers {
            device.pull(&lever, &position)?;
        }
    }
    serve(&configs, devices, &wires, &fleet.joints).await
}

/// A wire that controllers share: where it is, and their indices.
type Wire = (Endpoint, Vec<usize>);

fn devices(configs: &[Config], wires: &[Wire]) -> Result<Vec<Device>, StartError> {
    if configs.is_empty() {
        return Err(StartError::NoController);
    }
    let mut devices = Vec::new();
    for (index, config) in configs.iter().enumerate() {
        Pace::check(config.speed)?;
        if config.listen.is_empty() && !wires.iter().any(|(_, members)| members.contains(&index)) {
            return Err(StartError::NoEndpoint);
        }
        devices.push(Device::new(config)?);
    }
    Ok(devices)
}

async fn serve(
    configs: &[Config],
    devices: Vec<Device>,
    wires: &[Wire],
    joints: &[Joint],
) -> Result<Emulation, StartError> {
    let served: Vec<_> = devices
        .into_iter()
        .map(|device| (device.unit(), device.profile(), Arc::new(Served::new(device))))
        .collect();
    let rooms = rooms(configs, wires);
    for room in &rooms {
        room.check(&served)?;
    }
    let mut sockets = Vec::new();
    for room in rooms {
        sockets.push((Socket::bind(room.endpoint).await?, room));
    }

    let mut tasks = JoinSet::new();
    let mut controllers = controllers(configs, &served, joints, &mut tasks);
    let (mut urls, mut doors) = (Vec::new(), Vec::new());
    for ((url, socket), room) in sockets {
        for index in &room.members {
            if let Some(controller) = controllers.get_mut(*index) {
                controller.endpoints.push(url.clone());
            }
        }
        let devices = room.members(&served).map(|(unit, _, device)| (*unit, Arc::clone(device))).collect();
        let faults = room.members.iter().find_map(|index| configs.get(*index)?.faults.as_ref());
        let door = Arc::new(Door::new(url.clone(), devices, room.places, room.idle, faults));
        socket.open(Arc::clone(&door), &mut tasks);
        urls.push(url);
        doors.push(door);
    }
    Ok(Emulation { urls, controllers, doors, tasks })
}

/// A hold on each controller, whose clocks run from now on; those whose plants are joined have one together, which runs as
/// the first of them is to.
fn controllers(
    configs: &[Config],
    served: &[Member],
    joints: &[Joint],
    tasks: &mut JoinSet<()>,
) -> Vec<Controller> {
    let mut controllers = Vec::new();
    for members in groups(served.len(), joints) {
        let devices: Vec<_> = members.iter().map(|index| Arc::clone(&served[*index].2)).collect();
        let joints = joints.iter().filter_map(|joint| joint.within(&members)).collect();
        let group = Arc::new(Group::new(Clock::new(configs[members[0]].speed), devices, joints));
        tasks.spawn(tick(Arc::clone(&group)));
        for index in members {
            let served = Arc::clone(&served[index].2);
            let controller = Controller { served, group: Arc::clone(&group), endpoints: Vec::new() };
            controllers.push((index, controller));
        }
    }
    controllers.sort_by_key(|(index, _)| *index);
    controllers.into_iter().map(|(_, controller)| controller).collect()
}

/// A running imitation; dropping it ends it.
#[derive(Debug)]
pub struct Emulation {
    urls: Vec<Endpoint>,
    controllers: Vec<Controller>,
    doors: Vec<Arc<Door>>,
    tasks: JoinSet<()>,
}

impl Emulation {
    /// The endpoints listened on, with the ports and pseudo-terminals that the system chose: the shared ones first,
    /// then those of each configuration, in their order.
    pub fn urls(&self) -> &[Endpoint] {
        &self.urls
    }

    /// Its controllers, in the order of the configurations.
    pub fn controllers(&self) -> &[Controller] {
        &self.controllers
    }

    /// What has happened on all its endpoints so far.
    pub fn statistics(&self) -> Statistics {
        let mut all = Statistics::default();
        for door in &self.doors {
            all += *door.statistics();
        }
        all
    }

    /// What has happened on each of its endpoints so far, in the order of [`urls`](Self::urls).
    pub fn statistics_by_endpoint(&self) -> impl Iterator<Item = (&Endpoint, Statistics)> {
        self.doors.iter().map(|door| (&door.endpoint, *door.statistics()))
    }

    /// Drops every connection and frees the ports.
    pub async fn stop(mut self) {
        self.tasks.shutdown().await;
    }
}

type Member = (u8, &'static busbar_profile::Profile, Arc<Served>);

/// An endpoint to be, and who is to answer there.
struct Room<'a> {
    endpoint: &'a Endpoint,
    /// Indices of the devices that are reached.
    members: Vec<usize>,
    places: Arc<Semaphore>,
    idle: Duration,
}

fn rooms<'a>(configs: &'a [Config], wires: &'a [Wire]) -> Vec<Room<'a>> {
    let places = |connections: usize| Arc::new(Semaphore::new(connections.min(Semaphore::MAX_PERMITS)));
    let mut rooms = Vec::new();
    for (endpoint, members) in wires {
        let reached = || members.iter().filter_map(|index| configs.get(*index));
        let connections = reached().map(|config| config.connections).min().unwrap_or_default();
        let idle = reached().map(|config| config.idle).min().unwrap_or_default().min(LONGEST_IDLE);
        rooms.push(Room { endpoint, members: members.clone(), places: places(connections), idle });
    }
    for (index, config) in configs.iter().enumerate() {
        let places = places(config.connections);
        rooms.extend(config.listen.iter().map(|endpoint| Room {
            endpoint,
            members: vec![index],
            places: Arc::clone(&places),
            idle: config.idle.min(LONGEST_IDLE),
        }));
    }
    rooms
}

impl Room<'_> {
    fn members<'m>(&self, served: &'m [Member]) -> impl Iterator<Item = &'m Member> {
        self.members.iter().filter_map(|index| served.get(*index))
    }

    /// Whether these controllers can be on one wire, and on this one.
    fn check(&self, served: &[Member]) -> Result<(), StartError> {
        let mut taken = [false; 256];
        for (unit, profile, _) in self.members(served) {
            if std::mem::replace(&mut taken[usize::from(*unit)], true) {
                return Err(StartError::SameUnit { unit: *unit, endpoint: self.endpoint.clone() });
            }
            let Endpoint::Rtu { serial, .. } = self.endpoint else { continue };
            let has = &profile.wire.serial;
            let parity = has.parity.iter().any(|parity| parity.as_str() == serial.parity.to_string());
            let stop = has.stop.iter().any(|stop| stop.to_string() == serial.stop.to_string());
            if !has.baud.contains(&serial.baud) || !parity || !stop {
                return Err(StartError::LineSettings {
                    endpoint: self.endpoint.clone(),
                    key: profile.key.clone(),
                    has: Box::new(has.clone()),
                });
            }
        }
        Ok(())
    }
}

/// Lets the clock of a group run, at most as fast as leaves room for whoever reads its registers.
async fn tick(group: Arc<Group>) {
    let mut interval = interval(STEP);
    interval.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut last = Instant::now();
    loop {
        interval.tick().await;
        let now = Instant::now();
        let mut due = group.clock().due(now.duration_since(last));
        last = now;
        while !due.is_zero() && now.elapsed() < MOST_WORK {
            let stride = due.min(group.stride());
            group.live(|clock| clock.run(stride));
            due -= stride;
            yield_now().await;
        }
    }
}
