//! Genset and grid on one busbar: droop, the angle between the two, and who carries how much.

use crate::random::approach;

use super::{Feed, HERTZ_PER_RPM, PhaseLoads, RATED_KVAR, RATED_KW, RATED_RPM, RATED_VOLTAGE, tenth};

/// Seconds in which power follows a governor or a voltage regulator.
const FOLLOWING: f64 = 0.4;

/// The set point of a governor (rpm) or a voltage regulator (V).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Regulation {
    /// What a controller's analog output adds to it.
    pub(crate) trim: f64,
    /// By how much rated load bends it; 0 where it holds whatever the load.
    pub(crate) droop: f64,
}

impl Regulation {
    /// The speed or voltage at a part of rated load.
    pub(super) fn settles_at(&self, rated: f64, part: f64) -> f64 {
        rated + self.trim - self.droop * part
    }

    /// The part of rated load at which a busbar held by others is met; nothing without droop.
    fn part_at(&self, rated: f64, held: f64) -> f64 {
        match self.droop {
            droop if droop > 0.0 => ((rated + self.trim - held) / droop).clamp(-0.2, 1.1),
            _ => 0.0,
        }
    }
}

/// What ties the genset to the grid.
#[derive(Clone, Debug, Default)]
pub(super) struct Coupling {
    angle: f64,
    /// kW and kvar of the genset.
    active: f64,
    reactive: f64,
}

impl Coupling {
    /// Degrees by which the genset leads the mains.
    pub(super) fn angle(&self) -> f64 {
        self.angle
    }

    /// What the mains and the genset carry of a load when both feed it: the genset what its set points ask for, the
    /// grid the rest.
    pub(super) fn split(
        &mut self,
        dt: f64,
        (active, reactive): PhaseLoads,
        grid: &Feed,
        governor: &Regulation,
        excitation: &Regulation,
    ) -> (PhaseLoads, PhaseLoads) {
        let kw = RATED_KW * governor.part_at(RATED_RPM, grid.frequency / HERTZ_PER_RPM);
        let kvar = RATED_KVAR * excitation.part_at(RATED_VOLTAGE, grid.average_voltage());
        approach(&mut self.active, kw, FOLLOWING, dt);
        approach(&mut self.reactive, kvar, FOLLOWING, dt);
        let genset = ([tenth(self.active / 3.0); 3], [tenth(self.reactive / 3.0); 3]);
        let rest = |whole: [f64; 3], part: [f64; 3]| std::array::from_fn(|n| tenth(whole[n] - part[n]));
        ((rest(active, genset.0), rest(reactive, genset.1)), genset)
    }

    /// Lets the two run against each other, and remembers what the genset carries.
    pub(super) fn follow(&mut self, dt: f64, genset: &Feed, grid: &Feed, parallel: bool) {
        if parallel {
            self.angle = 0.0;
            return;
        }
        (self.active, self.reactive) = (genset.total_active(), genset.total_reactive());
        let angle = self.angle + 360.0 * (genset.frequency - grid.frequency) * dt;
        self.angle = (angle + 180.0).rem_euclid(360.0) - 180.0;
    }
}

#[cfg(test)]
mod tests {
    use crate::plant::{Controls, Plant};

    const DT: f64 = 0.1;

    fn run(plant: &mut Plant, controls: &Controls, seconds: f64) {
        for _ in 0..(seconds / DT) as u32 {
            plant.step(DT, controls);
        }
    }

    fn paralleled() -> (Plant, Controls) {
        let mut plant = Plant::new(3);
        plant.engine.governor.droop = 60.0;
        plant.excitation.droop = 9.0;
        let mut controls = Controls { fuel: true, starter: true, mains_breaker: true, ..Controls::default() };
        run(&mut plant, &controls, 5.0);
        controls.starter = false;
        run(&mut plant, &controls, 10.0);
        controls.genset_breaker = true;
        run(&mut plant, &controls, 2.0);
        (plant, controls)
    }

    #[test]
    fn in_parallel_the_governor_chooses_the_power_and_the_grid_the_frequency() {
        let (mut plant, controls) = paralleled();
        assert!(plant.genset.total_active().abs() < 4.0, "{:?}", plant.genset);
        plant.engine.governor.trim = 15.0;
        run(&mut plant, &controls, 5.0);
        let genset = plant.genset.total_active();
        assert!((16.0..24.0).contains(&genset), "{genset}");
        assert!(plant.mains.total_active() > 5.0);
        assert!((plant.genset.frequency - plant.mains.frequency).abs() < 1e-9);
        assert_eq!(plant.angle(), 0.0);
    }

    #[test]
    fn the_genset_goes_on_alone_where_it_was_when_the_grid_leaves() {
        let (mut plant, mut controls) = paralleled();
        plant.engine.governor.trim = 30.0;
        run(&mut plant, &controls, 5.0);
        plant.fail_mains(true);
        controls.mains_breaker = false;
        run(&mut plant, &controls, 3.0);
        assert_eq!((plant.mains.voltage, plant.mains.frequency), ([0.0; 3], 0.0));
        assert!(plant.genset.total_active() > 25.0);
        assert!((plant.genset.frequency - 50.0).abs() < 1.0, "{:?}", plant.genset);

        plant.fail_mains(false);
        run(&mut plant, &controls, 2.0);
        assert!(plant.mains_healthy());
        let before = plant.angle();
        plant.engine.governor.trim += 6.0;
        run(&mut plant, &controls, 1.0);
        assert_ne!(plant.angle(), before, "two sources apart run against each other");
    }
}
