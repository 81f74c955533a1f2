//! The connections that are open: which of them do something, and which one makes room when there are too many.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use tokio::task::{AbortHandle, Id};
use tokio::time::Instant;

use super::streams::Peer;

/// Who has more than one in so many of all connections has more than its share.
const SHARE: usize = 4;

/// So long a connection may say nothing before it makes room: a request takes its time on a slow line.
const GRACE: Duration = Duration::from_secs(2);

/// What one connection does. Its task writes it, the server reads it.
#[derive(Debug)]
pub(crate) struct Activity {
    origin: Instant,
    peer: Peer,
    /// Requests that are being answered.
    answering: AtomicUsize,
    /// When the client last took something or asked for something, in microseconds after the origin.
    since: AtomicU64,
}

impl Activity {
    pub(crate) fn new(origin: Instant, peer: Peer) -> Self {
        let activity = Self { origin, peer, answering: AtomicUsize::new(0), since: AtomicU64::new(0) };
        activity.mark();
        activity
    }

    /// Who is at the other end.
    pub(crate) fn peer(&self) -> Peer {
        self.peer
    }

    /// The client took something.
    pub(crate) fn mark(&self) {
        let micros = u64::try_from(self.origin.elapsed().as_micros()).unwrap_or(u64::MAX);
        self.since.store(micros, Ordering::Relaxed);
    }

    /// A request has come; it is answered when the guard is dropped.
    pub(crate) fn answering(self: &Arc<Self>) -> Answering {
        self.answering.fetch_add(1, Ordering::Relaxed);
        self.mark();
        Answering(Arc::clone(self))
    }

    /// Whether no request is being answered.
    fn is_idle(&self) -> bool {
        self.answering.load(Ordering::Relaxed) == 0
    }

    /// Since when nothing has happened.
    fn since(&self) -> Duration {
        Duration::from_micros(self.since.load(Ordering::Relaxed))
    }

    /// For how long nothing has happened.
    fn elapsed(&self) -> Duration {
        self.origin.elapsed().saturating_sub(self.since())
    }
}

/// A request that is being answered.
#[derive(Debug)]
pub(crate) struct Answering(Arc<Activity>);

impl Drop for Answering {
    fn drop(&mut self) {
        self.0.answering.fetch_sub(1, Ordering::Relaxed);
        self.0.mark();
    }
}

/// Every open connection.
#[derive(Debug, Default)]
pub(crate) struct Places {
    taken: HashMap<Id, (AbortHandle, Arc<Activity>)>,
}

impl Places {
    pub(crate) fn take(&mut self, task: AbortHandle, activity: Arc<Activity>) {
        self.taken.insert(task.id(), (task, activity));
    }

    pub(crate) fn leave(&mut self, task: Id) {
        self.taken.remove(&task);
    }

    /// Cuts off the connections that have been idle longest, so many at most. Where none is idle, those of the peer
    /// that has the most, if it has more than its share: the ones that took nothing for longest.
    pub(crate) fn make_room(&mut self, wanted: usize) {
        let idle = || self.taken.iter().filter(|(_, (_, activity))| activity.is_idle());
        if idle().next().is_none() {
            return self.level(wanted);
        }
        // One that was just let in has not had the time to ask.
        let late = idle().filter(|(_, (_, activity))| activity.elapsed() >= GRACE);
        let late = late.map(|(id, (_, activity))| (activity.since(), *id)).collect();
        self.cut(late, wanted);
    }

    fn level(&mut self, wanted: usize) {
        let peers = self.taken.values().map(|(_, activity)| activity.peer);
        let Some((greedy, most)) = Peer::most_frequent(peers) else { return };
        if most <= self.taken.len() / SHARE {
            return;
        }
        let theirs = self.taken.iter().filter(|(_, (_, activity))| activity.peer == greedy);
        let theirs = theirs.map(|(id, (_, activity))| (activity.since(), *id)).collect();
        self.cut(theirs, wanted);
    }

    fn cut(&mut self, mut connections: Vec<(Duration, Id)>, wanted: usize) {
        connections.sort_unstable_by_key(|(since, _)| *since);
        connections.truncate(wanted);
        for (_, id) in &connections {
            if let Some((task, _)) = self.taken.remove(id) {
                task.abort();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use tokio::task::JoinSet;
    use tokio::time::advance;

    use super::*;

    /// Connections of these peers, a second apart, and what ends of them by and by.
    struct Crowd {
        tasks: JoinSet<()>,
        places: Places,
        connections: Vec<(Id, Arc<Activity>)>,
    }

    impl Crowd {
        async fn of(peers: &[u8]) -> Self {
            let (mut tasks, mut places, origin) = (JoinSet::new(), Places::default(), Instant::now());
            let mut connections = Vec::new();
            for last in peers {
                advance(Duration::from_secs(1)).await;
                let activity = Arc::new(Activity::new(origin, Peer::of([192, 0, 2, *last].into())));
                let task = tasks.spawn(pending::<()>());
                connections.push((task.id(), Arc::clone(&activity)));
                places.take(task, activity);
            }
            Self { tasks, places, connections }
        }

        fn answering(&self, index: usize) -> Answering {
            self.connections[index].1.answering()
        }

        /// Which of them have made room.
        async fn make_room(&mut self, wanted: usize) -> Vec<usize> {
            let before = self.places.taken.len();
            self.places.make_room(wanted);
            let mut gone = Vec::new();
            for _ in self.places.taken.len()..before {
                let error = self.tasks.join_next().await.unwrap().unwrap_err();
                assert!(error.is_cancelled());
                gone.push(self.connections.iter().position(|(id, _)| *id == error.id()).unwrap());
            }
            gone
        }
    }

    #[tokio::test(start_paused = true)]
    async fn the_longest_idle_makes_room_and_who_is_answered_stays() {
        let mut crowd = Crowd::of(&[1; 4]).await;
        // The first is being answered, the second was a moment ago.
        let answering = crowd.answering(0);
        advance(Duration::from_secs(1)).await;
        drop(crowd.answering(1));
        advance(GRACE).await;
        for expected in [2, 3, 1] {
            assert_eq!(crowd.make_room(1).await, [expected]);
        }
        drop(answering);
        assert_eq!(crowd.make_room(9).await, [0; 0], "it has the time to ask again");
        advance(GRACE).await;
        assert_eq!(crowd.make_room(9).await, [0]);
    }

    #[tokio::test(start_paused = true)]
    async fn where_all_are_answered_who_has_the_most_makes_room() {
        let mut crowd = Crowd::of(&[2, 1, 1, 3, 1, 4]).await;
        let _answering: Vec<Answering> = (0..6).map(|index| crowd.answering(index)).collect();
        // The second took something just now, so the third goes first.
        for index in [2, 4, 1] {
            advance(Duration::from_secs(1)).await;
            crowd.connections[index].1.mark();
        }
        assert_eq!(crowd.make_room(1).await, [2]);
        assert_eq!(crowd.make_room(1).await, [4]);
        assert_eq!(crowd.make_room(9).await, [0; 0], "four different ones: nobody has more than a share");
    }

    #[tokio::test(start_paused = true)]
    async fn who_was_just_let_in_is_not_the_one_to_go() {
        let mut crowd = Crowd::of(&[1, 1, 2]).await;
        let _first = crowd.answering(0);
        advance(GRACE / 2).await;
        let _second = crowd.answering(1);
        assert_eq!(crowd.make_room(1).await, [0; 0]);
        let _asked = crowd.answering(2);
        assert_eq!(crowd.make_room(1).await, [0]);
    }
}
