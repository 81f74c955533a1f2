//! One command under way: what to read, the writes, each sent at most once, and the verdict. Pure; time is an argument.

mod verdicts;

use std::time::Duration;

use crate::command::sight::{Sight, sign_of_proof};
use crate::command::{
    Arguments, Command, Condition, Evidence, Hold, Proof, ProofStep, Report, Seen, Sign, Step, Subject, Test,
    Verdict, WriteValue,
};
use crate::profile::Profile;
use crate::terms::WordOrder;

/// Between two looks at the state.
const POLL: Duration = Duration::from_millis(500);
/// The same while a silence is waited for, which may be short.
const BRISK: Duration = Duration::from_millis(200);
/// A reading older than this does not speak for a write.
const FRESH: Duration = Duration::from_secs(1);
/// How long a device may be silent between the steps of a procedure.
const PATIENCE: Duration = Duration::from_secs(10);

/// One command on its way. Ask [`Run::next`] what to do, do it, and hand in what came of it.
///
/// ```
/// use std::time::Duration;
///
/// use busbar_profile::command::{Next, Run, Verdict, WriteOutcome};
/// use busbar_profile::{DateTime, builtin};
///
/// let profile = builtin("datakom-d").unwrap();
/// let command = profile.command("auto").unwrap();
/// let local: DateTime = "2026-11-23T05:19:51".parse().unwrap();
/// let arguments = command.arguments([], local).unwrap();
/// let mut run = Run::new(profile, command, arguments, profile.wire.word_order);
/// let (mut now, mut mode) = (Duration::ZERO, 1);
/// let report = loop {
///     match run.next(now) {
///         Next::Read(points) => {
///             for point in points.iter().map(|point| &profile.points[*point]) {
///                 run.store(point.address, &[mode]); // what the device answers
///             }
///             run.read(now, Ok(()));
///         }
///         Next::Write(frame) => {
///             assert_eq!((frame.function, frame.address, frame.value), (6, 8193, 4));
///             mode = 4;
///             run.written(now, WriteOutcome::Acknowledged);
///         }
///         Next::WaitUntil(at) => now = at,
///         Next::Pending => unreachable!("everything was answered"),
///         Next::Done(report) => break report,
///     }
/// };
/// assert_eq!((report.verdict, report.sent), (Verdict::Done, 1));
/// ```
///
/// What was not asked for is ignored. However answers are lost, late or out of order, [`Next::Write`] comes at most
/// once for each step of the command.
pub struct Run<'p> {
    command: &'p Command,
    sight: Sight<'p>,
    started: Option<Duration>,
    phase: Phase,
    stage: Stage,
    /// The step that is looked at.
    step: usize,
    /// How many steps must not be sent any more: all before `step`, and `step` itself once it was sent or left out.
    spent: usize,
    sent: u32,
    /// Whether the present step was there already and was left out.
    left_out: bool,
    answer: Answer,
    held_since: Option<Duration>,
    proving: Proving,
    /// When the last write left, by the time of the command.
    written: Duration,
    report: Option<Report>,
}

/// What to do next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    /// Read these points (indexes in the profile), now and not from a cache: [`Run::store`] what comes, then
    /// [`Run::read`].
    Read(Vec<usize>),
    /// Send this once, never again whatever happens, then [`Run::written`].
    Write(Frame),
    /// Nothing before then.
    WaitUntil(Duration),
    /// What was asked for last has not come yet.
    Pending,
    /// The command is over.
    Done(Report),
}

/// A write as it goes over the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Frame {
    /// Function 5, 6 or 16 (then of one register).
    pub function: u8,
    /// Coil or register address.
    pub address: u16,
    /// The word to write.
    pub value: u16,
}

/// What became of a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriteOutcome {
    /// The device echoed it.
    Acknowledged,
    /// The device answered with an exception.
    Exception(u8),
    /// It left, and no answer came that can be understood.
    Lost,
    /// It certainly never left.
    NotSent,
}

/// Why a reading is not whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReadFailure {
    /// The device did not answer.
    Silent,
    /// The wire is down.
    Down,
    /// The device answered with an exception.
    Exception(u8),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// A reading is wanted, not before `at`.
    Due {
        at: Duration,
    },
    Reading,
    /// All speaks for the write, by a reading of `read_at`.
    Ready {
        read_at: Duration,
    },
    Writing,
    Finished,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Before,
    After,
    /// The device refused the write with this; one look follows.
    Refused(u8),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Answer {
    Acknowledged,
    Lost,
}

/// How far the proof of the present step is.
#[derive(Clone, Debug, Default)]
struct Proving {
    /// Steps of the proof that were seen.
    seen: usize,
    /// Since when the present one is waited for.
    since: Duration,
    /// Which held before the write.
    held_before: Vec<bool>,
    /// Whether the device answered any reading since the write.
    answered: bool,
    /// Whether the last reading failed for want of an answer.
    silent: bool,
    /// Whether the device fell silent while that was waited for.
    fell_silent: bool,
}

impl<'p> Run<'p> {
    /// A command of `profile`, with arguments made by [`Command::arguments`] of the same command.
    pub fn new(profile: &'p Profile, command: &'p Command, arguments: Arguments, order: WordOrder) -> Self {
        Self {
            command,
            sight: Sight::new(profile, arguments, order),
            started: None,
            phase: Phase::Due { at: Duration::ZERO },
            stage: Stage::Before,
            step: 0,
            spent: 0,
            sent: 0,
            left_out: false,
            answer: Answer::Acknowledged,
            held_since: None,
            proving: Proving::default(),
            written: Duration::ZERO,
            report: None,
        }
    }

    /// What to do at `now`, which never goes back.
    pub fn next(&mut self, now: Duration) -> Next {
        self.started.get_or_insert(now);
        loop {
            match self.phase {
                Phase::Due { at } if now < at => return Next::WaitUntil(at),
                Phase::Due { .. } => {
                    self.sight.image.clear();
                    let points = self.points();
                    if points.is_empty() {
                        self.look_before(now);
                        continue;
                    }
                    self.phase = Phase::Reading;
                    return Next::Read(points);
                }
                Phase::Ready { read_at } => {
                    if now.saturating_sub(read_at) > FRESH && !self.points().is_empty() {
                        self.phase = Phase::Due { at: now };
                        continue;
                    }
                    if let Some(frame) = self.send(now) {
                        return Next::Write(frame);
                    }
                }
                Phase::Reading | Phase::Writing => return Next::Pending,
                Phase::Finished => return self.report.clone().map_or(Next::Pending, Next::Done),
            }
        }
    }

    /// Registers of the reading that is under way.
    pub fn store(&mut self, address: u16, registers: &[u16]) {
        if self.phase == Phase::Reading {
            self.sight.image.store(address, registers, &mut Vec::new());
        }
    }

    /// The reading is over; what of it came was stored.
    pub fn read(&mut self, now: Duration, outcome: Result<(), ReadFailure>) {
        if self.phase != Phase::Reading {
            return;
        }
        let unanswered = matches!(outcome, Err(ReadFailure::Silent | ReadFailure::Down));
        self.sight.learn_model();
        match self.stage {
            Stage::Before if unanswered => self.unread_before(now),
            Stage::Before => match outcome {
                Err(ReadFailure::Exception(code)) if self.is_foreign() => self.foreign(now, code),
                _ => self.look_before(now),
            },
            Stage::After => self.look_after(now, unanswered),
            Stage::Refused(code) => self.look_back(now, code),
        }
    }

    /// The write is over.
    pub fn written(&mut self, now: Duration, outcome: WriteOutcome) {
        if self.phase != Phase::Writing {
            return;
        }
        let profile = self.sight.profile;
        // 05h: accepted, and still at work. 0Bh: a gateway passed it on and heard nothing. Unless the maker means else.
        let outcome = match outcome {
            WriteOutcome::Exception(0x05) if profile.exception_name(0x05).is_none() => {
                WriteOutcome::Acknowledged
            }
            WriteOutcome::Exception(0x0B) if profile.exception_name(0x0B).is_none() => WriteOutcome::Lost,
            other => other,
        };
        match outcome {
            WriteOutcome::Acknowledged => self.after_answer(now, Answer::Acknowledged),
            WriteOutcome::Lost => self.after_answer(now, Answer::Lost),
            WriteOutcome::NotSent => {
                self.sent -= 1;
                self.give_up(now, "the write did not leave, the wire is down");
            }
            WriteOutcome::Exception(code) if self.goals().next().is_some() => {
                self.stage = Stage::Refused(code);
                self.phase = Phase::Due { at: now };
            }
            WriteOutcome::Exception(code) => self.refused(now, code, ""),
        }
    }

    /// How many writes have left.
    pub fn sent(&self) -> u32 {
        self.sent
    }

    /// The step that is under way, from 1.
    pub fn step(&self) -> usize {
        self.step + 1
    }

    fn current(&self) -> &'p Step {
        &self.command.steps[self.step]
    }

    fn is_last(&self) -> bool {
        self.step + 1 == self.command.steps.len()
    }

    /// Time since the command began: times of arguments have run on by this.
    fn later(&self, now: Duration) -> Duration {
        now.saturating_sub(self.started.unwrap_or(now))
    }

    fn hold(&self) -> Option<&'p Hold> {
        let general = if self.step == 0 { self.command.hold.as_ref() } else { None };
        self.current().hold.as_ref().or(general)
    }

    /// The proof of the present step, and of the command after the last one.
    fn goals(&self) -> impl Iterator<Item = &'p ProofStep> + use<'p> {
        let own = if self.left_out { &[][..] } else { self.current().proof.as_slice() };
        let end = if self.is_last() { self.command.proof.steps() } else { &[] };
        own.iter().chain(end)
    }

    /// Every proof of the command.
    fn all_goals(&self) -> impl Iterator<Item = &'p ProofStep> + use<'p> {
        let steps = self.command.steps.iter().flat_map(|step| &step.proof);
        steps.chain(self.command.proof.steps())
    }

    /// The points to read, ascending, each once.
    fn points(&self) -> Vec<usize> {
        let (command, step) = (self.command, self.current());
        let mut points = Vec::new();
        let mut proofs: Vec<_> = self.goals().collect();
        if self.stage == Stage::Before {
            let general =
                if self.step == 0 { [&command.require[..], &command.already] } else { [&[][..]; 2] };
            let hold = self.hold().map_or(&[][..], |hold| &hold.conditions);
            let conditions = general.into_iter().chain([&step.require[..], &step.already, hold]).flatten();
            points.extend(conditions.filter_map(point_of));
            if let WriteValue::By { point, .. } = step.write.value {
                points.push(point);
            }
            if self.step == 0 {
                // What the command is to bring about, as it was before its first write.
                proofs = self.all_goals().collect();
            } else {
                proofs.retain(|proof| changes(&proof.what).is_some());
            }
        }
        if self.stage == Stage::Before && self.step == 0 && points.is_empty() && proofs.is_empty() {
            // Nobody is commanded unseen, even where nothing will show what came of it.
            points.extend(probe(self.sight.profile));
        }
        for proof in proofs {
            match &proof.what {
                Evidence::Point(condition) => points.extend(point_of(condition)),
                Evidence::Clock { joined, .. } => {
                    points.extend(self.sight.profile.joined()[*joined].points())
                }
                Evidence::Device(_) => points.extend(probe(self.sight.profile)),
            }
        }
        if self.stage == Stage::Before
            && let Some(identity) = &self.sight.profile.identity
            && points.iter().any(|point| self.sight.profile.points[*point].depends_on_model())
        {
            points.push(identity.point);
        }
        points.sort_unstable();
        points.dedup();
        points
    }

    /// No answer before a write. What has begun is not left half done for one lost answer.
    fn unread_before(&mut self, now: Duration) {
        let waiting = self.held_since.is_some() || self.step > 0;
        let since = *self.held_since.get_or_insert(now);
        let patience = self.hold().map_or(PATIENCE, |hold| seconds(hold.within_s));
        if waiting && now < since.saturating_add(patience) {
            self.phase = Phase::Due { at: now.saturating_add(POLL) };
            return;
        }
        let why = "the device does not answer the reading that comes before it";
        if self.sent == 0 {
            return self.give_up(now, why);
        }
        let reason = format!("{} was not sent: {why}", self.place());
        self.finish(now, Verdict::Unknown, &reason);
    }

    /// Decides by a reading whether the present step is sent.
    fn look_before(&mut self, now: Duration) {
        let (command, step, later) = (self.command, self.current(), self.later(now));
        if self.step == 0 && !command.already.is_empty() {
            match self.sight.all_hold(&command.already, later) {
                Some(true) => return self.already(now, &command.already),
                None => return self.unreadable(now, &command.already),
                Some(false) => {}
            }
        }
        if self.step == 0
            && let Some(failed) = self.failed(&command.require, later)
        {
            return self.not_met(now, failed);
        }
        if !step.already.is_empty() {
            match self.sight.all_hold(&step.already, later) {
                Some(true) => return self.leave_out(now, &step.already),
                None => return self.unreadable(now, &step.already),
                Some(false) => {}
            }
        }
        if let Some(failed) = self.failed(&step.require, later) {
            return self.not_met(now, failed);
        }
        if let Some(changing) = self.unknown_before(later) {
            return self.unreadable(now, std::slice::from_ref(changing));
        }
        if self.value(later).is_none() {
            return self.no_value(now);
        }
        if let Some(hold) = self.hold() {
            let since = *self.held_since.get_or_insert(now);
            let met = |condition| self.sight.holds(condition, later) == Some(true);
            let holds =
                if hold.any { hold.conditions.iter().any(met) } else { hold.conditions.iter().all(met) };
            if !holds {
                return self.keep_holding(now, hold, since);
            }
        }
        self.phase = Phase::Ready { read_at: now };
    }

    /// Whether the device has none of what a device of this profile has: it may be another one, so it gets no write.
    fn is_foreign(&self) -> bool {
        let unread = |point: &usize| self.sight.image.registers(*point).is_none();
        self.sent == 0 && self.points().iter().all(unread)
    }

    fn failed(&self, conditions: &'p [Condition], later: Duration) -> Option<&'p Condition> {
        conditions.iter().find(|condition| self.sight.holds(condition, later) != Some(true))
    }

    /// A change cannot be proved where nobody knows what it was before.
    fn unknown_before(&self, later: Duration) -> Option<&'p Condition> {
        let changing = self.goals().filter_map(|goal| changes(&goal.what));
        changing.into_iter().find(|condition| self.sight.code(condition.subject, later).is_none())
    }

    /// What is written at this moment.
    fn value(&self, later: Duration) -> Option<u16> {
        let write = &self.current().write;
        let point = |point| self.sight.code(Subject::Point { point, bit: None }, later);
        let value = write.value.resolve(point)?;
        match write.arg {
            Some(arg) => Some(value | self.sight.number(arg, later)?),
            None => Some(value),
        }
    }

    fn keep_holding(&mut self, now: Duration, hold: &Hold, since: Duration) {
        let end = since.saturating_add(seconds(hold.within_s));
        if now < end {
            self.phase = Phase::Due { at: end.min(now.saturating_add(POLL)) };
            return;
        }
        self.no_moment(now, hold);
    }

    /// Hands the write out; the step is spent whatever becomes of it.
    fn send(&mut self, now: Duration) -> Option<Frame> {
        let later = self.later(now);
        let value = self.value(later).filter(|_| self.step >= self.spent);
        let Some(value) = value else {
            self.give_up(now, "its value is not known any more");
            return None;
        };
        self.remember(now, later);
        self.spent = self.step + 1;
        self.sent += 1;
        self.written = later;
        self.phase = Phase::Writing;
        let write = &self.current().write;
        Some(Frame { function: write.function, address: write.address, value })
    }

    /// Keeps what the write, or what others do from now on, may change.
    fn remember(&mut self, now: Duration, later: Duration) {
        let goals: Vec<_> = self.goals().collect();
        let noted: Vec<_> = if self.step == 0 { self.all_goals().collect() } else { goals.clone() };
        self.sight.remember(goals.iter().filter_map(|goal| match &goal.what {
            Evidence::Point(condition) => Some(condition.subject),
            _ => None,
        }));
        for goal in noted {
            if let Some(sign) = sign_of_proof(&goal.what) {
                let before = match sign {
                    Sign::Device => Some(Seen::Answers(true)),
                    _ => self.sight.seen(sign),
                };
                self.sight.note_before(sign, before, now);
            }
        }
        self.proving = Proving { since: now, ..Proving::default() };
        self.proving.held_before = goals
            .iter()
            .map(|goal| match &goal.what {
                Evidence::Point(condition) => self.sight.holds(condition, later) == Some(true),
                _ => false,
            })
            .collect();
    }

    fn after_answer(&mut self, now: Duration, answer: Answer) {
        self.answer = answer;
        self.stage = Stage::After;
        self.proving.since = now;
        if self.goals().next().is_some() {
            self.phase = Phase::Due { at: now };
            return;
        }
        match (&self.command.proof, answer, self.is_last()) {
            (_, Answer::Acknowledged, false) => self.go_on(now),
            (_, Answer::Lost, false) => {
                let reason =
                    format!("the answer to {} was lost, and nothing shows what became of it", self.place());
                self.finish(now, Verdict::Unknown, &reason);
            }
            (Proof::None { reason }, Answer::Acknowledged, true) => {
                let reason = format!("the device acknowledged {}, and {reason}", self.place());
                self.finish(now, Verdict::Unknown, &reason);
            }
            (Proof::None { reason }, Answer::Lost, true) => {
                let reason = format!("the answer to {} was lost, and {reason}", self.place());
                self.finish(now, Verdict::Unknown, &reason);
            }
            (Proof::Steps(_), _, true) => {
                self.finish(now, Verdict::Unknown, "nothing shows what became of it")
            }
        }
    }

    /// To the next step.
    fn go_on(&mut self, now: Duration) {
        self.step += 1;
        self.stage = Stage::Before;
        self.left_out = false;
        self.held_since = None;
        self.phase = Phase::Due { at: now };
    }

    /// The present step is there already.
    fn leave_out(&mut self, now: Duration, already: &[Condition]) {
        self.note_all_before(now, already);
        self.spent = self.step + 1;
        if !self.is_last() {
            return self.go_on(now);
        }
        self.left_out = true;
        if self.goals().next().is_none() {
            let reason = self.states(already);
            return self.finish(now, Verdict::Done, &format!("it is so already: {reason}"));
        }
        let later = self.later(now);
        self.remember(now, later);
        self.written = later;
        self.answer = Answer::Acknowledged;
        self.stage = Stage::After;
        self.phase = Phase::Due { at: now };
    }

    /// Holds a reading after a write against the proof.
    fn look_after(&mut self, now: Duration, unanswered: bool) {
        self.proving.silent = unanswered;
        self.proving.answered |= !unanswered;
        let goals: Vec<_> = self.goals().collect();
        while let Some(goal) = goals.get(self.proving.seen) {
            let met = self.is_met(goal, now);
            if let Some(sign) = sign_of_proof(&goal.what) {
                let after = match sign {
                    Sign::Device => Some(Seen::Answers(!unanswered)),
                    _ => self.sight.seen(sign),
                };
                // A reading that failed takes nothing away from what was seen before.
                if after.is_some() || !unanswered {
                    self.sight.note_after(sign, after, now);
                }
            }
            if !met {
                let end = self.proving.since.saturating_add(seconds(goal.within_s));
                if now >= end {
                    return self.too_late(now, &goals, goal);
                }
                let poll = if matches!(goal.what, Evidence::Device(_)) { BRISK } else { POLL };
                self.phase = Phase::Due { at: end.min(now.saturating_add(poll)) };
                return;
            }
            self.proving.seen += 1;
            self.proving.since = now;
            self.proving.fell_silent = false;
        }
        if self.is_last() { self.proved(now, &goals) } else { self.go_on(now) }
    }

    fn is_met(&mut self, goal: &ProofStep, now: Duration) -> bool {
        match &goal.what {
            // What was written is compared, not what its time has become since.
            Evidence::Point(condition) => self.sight.holds(condition, self.written) == Some(true),
            Evidence::Clock { joined, arg, tolerance_s } => {
                self.sight.clock_agrees(*joined, *arg, *tolerance_s, self.later(now))
            }
            Evidence::Device(_) => {
                self.proving.fell_silent |= self.proving.silent;
                self.proving.fell_silent && !self.proving.silent
            }
        }
    }
}

fn point_of(condition: &Condition) -> Option<usize> {
    match condition.subject {
        Subject::Point { point, .. } => Some(point),
        Subject::Arg(_) => None,
    }
}

/// The condition of a proof that compares with what was before.
fn changes(evidence: &Evidence) -> Option<&Condition> {
    match evidence {
        Evidence::Point(condition) if condition.test == Test::Changes => Some(condition),
        _ => None,
    }
}

/// Something to read where only the answer counts.
fn probe(profile: &Profile) -> Option<usize> {
    let identity = profile.identity.as_ref().map(|identity| identity.point);
    identity.or_else(|| profile.points.iter().position(|point| point.access.is_readable()))
}

fn seconds(seconds: u16) -> Duration {
    Duration::from_secs(u64::from(seconds))
}
