//! Chance that repeats itself: a seeded generator, and quantities that wander slowly around their mean.

/// SplitMix64: small, fast, and the same on every machine for the same seed.
#[derive(Clone, Debug)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Evenly spread from `low` up to, but not including, `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        // 53 bits are all that an f64 holds.
        let unit = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        low + unit * (high - low)
    }

    /// Mean 0, variance 1, never beyond 3.5: the sum of four even draws is normal enough for a meter.
    pub(crate) fn noise(&mut self) -> f64 {
        let sum: f64 = (0..4).map(|_| self.between(-1.0, 1.0)).sum();
        sum * 0.866
    }
}

/// A quantity that is pulled back to its mean and pushed away by chance (Ornstein-Uhlenbeck).
#[derive(Clone, Debug)]
pub(crate) struct Drift {
    offset: f64,
    /// Usual distance from the mean, in the quantity's unit.
    spread: f64,
    /// Seconds in which a distance is forgotten.
    memory: f64,
}

impl Drift {
    pub(crate) fn new(spread: f64, memory: f64, random: &mut Random) -> Self {
        Self { offset: spread * random.noise(), spread, memory }
    }

    pub(crate) fn step(&mut self, dt: f64, random: &mut Random) -> f64 {
        let pull = (dt / self.memory).min(1.0);
        self.offset += -self.offset * pull + self.spread * (2.0 * pull).sqrt() * random.noise();
        // Noise has tails and a meter has limits: three spreads are the end.
        self.offset = self.offset.clamp(-3.0 * self.spread, 3.0 * self.spread);
        self.offset
    }

    pub(crate) fn value(&self) -> f64 {
        self.offset
    }
}

/// Moves `value` towards `target` as a first-order lag with the time constant `tau` in seconds.
pub(crate) fn approach(value: &mut f64, target: f64, tau: f64, dt: f64) {
    *value += (target - *value) * (1.0 - (-dt / tau).exp());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_numbers_and_another_seed_others() {
        let draw = |seed| {
            let mut random = Random::new(seed);
            [random.bits(), random.bits(), random.bits()]
        };
        assert_eq!(draw(1), draw(1));
        assert_ne!(draw(1), draw(2));
    }

    #[test]
    fn noise_is_centred_with_variance_one() {
        let mut random = Random::new(7);
        let draws: Vec<f64> = (0..20_000).map(|_| random.noise()).collect();
        let mean = draws.iter().sum::<f64>() / 20_000.0;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 0.03, "mean {mean}");
        assert!((variance - 1.0).abs() < 0.05, "variance {variance}");
    }

    #[test]
    fn drift_stays_near_its_mean_and_moves() {
        let mut random = Random::new(3);
        let mut drift = Drift::new(2.0, 10.0, &mut random);
        let walk: Vec<f64> = (0..10_000).map(|_| drift.step(0.1, &mut random)).collect();
        assert!(walk.iter().all(|x| x.abs() <= 6.0));
        let spread = (walk.iter().map(|x| x * x).sum::<f64>() / 10_000.0).sqrt();
        assert!((0.8..4.0).contains(&spread), "spread {spread}");
    }
}
