//! What clients and clocks both want. A mutex is not fair: whoever takes it again and again lets in those who wait.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

#[derive(Debug, Default)]
pub(super) struct Shared<T> {
    value: Mutex<T>,
    waiting: AtomicUsize,
}

impl<T> Shared<T> {
    pub(super) fn new(value: T) -> Self {
        Self { value: Mutex::new(value), waiting: AtomicUsize::new(0) }
    }

    /// For a moment, and whoever has it for long can see that somebody waits.
    pub(super) fn lock(&self) -> MutexGuard<'_, T> {
        match self.value.try_lock() {
            Ok(guard) => return guard,
            Err(TryLockError::Poisoned(poisoned)) => return poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => {}
        }
        self.waiting.fetch_add(1, Relaxed);
        let guard = self.hold();
        self.waiting.fetch_sub(1, Relaxed);
        guard
    }

    /// For long: nobody steps aside for this.
    pub(super) fn hold(&self) -> MutexGuard<'_, T> {
        // A panel that panicked would have been caught half-way; registers are still registers.
        self.value.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether somebody waits for it.
    pub(super) fn is_wanted(&self) -> bool {
        self.waiting.load(Relaxed) > 0
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::thread;

    use super::*;

    #[test]
    fn whoever_waits_is_seen_and_let_in() {
        let shared = Arc::new(Shared::new(1));
        let held = shared.hold();
        assert!(!shared.is_wanted());
        let waiter = {
            let shared = Arc::clone(&shared);
            thread::spawn(move || *shared.lock())
        };
        while !shared.is_wanted() {
            thread::yield_now();
        }
        drop(held);
        assert_eq!(waiter.join().unwrap(), 1);
        assert!(!shared.is_wanted());
    }
}
