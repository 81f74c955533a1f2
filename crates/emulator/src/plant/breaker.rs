//! A breaker: it follows its command after its operating time, unless it is stuck or has tripped.

/// Seconds from command to position.
const OPERATING: f64 = 0.2;

/// What is wrong with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stuck {
    Nowhere,
    Open,
    Closed,
}

#[derive(Clone, Debug)]
pub(crate) struct Breaker {
    pub(crate) closed: bool,
    /// Its own release has opened it: it closes again only after its command was taken away.
    pub(crate) tripped: bool,
    pub(super) stuck: Stuck,
    moving: f64,
}

impl Breaker {
    pub(super) fn new(closed: bool) -> Self {
        Self { closed, tripped: false, stuck: Stuck::Nowhere, moving: 0.0 }
    }

    pub(super) fn step(&mut self, dt: f64, command: bool) {
        self.tripped &= command;
        let wanted = command && !self.tripped;
        let free = match self.stuck {
            Stuck::Nowhere => true,
            Stuck::Open => !wanted,
            Stuck::Closed => wanted,
        };
        self.moving = if wanted == self.closed || !free { 0.0 } else { self.moving + dt };
        // Tenths add up to a little less than they should.
        if self.moving > OPERATING - dt / 2.0 {
            self.closed = wanted;
            self.moving = 0.0;
        }
    }

    /// Opens at once, if it can.
    pub(super) fn trip(&mut self) {
        if self.closed && self.stuck != Stuck::Closed {
            (self.closed, self.tripped) = (false, true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(breaker: &mut Breaker, command: bool, tenths: u32) -> bool {
        (0..tenths).for_each(|_| breaker.step(0.1, command));
        breaker.closed
    }

    #[test]
    fn it_takes_its_time() {
        let mut breaker = Breaker::new(false);
        assert!(!run(&mut breaker, true, 1));
        assert!(!run(&mut breaker, false, 1), "a command that is taken back is forgotten");
        assert!(!run(&mut breaker, true, 1));
        assert!(run(&mut breaker, true, 1));
        assert!(run(&mut breaker, false, 1));
        assert!(!run(&mut breaker, false, 1));
    }

    #[test]
    fn one_that_is_stuck_moves_one_way_only() {
        let mut breaker = Breaker { stuck: Stuck::Open, ..Breaker::new(true) };
        assert!(!run(&mut breaker, false, 5));
        assert!(!run(&mut breaker, true, 50));
        let mut breaker = Breaker { stuck: Stuck::Closed, ..Breaker::new(false) };
        assert!(run(&mut breaker, true, 5));
        assert!(run(&mut breaker, false, 50));
        breaker.trip();
        assert!(breaker.closed && !breaker.tripped);
        breaker.stuck = Stuck::Nowhere;
        assert!(!run(&mut breaker, false, 5));
    }

    #[test]
    fn a_tripped_one_waits_until_its_command_is_taken_away() {
        let mut breaker = Breaker::new(true);
        breaker.trip();
        assert!(breaker.tripped && !run(&mut breaker, true, 50));
        assert!(!run(&mut breaker, false, 1) && !breaker.tripped);
        assert!(run(&mut breaker, true, 2));
    }
}
