// What the nameplate makes of a value, what is in doubt, and times of the site.
import { expect, test } from 'vitest'
import { doubtText } from './doubt'
import { clockText, panelText, zoneOf } from './format'
import { ratedOf } from './nameplate'
import { typeText } from './point'

const PLATE = { power_kw: 110, tank_l: 900, battery_v: 24 }

test.each([
  ['genset.power.active', 36.2, '33 % of 110 kW', 0.329],
  ['genset.power.active', 121, '110 % of 110 kW', 1],
  ['genset.power.active', -5, '-5 % of 110 kW', 0],
  ['fuel.level', 25, 'about 225 L of 900 L', 0.25],
  ['battery.voltage', 26.9, 'of 24 V nominal', undefined],
  ['battery.voltage', 23.9, 'below 24 V nominal', undefined],
])('%s at %d is %s', (signal, value, text, share) => {
  const rated = ratedOf(signal, value, PLATE)
  // No line end parts a number from its unit.
  expect(rated?.text.replaceAll('\u00a0', ' ')).toBe(text)
  if (share === undefined) expect(rated?.share).toBeUndefined()
  else expect(rated?.share).toBeCloseTo(share, 2)
  expect(rated?.low ?? false).toBe(text.startsWith('below'))
})

test('where the site file says nothing, nothing is said', () => {
  const nothing = { power_kw: null, tank_l: null, battery_v: null }
  for (const signal of ['genset.power.active', 'fuel.level', 'battery.voltage', 'mains.frequency', null]) {
    expect(ratedOf(signal, 5, nothing)).toBeUndefined()
  }
  expect(ratedOf('mains.frequency', 50, PLATE)).toBeUndefined()
})

test.each([
  ['sign', 'The manual does not say for certain whether it can be negative.'],
  [
    'source, scale, sign',
    'The manual does not say for certain where it is measured, its scale and whether it can be negative.',
  ],
  ['16 of 19 bits', 'The manual leaves in doubt: 16 of 19 bits.'],
  [
    'unit; 14 registers lower in older firmware',
    'The manual does not say for certain its unit. The manual leaves in doubt: 14 registers lower in older firmware.',
  ],
  [
    'order of the input alarms, bits 0 to 47',
    'The manual leaves in doubt: order of the input alarms, bits 0 to 47.',
  ],
])('doubt about "%s" in words', (doubt, text) => expect(doubtText(doubt)).toBe(text))

test('times are told in the site’s zone where its clocks are other ones', () => {
  const now = Date.parse('2026-11-23T20:00:00Z')
  expect(clockText(now, now, 'Asia/Kathmandu')).toBe('01:45:00')
  expect(clockText(now - 3 * 3_600_000, now, 'Asia/Kathmandu')).toBe('2026-11-23 22:45:00')
  const here = Intl.DateTimeFormat().resolvedOptions().timeZone
  expect(zoneOf(here, now)).toBeUndefined()
  expect(zoneOf('Asia/Kathmandu', now)).toBe(here === 'Asia/Kathmandu' ? undefined : 'Asia/Kathmandu')
  expect(zoneOf('Mars/Olympus', now)).toBeUndefined()
  expect(zoneOf(null, now)).toBeUndefined()
  expect(clockText(now, now, 'Mars/Olympus')).toBe(clockText(now, now))
})

test('words of the vocabulary as panels write them, types in words', () => {
  expect(panelText('load_test')).toBe('LOAD TEST')
  expect(typeText({ type: 'u16' })).toBe('u16: unsigned, 16 bits')
  expect(typeText({ type: 'bytes' })).toBe('bytes')
})
