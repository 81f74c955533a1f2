import { describe, expect, test } from 'vitest'
import { chosenOf, differs, isWrong, urgency, type Show } from './fleet'
import { alarm, device } from './samples'
import type { AlarmCounts, DeviceView } from './types'

const NONE: AlarmCounts = { shutdown: 0, load_dump: 0, trip: 0, warning: 0, indication: 0 }
const member = (id: string, rest: Partial<DeviceView> = {}) => ({ view: device(id, rest), alarms: [] })

const FLEET = [
  member('fine', {
    name: 'North',
    state: { code: 1, label: 'At rest', canonical: 'stopped', timer_s: null },
  }),
  member('hint', { alarms: { ...NONE, indication: 1 } }),
  member('manual', { desired: { mode: 'auto', met: false } }),
  { ...member('warned', { alarms: { ...NONE, warning: 1 } }), alarms: [alarm('warned', 7, 'warning')] },
  member('gone', { online: false, fault: 'gone' }),
  member('other', { identity: { verdict: 'wrong', detail: 'a D-300', checked: null } }),
  member('tripped', { alarms: { ...NONE, trip: 1, warning: 3 } }),
  member('down', { alarms: { ...NONE, shutdown: 1 }, online: false }),
]
const ids = (show: Show, query = '', worst = false) =>
  chosenOf(FLEET, show, query, worst).map(({ view }) => view.id)

test('the most urgent come first, the rest keeps the order of the site', () => {
  expect(ids('all', '', true)).toEqual([
    'down',
    'tripped',
    'gone',
    'other',
    'warned',
    'manual',
    'hint',
    'fine',
  ])
  expect(ids('all')).toEqual(FLEET.map(({ view }) => view.id))
  expect(urgency(device('x'))).toBeGreaterThan(urgency(device('x', { alarms: { ...NONE, indication: 1 } })))
})

describe('of the fleet are shown', () => {
  test.each([
    ['alarms', ['hint', 'warned', 'tripped', 'down']],
    ['silent', ['gone', 'other', 'down']],
    ['differs', ['manual']],
  ] as const)('%s', (show, expected) => expect(ids(show)).toEqual(expected))

  test('those that a text finds: by name, id, kind, state or active alarm', () => {
    expect(ids('all', 'NORTH')).toEqual(['fine'])
    expect(ids('all', 'warn')).toEqual(['warned'])
    expect(ids('all', 'alarm 7')).toEqual(['warned'])
    expect(ids('all', 'at rest')).toEqual(['fine'])
    expect(ids('all', 'datakom')).toHaveLength(FLEET.length)
    expect(ids('alarms', 'north')).toEqual([])
  })
})

test('what is not known does not differ, and only a wrong device is wrong', () => {
  expect(differs(device('x', { desired: { mode: 'auto', met: null } }))).toBe(false)
  expect(differs(device('x'))).toBe(false)
  expect(isWrong(device('x', { identity: { verdict: 'unknown', detail: null, checked: null } }))).toBe(false)
})
