//! A switch as a piece of machinery: it moves while an output drives it, stays where it is otherwise, and wears.

use super::super::switches::Drive;

/// What is wrong with a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Condition {
    Normal,
    WillNotClose,
    /// Of its closing pulses the first one does nothing.
    ClosesAtSecond,
    WillNotOpen,
    /// Its release opens it and keeps it open.
    Trips,
}

/// A withdrawable circuit breaker with stored energy.
#[derive(Clone, Debug)]
pub(in super::super) struct Mechanism {
    closed: bool,
    closings: u32,
    condition: Condition,
    /// In the test position it moves as ever, and carries nothing.
    in_work: bool,
    /// Seconds from its output to its position.
    seconds: f64,
    moving: f64,
    /// Closing pulses since it was closed last, and whether one lasts.
    pulses: u32,
    pulse: bool,
}

impl Mechanism {
    pub(super) fn new(closed: bool, closings: u32, seconds: f64) -> Self {
        Self {
            closed,
            closings,
            condition: Condition::Normal,
            in_work: true,
            seconds,
            moving: 0.0,
            pulses: 0,
            pulse: false,
        }
    }

    pub(super) fn step(&mut self, dt: f64, drive: Option<Drive>) {
        let wanted = drive.map_or(self.closed, Drive::closes);
        let pulse = drive == Some(Drive::Close);
        self.pulses = self.pulses.saturating_add(u32::from(pulse && !self.pulse));
        self.pulse = pulse;
        let stuck = match self.condition {
            Condition::Normal => false,
            Condition::ClosesAtSecond => wanted && self.pulses < 2,
            Condition::WillNotClose | Condition::Trips => wanted,
            Condition::WillNotOpen => !wanted,
        };
        if wanted == self.closed || stuck {
            self.moving = 0.0;
            return;
        }
        self.moving += dt;
        // Steps of a tenth do not add up to a round number.
        if self.moving > self.seconds - dt / 2.0 {
            self.closed = wanted;
            self.closings = self.closings.saturating_add(u32::from(wanted));
            (self.moving, self.pulses) = (0.0, 0);
        }
    }

    /// Its release opens it at once, unless it jams.
    pub(super) fn release(&mut self) {
        self.closed &= self.condition == Condition::WillNotOpen;
        self.moving = 0.0;
    }

    pub(in super::super) fn set_condition(&mut self, condition: Condition) {
        self.condition = condition;
        self.pulses = 0;
        if condition == Condition::Trips {
            self.release();
        }
    }

    /// Draws it out of the work position or puts it back: closed, it opens first. Its interlock holds one that does not.
    pub(in super::super) fn set_in_work(&mut self, in_work: bool) {
        if in_work != self.in_work {
            self.release();
        }
        if !self.closed {
            self.in_work = in_work;
        }
    }

    pub(in super::super) fn condition(&self) -> Condition {
        self.condition
    }

    pub(in super::super) fn is_in_work(&self) -> bool {
        self.in_work
    }

    pub(in super::super) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Whether current can flow through it.
    pub(in super::super) fn conducts(&self) -> bool {
        self.closed && self.in_work
    }

    pub(in super::super) fn closings(&self) -> u32 {
        self.closings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.1;

    fn drive(switch: &mut Mechanism, steps: u32, drive: Drive) -> (bool, u32) {
        (0..steps).for_each(|_| switch.step(DT, Some(drive)));
        (switch.is_closed(), switch.closings())
    }

    #[test]
    fn a_switch_takes_its_time_and_counts_its_closings() {
        let mut switch = Mechanism::new(false, 7, 0.3);
        assert_eq!(drive(&mut switch, 2, Drive::Close), (false, 7));
        switch.step(DT, None);
        assert_eq!(drive(&mut switch, 2, Drive::Close), (false, 7), "it begins anew");
        assert_eq!(drive(&mut switch, 1, Drive::Close), (true, 8));
        assert_eq!(drive(&mut switch, 3, Drive::Open), (false, 8));
    }

    #[test]
    fn wear_keeps_it_where_it_is() {
        let mut switch = Mechanism::new(false, 7, 0.3);
        switch.set_condition(Condition::WillNotClose);
        assert_eq!(drive(&mut switch, 20, Drive::Close), (false, 7));
        switch.set_condition(Condition::WillNotOpen);
        assert_eq!(drive(&mut switch, 20, Drive::Close), (true, 8));
        assert_eq!(drive(&mut switch, 20, Drive::Open), (true, 8));
        switch.release();
        switch.set_in_work(false);
        assert!(switch.conducts(), "neither by its release nor by its drawer");
        switch.set_condition(Condition::Trips);
        assert!(!switch.is_closed());
        assert_eq!(drive(&mut switch, 20, Drive::Close), (false, 8));
        switch.set_condition(Condition::ClosesAtSecond);
        switch.step(DT, None);
        assert_eq!(drive(&mut switch, 20, Drive::Close), (false, 8));
        switch.step(DT, None);
        assert_eq!(drive(&mut switch, 20, Drive::Close), (true, 9));
        drive(&mut switch, 3, Drive::Open);
        assert_eq!(drive(&mut switch, 20, Drive::Close), (false, 9), "and again");
    }

    #[test]
    fn drawn_out_it_moves_and_carries_nothing() {
        let mut switch = Mechanism::new(true, 7, 0.3);
        switch.set_in_work(true);
        assert!(switch.conducts(), "it stands where it stood");
        switch.set_in_work(false);
        assert!(!switch.is_closed(), "the interlock");
        drive(&mut switch, 3, Drive::Close);
        assert_eq!((switch.is_closed(), switch.conducts()), (true, false));
        switch.set_in_work(true);
        assert!(!switch.is_closed());
    }
}
