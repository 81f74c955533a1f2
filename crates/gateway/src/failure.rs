//! Why a point could not be read, as one sentence.

use std::time::Duration;

use busbar_link::{Cause, LinkError};
use busbar_profile::Profile;
use thiserror::Error;

/// Exception code of a device that knows no such address.
const ILLEGAL_DATA_ADDRESS: u8 = 0x02;
/// The last of the exception codes by which a device says that it never answers such a read.
const ILLEGAL_DATA_VALUE: u8 = 0x03;

/// Why a read gave no registers for a point.
#[derive(Debug, Clone, PartialEq, Error)]
pub(crate) enum Failure {
    /// The device refused. It is alive.
    #[error("the device answered exception {code} ({name})")]
    Exception { code: u8, name: String },
    /// The device answered, but too little. It is alive.
    #[error("the device answered only {got} of {wanted} registers")]
    Short { got: usize, wanted: u16 },
    /// Nothing came back, or nothing got through.
    #[error("{0}")]
    Link(LinkError),
    /// Another device answers in its place, whose registers mean something else.
    #[error("another device answers in its place: {detail}")]
    Wrong { detail: String },
}

impl Failure {
    /// What a failed read means; exceptions are named as the maker names them.
    pub(crate) fn new(error: LinkError, profile: &Profile) -> Self {
        match error {
            LinkError::Exception { code, .. } => Self::Exception {
                code: code.0,
                name: profile.exception_name(code.0).unwrap_or(code.name()).to_owned(),
            },
            error => Self::Link(error),
        }
    }

    /// Whether the device answered, if only to refuse.
    pub(crate) fn device_answered(&self) -> bool {
        matches!(self, Self::Exception { .. } | Self::Short { .. })
    }

    /// Whether the device says that it never answers such a read.
    pub(crate) fn is_refusal(&self) -> bool {
        matches!(self, Self::Exception { code: ..=ILLEGAL_DATA_VALUE, .. })
    }

    /// Whether the device does not know one of the addresses it was asked for.
    pub(crate) fn is_illegal_address(&self) -> bool {
        matches!(self, Self::Exception { code: ILLEGAL_DATA_ADDRESS, .. })
    }

    /// Whether the same read may well succeed soon: the device was away, busy or locked, and not asked for what it does
    /// not have.
    pub(crate) fn may_pass(&self) -> bool {
        match self {
            Self::Exception { .. } => !self.is_refusal(),
            Self::Short { .. } | Self::Wrong { .. } => false,
            Self::Link(_) => true,
        }
    }

    /// Whether the device said nothing, or could not even be asked for all that was said on its line, though nothing
    /// else is known to be wrong.
    pub(crate) fn is_silence(&self) -> bool {
        match self {
            Self::Link(
                LinkError::Timeout { .. } | LinkError::Silent { .. } | LinkError::NeverSilent { .. },
            ) => true,
            Self::Link(LinkError::Down { reason }) => {
                matches!(reason.cause, Cause::Silent { .. } | Cause::StillConnecting { .. })
            }
            _ => false,
        }
    }

    /// How long until the wire lets a poll through again, where it held this one back for the sake of others.
    pub(crate) fn next_probe(&self) -> Option<Duration> {
        match self {
            Self::Link(LinkError::Silent { next_probe, .. }) => Some(*next_probe),
            _ => None,
        }
    }

    /// Whether it is no news after `other`: silence has several causes on a wire, and they take turns.
    pub(crate) fn is_no_news_after(&self, other: &Self) -> bool {
        self == other || (self.is_silence() && other.is_silence())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use busbar_link::{Cause, LinkError};

    use super::Failure;
    use crate::testing::{outage, refusal, timeout};

    #[test]
    fn exceptions_are_named_as_the_maker_names_them() {
        assert_eq!(refusal(10).to_string(), "the device answered exception 10 (write protection)");
        assert_eq!(refusal(2).to_string(), "the device answered exception 2 (illegal data address)");
    }

    #[test]
    fn only_silence_is_silence() {
        assert!(timeout().is_silence() && !timeout().device_answered());
        assert!(outage(Cause::Silent { requests: 3 }).is_silence() && !outage(Cause::Refused).is_silence());
        assert!(!outage(Cause::Refused).is_no_news_after(&timeout()));
        let again = Duration::from_millis(700);
        let held = Failure::Link(LinkError::Silent { unit: 1, next_probe: again });
        let noisy = Failure::Link(LinkError::NeverSilent { unit: 1, after: again });
        assert!(noisy.is_no_news_after(&timeout()) && !noisy.device_answered() && noisy.may_pass());
        assert!(held.is_silence() && held.is_no_news_after(&timeout()) && !held.device_answered());
        assert_eq!((held.next_probe(), timeout().next_probe()), (Some(again), None));
        assert!(refusal(2).is_illegal_address() && !refusal(3).is_illegal_address());
        assert!(refusal(2).device_answered() && !refusal(2).is_silence());
    }

    #[test]
    fn what_the_device_does_not_have_does_not_pass() {
        assert!(timeout().may_pass() && outage(Cause::Refused).may_pass());
        assert!(refusal(6).may_pass() && refusal(10).may_pass());
        assert!(!refusal(1).may_pass() && !refusal(2).may_pass() && !refusal(3).may_pass());
    }
}
