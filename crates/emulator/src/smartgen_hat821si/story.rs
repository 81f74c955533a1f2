//! Some days at the demonstration site in five minutes, told again and again: source 1 fails and comes back, a feeder
//! trips and somebody comes to put it right. In every third chapter the tie jams too, and section 1 waits for him.

use super::plant::Trouble;

/// Seconds until the next chapter.
const CHAPTER: f64 = 300.0;

/// What happens at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// What ails source 1.
    pub(super) source_1: Trouble,
    /// QTIE does not move.
    pub(super) tie_jammed: bool,
    /// There is a short circuit behind load switch 2-7.
    pub(super) feeder_fault: bool,
    /// Somebody stands at the controller and has set it to local.
    pub(super) attended: bool,
    /// He has repaired what was broken, and switches on again.
    pub(super) repaired: bool,
}

impl Scene {
    pub(super) const NOTHING: Self = Self {
        source_1: Trouble::Nothing,
        tie_jammed: false,
        feeder_fault: false,
        attended: false,
        repaired: false,
    };

    /// The scene at `time` seconds since power-on.
    pub(super) fn at(time: f64) -> Self {
        let moment = time.rem_euclid(CHAPTER);
        // Each chapter has another trouble.
        let chapter = (time / CHAPTER) as u64 % 3;
        let trouble = match chapter {
            0 => Trouble::Blackout,
            1 => Trouble::PhaseLost,
            _ => Trouble::Sag,
        };
        Self {
            source_1: if (25.0..70.0).contains(&moment) { trouble } else { Trouble::Nothing },
            tie_jammed: chapter == 2 && (25.0..190.0).contains(&moment),
            feeder_fault: (150.0..180.0).contains(&moment),
            attended: (185.0..200.0).contains(&moment),
            repaired: (195.0..200.0).contains(&moment),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trouble_alternates_with_quiet() {
        assert_eq!(Scene::at(0.0), Scene::NOTHING);
        assert_eq!(Scene::at(30.0).source_1, Trouble::Blackout);
        assert_eq!(Scene::at(330.0).source_1, Trouble::PhaseLost);
        assert_eq!(Scene::at(630.0).source_1, Trouble::Sag);
        assert_eq!([30.0, 330.0, 630.0].map(|time| Scene::at(time).tie_jammed), [false, false, true]);
        assert_eq!(Scene::at(930.0), Scene::at(30.0));
        assert!(Scene::at(160.0).feeder_fault && Scene::at(190.0).attended && Scene::at(196.0).repaired);
        assert_eq!(Scene::at(250.0), Scene::NOTHING);
    }
}
