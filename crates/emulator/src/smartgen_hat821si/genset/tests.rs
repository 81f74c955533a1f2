//! The start of gensets alone, with sets that run when they are asked to.

use super::*;

const SECOND: Duration = Duration::from_secs(1);

struct Yard {
    genset: Genset,
    board: Board,
    limits: Limits,
    now: DateTime,
    available: [bool; 2],
    masters: [bool; 2],
    healthy: [bool; 2],
    runs: [bool; 2],
    auto: bool,
    serves: bool,
    feeds: [bool; 2],
    inputs: [bool; 3],
}

impl Yard {
    fn new(set: &[(&str, &str)]) -> Self {
        let mut settings = super::super::tests::settings();
        set.iter().for_each(|(id, value)| settings.set(id, value).unwrap());
        Self {
            genset: Genset::new(),
            board: Board::default(),
            limits: Limits::of(&settings),
            now: "2026-01-05T09:59:50".parse().unwrap(),
            available: [true; 2],
            masters: [true; 2],
            healthy: [true; 2],
            runs: [false; 2],
            auto: true,
            serves: false,
            feeds: [false; 2],
            inputs: [false; 3],
        }
    }

    /// Status, delay and start signals after a time.
    fn walk(&mut self, seconds: u32) -> (u16, u16, [bool; 2]) {
        for _ in 0..seconds {
            self.now = self.now.plus(SECOND);
            let [on_load_input, off_load_input, inhibited] = self.inputs;
            let scene = Scene {
                now: self.now,
                auto: self.auto,
                masters: self.masters,
                available: [0, 1].map(|source| self.available[source] || self.runs[source]),
                on_genset: [0, 1].map(|source| !self.available[source] && self.runs[source]),
                serves: self.serves,
                feeds: self.feeds,
                on_load_input,
                off_load_input,
                inhibited,
                runs: self.runs,
                limits: &self.limits,
            };
            self.genset.step(SECOND, scene, &mut self.board);
            let signals = self.genset.signals();
            self.runs = [0, 1].map(|set| signals[set] && self.healthy[set]);
        }
        (self.genset.status(), self.genset.seconds_left(), self.genset.signals())
    }
}

#[test]
fn start_and_stop_take_their_delays() {
    let mut yard = Yard::new(&[]);
    let mut walk = |start, seconds| {
        yard.genset.command(start, true);
        let (status, delay, _) = yard.walk(seconds);
        (status, delay, yard.genset.start_output())
    };
    assert_eq!(walk(true, 1), (0, 3, false));
    assert_eq!(walk(false, 1), (9, 0, false), "no longer wanted before it was started");
    assert_eq!(walk(true, 4), (8, 0, true));
    assert_eq!(walk(false, 1), (1, 5, true));
    assert_eq!(walk(true, 1), (8, 0, true), "wanted again");
    assert_eq!(walk(false, 6), (9, 0, false));
}

#[test]
fn without_mains_it_runs_until_they_are_back() {
    let mut yard = Yard::new(&[]);
    yard.available = [false, true];
    assert_eq!(yard.walk(10).0, 9, "source 2 is there");
    yard.available = [false, false];
    assert_eq!(yard.walk(10), (8, 0, [false, true]));
    assert!(yard.genset.causes().mains_abnormal && yard.genset.choice_bit().is_none());
    yard.genset.command(false, true);
    assert_eq!(yard.walk(5).0, 8, "a command does not end that");
    yard.available = [false, true];
    assert_eq!(yard.walk(10).0, 9, "its own mains are back");
    yard.available = [false, false];
    yard.walk(10);
    (yard.available, yard.serves) = ([true, false], true);
    assert_eq!(yard.walk(10).0, 8, "it still carries load");
    yard.serves = false;
    assert_eq!(yard.walk(10).0, 9);
    yard.available = [false, false];
    yard.auto = false;
    assert_eq!(yard.walk(10).0, 9, "in manual mode nobody starts it");

    let mut nothing = Yard::new(&[("gensets", "0")]);
    nothing.available = [false, false];
    assert_eq!(nothing.walk(30), (9, 0, [false; 2]));
    assert_eq!(nothing.genset.causes(), Causes::default());
}

#[test]
fn in_manual_mode_what_runs_goes_on_until_somebody_stops_it() {
    for stopped in [false, true] {
        let mut yard = Yard::new(&[]);
        yard.available = [false, false];
        yard.walk(10);
        (yard.auto, yard.inputs) = (false, [false, false, true]);
        assert_eq!(yard.walk(100).0, 8);
        if stopped {
            yard.genset.command(false, false);
        } else {
            yard.available = [true, false];
        }
        assert_eq!(yard.walk(10).0, 9, "{stopped}");
    }
    let mut yard = Yard::new(&[]);
    yard.available = [false, false];
    yard.walk(2);
    yard.auto = false;
    assert_eq!(yard.walk(100).0, 9, "it had not been started yet");
}

#[test]
fn a_start_that_cannot_be_obeyed_is_forgotten() {
    let mut yard = Yard::new(&[]);
    yard.inputs = [false, false, true];
    yard.walk(1);
    yard.genset.command(true, true);
    yard.walk(5);
    yard.inputs = [false; 3];
    assert_eq!(yard.walk(10).0, 9, "inhibited");

    yard.healthy = [false; 2];
    yard.genset.command(true, true);
    yard.walk(60);
    assert!(yard.board.has(Alarm::genset(1)));
    yard.healthy = [true; 2];
    yard.board.reset();
    assert_eq!(yard.walk(20).0, 9, "a reset starts nothing");
}

#[test]
fn inputs_start_it_and_hold_it_off() {
    let mut yard = Yard::new(&[]);
    yard.inputs = [true, false, false];
    assert_eq!(yard.walk(10).0, 8);
    assert!(yard.genset.carries() && yard.genset.causes().on_load);
    yard.inputs = [false, true, false];
    assert_eq!(yard.walk(10).0, 8);
    assert!(!yard.genset.carries() && yard.genset.causes().off_load);
    yard.inputs = [true, true, true];
    assert_eq!(yard.walk(10).0, 9);
    assert!(yard.genset.is_inhibited());
}

#[test]
fn the_calendar_starts_it_and_holds_it_off() {
    let run = [("scheduled_run_weekday", "1"), ("scheduled_run_hour", "10"), ("scheduled_run_length", "2")];
    let off_load = [&run[..], &[("scheduled_run", "1")]].concat();
    let mut yard = Yard::new(&off_load);
    assert_eq!(yard.walk(9).0, 9);
    assert_eq!(yard.walk(11), (3, 110, [false, true]), "ten past ten and ten seconds");
    assert!(yard.genset.causes().scheduled && !yard.genset.carries());
    assert_eq!(yard.walk(110), (1, 5, [false, true]));
    assert_eq!(yard.walk(6).0, 9);

    let mut yard = Yard::new(&[&run[..], &[("scheduled_run", "2")]].concat());
    yard.walk(20);
    assert!(yard.genset.carries());

    let not = [
        ("scheduled_not_run", "1"),
        ("scheduled_not_run_weekday", "7"),
        ("scheduled_not_run_hour", "10"),
        ("scheduled_not_run_length", "1"),
    ];
    let mut yard = Yard::new(&[&off_load[..], &not].concat());
    yard.available = [false, false];
    yard.inputs[1] = true;
    assert_eq!(yard.walk(20).0, 8, "who asks for it gets it");
    yard.inputs[1] = false;
    assert_eq!(yard.walk(20), (2, 30, [false; 2]));
    assert!(yard.genset.is_not_scheduled());
    assert_eq!(yard.walk(40).0, 3, "not running comes before running");
}

#[test]
fn a_set_that_does_not_run_is_told_of() {
    let mut yard = Yard::new(&[("genset_supply_time", "20")]);
    yard.healthy[1] = false;
    yard.available = [false; 2];
    yard.walk(20);
    assert!(!yard.board.has(Alarm::genset(1)));
    yard.walk(10);
    assert!(yard.board.has(Alarm::genset(1)));
    assert_eq!(yard.walk(1), (9, 0, [false; 2]), "it is not asked again");
    yard.board.reset();
    yard.healthy[1] = true;
    assert_eq!(yard.walk(5).2, [false, true]);
}

#[test]
fn of_two_sets_one_is_chosen() {
    let two = |choice| Yard::new(&[("gensets", "2"), ("genset_choice", choice), ("genset_2_turn", "1")]);
    let mut yard = two("1");
    yard.available = [false, false];
    assert_eq!(yard.walk(10).2, [true, false], "that of the first master");
    assert_eq!(yard.genset.choice_bit(), Some(2));
    yard.healthy[0] = false;
    assert_eq!(yard.walk(40).2, [false, true], "the other one takes over");

    let mut yard = two("1");
    (yard.available, yard.masters) = ([false, false], [false, true]);
    assert_eq!(yard.walk(10).2, [false, true]);

    let mut yard = two("0");
    yard.available = [false, false];
    assert_eq!(yard.walk(10).2, [false, true]);
    assert_eq!(yard.genset.choice_bit(), Some(0));
    yard.feeds = [false, true];
    yard.walk(54);
    assert_eq!(yard.walk(9).2, [true, true], "its turn was a minute, and it still feeds somebody");
    assert_eq!(yard.genset.leaving(), [false, true]);
    yard.feeds = [true, false];
    assert_eq!(yard.walk(1).2, [true, false]);

    let mut yard = two("2");
    yard.genset.command(true, true);
    yard.walk(60);
    yard.genset.command(false, true);
    yard.walk(10);
    yard.available = [false, false];
    assert_eq!(yard.walk(10).2, [false, true], "the first one has run");
    assert_eq!(yard.genset.choice_bit(), Some(1));
}
