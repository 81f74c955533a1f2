//! The three switches between the sources and the bus sections, in words that controller and switchgear share.

/// Load switches of a section.
pub(super) const FEEDERS: usize = 12;

/// The three switches, in the order of the digits of a transfer command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Switch {
    Qs1,
    Qtie,
    Qs2,
}

impl Switch {
    pub(super) const ALL: [Self; 3] = [Self::Qs1, Self::Qtie, Self::Qs2];
    /// Those of source 1 and source 2.
    pub(super) const OF_SOURCES: [Self; 2] = [Self::Qs1, Self::Qs2];
}

/// A position of all three switches: which of them are closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Positions([bool; 3]);

impl Positions {
    pub(super) const OPEN: Self = Self::of(0, 0, 0);
    pub(super) const ALL_CLOSED: Self = Self::of(1, 1, 1);

    /// By the digits of a transfer command, QS1, QTIE and QS2.
    pub(super) const fn of(qs1: u8, qtie: u8, qs2: u8) -> Self {
        Self([qs1 == 1, qtie == 1, qs2 == 1])
    }

    /// By what holds of each switch.
    pub(super) fn by(closed: impl FnMut(Switch) -> bool) -> Self {
        Self(Switch::ALL.map(closed))
    }

    pub(super) fn is_closed(self, switch: Switch) -> bool {
        self.0[switch as usize]
    }

    pub(super) fn digits(self) -> [u8; 3] {
        self.0.map(u8::from)
    }

    /// Which sources feed each section, were both of them there: by section, then by source.
    pub(super) fn feeds(self) -> [[bool; 2]; 2] {
        let [qs1, qtie, qs2] = self.0;
        [[qs1, qtie && qs2], [qs1 && qtie, qs2]]
    }
}

/// What an output does to a switch; without either it stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Drive {
    Close,
    Open,
}

impl Drive {
    pub(super) fn closes(self) -> bool {
        self == Self::Close
    }
}
