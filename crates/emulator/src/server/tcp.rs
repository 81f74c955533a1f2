//! TCP listeners: Modbus TCP, and RTU frames as a converter passes them on.

use std::pin::pin;
use std::sync::Arc;

use busbar_modbus::server::DEFAULT_QUIET;
use busbar_modbus::{Framing, ServerDecoder};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, timeout};

use super::WRITE_PATIENCE;
use super::door::{Door, Outcome, dropped};
use crate::device::STEP;

/// Bytes of one read: more than 150 requests of a client that does not wait for answers.
const READ_BYTES: usize = 2048;

/// Serves one listener until it is dropped.
pub(super) async fn accept(listener: TcpListener, door: Arc<Door>) {
    // Kept, so that a door without an owner waits for a restart that never comes.
    let silent = watch::Sender::new(());
    let mut restarts = door.owner().map_or(&silent, |owner| &owner.restarts).subscribe();
    let mut connections = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) => admit(stream, &door, &mut connections),
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

fn admit(stream: TcpStream, door: &Arc<Door>, connections: &mut JoinSet<()>) {
    let place = Arc::clone(&door.places).try_acquire_owned();
    let restarting = door.owner().is_some_and(|owner| owner.lock().is_silent());
    match place {
        Ok(place) if !restarting => {
            door.statistics().connections += 1;
            connections.spawn(serve(stream, Arc::clone(door), place));
        }
        _ => {
            door.statistics().turned_away += 1;
            // A reset, not a farewell: nobody is there to talk to.
            let _ = stream.set_zero_linger();
        }
    }
}

/// One connection: one read and one write for each exchange.
async fn serve(mut stream: TcpStream, door: Arc<Door>, _place: OwnedSemaphorePermit) {
    let _ = stream.set_nodelay(true);
    let mut conversation = Conversation::new(&door);
    let mut buffer = [0; READ_BYTES];
    // Checked once an idle period instead of being set anew with every request.
    let mut check = pin!(sleep(door.idle));
    let mut heard = false;
    loop {
        let outcome = tokio::select! {
            biased;
            read = stream.read(&mut buffer) => match read {
                Ok(count) if count > 0 => {
                    heard = true;
                    conversation.hear(buffer.get(..count).unwrap_or_default())
                }
                _ => return,
            },
            () = sleep(DEFAULT_QUIET), if conversation.is_waiting() => conversation.fall_silent(),
            () = &mut check => {
                if !heard {
                    return;
                }
                heard = false;
                check.as_mut().reset(Instant::now() + door.idle);
                continue;
            }
        };
        if !outcome.delay.is_zero() {
            sleep(outcome.delay).await;
        }
        let answer = &conversation.out;
        let sent = answer.is_empty()
            || matches!(timeout(WRITE_PATIENCE, stream.write_all(answer)).await, Ok(Ok(())));
        if outcome.restarting {
            door.announce_restarts();
        }
        let dropped_by_restart = outcome.restarting && door.owner().is_some();
        if dropped_by_restart || outcome.hangs_up || !sent || conversation.decoder.fault().is_some() {
            return;
        }
    }
}

/// What is said on one connection.
struct Conversation<'a> {
    door: &'a Door,
    decoder: ServerDecoder,
    garbage: u64,
    /// The answers to what came last.
    out: Vec<u8>,
}

impl<'a> Conversation<'a> {
    fn new(door: &'a Door) -> Self {
        Self { door, decoder: ServerDecoder::new(door.framing()), garbage: 0, out: Vec::with_capacity(512) }
    }

    fn hear(&mut self, bytes: &[u8]) -> Outcome {
        if let Some(owner) = self.door.owner() {
            owner.lock().count_packet();
        }
        self.decoder.push(bytes);
        self.exchange()
    }

    /// Whether there is half a frame that silence would end.
    fn is_waiting(&self) -> bool {
        self.door.framing() == Framing::Rtu && self.decoder.is_waiting()
    }

    fn fall_silent(&mut self) -> Outcome {
        self.decoder.silence();
        self.exchange()
    }

    /// Answers everything that is there, in turn.
    fn exchange(&mut self) -> Outcome {
        self.out.clear();
        let mut outcome = Outcome::default();
        while let Some(Ok(frame)) = self.decoder.next_frame() {
            outcome = outcome.and(self.door.answer(&frame, &mut self.out).unwrap_or_default());
        }
        let garbage = dropped(self.decoder.losses());
        if garbage > self.garbage {
            self.door.statistics().garbage += garbage - self.garbage;
            self.garbage = garbage;
        }
        outcome
    }
}
