//! The 26 statuses of register 10604. Which may follow which stands in [`super::transitions`].

/// What the unit is doing, with its code in the register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub(super) enum Operation {
    AtRest = 0,
    WaitBeforeFuel = 1,
    Preheat = 2,
    WaitOilFlashOff = 3,
    CrankRest = 4,
    Cranking = 5,
    IdleSpeed = 6,
    Heating = 7,
    OffLoad = 8,
    Synchronizing = 9,
    TransferToGenset = 10,
    GensetBreakerActivation = 11,
    GensetBreakerTimer = 12,
    OnLoad = 13,
    PeakLopping = 14,
    Exporting = 15,
    SlaveOnLoad = 16,
    SynchronizingBack = 17,
    TransferToMains = 18,
    MainsBreakerActivation = 19,
    MainsBreakerTimer = 20,
    StopWithCooldown = 21,
    CoolingDown = 22,
    IdleBeforeStop = 23,
    ImmediateStop = 24,
    Stopping = 25,
}

use Operation::*;

impl Operation {
    /// The engine has been brought to speed: it can take the load, and its protections are live.
    pub(super) fn is_up_to_speed(self) -> bool {
        (OffLoad..=CoolingDown).contains(&self)
    }

    /// From the first crank until the engine is to stop.
    pub(super) fn is_committed(self) -> bool {
        (CrankRest..=CoolingDown).contains(&self)
    }

    /// The genset's breaker is meant to stay closed.
    pub(super) fn carries_load(self) -> bool {
        matches!(
            self,
            TransferToGenset
                | OnLoad
                | PeakLopping
                | Exporting
                | SlaveOnLoad
                | SynchronizingBack
                | TransferToMains
        )
    }

    /// The genset carries the load alone.
    pub(super) fn has_the_load(self) -> bool {
        matches!(self, OnLoad | SlaveOnLoad)
    }

    /// The genset is led to the mains' frequency, voltage and angle.
    pub(super) fn is_synchronizing(self) -> bool {
        matches!(self, Synchronizing | SynchronizingBack)
    }
}
