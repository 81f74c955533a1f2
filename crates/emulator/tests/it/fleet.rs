//! Several controllers whose plants are joined, and the files that say so.

use std::fs;
use std::path::Path;
use std::time::Duration;

use busbar_emulator::{Emulation, Fleet, start_fleet};
use busbar_link::Endpoint;

/// What `busbar demo` imitates, from the folder of the examples.
const DEMONSTRATION: &str = "../../crates/cli/src/commands/demo/fleet.toml";

/// A fleet that is shipped, with ports of the system's choice.
fn shipped(name: &str) -> Fleet {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/fleets").join(name);
    let text = fs::read_to_string(&path).unwrap();
    let mut fleet = Fleet::parse(name, &text).unwrap_or_else(|findings| panic!("{findings}"));
    for wire in &mut fleet.wires {
        match wire {
            Endpoint::Tcp { port, .. } | Endpoint::RtuTcp { port, .. } => *port = 0,
            other => *other = "rtu+tcp://127.0.0.1:0".parse().unwrap(),
        }
    }
    fleet
}

/// A fleet whose clock stands, but for what the test lets pass.
struct Site {
    emulation: Emulation,
}

impl Site {
    async fn new(name: &str) -> Self {
        let emulation = start_fleet(shipped(name)).await.unwrap();
        emulation.controllers().iter().for_each(|controller| controller.pause(true));
        let site = Self { emulation };
        site.pass(5);
        site
    }

    fn pull(&self, controller: usize, lever: &str, to: &str) {
        self.emulation.controllers()[controller].with(|device| device.pull(lever, to)).unwrap();
    }

    fn pass(&self, seconds: u64) {
        self.emulation.controllers()[0].step(Duration::from_secs(seconds));
    }

    fn fact(&self, controller: usize, name: &str) -> String {
        self.emulation.controllers()[controller].with(|device| device.fact(name)).unwrap().to_string()
    }

    fn number(&self, controller: usize, name: &str) -> f64 {
        self.fact(controller, name).parse().unwrap()
    }

    fn facts(&self, controllers: std::ops::Range<usize>, name: &str) -> Vec<String> {
        controllers.map(|controller| self.fact(controller, name)).collect()
    }

    /// Seconds until a fact is so.
    fn seconds_until(&self, controller: usize, name: &str, value: &str) -> u64 {
        for second in 0..600 {
            if self.fact(controller, name) == value {
                return second;
            }
            self.pass(1);
        }
        panic!("{name} of {controller} is {}, not {value}", self.fact(controller, name));
    }
}

#[tokio::test]
async fn the_grid_fails_and_the_site_saves_itself() {
    for fleet in ["emergency-power.toml", DEMONSTRATION] {
        saves_itself(&Site::new(fleet).await);
    }
}

/// The first two are gensets, the third is the transfer switch before them.
fn saves_itself(site: &Site) {
    assert_eq!(site.facts(0..2, "breaker.mains.closed"), ["yes", "yes"]);
    assert!(site.number(0, "mains.l1.voltage") > 220.0 && site.number(1, "mains.l1.voltage") > 220.0);

    site.pull(2, "grid", "failed");
    site.pass(3);
    assert_eq!(site.facts(0..2, "mains.l1.voltage"), ["0", "0"], "what hangs on a dead section is dead");
    for genset in 0..2 {
        let seconds = site.seconds_until(genset, "breaker.genset.closed", "yes");
        assert!(seconds < 40, "genset {genset}: {seconds} s");
    }
    site.pass(5);
    assert_eq!(site.facts(0..2, "breaker.mains.closed"), ["no", "no"]);
    assert!((0..2).all(|genset| site.number(genset, "genset.power.active") > 10.0));

    site.pull(2, "grid", "normal");
    for genset in 0..2 {
        site.seconds_until(genset, "breaker.mains.closed", "yes");
        site.seconds_until(genset, "breaker.genset.closed", "no");
    }
    site.pass(5);
    assert_eq!(site.facts(0..2, "breaker.genset.closed"), ["no", "no"]);
    assert!((0..2).all(|genset| site.number(genset, "mains.power.active") > 10.0));
}

#[tokio::test]
async fn one_source_fails_and_only_what_the_switch_cannot_feed_starts_its_genset() {
    let site = Site::new("emergency-power.toml").await;
    site.pull(2, "switch.qtie", "will_not_close");
    site.pull(2, "src1", "failed");
    site.seconds_until(0, "breaker.genset.closed", "yes");
    assert_eq!(site.fact(1, "state.engine"), "stopped");
    assert!(site.number(1, "mains.l1.voltage") > 220.0);
}

#[tokio::test]
async fn a_sick_feed_is_sick_behind_the_transformer_too() {
    let site = Site::new("emergency-power.toml").await;
    site.pull(2, "src2.frequency", "49.2");
    site.pull(2, "src1", "reversed");
    site.pass(2);
    let hertz = site.number(1, "mains.frequency");
    assert!((49.1..49.3).contains(&hertz), "{hertz}");
    assert_eq!(site.fact(0, "mains.phase_order.wrong"), "yes");
}

/// kW of each of the first three controllers' gensets.
fn carried(site: &Site) -> [f64; 3] {
    [0, 1, 2].map(|genset| site.number(genset, "genset.power.active"))
}

#[tokio::test]
async fn three_units_share_a_bus_bar_and_carry_the_consumers_of_one_that_trips() {
    let site = Site::new("bus-bar.toml").await;
    assert_eq!(site.facts(0..3, "plant.power.active"), ["0", "0", "0"]);
    site.pull(3, "grid", "failed");
    for genset in 0..3 {
        site.seconds_until(genset, "breaker.genset.closed", "yes");
    }
    site.pass(30);
    let each = carried(&site);
    assert!(each.iter().all(|kw| (28.0..32.0).contains(kw)), "90 kW in three: {each:?}");
    for genset in 0..3 {
        let all = site.number(genset, "plant.power.active");
        assert!((88.0..92.0).contains(&all), "every unit knows of all: {all}");
        assert!((36.0..39.0).contains(&site.number(genset, "plant.load.active")));
    }

    site.pull(1, "emergency_stop", "pressed");
    site.pass(10);
    let [first, second, third] = carried(&site);
    assert_eq!(second, 0.0);
    assert!((43.0..47.0).contains(&first) && (43.0..47.0).contains(&third), "{first} {third}");
    assert!((88.0..92.0).contains(&site.number(1, "plant.power.active")), "it hears of the others");

    site.pull(3, "grid", "normal");
    for genset in [0, 2] {
        site.seconds_until(genset, "state.engine", "stopped");
    }
    assert_eq!(carried(&site), [0.0; 3]);
    assert!(site.number(1, "mains.power.active") > 25.0, "its own mains feed its consumers");
}

#[tokio::test]
async fn whoever_looks_while_an_hour_is_stepped_is_let_in() {
    let site = Site::new("bus-bar.toml").await;
    let [first, second] = [0, 1].map(|index| site.emulation.controllers()[index].clone());
    let start = second.with(|device| device.time());
    let end = start + Duration::from_secs(3600);
    let stepping = std::thread::spawn(move || first.step(Duration::from_secs(3600)));
    let mut seen = Vec::new();
    while !stepping.is_finished() {
        seen.push(second.with(|device| device.time()));
    }
    stepping.join().unwrap();
    assert_eq!(second.with(|device| device.time()), end);
    seen.dedup();
    assert!(seen.len() > 100, "{}", seen.len());
}

/// Three units that share a bus bar.
async fn on_one_bar() -> Site {
    let site = Site::new("bus-bar.toml").await;
    site.pull(3, "grid", "failed");
    for genset in 0..3 {
        site.seconds_until(genset, "breaker.genset.closed", "yes");
    }
    site.pass(30);
    site
}

#[tokio::test]
async fn whatever_is_on_one_bus_bar_has_one_frequency_and_one_voltage() {
    for (lever, to) in
        [("governor", "normal"), ("governor", "hunting"), ("avr", "high"), ("fuel.supply", "shut")]
    {
        let site = on_one_bar().await;
        site.pull(1, lever, to);
        for _ in 0..60 {
            site.emulation.controllers()[0].step(Duration::from_millis(100));
            if site.facts(0..3, "breaker.genset.closed") != ["yes", "yes", "yes"] {
                break;
            }
            let hertz = site.facts(0..3, "genset.frequency");
            assert!(hertz.iter().all(|other| *other == hertz[0]), "{lever} {hertz:?}");
            let volts = [0, 1, 2].map(|genset| site.number(genset, "genset.l1.voltage"));
            assert!(volts.iter().all(|other| (other - volts[0]).abs() < 1.0), "{lever} {volts:?}");
            let all: f64 = carried(&site).iter().sum();
            // What one lets go the others take a step later.
            assert!((78.0..102.0).contains(&all), "{lever} {all}");
        }
    }
}

#[tokio::test]
async fn a_set_that_the_others_turn_or_excite_is_thrown_off_the_bus_bar() {
    for (lever, to, alarm) in [
        ("fuel.supply", "shut", "load_dump_alarms.reverse_power"),
        ("avr", "failed", "load_dump_alarms.excitation_lost"),
    ] {
        let site = on_one_bar().await;
        site.pull(1, lever, to);
        let seconds = site.seconds_until(1, "breaker.genset.closed", "no");
        assert!(seconds < 15, "{lever}: {seconds} s");
        assert_eq!(site.fact(1, alarm), "yes", "{lever}");
        site.pass(5);
        assert_eq!(site.facts(0..3, "breaker.genset.closed"), ["yes", "no", "yes"]);
        let [first, second, third] = carried(&site);
        assert!(second == 0.0 && (88.0..92.0).contains(&(first + third)), "{first} {third}");
    }
}

#[tokio::test]
async fn joined_controllers_have_one_clock_and_the_same_run_every_time() {
    let runs = [Site::new("bus-bar.toml").await, Site::new("bus-bar.toml").await];
    for site in &runs {
        let controllers = site.emulation.controllers();
        controllers[1].run_at(7.0).unwrap();
        assert!(controllers.iter().all(|controller| controller.pace().speed == 7.0));
        site.pull(3, "grid", "failed");
    }
    runs[0].pass(60);
    (0..60).for_each(|_| runs[1].pass(1));
    let image = |site: &Site, controller: usize| {
        site.emulation.controllers()[controller].with(|device| {
            let points = device.profile().points.iter().filter(|point| point.access.is_readable());
            let registers = points.filter_map(|point| device.registers(point.address, point.registers));
            (device.time(), registers.map(<[u16]>::to_vec).collect::<Vec<_>>())
        })
    };
    for controller in 0..4 {
        assert_eq!(image(&runs[0], controller), image(&runs[1], controller), "{controller}");
    }
}

const HEAD: &str = "[fleet]\ntitle = \"Two\"\n[[wires]]\nid = \"w\"\nendpoint = \"tcp://127.0.0.1:0\"\n";
const GENSET: &str = "[[controllers]]\nid = \"a\"\nprofile = \"datakom-d\"\nwire = \"w\"\n";
const SWITCH: &str = "[[controllers]]\nid = \"s\"\nprofile = \"smartgen-hat821si\"\nwire = \"w\"\nunit = 9\n";

#[test]
fn what_is_wrong_with_a_file_is_said_with_its_line_and_a_remedy() {
    let with = |rest: &str| format!("{HEAD}{GENSET}{SWITCH}{rest}");
    let supply = |rest: &str| with(&format!("[[supplies]]\n{rest}"));
    for (text, line, says) in [
        (String::new(), 1, "there are no controllers"),
        ("[fleet".to_owned(), 1, "this is not TOML"),
        ("fleet = 3\n".to_owned(), 1, "`fleet` has the wrong type"),
        (HEAD.replace("Two", ""), 2, "this is no title"),
        (HEAD.replace("title", "name"), 2, "unknown key `name` in [fleet]"),
        (HEAD.replace("tcp:", "http:"), 5, "http"),
        (format!("{HEAD}controllers = 3\n"), 6, "unknown key `controllers` in [[wires]]"),
        (format!("{HEAD}{HEAD}"), 6, "this is not TOML"),
        (with("[[wires]]\nid = \"w\"\nendpoint = \"tcp://127.0.0.1:0\"\n"), 16, "the id `w` is there twice"),
        (format!("{HEAD}[[controllers]]\n"), 6, "`id` is missing in [[controllers]]"),
        (
            HEAD.to_owned() + &GENSET.replace("datakom-d", "datakom-e"),
            8,
            "there is no controller `datakom-e`",
        ),
        (HEAD.to_owned() + &GENSET.replace("\"w\"", "\"x\""), 9, "there is no wire `x`"),
        (HEAD.to_owned() + &GENSET.replace("\"a\"", "\"A b\""), 7, "`A b` is no id"),
        (format!("{HEAD}{GENSET}unit = 0\n"), 10, "unit 0 is not possible"),
        (format!("{HEAD}{GENSET}unit = 3000000000\n"), 10, "unit 3000000000 is not possible"),
        (format!("{HEAD}{GENSET}unit = \"1\"\n"), 10, "`unit` has the wrong type"),
        (format!("{HEAD}{GENSET}model = \"D-900\"\n"), 10, "`D-900` is not a model"),
        (format!("{HEAD}{GENSET}seed = -1\n"), 10, "`seed` is -1"),
        (format!("{HEAD}{GENSET}settings = {{ crank = 1 }}\n"), 10, "crank"),
        (format!("{HEAD}{GENSET}levers = {{ mains = \"gone\" }}\n"), 10, "`mains` cannot be `gone`"),
        (format!("{HEAD}{GENSET}levers = 3\n"), 10, "`levers` has the wrong type"),
        (format!("{HEAD}{GENSET}{GENSET}"), 11, "the id `a` is there twice"),
        (format!("{HEAD}{GENSET}{}", GENSET.replace("\"a\"", "\"b\"")), 10, "unit 1 is there twice"),
        (supply("from = \"s\"\nsection = 3\nto = \"a\"\n"), 17, "`s` has no section 3"),
        (supply("from = \"s\"\nsection = 0\nto = \"a\"\n"), 17, "`s` has no section 0"),
        (supply("from = \"a\"\nsection = 1\nto = \"a\"\n"), 16, "`a` has no bus sections"),
        (supply("from = \"s\"\nsection = 1\nto = \"s\"\n"), 18, "`s` is no genset"),
        (supply("from = \"z\"\nsection = 1\nto = \"a\"\n"), 16, "there is no controller `z`"),
        (supply("from = \"s\"\nto = \"a\"\n"), 15, "`section` is missing in [[supplies]]"),
        (
            supply(
                "from = \"s\"\nsection = 1\nto = \"a\"\n[[supplies]]\nfrom = \"s\"\nsection = 2\nto = \"a\"\n",
            ),
            22,
            "supplied twice",
        ),
        (with("[[bus_bars]]\ngensets = [\"a\"]\n"), 15, "a bus bar needs two gensets"),
        (with("[[bus_bars]]\ngensets = [\"a\", \"a\"]\n"), 16, "`a` is on a bus bar already"),
        (with("[[bus_bars]]\ngensets = [\"a\", \"s\"]\n"), 16, "`s` is no genset"),
        (with("[[bus_bars]]\n"), 15, "`gensets` is missing in [[bus_bars]]"),
        (format!("{HEAD}{GENSET}unit = 241\n"), 10, "unit 241 is not possible"),
        (
            format!("{HEAD}[[wires]]\nid = \"v\"\nendpoint = \"tcp://127.0.0.1:0\"\n{GENSET}"),
            6,
            "nobody is on wire `v`",
        ),
        (
            format!("{HEAD}[[wires]]\nid = \"v\"\nendpoint = \"rtu+tcp://127.0.0.1:0\"\n{GENSET}")
                .replace(":0", ":9"),
            8,
            "another wire has this endpoint",
        ),
        (with("[[tie]]\n"), 15, "unknown key `tie` in a fleet file"),
    ] {
        let findings = Fleet::parse("f.toml", &text).err().unwrap_or_else(|| panic!("accepted: {text}"));
        let said = findings.to_string();
        let there = said.lines().any(|said| said.contains(&format!("f.toml:{line}:")) && said.contains(says));
        assert!(there, "line {line}, {says}:\n{said}\n{text}");
    }
}

#[test]
fn what_is_wrong_is_said_once_and_where_it_stands() {
    let supply = "[[supplies]]\nfrom = \"s\"\nsection = 1\nto = \"a\"\n";
    let many: String = (0..300)
        .map(|n| GENSET.replace("\"a\"", &format!("\"a{n}\"")) + &format!("unit = {}\n", n % 200 + 1))
        .collect();
    for (text, says) in [
        (format!("{HEAD}{GENSET}unit = 0\n{SWITCH}{supply}"), "unit 0 is not possible"),
        (HEAD.replace("tcp:", "http:") + GENSET + SWITCH + supply, "unknown scheme"),
        (format!("{HEAD}{GENSET}{SWITCH}[[bus_bars]]\ngensets = 3\n"), "`gensets` has the wrong type"),
        (format!("{HEAD}{many}[[bus_bars]]\ngensets = [\"a1\", \"a299\"]\n"), "more than 100 controllers"),
    ] {
        let said = Fleet::parse("f.toml", &text).unwrap_err().to_string();
        assert_eq!(said.matches("f.toml:").count(), 1, "{said}");
        assert!(said.contains(says), "{said}");
    }
}

#[test]
fn a_text_that_is_cut_anywhere_is_read_or_refused() {
    let whole = format!(
        "{HEAD}{GENSET}levers = {{ load = 40 }}\n{SWITCH}[[supplies]]\nfrom = \"s\"\nsection = 1\nto = \"a\"\n"
    );
    assert_eq!(Fleet::parse("f.toml", &whole).unwrap().members.len(), 2);
    for end in 0..whole.len() {
        let _ = Fleet::parse("f.toml", &whole[..end]);
    }
}
