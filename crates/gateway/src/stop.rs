//! The end of the gateway, announced to every task.

use tokio::sync::watch;

/// Makes the two halves: what announces the end, and what waits for it.
pub(crate) fn channel() -> (Announcer, Stop) {
    let (announce, wait) = watch::channel(false);
    (Announcer(announce), Stop(wait))
}

/// Announces the end; dropped, it announces it too.
#[derive(Debug)]
pub(crate) struct Announcer(watch::Sender<bool>);

impl Announcer {
    pub(crate) fn announce(&self) {
        self.0.send_replace(true);
    }
}

/// Waits for the end.
#[derive(Debug, Clone)]
pub(crate) struct Stop(watch::Receiver<bool>);

impl Stop {
    /// Returns once the end is announced, at once if it was before.
    pub(crate) async fn requested(&mut self) {
        // An error means that the announcer is gone, and so is the gateway.
        let _ = self.0.wait_for(|stop| *stop).await;
    }
}
