//! The load switches of one side, with switches that move at once unless they are told not to.

use super::*;

const TENTH: Duration = Duration::from_millis(100);

struct Side {
    loads: Loads,
    heard: Heard,
    board: Board,
    limits: Limits,
    full: Option<usize>,
    stuck: Option<usize>,
    dead: u32,
}

impl Side {
    fn new(set: &[(&str, &str)]) -> Self {
        let mut settings = super::super::tests::settings();
        set.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
        Self {
            loads: Loads::new(0),
            heard: Heard { closed: [true; FEEDERS], tripped: [false; FEEDERS], in_work: [true; FEEDERS] },
            board: Board::default(),
            limits: Limits::of(&settings),
            full: None,
            stuck: None,
            dead: 0,
        }
    }

    fn around(&self, alive: bool, auto: bool) -> Around<'_> {
        Around { heard: self.heard, alive, auto, full: self.full, limits: &self.limits }
    }

    fn run(&mut self, tenths: u32, alive: bool, auto: bool) {
        for _ in 0..tenths {
            self.dead = if alive { 0 } else { self.dead + 1 };
            for (feeder, drive) in self.loads.drives().into_iter().enumerate() {
                if let Some(drive) = drive.filter(|_| self.stuck != Some(feeder)) {
                    self.heard.closed[feeder] = drive.closes();
                }
            }
            if self.dead >= 10 {
                self.heard.closed = [false; FEEDERS];
            }
            let around = Around { heard: self.heard, alive, auto, full: self.full, limits: &self.limits };
            self.loads.step(TENTH, around, &mut self.board);
        }
    }

    fn drive(&mut self, index: usize, drive: Drive) {
        self.loads.drive(index, drive, &self.limits, &self.board);
    }

    fn closed(&self) -> usize {
        self.heard.closed.iter().filter(|closed| **closed).count()
    }
}

#[test]
fn in_auto_they_come_back_one_a_second_by_their_priority() {
    let mut side = Side::new(&[("load_1_1_priority", "12"), ("load_1_12_priority", "1")]);
    side.run(20, false, true);
    assert_eq!(side.closed(), 0);
    let mut acted = Vec::new();
    for _ in 0..13 {
        side.run(10, true, true);
        acted.push((side.closed(), side.loads.acted()));
    }
    assert_eq!(acted[..3], [(0, 12), (1, 2), (2, 3)], "the number is that of the one that moves");
    assert_eq!(acted[11..], [(11, 1), (12, 1)]);
    assert!(side.loads.steps().is_none() && !side.loads.asks());
}

#[test]
fn one_without_priority_stays_open() {
    let mut side = Side::new(&[("load_1_5_priority", "0")]);
    side.run(20, false, true);
    side.run(200, true, true);
    assert_eq!((side.closed(), side.heard.closed[4]), (11, false));
}

#[test]
fn those_that_fall_as_the_voltage_comes_back_come_back_too() {
    let mut side = Side::new(&[]);
    side.run(9, false, true);
    side.heard.closed = [false; FEEDERS];
    side.run(200, true, true);
    assert_eq!(side.closed(), 12);
}

#[test]
fn in_manual_the_window_asks_first() {
    let mut side = Side::new(&[]);
    side.run(20, false, false);
    side.run(50, true, false);
    assert!(side.loads.asks() && side.loads.steps().is_none() && side.closed() == 0);
    side.loads.answer(true);
    side.run(200, true, false);
    assert_eq!((side.closed(), side.loads.asks()), (12, false));

    side.run(20, false, false);
    side.run(10, true, false);
    side.loads.answer(false);
    side.run(200, true, false);
    assert_eq!((side.closed(), side.loads.asks()), (0, false));

    let mut side = Side::new(&[("stepwise_confirmation", "0")]);
    side.run(20, false, false);
    side.run(200, true, false);
    assert_eq!((side.closed(), side.loads.asks()), (12, false), "nobody is asked");
}

#[test]
fn one_that_was_opened_stays_open_and_a_tripped_one_does_not_close() {
    let mut side = Side::new(&[]);
    side.drive(4, Drive::Open);
    assert_eq!(side.loads.driven(Drive::Open).iter().collect::<Vec<_>>(), [4]);
    assert_eq!((side.loads.steps(), side.loads.acted()), (Some(Drive::Open), 5));
    side.run(4, true, true);
    assert_eq!((side.closed(), side.loads.acted()), (11, 5));
    side.heard.tripped[6] = true;
    side.heard.closed[6] = false;
    side.run(1, true, true);
    side.heard.tripped[6] = false;
    side.drive(6, Drive::Close);
    side.run(20, false, true);
    side.run(200, true, true);
    assert_eq!((side.closed(), side.loads.trip_number()), (10, 7));
    assert!(side.board.has(Alarm::feeder_tripped(0, 6)));
    side.board.reset();
    side.loads.acknowledge();
    side.drive(6, Drive::Close);
    side.drive(4, Drive::Close);
    side.run(4, true, true);
    assert_eq!((side.closed(), side.loads.trip_number()), (12, 0));
}

#[test]
fn a_trip_that_is_only_told_of_is_acted_upon() {
    let mut side = Side::new(&[]);
    assert!(side.board.inject(527, 3, true));
    side.run(2, true, true);
    assert_eq!((side.closed(), side.loads.trip_number()), (11, 4));
}

#[test]
fn nothing_closes_without_voltage() {
    let mut side = Side::new(&[]);
    side.run(20, false, true);
    side.drive(0, Drive::Close);
    assert!(side.loads.driven(Drive::Close).is_empty());
}

#[test]
fn one_that_does_not_move_is_told_of_and_left_alone() {
    let mut side = Side::new(&[]);
    side.stuck = Some(2);
    side.drive(2, Drive::Open);
    side.run(31, true, true);
    assert!(side.board.has(Alarm::feeder_stuck(0, 2, Drive::Open)));
    assert_eq!((side.loads.failure_number(), side.loads.driven(Drive::Open).len()), (3, 0));
    side.drive(2, Drive::Open);
    assert!(side.loads.driven(Drive::Open).is_empty());

    side.board.reset();
    side.run(20, false, true);
    side.run(300, true, true);
    assert_eq!(side.closed(), 11, "the others come back");
    assert!(side.board.has(Alarm::feeder_stuck(0, 2, Drive::Close)));
    side.board.reset();
    side.loads.acknowledge();
    assert_eq!(side.loads.failure_number(), 0);
}

#[test]
fn one_that_is_drawn_out_does_not_come_back_by_itself() {
    let mut side = Side::new(&[]);
    side.heard.in_work[1] = false;
    side.heard.closed[1] = false;
    side.run(50, true, true);
    assert_eq!(side.closed(), 11);
    side.drive(1, Drive::Close);
    side.run(5, true, true);
    assert!(side.heard.closed[1], "on the test bench it moves");
}

#[test]
fn what_a_source_cannot_carry_waits_until_it_can() {
    let mut side = Side::new(&[]);
    let (priority, feeder) = side.loads.least_important(side.around(true, true), &side.board).unwrap();
    assert_eq!((priority, feeder), (12, 11));
    side.loads.unload(feeder, 1, &side.limits);
    side.run(5, true, true);
    assert_eq!((side.closed(), side.loads.unloaded(Some(1)).len()), (11, 1));
    assert!(side.loads.unloaded(Some(0)).is_empty());
    side.run(20, false, true);
    side.full = Some(0);
    side.run(50, true, true);
    assert_eq!((side.closed(), side.loads.unloaded(None).len()), (0, 12), "there is no room");
    side.full = None;
    let (_, first) = side.loads.most_important(side.around(true, true), &side.board).unwrap();
    side.loads.recover(first, &side.limits);
    assert_eq!(side.loads.recovering(None).iter().collect::<Vec<_>>(), [0]);
    side.run(5, true, true);
    assert_eq!(
        (side.closed(), side.loads.unloaded(None).len(), side.loads.recovering(None).len()),
        (1, 11, 0)
    );
}
