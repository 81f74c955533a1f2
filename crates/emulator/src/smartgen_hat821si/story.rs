//! Some days at the demonstration site in five minutes, told again and again: source 1 fails and comes back, a feeder
//! trips and somebody comes to put it right. In every third chapter the tie jams too, and section 1 waits for source 1.
//!
//! The story pulls levers when something happens, so that whoever pulls others meanwhile is not undone.

use crate::levers::Position;

use super::switches::Drive;
use super::{Hat821si, Panel};

/// Seconds until the next chapter.
const CHAPTER: f64 = 300.0;
/// The feeder of the story, load switch 2-7: its lever, and section and index.
const FEEDER: (&str, usize, usize) = ("switch.l2_7", 1, 6);

/// What happens at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scene {
    /// How the mains of source 1 are.
    source_1: &'static str,
    /// How QTIE is.
    tie: &'static str,
    /// How load switch 2-7 is: there is a short circuit behind it.
    feeder: &'static str,
    /// Somebody stands at the controller and has set it to local.
    front: &'static str,
    /// He has repaired what was broken, and switches on again.
    repaired: bool,
}

impl Scene {
    pub(super) const NOTHING: Self =
        Self { source_1: "normal", tie: "normal", feeder: "normal", front: "remote", repaired: false };

    /// The scene at `time` seconds since power-on.
    fn at(time: f64) -> Self {
        let moment = time.rem_euclid(CHAPTER);
        // Each chapter has another trouble.
        let chapter = (time / CHAPTER) as u64 % 3;
        let trouble = ["failed", "l2_lost", "sagging"][chapter as usize];
        let during = |from, until, word, otherwise| {
            if (from..until).contains(&moment) { word } else { otherwise }
        };
        Self {
            source_1: during(25.0, 70.0, trouble, "normal"),
            tie: if chapter == 2 { during(25.0, 190.0, "will_not_close", "normal") } else { "normal" },
            feeder: during(150.0, 151.0, "trips", "normal"),
            front: during(185.0, 200.0, "local", "remote"),
            repaired: (195.0..200.0).contains(&moment),
        }
    }
}

impl Hat821si {
    /// Lets the story go on, where one is told.
    pub(super) fn play(&mut self) {
        if !self.story {
            return;
        }
        let scene = Scene::at(self.passed.as_secs_f64());
        let before = std::mem::replace(&mut self.scene, scene);
        let (feeder, side, index) = FEEDER;
        for (lever, was, is) in [
            ("src1", before.source_1, scene.source_1),
            ("switch.qtie", before.tie, scene.tie),
            (feeder, before.feeder, scene.feeder),
            ("front", before.front, scene.front),
        ] {
            if was != is {
                self.pull(lever, Position::Word(is));
            }
        }
        if scene.repaired && !before.repaired {
            self.acknowledge();
            self.loads[side].drive(index, Drive::Close, &self.limits.loads, &self.board);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trouble_alternates_with_quiet() {
        assert_eq!(Scene::at(0.0), Scene::NOTHING);
        assert_eq!(
            [30.0, 330.0, 630.0].map(|time| Scene::at(time).source_1),
            ["failed", "l2_lost", "sagging"]
        );
        let ties = [30.0, 330.0, 630.0].map(|time| Scene::at(time).tie);
        assert_eq!(ties, ["normal", "normal", "will_not_close"]);
        assert_eq!(Scene::at(930.0), Scene::at(30.0));
        assert_eq!(Scene::at(150.5).feeder, "trips");
        assert!(Scene::at(190.0).front == "local" && Scene::at(196.0).repaired);
        assert_eq!(Scene::at(250.0), Scene::NOTHING);
    }

    #[test]
    fn the_story_undoes_nobody() {
        let mut unit = super::super::tests::quiet();
        unit.story = true;
        unit.pull("src2", Position::Word("sagging"));
        for _ in 0..800 {
            unit.step(std::time::Duration::from_millis(100));
        }
        assert_eq!(unit.lever("src2"), Some(Position::Word("sagging")));
        assert_eq!(unit.lever("src1"), Some(Position::Word("normal")), "it is back");
    }
}
