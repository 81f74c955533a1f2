//! What one poll round brought, and which registers of it go together.

use std::time::Duration;

use busbar_profile::plan::Read;

use super::Known;
use crate::failure::Failure;
use crate::rates::Rates;

/// What one poll round brought.
#[derive(Debug, Default)]
pub(crate) struct Round {
    /// Who answered, where that was asked before all else.
    pub(crate) identity: Option<Known>,
    /// What was due.
    pub(crate) rates: Rates,
    /// Registers that came, by address.
    pub(crate) answers: Vec<(u16, Vec<u16>)>,
    /// Reads that failed, and why.
    pub(crate) failures: Vec<(Read, Failure)>,
    /// Set when the device, not just a read, could not be reached.
    pub(crate) silence: Option<Failure>,
    /// Whether it was cut short, so that it says nothing about what is missing.
    pub(crate) is_cut: bool,
    /// How long it took, of what is read on demand: one picture may take as long as many rounds.
    pub(crate) took: Duration,
}

impl Round {
    /// When the wire lets a poll through again, where it held the last one back.
    pub(crate) fn held(&self) -> Option<Duration> {
        self.failures.last().and_then(|(_, failure)| failure.next_probe())
    }

    /// Whether the device answered anything at all, if only to refuse.
    pub(crate) fn reached_the_device(&self) -> bool {
        self.identity.is_some()
            || !self.answers.is_empty()
            || self.failures.iter().any(|(_, failure)| failure.device_answered())
    }
}

/// What of an answer lies outside all of `spans`, which ascend.
pub(super) fn outside<'a>(
    spans: &'a [(u32, u32)],
    address: u16,
    registers: &'a [u16],
) -> impl Iterator<Item = (u16, &'a [u16])> {
    let end = u32::from(address) + registers.len() as u32;
    let starts = std::iter::once(u32::from(address)).chain(spans.iter().map(|span| span.1));
    let ends = spans.iter().map(|span| span.0).chain([end]);
    starts.zip(ends).filter_map(move |(from, to)| {
        let (from, to) = (from.max(u32::from(address)), to.min(end));
        let first = u16::try_from(from).ok()?;
        let part = registers
            .get((from - u32::from(address)) as usize..to.checked_sub(u32::from(address))? as usize)?;
        (!part.is_empty()).then_some((first, part))
    })
}

/// Address ranges that the answers cover, first and behind the last; answers that touch are one.
pub(super) fn windows(answers: &[(u16, Vec<u16>)]) -> Vec<(u32, u32)> {
    let mut ranges: Vec<(u32, u32)> = answers
        .iter()
        .map(|(address, registers)| (u32::from(*address), u32::from(*address) + registers.len() as u32))
        .collect();
    ranges.sort_unstable();
    let mut windows: Vec<(u32, u32)> = Vec::with_capacity(ranges.len());
    for (first, end) in ranges {
        match windows.last_mut() {
            Some(last) if first <= last.1 => last.1 = last.1.max(end),
            _ => windows.push((first, end)),
        }
    }
    windows
}
