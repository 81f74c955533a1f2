//! The service manager that started us, where it is systemd or speaks like it: told when the gateway is ready, how its
//! devices fare, and that it lives.

use std::time::Duration;

use busbar_gateway::Tally;

/// Who is told; nobody where nobody listens.
#[derive(Default)]
pub(crate) struct Manager {
    told: String,
}

impl Manager {
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

    /// Gives a sign of life, unless the gateway hangs.
    pub(crate) fn lives(&self, hangs: bool) {
        if hangs {
            tracing::error!("the gateway hangs, so the service manager is not told that it lives");
        } else {
            wire::send(wire::Message::Alive);
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
    fn how_the_devices_fare_is_one_line() {
        let mut tally = Tally::default();
        assert_eq!(status(tally), "0 of 0 devices answer, no fault");
        (tally.devices, tally.answering, tally.faults) = (4, 3, 1);
        assert_eq!(status(tally), "3 of 4 devices answer, 1 fault");
        tally.faults = 2;
        assert_eq!(status(tally), "3 of 4 devices answer, 2 faults");
    }
}
