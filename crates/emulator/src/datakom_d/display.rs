//! The pages of the 128 x 64 display. They show what the registers hold, so that a client can hold one against the
//! other; which pages there are is not in the manual.

use crate::bank::Bank;
use crate::lcd::{COLUMNS, Canvas};
use crate::plant::Synchronism;
use crate::waveform::{Analysis, SAMPLES, order};

use super::DatakomD;
use super::keys::Group;
use super::render::SERVICES;
use super::status::Shown;

const LCD: u16 = 10648;
/// Lines of text under the title of a page.
const LINES: usize = 6;

/// Stores the page that the keys have turned to.
pub(super) fn draw(unit: &DatakomD, shown: &Shown, analysis: &Analysis, bank: &mut Bank) {
    let mut page = Page { canvas: Canvas::new(), bank };
    page.head(unit);
    match unit.menu.group {
        Group::Status => match page.turned(unit, 2) {
            0 => page.status(unit, shown),
            _ => page.mimic(unit),
        },
        Group::Mains => page.feed(unit, "Mains", &MAINS),
        Group::Genset => page.feed(unit, "Genset", &GENSET),
        Group::Engine => page.engine(unit),
        Group::Synchroscope => page.synchroscope(unit),
        Group::Scope => match page.turned(unit, 2) {
            0 => page.scope(unit, analysis),
            _ => page.harmonics(unit, analysis),
        },
        Group::Counters => page.counters(),
        Group::Service => page.service(),
        Group::Alarms => page.alarms(unit, shown),
        Group::Unit => page.identity(unit),
    }
    let bytes = page.canvas.datakom_bytes();
    bank.bytes(LCD, bytes);
}

/// Where a feed's page gets its values from.
struct FeedRows {
    phase_voltage: u16,
    line_voltage: u16,
    current: u16,
    frequency: u16,
    active: u16,
    reactive: u16,
    apparent: u16,
    power_factor: u16,
}

const MAINS: FeedRows = FeedRows {
    phase_voltage: 10240,
    line_voltage: 10252,
    current: 10264,
    frequency: 10338,
    active: 10292,
    reactive: 10308,
    apparent: 10324,
    power_factor: 10334,
};

const GENSET: FeedRows = FeedRows {
    phase_voltage: 10246,
    line_voltage: 10258,
    current: 10270,
    frequency: 10339,
    active: 10294,
    reactive: 10310,
    apparent: 10326,
    power_factor: 10335,
};

/// A page that is being drawn.
struct Page<'a> {
    canvas: Canvas,
    bank: &'a Bank,
}

impl Page<'_> {
    /// The model and the mode, on every page.
    fn head(&mut self, unit: &DatakomD) {
        self.canvas.text(0, 0, &unit.identity.model);
        let mode = self.label(unit, "unit_mode", unit.mode as u8);
        self.canvas.text_right(0, mode);
        self.canvas.invert(0);
    }

    fn status(&mut self, unit: &DatakomD, shown: &Shown) {
        let status = self.label(unit, "operation_status", unit.sequence.operation() as u8);
        // The longest take two lines.
        let (first, rest) = match status.rsplit_once(' ') {
            Some(halves) if status.len() > COLUMNS => halves,
            _ => (status, ""),
        };
        self.canvas.text(1, 0, first);
        self.canvas.text(2, 0, rest);
        if unit.seconds_left() > 0 {
            self.canvas.text_right(2, &format!("{} s", unit.seconds_left()));
        }
        for (line, name, rows) in [(3, "M", &MAINS), (4, "G", &GENSET)] {
            let [l1, l2, l3] = self.phases(rows.phase_voltage);
            self.canvas.text(line, 0, &format!("{name} {l1:3.0} {l2:3.0} {l3:3.0}V"));
            self.canvas.text_right(line, &format!("{:4.1}", self.number(rows.frequency)));
        }
        let load = self.number(MAINS.active) + self.number(GENSET.active);
        self.canvas.text(5, 0, &format!("{load:.1} kW  {:.0} rpm", self.number(10376)));
        self.canvas.text(6, 0, &format!("Fuel {:.0}%  Bat {:.1}V", self.number(10363), self.number(10341)));
        match shown.count() {
            0 => self.canvas.text(7, 0, "No alarms"),
            count => {
                self.canvas.text(7, 0, &format!("Alarms: {count}"));
                self.canvas.invert(7);
            }
        }
    }

    /// Mains, load and genset with the breakers between them.
    fn mimic(&mut self, unit: &DatakomD) {
        let plant = &unit.plant;
        for (x, name) in [(0, "M"), (108, "G")] {
            self.canvas.frame(x, 20, 19, 17);
            self.canvas.text(3, x / 6 + 1, name);
        }
        self.breaker(19, plant.mains_breaker.closed);
        self.breaker(64, plant.genset_breaker.closed);
        // The load hangs on the middle of the bus bar.
        self.canvas.fill(63, 24, 2, 22);
        for (line, column, address) in [(5, 0, MAINS.active), (5, 15, GENSET.active)] {
            self.canvas.text(line, column, &format!("{:.1}", self.number(address)));
        }
        let load = self.number(MAINS.active) + self.number(GENSET.active);
        self.canvas.text(6, 7, &format!("{load:.1} kW"));
        let status = self.label(unit, "operation_status", unit.sequence.operation() as u8);
        self.canvas.text(1, 0, status);
    }

    /// A breaker in a line of 44 pixels: closed it is whole, open its contact points away.
    fn breaker(&mut self, x: usize, closed: bool) {
        self.canvas.fill(x, 28, 14, 1);
        self.canvas.fill(x + 30, 28, 14, 1);
        if closed {
            self.canvas.fill(x + 14, 27, 16, 3);
        } else {
            for step in 0..14 {
                self.canvas.dot(x + 14 + step, 27 - step / 2);
            }
        }
    }

    fn feed(&mut self, unit: &DatakomD, name: &str, rows: &FeedRows) {
        match self.turned(unit, 2) {
            0 => {
                self.title(name, "1/2");
                for (line, what, address, decimals) in [
                    (2, "V", rows.phase_voltage, 0),
                    (3, "VLL", rows.line_voltage, 0),
                    (4, "A", rows.current, 1),
                ] {
                    let [l1, l2, l3] = self.phases(address);
                    self.canvas.text(line, 0, what);
                    self.canvas
                        .text_right(line, &format!("{l1:5.decimals$} {l2:5.decimals$} {l3:5.decimals$}"));
                }
                self.row(5, "Frequency", rows.frequency, 2, "Hz");
            }
            _ => {
                self.title(name, "2/2");
                self.row(2, "Active", rows.active, 1, "kW");
                self.row(3, "Reactive", rows.reactive, 1, "kvar");
                self.row(4, "Apparent", rows.apparent, 1, "kVA");
                self.row(5, "Power factor", rows.power_factor, 1, "");
            }
        }
    }

    fn engine(&mut self, unit: &DatakomD) {
        match self.turned(unit, 2) {
            0 => {
                self.title("Engine", "1/2");
                self.row(2, "Speed", 10376, 0, "rpm");
                self.row(3, "Oil pressure", 10361, 1, "bar");
                self.row(4, "Temperature", 10362, 1, "C");
                self.row(5, "Fuel", 10363, 1, "%");
                self.row(6, "Battery", 10341, 1, "V");
                self.row(7, "Charge", 10340, 1, "V");
            }
            _ => {
                self.title("Engine", "2/2");
                self.row(2, "Oil", 10364, 1, "C");
                self.row(3, "Canopy", 10365, 1, "C");
                self.row(4, "Ambient", 10366, 1, "C");
                self.row(5, "Governor", 10607, 1, "%");
                self.row(6, "Regulator", 10608, 1, "%");
                self.row(7, "Fuel flow", 11680, 1, "L/h");
            }
        }
    }

    fn synchroscope(&mut self, unit: &DatakomD) {
        self.title("Synchroscope", "1/1");
        let Synchronism { live, angle, slip, voltage, .. } = unit.plant.synchronism();
        for (line, what, value, unit) in
            [(2, "Slip", slip, "Hz"), (3, "Voltage", voltage, "V"), (4, "Angle", angle, "deg")]
        {
            self.canvas.text(line, 0, what);
            let text = if live { format!("{value:+.1} {unit}") } else { "---".to_owned() };
            self.canvas.text_right(line, &text);
        }
        self.canvas.frame(4, 48, 121, 9);
        self.canvas.fill(64, 45, 1, 3);
        if live {
            // The needle moves over half a turn to each side of the middle.
            let needle = (64.0 + angle / 180.0 * 58.0).round() as usize;
            self.canvas.fill(needle.saturating_sub(1), 49, 3, 7);
        }
    }

    /// The trace of the selected channel, as high as it fits.
    fn scope(&mut self, unit: &DatakomD, analysis: &Analysis) {
        let channel = self.label(unit, "selected_channel", unit.channel as u8);
        self.canvas.text(1, 0, channel);
        let peak = analysis.trace.iter().map(|sample| sample.unsigned_abs()).max().unwrap_or(0).max(1);
        let height = |sample: i16| (39.0 - f64::from(sample) / f64::from(peak) * 22.0).round() as usize;
        for x in 0..SAMPLES {
            self.canvas.dot(14 + x, 39);
        }
        for (x, pair) in analysis.trace.windows(2).enumerate() {
            let (from, to) = (height(pair[0]), height(pair[1]));
            self.canvas.fill(14 + x, from.min(to), 1, from.abs_diff(to) + 1);
        }
    }

    /// A bar for each harmonic of the selected channel, the greatest as high as it fits.
    fn harmonics(&mut self, unit: &DatakomD, analysis: &Analysis) {
        let channel = self.label(unit, "selected_channel", unit.channel as u8);
        self.canvas.text(1, 0, channel);
        self.canvas.text(2, 0, &format!("THD {:.2}%", analysis.distortion));
        let greatest = analysis.harmonics.into_iter().fold(0.1, f64::max);
        for (index, level) in analysis.harmonics.into_iter().enumerate() {
            let height = (level / greatest * 28.0).round() as usize;
            self.canvas.fill(4 + 8 * index, 54 - height, 5, height + 1);
        }
        for (column, index) in [(0, 0), (9, 7), (18, 14)] {
            self.canvas.text(7, column, &format!("{}", order(index)));
        }
    }

    fn counters(&mut self) {
        self.title("Counters", "1/1");
        self.row(2, "Runs", 10616, 0, "");
        self.row(3, "Cranks", 10618, 0, "");
        self.row(4, "Hours", 10622, 1, "h");
        self.row(5, "Genset", 10628, 0, "kWh");
        self.row(6, "Mains", 11569, 0, "kWh");
        self.row(7, "Fuel", 11577, 0, "L");
    }

    fn service(&mut self) {
        self.title("Service", "1/1");
        for (line, (number, [hours, days])) in (2..).zip((1..).zip(SERVICES)) {
            let (hours, days) = (self.number(hours), self.number(days));
            self.canvas.text(line, 0, &format!("{number}: {hours:.0} h, {days:.0} d"));
        }
        self.canvas.text(6, 0, "Hold DOWN when done");
    }

    /// What is wrong, the gravest first.
    fn alarms(&mut self, unit: &DatakomD, shown: &Shown) {
        let list: Vec<_> = [
            ("shutdown_alarms", 'S', shown.shutdown),
            ("load_dump_alarms", 'L', shown.load_dump),
            ("warning_alarms", 'W', shown.warning),
        ]
        .into_iter()
        .flat_map(|(point, letter, bits)| bits.iter().map(move |bit| (point, letter, bit)))
        .collect();
        let pages = list.len().div_ceil(LINES).max(1);
        let page = self.turned(unit, pages);
        self.title(&format!("Alarms: {}", list.len()), &format!("{}/{pages}", page + 1));
        for (line, (point, letter, bit)) in (2..).zip(list.iter().skip(page * LINES).take(LINES)) {
            let point = self.bank.profile().point(point);
            let label = point.and_then(|point| point.bit(*bit)).map_or("", |bit| bit.label.as_str());
            self.canvas.text(line, 0, &format!("{letter} {label}"));
        }
        if list.is_empty() {
            self.canvas.text(4, 6, "No alarms");
        }
    }

    fn identity(&mut self, unit: &DatakomD) {
        self.title("Unit", "1/1");
        let identity = &unit.identity;
        let mac: String = identity.mac.iter().map(|byte| format!("{byte:02X}")).collect();
        self.canvas.text(2, 0, &format!("Code {:04X}", identity.code));
        self.canvas.text(3, 0, &format!("MAC {mac}"));
        let imei = String::from_utf8_lossy(&identity.imei);
        self.canvas.text(4, 0, &format!("IMEI {}", imei.trim_end_matches('\0')));
        for (line, axis, address) in [(5, "Lat", 10594), (6, "Lon", 10596)] {
            self.canvas.text(line, 0, axis);
            self.canvas.text_right(line, &format!("{:.5}", self.number(address) / 100_000.0));
        }
        self.row(7, "Alt", 10598, 0, "m");
    }

    fn title(&mut self, text: &str, page: &str) {
        self.canvas.text(1, 0, text);
        self.canvas.text_right(1, page);
    }

    fn row(&mut self, line: usize, what: &str, address: u16, decimals: usize, unit: &str) {
        self.canvas.text(line, 0, what);
        let value = self.bank.number_shown(address);
        let text = value.map_or("---".to_owned(), |value| format!("{value:.decimals$} {unit}"));
        self.canvas.text_right(line, text.trim_end());
    }

    /// Which of so many pages the keys have turned to.
    fn turned(&self, unit: &DatakomD, pages: usize) -> usize {
        let pages = i32::try_from(pages).unwrap_or(1);
        usize::try_from(unit.menu.turned.rem_euclid(pages)).unwrap_or(0)
    }

    fn number(&self, address: u16) -> f64 {
        self.bank.number_shown(address).unwrap_or(0.0)
    }

    /// Three values 32 bits apart.
    fn phases(&self, address: u16) -> [f64; 3] {
        [0, 2, 4].map(|offset| self.number(address + offset))
    }

    /// What the profile calls a code, on this model.
    fn label(&self, unit: &DatakomD, point: &str, code: u8) -> &'static str {
        let choice = self.bank.profile().point(point).and_then(|point| point.choice(code.into()));
        choice.map_or("", |choice| choice.label_for(Some(&unit.identity.model)))
    }
}
