//! Who looks at what is read on demand: a group of points is worth reading while at least one reader has it open.

use std::sync::Arc;

use tokio::sync::watch;

/// How many readers look at each group of a device, by index in the profile.
#[derive(Debug)]
pub(crate) struct Looks(Arc<watch::Sender<Vec<usize>>>);

/// Somebody looks for as long as this lives.
#[derive(Debug)]
pub(crate) struct Look {
    looks: Arc<watch::Sender<Vec<usize>>>,
    groups: Vec<usize>,
}

impl Default for Looks {
    fn default() -> Self {
        Self(Arc::new(watch::Sender::new(Vec::new())))
    }
}

impl Looks {
    /// Begins to look at these groups.
    pub(crate) fn look(&self, groups: &[usize]) -> Look {
        if !groups.is_empty() {
            self.0.send_modify(|looked| {
                looked.extend_from_slice(groups);
                looked.sort_unstable();
            });
        }
        Look { looks: Arc::clone(&self.0), groups: groups.to_vec() }
    }

    /// The groups somebody looks at: each once for each reader, in order. Tells of changes.
    pub(crate) fn watch(&self) -> watch::Receiver<Vec<usize>> {
        self.0.subscribe()
    }
}

impl Drop for Look {
    fn drop(&mut self) {
        if self.groups.is_empty() {
            return;
        }
        self.looks.send_modify(|looked| {
            for group in &self.groups {
                if let Some(place) = looked.iter().position(|other| other == group) {
                    looked.remove(place);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_looked_at_until_the_last_reader_is_gone() {
        let looks = Looks::default();
        let mut watch = looks.watch();
        let one = looks.look(&[3]);
        let other = looks.look(&[3, 1]);
        assert!(watch.has_changed().unwrap());
        assert_eq!(*watch.borrow_and_update(), [1, 3, 3]);
        drop(one);
        assert_eq!(*watch.borrow_and_update(), [1, 3]);
        drop(other);
        assert!(watch.borrow_and_update().is_empty());
        drop(looks.look(&[]));
        assert!(!watch.has_changed().unwrap(), "looking at nothing is no news");
    }
}
