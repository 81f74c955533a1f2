//! The shape of a voltage or current: odd harmonics up to the 31st, and the period they add up to.

use std::f64::consts::{SQRT_2, TAU};

use crate::random::{Drift, Random};

/// Samples of one period.
pub(crate) const SAMPLES: usize = 100;
/// Harmonics 3, 5, .. 31.
pub(crate) const HARMONICS: usize = 15;

/// Where a channel gets its shape from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    MainsVoltage,
    GensetVoltage,
    Current,
    NeutralCurrent,
}

impl Shape {
    /// Per cent of the fundamental for the harmonics 3, 5, .. 31.
    const fn spectrum(self) -> [f64; HARMONICS] {
        match self {
            Self::MainsVoltage => {
                [0.45, 1.90, 1.20, 0.20, 0.65, 0.50, 0.10, 0.28, 0.22, 0.06, 0.14, 0.12, 0.04, 0.08, 0.06]
            }
            Self::GensetVoltage => {
                [1.60, 1.10, 0.80, 0.35, 0.40, 0.30, 0.15, 0.22, 0.18, 0.08, 0.12, 0.10, 0.05, 0.07, 0.05]
            }
            Self::Current => {
                [6.50, 9.80, 5.60, 1.40, 3.10, 2.20, 0.60, 1.30, 1.00, 0.35, 0.60, 0.50, 0.20, 0.35, 0.30]
            }
            Self::NeutralCurrent => {
                [38.0, 8.20, 4.90, 9.50, 2.60, 1.90, 3.80, 1.20, 0.90, 1.70, 0.55, 0.45, 0.90, 0.30, 0.25]
            }
        }
    }
}

/// What the analyser of a panel shows for one channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Analysis {
    /// Per cent; 100 where there is something to analyse, else 0.
    pub(crate) fundamental: f64,
    /// Per cent of the fundamental, harmonics 3, 5, .. 31.
    pub(crate) harmonics: [f64; HARMONICS],
    /// Per cent of the fundamental.
    pub(crate) distortion: f64,
    /// One period in tenths of V or A.
    pub(crate) trace: [i16; SAMPLES],
}

impl Analysis {
    /// Nothing to see.
    pub(crate) const DEAD: Self =
        Self { fundamental: 0.0, harmonics: [0.0; HARMONICS], distortion: 0.0, trace: [0; SAMPLES] };
}

/// Slowly changing distortion of a site.
#[derive(Clone, Debug)]
pub(crate) struct Distortion {
    levels: [Drift; HARMONICS],
}

impl Distortion {
    pub(crate) fn new(random: &mut Random) -> Self {
        Self { levels: std::array::from_fn(|_| Drift::new(0.05, 30.0, random)) }
    }

    pub(crate) fn step(&mut self, dt: f64, random: &mut Random) {
        for level in &mut self.levels {
            level.step(dt, random);
        }
    }

    /// Takes a channel apart: `rms` in V or A, `lag` in turns behind L1, `line_to_line` without the harmonics that
    /// three phases have in common.
    pub(crate) fn analyse(&self, shape: Shape, rms: f64, lag: f64, line_to_line: bool) -> Analysis {
        if rms < 1.0 {
            return Analysis::DEAD;
        }
        let mut harmonics = shape.spectrum();
        for (index, (part, drift)) in harmonics.iter_mut().zip(&self.levels).enumerate() {
            let cancelled = line_to_line && order(index).is_multiple_of(3);
            // Two decimals are what the registers hold: the trace then agrees with what is shown.
            *part = if cancelled { 0.0 } else { (*part * (1.0 + drift.value()) * 100.0).round() / 100.0 };
        }
        let squares: f64 = harmonics.iter().map(|part| part * part).sum();
        let distortion = squares.sqrt();
        // The meter's rms is that of the whole wave.
        let peak = SQRT_2 * rms / (1.0 + squares / 10_000.0).sqrt();
        let mut wave = [0.0; SAMPLES];
        add(&mut wave, 1.0, 1.0, -lag * TAU);
        for (index, part) in harmonics.iter().enumerate().filter(|(_, part)| **part > 0.0) {
            let order = order(index) as f64;
            // Each harmonic has an angle of its own; any will do as long as it stays.
            add(&mut wave, part / 100.0, order, (0.11 * order * order - order * lag) * TAU);
        }
        let trace = wave.map(|value| (10.0 * peak * value).round() as i16);
        Analysis { fundamental: 100.0, harmonics, distortion, trace }
    }
}

/// Adds a sine of so many periods that starts at an angle.
fn add(wave: &mut [f64; SAMPLES], amplitude: f64, periods: f64, from: f64) {
    // The pointer turns by the same angle from sample to sample.
    let (turn_sine, turn_cosine) = (TAU * periods / SAMPLES as f64).sin_cos();
    let (mut sine, mut cosine) = from.sin_cos();
    for value in wave {
        *value += amplitude * sine;
        (sine, cosine) = (sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine);
    }
}

/// Order of the harmonic at `index` of a spectrum.
pub(crate) const fn order(index: usize) -> usize {
    3 + 2 * index
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitude of one harmonic in the samples.
    fn amplitude(trace: &[i16; SAMPLES], order: usize) -> f64 {
        let (mut sine, mut cosine) = (0.0, 0.0);
        for (sample, value) in trace.iter().enumerate() {
            let angle = TAU * (order * sample) as f64 / SAMPLES as f64;
            sine += f64::from(*value) * angle.sin();
            cosine += f64::from(*value) * angle.cos();
        }
        sine.hypot(cosine) * 2.0 / SAMPLES as f64
    }

    #[test]
    fn the_trace_holds_the_harmonics_that_are_shown() {
        let distortion = Distortion::new(&mut Random::new(8));
        for (shape, rms, line_to_line) in [
            (Shape::MainsVoltage, 231.0, false),
            (Shape::GensetVoltage, 400.0, true),
            (Shape::Current, 60.0, false),
            (Shape::NeutralCurrent, 4.0, false),
        ] {
            let analysis = distortion.analyse(shape, rms, 0.333, line_to_line);
            let fundamental = amplitude(&analysis.trace, 1);
            // One count of the trace is the most that rounding can add to a harmonic.
            let tolerance = 100.0 / fundamental * 0.3 + 0.01;
            for (index, shown) in analysis.harmonics.iter().enumerate() {
                let found = 100.0 * amplitude(&analysis.trace, order(index)) / fundamental;
                assert!((found - shown).abs() < tolerance, "{shape:?} {}: {found} {shown}", order(index));
            }
            let squares: f64 = analysis.trace.iter().map(|value| f64::from(*value).powi(2)).sum();
            let trace_rms = (squares / SAMPLES as f64).sqrt() / 10.0;
            assert!((trace_rms - rms).abs() < 0.05, "{shape:?}: {trace_rms}");
        }
    }

    #[test]
    fn three_phases_cancel_their_common_harmonics_between_lines() {
        let distortion = Distortion::new(&mut Random::new(8));
        let analysis = distortion.analyse(Shape::MainsVoltage, 400.0, 0.0, true);
        assert_eq!(analysis.harmonics[0], 0.0);
        assert_ne!(analysis.harmonics[1], 0.0);
    }

    #[test]
    fn a_dead_channel_is_flat() {
        let distortion = Distortion::new(&mut Random::new(8));
        assert_eq!(distortion.analyse(Shape::Current, 0.0, 0.0, false), Analysis::DEAD);
    }
}
