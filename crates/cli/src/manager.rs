//! The service manager that started us, where it is systemd or speaks like it: told when the gateway is ready, how its
//! devices fare, and that it lives.

use std::time::{Duration, Instant};

use busbar_gateway::Tally;

/// The gateway's heart beats each second; a machine that is busy for longer than this is as bad as a gateway that hangs.
const PATIENCE: Duration = Duration::from_secs(5);

/// Who is told; nobody where nobody listens.
pub(crate) struct Manager {
    told: String,
    pulse: Pulse,
}

impl Manager {
    pub(crate) fn new() -> Self {
        Self { told: String::new(), pulse: Pulse { beats: 0, felt: Instant::now() } }
    }

    /// The gateway listens, or goes on with another site file or with the one before.
    pub(crate) fn ready(&self) {
        wire::send(wire::Message::Ready);
    }

    /// The site file is being read again.
    pub(crate) fn reloading(&self) {
        wire::send(wire::Message::Reloading);
    }

    /// The gateway ends.
    pub(crate) fn stopping(&self) {
        wire::send(wire::Message::Stopping);
    }

    /// How the devices fare, when that is news.
    pub(crate) fn status(&mut self, tally: Tally) {
        let status = status(tally);
        if self.told != status {
            wire::send(wire::Message::Status(&status));
            self.told = status;
        }
    }

    /// How often it wants a sign of life; none where it wants none.
    pub(crate) fn beat(&self) -> Option<Duration> {
        // Half of what it waits for, so that one that comes late is not the end.
        wire::watchdog().map(|patience| (patience / 2).max(Duration::from_millis(1)))
    }

    /// Gives a sign of life, if there was one: when the gateway last had a heartbeat.
    pub(crate) fn lives(&mut self, heartbeat: u64) {
        match self.pulse.is_felt(heartbeat, Instant::now()) {
            true => wire::send(wire::Message::Alive),
            false => tracing::error!(
                "the gateway hangs: its values no longer age, and the service manager is not told that it lives"
            ),
        }
    }
}

fn status(Tally { devices, answering, faults, .. }: Tally) -> String {
    let faults = match faults {
        0 => "no fault".to_owned(),
        1 => "1 fault".to_owned(),
        faults => format!("{faults} faults"),
    };
    format!("{answering} of {devices} devices answer, {faults}")
}

/// A count that goes up while the gateway lives.
struct Pulse {
    beats: u64,
    /// When it last went up.
    felt: Instant,
}

impl Pulse {
    fn is_felt(&mut self, beats: u64, now: Instant) -> bool {
        if beats != self.beats {
            (self.beats, self.felt) = (beats, now);
        }
        now.saturating_duration_since(self.felt) <= PATIENCE
    }
}

#[cfg(unix)]
mod wire {
    use std::{io, time::Duration};

    use sd_notify::NotifyState;

    pub(super) enum Message<'a> {
        Ready,
        Reloading,
        Stopping,
        Status(&'a str),
        Alive,
    }

    /// Says it to the socket in `NOTIFY_SOCKET`. Nothing ends because nobody hears it.
    pub(super) fn send(message: Message<'_>) {
        if let Err(error) = say(message) {
            tracing::debug!(%error, "the service manager does not listen");
        }
    }

    fn say(message: Message<'_>) -> io::Result<()> {
        match message {
            Message::Ready => sd_notify::notify(&[NotifyState::Ready]),
            // Type=notify-reload wants to know when, to tell this reload from the one before.
            Message::Reloading => {
                sd_notify::notify(&[NotifyState::Reloading, NotifyState::monotonic_usec_now()?])
            }
            Message::Stopping => sd_notify::notify(&[NotifyState::Stopping]),
            Message::Status(line) => sd_notify::notify(&[NotifyState::Status(line)]),
            Message::Alive => sd_notify::notify(&[NotifyState::Watchdog]),
        }
    }

    pub(super) fn watchdog() -> Option<Duration> {
        sd_notify::watchdog_enabled()
    }
}

#[cfg(not(unix))]
mod wire {
    use std::time::Duration;

    pub(super) enum Message<'a> {
        Ready,
        Reloading,
        Stopping,
        Status(&'a str),
        Alive,
    }

    pub(super) fn send(_: Message<'_>) {}

    pub(super) fn watchdog() -> Option<Duration> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gateway_that_hangs_gives_no_sign_of_life() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        let mut pulse = Pulse { beats: 0, felt: start };
        for (beats, second, lives) in [
            (0, 0, true),
            (0, 5, true),
            (0, 6, false),
            (1, 7, true),
            (1, 12, true),
            (1, 13, false),
            (9, 14, true),
        ] {
            assert_eq!(pulse.is_felt(beats, after(second)), lives, "{beats} beats after {second} s");
        }
    }
}
