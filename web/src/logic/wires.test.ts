import { describe, expect, test } from 'vitest'
import { unit, wire, wireDetail } from './samples'
import {
  barsOf,
  bytesText,
  countersOf,
  countText,
  exceptionsText,
  msText,
  shareText,
  spansOf,
  unitWords,
  whenText,
} from './wires'

test.each([
  [0, '0'],
  [999, '999'],
  [1000, '1\u202f000'],
  [1234567, '1\u202f234\u202f567'],
])('%d is counted as %s', (count, text) => expect(countText(count)).toBe(text))

test.each([
  [0, '0 B'],
  [999, '999 B'],
  [1234, '1.2 kB'],
  [123_456, '123 kB'],
  [2_500_000, '2.5 MB'],
  [7e9, '7.0 GB'],
])('%d bytes are %s', (bytes, text) => expect(bytesText(bytes)).toBe(text))

test.each([
  [null, '–'],
  [0.345, '0.34 ms'],
  [3.25, '3.3 ms'],
  [46.5, '47 ms'],
  [1234, '1.2 s'],
])('%d ms are %s', (ms, text) => expect(msText(ms)).toBe(text))

test.each([
  [null, '–'],
  [0, '0 %'],
  [0.004, '0.4 %'],
  [0.23, '23 %'],
  [1.31, '131 %'],
])('a share of %d is %s', (share, text) => expect(shareText(share)).toBe(text))

test('a unit says what it did when it was asked last', () => {
  expect(unitWords(unit(1))).toBe('Answering')
  expect(unitWords(unit(1, { state: 'missing' }))).toBe('Did not answer')
  expect(unitWords(unit(1, { state: 'silent', next_probe_s: 3.2 }))).toBe('Silent, asked again in 4 s')
  expect(unitWords(unit(1, { state: 'unknown' }))).toBe('Not known yet')
})

test('exceptions are counted by code', () => {
  expect(exceptionsText([])).toBe('–')
  expect(
    exceptionsText([
      { code: 2, count: 3 },
      { code: 6, count: 1 },
    ]),
  ).toBe('code 2: 3, code 6: 1')
})

describe('the counters of a wire', () => {
  const of = (id: string) => countersOf(wire(id)).map(({ title }) => title)

  test('leave out what never happened', () => {
    expect(of('bus')).toContain('Noise')
    for (const title of ['Echoes', 'Wrong unit', 'Reconnected', 'Held back'])
      expect(of('bus')).not.toContain(title)
  })

  test('mark what somebody should look at', () => {
    const bad = countersOf(wire('bus')).filter(({ bad }) => bad)
    expect(bad.map(({ title, value }) => [title, value])).toEqual([
      ['Time-outs', '1'],
      ['CRC errors', '2'],
      ['Exceptions', 'code 2: 3'],
      ['Noise', '7'],
    ])
  })
})

describe('how long answers took', () => {
  const { latency } = wireDetail('bus')

  test('is shown from the first to the last range that has any', () => {
    expect(barsOf(latency).map(({ label, count }) => [label, count])).toEqual([
      ['up to 2.0 ms', 3],
      ['up to 5.0 ms', 0],
      ['up to 20 ms', 1],
    ])
    expect(barsOf(latency)[0]?.size).toBe(100)
  })

  test('has no end at the top', () => {
    const buckets = [
      { up_to_ms: 500, count: 0 },
      { up_to_ms: null, count: 2 },
    ]
    expect(barsOf({ ...latency, buckets })).toEqual([{ label: 'over 500 ms', count: 2, size: 100 }])
  })

  test('is nothing before the first answer', () => {
    expect(barsOf({ ...latency, buckets: latency.buckets.map((b) => ({ ...b, count: 0 })) })).toEqual([])
  })
})

describe('the time of a wire', () => {
  test('is shared out without rest', () => {
    const spans = spansOf({ busy_s: 25, busy_share: 0.25, waiting_s: 5, waiting_share: 0.05 })
    expect(spans.map(({ kind }) => kind)).toEqual(['busy', 'waiting', 'free'])
    expect(spans.reduce((sum, { share }) => sum + share, 0)).toBeCloseTo(1)
  })

  test('is never more than there is', () => {
    const spans = spansOf({ busy_s: 9, busy_share: 0.9, waiting_s: 2, waiting_share: 0.2 })
    expect(spans.map(({ share }) => share)).toEqual([0.9, expect.closeTo(0.1), expect.closeTo(0)])
  })

  test('over TCP says nothing of the line', () => {
    const spans = spansOf({ busy_s: null, busy_share: null, waiting_s: 5, waiting_share: 0.05 })
    expect(spans.map(({ kind }) => kind)).toEqual(['waiting', 'free'])
  })
})

test('a round says when it comes', () => {
  const round = { reads: [], characters: 0, ms: null }
  expect(whenText({ ...round, every_s: 1, rates: ['fast'] })).toBe('Every 1 s')
  expect(whenText({ ...round, every_s: 10, rates: ['fast', 'slow'] })).toBe(
    'Every 10 s, slow points with the fast ones',
  )
  expect(whenText({ ...round, every_s: null, rates: ['fast', 'slow', 'once'] })).toBe(
    'At the start, and when the device comes back',
  )
})
