//! The connections that are open: which of them do something, and which one makes room when there are too many.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use tokio::task::{AbortHandle, Id};
use tokio::time::Instant;

/// What one connection does. Its task writes it, the server reads it.
#[derive(Debug)]
pub(crate) struct Activity {
    origin: Instant,
    /// Requests that are being answered.
    answering: AtomicUsize,
    /// When the client last took something or asked for something, in microseconds after the origin.
    since: AtomicU64,
}

impl Activity {
    pub(crate) fn new(origin: Instant) -> Self {
        let activity = Self { origin, answering: AtomicUsize::new(0), since: AtomicU64::new(0) };
        activity.mark();
        activity
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

    /// Since when nothing has happened; none while a request is being answered.
    fn idle_since(&self) -> Option<Duration> {
        (self.answering.load(Ordering::Relaxed) == 0)
            .then(|| Duration::from_micros(self.since.load(Ordering::Relaxed)))
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

    /// Cuts off the connections that have been idle longest, so many at most; how many it were.
    pub(crate) fn make_room(&mut self, wanted: usize) -> usize {
        let idle = self.taken.iter().filter_map(|(id, (_, activity))| Some((activity.idle_since()?, *id)));
        let mut idle: Vec<(Duration, Id)> = idle.collect();
        idle.sort_unstable_by_key(|(since, _)| *since);
        idle.truncate(wanted);
        for (_, id) in &idle {
            if let Some((task, _)) = self.taken.remove(id) {
                task.abort();
            }
        }
        idle.len()
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use tokio::task::JoinSet;
    use tokio::time::advance;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn the_longest_idle_makes_room_and_who_is_answered_stays() {
        let (mut tasks, mut places, origin) = (JoinSet::new(), Places::default(), Instant::now());
        let mut activities = Vec::new();
        let mut ids = Vec::new();
        for _ in 0..4 {
            advance(Duration::from_secs(1)).await;
            let activity = Arc::new(Activity::new(origin));
            let task = tasks.spawn(pending::<()>());
            ids.push(task.id());
            places.take(task, Arc::clone(&activity));
            activities.push(activity);
        }
        // The first is being answered, the second was a moment ago.
        let answering = activities[0].answering();
        advance(Duration::from_secs(1)).await;
        drop(activities[1].answering());

        for expected in [2, 3, 1] {
            assert_eq!(places.make_room(1), 1);
            let error = tasks.join_next().await.unwrap().unwrap_err();
            assert_eq!((error.id(), error.is_cancelled()), (ids[expected], true));
        }
        assert_eq!(places.make_room(1), 0, "the only one left is being answered");
        drop(answering);
        assert_eq!(places.make_room(9), 1);
    }
}
