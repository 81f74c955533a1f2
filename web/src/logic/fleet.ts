// Many controllers: which of them a person wants to see, and in which order.
import { CLASSES } from './alarms'
import { kindText } from './format'
import type { AlarmView, DeviceView } from './types'

export const SHOWS = {
  all: 'all',
  alarms: 'with alarms',
  silent: 'not answering',
  differs: 'not as desired',
} as const
export type Show = keyof typeof SHOWS

export interface Member {
  view: DeviceView
  alarms: readonly AlarmView[]
}

/** The device that answers is not the one that the site file says. */
export function isWrong(view: DeviceView): boolean {
  return view.identity.verdict === 'wrong'
}

/** It is known not to be as the site file wants it. */
export function differs(view: DeviceView): boolean {
  return view.desired?.met === false
}

/** How much a device wants to be looked at: 0 is the most urgent. */
export function urgency(view: DeviceView): number {
  const gravest = CLASSES.findIndex((words) => view.alarms[words.class] > 0)
  const ranks = [
    // Shutdown, load dump, trip come first; a device that nobody hears comes before warnings.
    gravest < 0 ? 7 : gravest < 3 ? gravest : gravest === 3 ? 4 : 6,
    isWrong(view) || !view.online ? 3 : 7,
    differs(view) || view.alarms_fault !== null ? 5 : 7,
  ]
  return Math.min(...ranks)
}

function wanted(view: DeviceView, show: Show): boolean {
  switch (show) {
    case 'all':
      return true
    case 'alarms':
      return CLASSES.some((words) => view.alarms[words.class] > 0)
    case 'silent':
      return !view.online || isWrong(view)
    case 'differs':
      return differs(view)
  }
}

function textOf({ view, alarms }: Member): string {
  const { name, id, wire, state, mode } = view
  return [name, id, wire, kindText(view), state?.label, mode?.label, ...alarms.map(({ label }) => label)]
    .join('\n')
    .toLowerCase()
}

/** The devices in which every word of `query` is found, of those that `show` names; the most urgent first if so wished. */
export function chosenOf<T extends Member>(
  devices: readonly T[],
  show: Show,
  query: string,
  worstFirst: boolean,
): T[] {
  const terms = query.toLowerCase().split(/\s+/).filter(Boolean)
  const chosen = devices.filter((device) => {
    if (!wanted(device.view, show)) return false
    const text = terms.length > 0 ? textOf(device) : ''
    return terms.every((term) => text.includes(term))
  })
  return worstFirst ? chosen.toSorted((a, b) => urgency(a.view) - urgency(b.view)) : chosen
}
