// How a value looks now: its quality, its age, and the last good value when there is no new one.
import { timeOf } from './format'
import type { Quality, ValueView } from './types'

export type Look = Quality | 'unread'

export interface Standing {
  look: Look
  /** Milliseconds since the value shown was read; undefined when it never was. */
  age: number | undefined
}

/**
 * A good value is as old as the last finished round of its rate, because a round sends only what changed.
 * Without a live connection nobody knows whether it is still good: it counts as stale.
 */
export function standing(
  view: Pick<ValueView, 'quality' | 'ts'> | undefined,
  round: number | undefined,
  now: number,
  live: boolean,
): Standing {
  if (!view) return { look: 'unread', age: undefined }
  // That there is no value does not age.
  if (view.quality === 'invalid') return { look: 'invalid', age: undefined }
  const read = timeOf(view.ts)
  const at = view.quality === 'good' ? later(read, round) : read
  return {
    look: view.quality === 'good' && !live ? 'stale' : view.quality,
    age: at === undefined ? undefined : Math.max(0, now - at),
  }
}

const RANK: Record<Look, number> = { good: 0, unread: 1, invalid: 2, stale: 3, bad: 4 }

/** Several values in one line show the worst quality and the greatest age. */
export function worstStanding(standings: readonly Standing[]): Standing {
  return standings.reduce((a, b) => ({
    look: RANK[b.look] > RANK[a.look] ? b.look : a.look,
    age: later(a.age, b.age),
  }))
}

/** The reason that all bad values among these share; undefined when there is none or they differ. */
export function sharedReason(views: readonly (ValueView | undefined)[]): string | undefined {
  const reasons = new Set(views.filter((view) => view?.quality === 'bad').map((view) => view?.error ?? ''))
  const [reason] = reasons
  return reasons.size === 1 && reason ? reason : undefined
}

function later(a: number | undefined, b: number | undefined): number | undefined {
  if (a === undefined) return b
  if (b === undefined) return a
  return Math.max(a, b)
}
