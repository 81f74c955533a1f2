// Active alarms: their order, their words, and what to say when they change.
import type { AlarmClass, AlarmCounts, AlarmView } from './types'

export interface ClassWords {
  class: AlarmClass
  title: string
  meaning: string
}

/** Most severe first. */
export const CLASSES: readonly ClassWords[] = [
  { class: 'shutdown', title: 'Shutdown', meaning: 'load off, engine stopped at once' },
  { class: 'load_dump', title: 'Load dump', meaning: 'load off, engine stops after cooling down' },
  { class: 'trip', title: 'Trip', meaning: 'a switch has opened' },
  { class: 'warning', title: 'Warning', meaning: 'running goes on' },
  { class: 'indication', title: 'Indication', meaning: 'for information' },
]

export function keyOf(alarm: AlarmView): string {
  return `${alarm.device}/${alarm.point}/${alarm.bit}`
}

/** The classes that have alarms, most severe first, the newest alarm first in each. */
export function byClass(alarms: readonly AlarmView[]): (ClassWords & { alarms: AlarmView[] })[] {
  return CLASSES.map((words) => ({
    ...words,
    alarms: alarms
      .filter((alarm) => alarm.class === words.class)
      .toSorted((a, b) => Date.parse(b.since) - Date.parse(a.since) || a.bit - b.bit),
  })).filter((group) => group.alarms.length > 0)
}

/** The most severe class among the counts of a device. */
export function worst(counts: AlarmCounts): AlarmClass | undefined {
  return CLASSES.find((words) => counts[words.class] > 0)?.class
}

/** One sentence for a screen reader: what came and what went. Empty when nothing did. */
export function announcement(before: readonly AlarmView[], after: readonly AlarmView[]): string {
  const title = (alarm: AlarmView) =>
    CLASSES.find((words) => words.class === alarm.class)?.title ?? alarm.class
  const had = new Set(before.map(keyOf))
  const has = new Set(after.map(keyOf))
  const came = after.filter((alarm) => !had.has(keyOf(alarm))).map((a) => `${title(a)}: ${a.label}.`)
  const went = before.filter((alarm) => !has.has(keyOf(alarm))).map((a) => `Cleared: ${a.label}.`)
  return [...came, ...went].join(' ')
}
