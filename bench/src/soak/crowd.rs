//! Many readers of the event stream: most follow one device each, the others ask for the whole site and never read.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::net::TcpStream;
use tokio::task::JoinSet;

use super::Failure;
use super::stream::{Events, ask};

/// One in so many never reads.
const MUTE: usize = 10;

pub(super) struct Crowd {
    reading: JoinSet<Result<(), Failure>>,
    mute: Vec<TcpStream>,
    /// By reader: rounds that it was told of.
    told: Vec<Arc<AtomicU64>>,
}

impl Crowd {
    pub(super) async fn gather(address: SocketAddr, readers: usize, devices: usize) -> Result<Self, Failure> {
        let mut crowd = Self { reading: JoinSet::new(), mute: Vec::new(), told: Vec::new() };
        for reader in 0..readers {
            if reader.is_multiple_of(MUTE) {
                crowd.mute.push(ask(address, "/api/v1/events").await?);
                continue;
            }
            let events = Events::open(address, &format!("?device=d{}", reader % devices)).await?;
            let told = Arc::new(AtomicU64::new(0));
            crowd.told.push(Arc::clone(&told));
            crowd.reading.spawn(read(events, told));
        }
        Ok(crowd)
    }

    pub(super) fn mute(&self) -> usize {
        self.mute.len()
    }

    /// The fewest rounds that any of those who read was told of.
    pub(super) fn fewest(&self) -> u64 {
        self.told.iter().map(|told| told.load(Ordering::Relaxed)).min().unwrap_or_default()
    }

    /// Readers whose stream ended.
    pub(super) fn lost(&mut self) -> usize {
        std::iter::from_fn(|| self.reading.try_join_next()).count()
    }
}

async fn read(mut events: Events, told: Arc<AtomicU64>) -> Result<(), Failure> {
    loop {
        let event = events.next().await?;
        told.fetch_add(u64::from(event.name == "values"), Ordering::Relaxed);
    }
}
