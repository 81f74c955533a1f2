//! Which rates are read together.

use busbar_profile::Rate;

/// The rates that are polled; what is read on demand is read while somebody looks.
pub(crate) const POLLED: [Rate; 3] = [Rate::Fast, Rate::Slow, Rate::Once];

/// All rates, the polled ones first.
pub(crate) const RATES: [Rate; 4] = [Rate::Fast, Rate::Slow, Rate::Once, Rate::OnDemand];

/// A set of rates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Rates([bool; RATES.len()]);

impl Rates {
    pub(crate) fn contains(self, rate: Rate) -> bool {
        self.iter().any(|other| other == rate)
    }

    /// The most frequent first.
    pub(crate) fn iter(self) -> impl Iterator<Item = Rate> {
        RATES.into_iter().zip(self.0).filter_map(|(rate, contained)| contained.then_some(rate))
    }
}

impl FromIterator<Rate> for Rates {
    fn from_iter<I: IntoIterator<Item = Rate>>(rates: I) -> Self {
        let mut set = Self::default();
        for rate in rates {
            for (known, contained) in RATES.iter().zip(&mut set.0) {
                *contained |= *known == rate;
            }
        }
        set
    }
}

impl From<Rate> for Rates {
    fn from(rate: Rate) -> Self {
        Self::from_iter([rate])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_rates() {
        let rates = Rates::from_iter([Rate::Once, Rate::Fast, Rate::OnDemand, Rate::Fast]);
        assert_eq!(rates.iter().collect::<Vec<_>>(), [Rate::Fast, Rate::Once, Rate::OnDemand]);
        assert!(rates.contains(Rate::Once) && !rates.contains(Rate::Slow));
    }
}
