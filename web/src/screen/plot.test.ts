import { expect, test } from 'vitest'
import { ceiling, samplesOf, traceOf } from './plot'

test.each([
  [0, 1],
  [-3, 1],
  [NaN, 1],
  [Infinity, 1],
  [0.03, 0.05],
  [0.3, 0.5],
  [1, 1],
  [1.01, 2],
  [5, 5],
  [7, 10],
  [325, 500],
  [3250, 5000],
  [32767, 50000],
])('an axis for %d ends at %d', (value, edge) => {
  expect(ceiling(value)).toBe(edge)
})

test('a row of numbers is a trace, and nothing else is', () => {
  expect(samplesOf([1, -2, 3])).toEqual([1, -2, 3])
  for (const value of [null, undefined, 5, 'ff', [], [1], [1, 'a'], [1, null]])
    expect(samplesOf(value)).toBeUndefined()
})

test('zero lies in the middle, the edges are the scale, first and last sample at the sides', () => {
  const trace = traceOf([0, 500, 0, -500, 250], 100, 40)
  expect(trace).toEqual({ path: 'M0 20L25 0L50 20L75 40L100 10', min: -500, max: 500, edge: 500 })
})

test('a dead channel is a flat line', () => {
  expect(traceOf([0, 0, 0], 100, 40)).toEqual({ path: 'M0 20L50 20L100 20', min: 0, max: 0, edge: 1 })
})
