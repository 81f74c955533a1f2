import { expect, test } from 'vitest'
import { announcement, byClass, worst } from './alarms'
import { alarm } from './samples'

test('the gravest class comes first, the newest alarm first in it', () => {
  const groups = byClass([
    alarm('gen1', 58, 'warning', 5),
    alarm('gen1', 54, 'shutdown', 1),
    alarm('gen1', 96, 'warning', 9),
    alarm('gen1', 3, 'status'),
  ])
  expect(groups.map(({ title, alarms }) => [title, alarms.map(({ bit }) => bit)])).toEqual([
    ['Shutdown', [54]],
    ['Warning', [96, 58]],
  ])
})

test('the same bit in two arrays is two alarms', () => {
  const both = [alarm('gen1', 58, 'warning'), alarm('gen1', 58, 'shutdown')]
  expect(announcement([both[0]!], both)).toBe('Shutdown: Alarm 58.')
})

test('what came and what went is said once', () => {
  const low = alarm('gen1', 58, 'warning')
  const stop = alarm('gen1', 54, 'shutdown')
  expect(announcement([low], [stop])).toBe('Shutdown: Alarm 54. Cleared: Alarm 58.')
  expect(announcement([low], [{ ...low }])).toBe('')
})

test('a device shows the gravest class that it counts', () => {
  const none = { shutdown: 0, load_dump: 0, trip: 0, warning: 0, indication: 0 }
  expect(worst(none)).toBeUndefined()
  expect(worst({ ...none, warning: 3, trip: 1 })).toBe('trip')
})
