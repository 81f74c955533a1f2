//! What the unit can be doing, with the codes of register 003Fh, and how it gets from one to the next.

/// What the unit is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Operation {
    /// The engine stands.
    AtRest,
    WaitBeforeFuel,
    /// Before the first crank and between cranks.
    WaitBeforeCrank,
    Cranking,
    Heating,
    /// The engine runs beside the load, as in TEST: the table has no code for it but that of the mains on load.
    OffLoad,
    SynchronizeToGenset,
    GensetContactorSynch,
    GensetContactor,
    LoadOnGenset,
    SynchronizeToMains,
    MainsContactorSynch,
    MainsContactor,
    Cooldown,
    Stopping,
    SoftToMains,
    SoftToGenset,
}

impl Operation {
    /// In register 003Fh.
    pub(super) fn code(self) -> u16 {
        use Operation::*;
        match self {
            AtRest | OffLoad => 0,
            WaitBeforeFuel => 1,
            WaitBeforeCrank => 2,
            Cranking => 3,
            Heating => 4,
            SynchronizeToGenset => 5,
            GensetContactorSynch => 6,
            GensetContactor => 7,
            LoadOnGenset => 8,
            SynchronizeToMains => 9,
            MainsContactorSynch => 10,
            MainsContactor => 11,
            Cooldown => 12,
            Stopping => 13,
            SoftToMains => 14,
            SoftToGenset => 15,
        }
    }

    /// Both contactors are meant to be closed.
    pub(super) fn is_parallel(self) -> bool {
        use Operation::*;
        matches!(self, GensetContactorSynch | MainsContactorSynch | SoftToMains | SoftToGenset)
    }

    /// The genset carries the load, or is about to.
    pub(super) fn is_loaded(self) -> bool {
        use Operation::*;
        self.is_parallel() || matches!(self, GensetContactor | LoadOnGenset | SynchronizeToMains)
    }

    /// The genset is led to the mains' frequency, voltage and angle, until the contactor between them has closed.
    pub(super) fn is_synchronizing(self) -> bool {
        use Operation::*;
        matches!(self, SynchronizeToGenset | GensetContactorSynch | SynchronizeToMains | MainsContactorSynch)
    }
}
