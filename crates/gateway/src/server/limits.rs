//! How much the server takes on, and how long it waits for a client.

use std::time::Duration;

/// What one client, and all of them together, may ask of the server.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Connections at a time. At this bound the one that has been idle longest makes room for the next; where none is
    /// idle, one of the client that has by far the most.
    pub connections: usize,
    /// Readers of the event stream among them. At this bound the client that has the most gives a place to one that has
    /// fewer.
    pub streams: usize,
    /// KiB of answers that are ready and wait for their readers, all together.
    pub waiting_kib: usize,
    /// A client has this long to send the head of a request, and a connection may be idle for as long.
    pub head: Duration,
    /// A reader that takes nothing for so long is gone, whatever its connection says.
    pub write: Duration,
}

impl Limits {
    const MOST: Self = Self {
        connections: 4_096,
        streams: 2_048,
        waiting_kib: 64 * 1_024,
        head: Duration::from_secs(10),
        write: Duration::from_secs(60),
    };

    /// Those of a process that may have so many files open, and needs some of them for its wires.
    pub(crate) fn with_handles(handles: usize, wires: usize) -> Self {
        // A wire that reconnects may hold two; the rest is for standard streams, the runtime and the log.
        let own = 64 + 2 * wires;
        let connections = handles.saturating_sub(own).clamp(16, Self::MOST.connections);
        Self { connections, streams: (connections / 2).min(Self::MOST.streams), ..Self::MOST }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::MOST
    }
}

/// How many files this process may have open, once it has asked for all that it may ask for.
#[cfg(unix)]
pub(crate) fn handles() -> usize {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    let raised = Rlimit { current: maximum, maximum };
    let now = match setrlimit(Resource::Nofile, raised) {
        Ok(()) => maximum,
        Err(error) => {
            tracing::debug!(%error, "cannot raise the number of open files");
            current
        }
    };
    now.map_or(usize::MAX, |most| usize::try_from(most).unwrap_or(usize::MAX))
}

/// Sockets are no files elsewhere, and are not counted like them.
#[cfg(not(unix))]
pub(crate) fn handles() -> usize {
    usize::MAX
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wires_always_find_a_handle() {
        let few = Limits::with_handles(1_024, 10);
        assert_eq!((few.connections, few.streams), (940, 470));
        let many = Limits::with_handles(20_000, 1_000);
        assert_eq!((many.connections, many.streams), (4_096, 2_048));
        let none = Limits::with_handles(20, 10);
        assert_eq!((none.connections, none.streams), (16, 8));
        assert!(handles() >= 256, "{}", handles());
    }
}
