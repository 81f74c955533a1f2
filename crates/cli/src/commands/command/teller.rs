//! What a command under way tells people on standard error, and what is known of it when it is interrupted.

use busbar_link::{Link, LinkError, command::Progress};
use busbar_profile::{Command, Profile, command::Frame};

use crate::{terminal, wire};

/// More points than this are not named in a line.
const MOST_NAMED: usize = 4;

/// Follows one command.
pub(super) struct Teller<'a> {
    link: &'a Link,
    profile: &'a Profile,
    command: &'a Command,
    quiet: bool,
    /// What was told last and just before that: two that take turns are told once.
    told: [String; 2],
    /// The last reading: its points and how many writes came before.
    reading: (Vec<usize>, u32),
    /// Why the last reading has no answer.
    unread: Option<String>,
    /// Writes that have left and are over.
    left: u32,
    /// A write is with the wire, which had sent so many frames by then.
    handed: Option<u64>,
}

impl<'a> Teller<'a> {
    /// Tells of a command on this wire; nothing where programs read along.
    pub(super) fn new(link: &'a Link, profile: &'a Profile, command: &'a Command, quiet: bool) -> Self {
        Self {
            link,
            profile,
            command,
            quiet,
            told: Default::default(),
            reading: (Vec::new(), 0),
            unread: None,
            left: 0,
            handed: None,
        }
    }

    pub(super) fn tell(&mut self, progress: Progress<'_>) {
        match progress {
            Progress::Reading { points, sent } => self.reads(points, sent),
            Progress::NotRead { error } => {
                let why = wire::sentence(error, Some(self.profile));
                match error {
                    LinkError::Exception { .. } => self.say(why),
                    _ => {
                        self.say("no answer yet".to_owned());
                        self.unread = Some(why);
                    }
                }
            }
            Progress::Writing { step, frame } => {
                self.handed = Some(self.link.statistics().requests);
                self.say(self.sending(step, frame));
            }
            Progress::Confirmed => {
                self.handed = None;
                self.left += 1;
                self.say("the controller confirmed it".to_owned());
            }
            Progress::NotConfirmed { error } => {
                self.handed = None;
                self.left += u32::from(matches!(error, LinkError::Lost { .. } | LinkError::Exception { .. }));
                self.say(wire::sentence(error, Some(self.profile)));
            }
            _ => {}
        }
    }

    /// Why the last reading has no answer, as a sentence without its full stop.
    pub(super) fn unread(&self) -> Option<String> {
        let sentence = self.unread.as_ref()?;
        // An endpoint at the beginning stays as it is written.
        match sentence.split_once(' ') {
            Some((first, _)) if first.contains("://") => Some(sentence.clone()),
            _ => {
                let mut letters = sentence.chars();
                let first = letters.next()?;
                Some(first.to_uppercase().chain(letters).collect())
            }
        }
    }

    /// How many writes have left by now. Exact once the command under way was dropped.
    pub(super) fn sent(&self) -> u32 {
        let leaving = self.handed.is_some_and(|requests| self.link.statistics().requests > requests);
        self.left + u32::from(leaving)
    }

    fn reads(&mut self, points: &[usize], sent: u32) {
        self.unread = None;
        let reading = (points.to_vec(), sent);
        let again = reading == self.reading;
        self.reading = reading;
        let names = self.names(points);
        self.say(match (sent, again) {
            (0, false) => format!("checking {names}"),
            (0, true) => format!("waiting for the moment to send it: {names}"),
            _ => format!("waiting for {names}"),
        });
    }

    fn names(&self, points: &[usize]) -> String {
        let names: Vec<&str> = points.iter().map(|point| self.profile.points[*point].name.as_str()).collect();
        match names.len() {
            0..=MOST_NAMED => names.join(", "),
            more => format!("{} and {} more", names[..MOST_NAMED].join(", "), more - MOST_NAMED),
        }
    }

    fn sending(&self, step: usize, frame: Frame) -> String {
        let Frame { function, address, value, .. } = frame;
        let what = format!("function {function}, {value:04X}h to {address}");
        match self.command.steps.len() {
            1 => format!("sending {what}"),
            all => format!("sending step {step} of {all}: {what}"),
        }
    }

    /// Each sentence once, however often it is so again.
    fn say(&mut self, sentence: String) {
        if self.told.contains(&sentence) {
            return;
        }
        if !self.quiet {
            terminal::message(&sentence);
        }
        let [last, before] = &mut self.told;
        *before = std::mem::replace(last, sentence);
    }
}
