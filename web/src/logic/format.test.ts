import { describe, expect, test } from 'vitest'
import {
  ageText,
  clockText,
  countdownText,
  decimalsOf,
  durationText,
  hoursText,
  numberText,
  registersText,
  timeOf,
  unitText,
} from './format'

describe('numbers', () => {
  test.each([
    ['230.2', '230.2'],
    ['27.6', '27.6'],
    ['0', '0'],
    ['-0.5', '-0.5'],
    ['50.3922', '50.3922'],
    ['4294967295', '4294967295'],
    ['42949672.95', '42949672.95'],
    ['-21474836.48', '-21474836.48'],
    ['0.0001', '0.0001'],
    ['1e-7', '0.0000001'],
    ['-1.25e-8', '-0.0000000125'],
    ['1e21', '1000000000000000000000'],
  ])('%s is shown as it came', (json, text) => {
    expect(numberText(JSON.parse(json) as number)).toBe(text)
  })

  test('every tenth that 32 bits can hold keeps its digits', () => {
    for (let raw = 1; raw < 2 ** 32; raw += 7_654_321) {
      const sent = `${Math.floor(raw / 10)}.${raw % 10}`.replace(/\.0$/, '')
      expect(numberText(JSON.parse(sent) as number)).toBe(sent)
    }
  })

  test.each([
    [50, 0],
    [49.98, 2],
    [1e-7, 7],
  ])('%d has %d decimals', (value, decimals) => expect(decimalsOf(value)).toBe(decimals))
})

test('units are written as engineers write them', () => {
  expect(['degC', 'ohm', 'kvar', 'L/h', null, undefined].map(unitText)).toEqual([
    '°C',
    'Ω',
    'kvar',
    'L/h',
    '',
    '',
  ])
})

test.each([
  [-500, '0 s'],
  [999, '0 s'],
  [59_999, '59 s'],
  [60_000, '1 min'],
  [3_599_999, '59 min'],
  [3_600_000, '1 h'],
  [47 * 3_600_000, '47 h'],
  [48 * 3_600_000, '2 d'],
])('an age of %d ms reads %s', (ms, text) => expect(ageText(ms)).toBe(text))

test.each([
  [8_000, '8 s'],
  [125_000, '2 min 05 s'],
  [12_000_000, '3 h 20 min'],
  [187_200_000, '2 d 4 h'],
])('a duration of %d ms reads %s', (ms, text) => expect(durationText(ms)).toBe(text))

test.each([
  [0, '0 s'],
  [7, '7 s'],
  [6.2, '7 s'],
  [67, '1:07 min'],
  [3727, '1:02:07 h'],
])('%d seconds left read %s', (seconds, text) => expect(countdownText(seconds)).toBe(text))

test('the date stands in front of another day only', () => {
  const now = new Date(2026, 10, 23, 14, 3, 9).getTime()
  expect(clockText(now, now)).toBe('14:03:09')
  expect(clockText(new Date(2026, 10, 22, 14, 3, 9).getTime(), now)).toBe('2026-11-22 14:03:09')
})

test('registers are four hex digits each', () =>
  expect(registersText([2302, 0, 65535])).toBe('08FE 0000 FFFF'))

test('a missing or unreadable time is none', () => {
  expect([null, undefined, '', 'soon'].map(timeOf)).toEqual([undefined, undefined, undefined, undefined])
  expect(timeOf('2026-11-23T04:00:00.250Z')).toBe(Date.UTC(2026, 10, 23, 4, 0, 0, 250))
})

test.each([
  [1234.5083, '1234 h 30 min 30 s', '1234 h 30 min'],
  [0.0003, '0 h 00 min 01 s', '0 h 00 min'],
  [0.0111, '0 h 00 min 40 s', '0 h 00 min'],
  [65535.9997, '65535 h 59 min 59 s', '65535 h 59 min'],
  [-1.5, '-1 h 30 min 00 s', '-1 h 30 min'],
])('%d hours are %s', (hours, whole, brief) => {
  expect(hoursText(hours)).toBe(whole)
  expect(hoursText(hours, true)).toBe(brief)
})
