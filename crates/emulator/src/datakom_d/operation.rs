//! The 26 statuses of register 10604, and which may follow which: the table behind the diagram in
//! `docs/imitation/datakom-d.md`.

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

    /// The genset is led to the mains' frequency, voltage and angle.
    pub(super) fn is_synchronizing(self) -> bool {
        matches!(self, Synchronizing | SynchronizingBack)
    }
}

/// A status, one that may follow it, and what brings it about.
#[cfg(test)]
pub(super) type Transition = (Operation, Operation, &'static str);

/// Every change of status that the unit can make.
#[cfg(test)]
pub(super) const TRANSITIONS: &[Transition] = &[
    (AtRest, WaitBeforeFuel, "the engine is wanted, and nothing has tripped"),
    (WaitBeforeFuel, AtRest, "no longer wanted"),
    (WaitBeforeFuel, Preheat, "timer"),
    (Preheat, AtRest, "no longer wanted"),
    (Preheat, WaitOilFlashOff, "timer"),
    (WaitOilFlashOff, AtRest, "no longer wanted"),
    (WaitOilFlashOff, Cranking, "timer"),
    (Cranking, IdleSpeed, "the engine fires"),
    (Cranking, CrankRest, "timer, attempts left"),
    (Cranking, Stopping, "timer, last attempt: fail to start; or no longer wanted"),
    (CrankRest, Cranking, "timer"),
    (CrankRest, Stopping, "no longer wanted"),
    (IdleSpeed, Heating, "timer"),
    (IdleSpeed, CrankRest, "the engine dies, attempts left"),
    (IdleSpeed, Stopping, "the engine dies, last attempt: fail to start"),
    (IdleSpeed, StopWithCooldown, "no longer wanted"),
    (Heating, OffLoad, "timer"),
    (Heating, CrankRest, "the engine dies, attempts left"),
    (Heating, Stopping, "the engine dies, last attempt: fail to start"),
    (Heating, StopWithCooldown, "no longer wanted"),
    (OffLoad, Synchronizing, "to take load beside live mains"),
    (OffLoad, GensetBreakerTimer, "to take the load, mains breaker open"),
    (OffLoad, StopWithCooldown, "no longer wanted"),
    (Synchronizing, GensetBreakerActivation, "in step with the mains"),
    (
        Synchronizing,
        OffLoad,
        "timer: synchronization fail; or the load is no longer to move; or the mains fail",
    ),
    (Synchronizing, StopWithCooldown, "no longer wanted"),
    (GensetBreakerTimer, GensetBreakerActivation, "timer"),
    (GensetBreakerTimer, MainsBreakerTimer, "the load is to go back"),
    (GensetBreakerTimer, OffLoad, "the load is no longer to move"),
    (GensetBreakerTimer, StopWithCooldown, "no longer wanted"),
    (GensetBreakerActivation, OnLoad, "genset breaker closed"),
    (GensetBreakerActivation, SlaveOnLoad, "genset breaker closed, the unit is a slave"),
    (GensetBreakerActivation, TransferToGenset, "genset breaker closed beside the mains, soft transfer"),
    (GensetBreakerActivation, PeakLopping, "genset breaker closed beside the mains, to lop peaks"),
    (GensetBreakerActivation, Exporting, "genset breaker closed beside the mains, to export"),
    (GensetBreakerActivation, GensetBreakerTimer, "the mains fail before the breaker has closed"),
    (GensetBreakerActivation, MainsBreakerTimer, "the load is to go back"),
    (GensetBreakerActivation, OffLoad, "the load is no longer to move"),
    (GensetBreakerActivation, StopWithCooldown, "no longer wanted"),
    (TransferToGenset, OnLoad, "mains breaker open"),
    (TransferToGenset, SlaveOnLoad, "mains breaker open, the unit is a slave"),
    (TransferToGenset, TransferToMains, "the load is to go back"),
    (TransferToGenset, PeakLopping, "to lop peaks"),
    (TransferToGenset, Exporting, "to export"),
    (TransferToGenset, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (TransferToGenset, OffLoad, "genset breaker open"),
    (TransferToGenset, StopWithCooldown, "genset breaker open, no longer wanted"),
    (OnLoad, SynchronizingBack, "the load goes back without a break"),
    (OnLoad, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (OnLoad, OffLoad, "genset breaker open, nobody to take over"),
    (OnLoad, StopWithCooldown, "genset breaker open, nobody to take over, no longer wanted"),
    (SlaveOnLoad, SynchronizingBack, "the load goes back without a break"),
    (SlaveOnLoad, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (SlaveOnLoad, OffLoad, "genset breaker open, nobody to take over"),
    (SlaveOnLoad, StopWithCooldown, "genset breaker open, nobody to take over, no longer wanted"),
    (PeakLopping, Exporting, "to export"),
    (PeakLopping, TransferToGenset, "to take the whole load softly"),
    (PeakLopping, TransferToMains, "the load is to go back"),
    (PeakLopping, OnLoad, "the mains fail, or the genset is to take the whole load"),
    (PeakLopping, SlaveOnLoad, "the same, the unit is a slave"),
    (PeakLopping, OffLoad, "genset breaker open"),
    (PeakLopping, StopWithCooldown, "genset breaker open, no longer wanted"),
    (Exporting, OffLoad, "genset breaker open"),
    (Exporting, StopWithCooldown, "genset breaker open, no longer wanted"),
    (Exporting, PeakLopping, "to lop peaks"),
    (Exporting, TransferToGenset, "to take the whole load softly"),
    (Exporting, TransferToMains, "the load is to go back"),
    (Exporting, OnLoad, "the mains fail, or the genset is to take the whole load"),
    (Exporting, SlaveOnLoad, "the same, the unit is a slave"),
    (SynchronizingBack, TransferToMains, "mains breaker closed, soft transfer"),
    (SynchronizingBack, PeakLopping, "mains breaker closed, to lop peaks"),
    (SynchronizingBack, Exporting, "mains breaker closed, to export"),
    (SynchronizingBack, TransferToGenset, "mains breaker closed, the genset is to keep the load"),
    (SynchronizingBack, OffLoad, "mains breaker closed, or genset breaker open"),
    (SynchronizingBack, StopWithCooldown, "the same, no longer wanted"),
    (SynchronizingBack, MainsBreakerTimer, "genset breaker open, mains to take over"),
    (
        SynchronizingBack,
        OnLoad,
        "timer: synchronization fail; or the mains fail; or the genset is to keep the load",
    ),
    (SynchronizingBack, SlaveOnLoad, "the same, the unit is a slave"),
    (TransferToMains, OffLoad, "genset breaker open"),
    (TransferToMains, StopWithCooldown, "genset breaker open, no longer wanted"),
    (TransferToMains, TransferToGenset, "the genset is to take the load again"),
    (TransferToMains, PeakLopping, "to lop peaks"),
    (TransferToMains, Exporting, "to export"),
    (TransferToMains, OnLoad, "the mains fail"),
    (TransferToMains, SlaveOnLoad, "the mains fail, the unit is a slave"),
    (MainsBreakerTimer, MainsBreakerActivation, "timer"),
    (MainsBreakerTimer, GensetBreakerTimer, "the genset is to take the load again"),
    (MainsBreakerTimer, OffLoad, "nobody is to take the load, or the mains fail"),
    (MainsBreakerTimer, StopWithCooldown, "the same, no longer wanted"),
    (
        MainsBreakerActivation,
        OffLoad,
        "mains breaker closed; or nobody is to take the load, or the mains fail",
    ),
    (MainsBreakerActivation, StopWithCooldown, "the same, no longer wanted"),
    (MainsBreakerActivation, GensetBreakerTimer, "the genset is to take the load again"),
    (StopWithCooldown, CoolingDown, "timer"),
    (StopWithCooldown, OffLoad, "wanted again"),
    (StopWithCooldown, Stopping, "the engine dies"),
    (CoolingDown, IdleBeforeStop, "timer"),
    (CoolingDown, OffLoad, "wanted again"),
    (CoolingDown, Stopping, "the engine dies"),
    (IdleBeforeStop, Stopping, "timer, or the engine dies"),
    (ImmediateStop, Stopping, "timer"),
    (Stopping, AtRest, "timer, and the engine stands"),
];
