//! The gateway as its users run it, a process of its own, and what the system says of it.

use std::error::Error;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::Deserialize;
use tokio::task::AbortHandle;
use tokio::time::sleep;

use super::Failure;
use super::stream::Body;
use crate::process::{Process, resident};

pub(super) struct Gateway {
    process: Process,
    pub(super) address: SocketAddr,
    /// The most memory since this was last asked, in bytes.
    most: Arc<AtomicU64>,
    watch: AbortHandle,
}

/// What `busbar run --json` prints.
#[derive(Deserialize)]
struct Served {
    page: String,
}

/// A wire of `/api/v1/wires`.
#[derive(Deserialize)]
struct Wire {
    statistics: Statistics,
}

/// What went wrong on wires.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Statistics {
    pub(super) timeouts: u64,
    pub(super) retries: u64,
    pub(super) reconnects: u64,
}

impl Gateway {
    /// Starts the `busbar` that was built with this bench.
    pub(super) fn start(site: &Path) -> Result<Self, Failure> {
        let mut command = Command::new(std::env::current_exe()?.with_file_name("busbar"));
        command.args(["run", "--json", "--listen", "127.0.0.1:0", "--config"]).arg(site);
        let mut process = Process::start(command.env("BUSBAR_LOG", "warn")).map_err(told)?;
        let served: Served = serde_json::from_str(&process.line().map_err(told)?)?;
        let address = served.page.trim_start_matches("http://").trim_end_matches('/').parse()?;
        let most = Arc::new(AtomicU64::new(0));
        let watch = tokio::spawn(watch(process.id(), Arc::clone(&most))).abort_handle();
        Ok(Self { process, address, most, watch })
    }

    pub(super) fn processor_time(&self) -> Result<Duration, Failure> {
        self.process.processor_time().map_err(told)
    }

    /// MiB of memory, the most of each second since this was last asked.
    pub(super) fn memory(&self) -> Result<f64, Failure> {
        let now = self.process.resident().map_err(told)?;
        Ok(self.most.swap(0, Ordering::Relaxed).max(now) as f64 / 1_048_576.0)
    }

    /// What went wrong on all wires together.
    pub(super) async fn statistics(&self) -> Result<Statistics, Failure> {
        let wires = Body::of(self.address, "/api/v1/wires").await?.whole().await?;
        let wires: Vec<Wire> = serde_json::from_slice(&wires)?;
        Ok(wires.into_iter().fold(Statistics::default(), |all, Wire { statistics }| Statistics {
            timeouts: all.timeouts + statistics.timeouts,
            retries: all.retries + statistics.retries,
            reconnects: all.reconnects + statistics.reconnects,
        }))
    }
}

impl Drop for Gateway {
    fn drop(&mut self) {
        self.watch.abort();
    }
}

/// An error that may go from task to task.
fn told(error: Box<dyn Error>) -> Failure {
    error.to_string().into()
}

async fn watch(process: u32, most: Arc<AtomicU64>) {
    loop {
        match resident(process) {
            Ok(now) => most.fetch_max(now, Ordering::Relaxed),
            Err(_) => return,
        };
        sleep(Duration::from_secs(1)).await;
    }
}
