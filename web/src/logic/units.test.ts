import { expect, test } from 'vitest'
import { keepChoice, keptChoice, shown, unitFor } from './units'

const text = ({ number, unit }: { number: string; unit: string }) => `${number} ${unit}`

test.each([
  // Source value, its unit, decimals of the source, chosen, shown: never a digit more than the source has.
  [3.4, 'bar', 1, 'kPa', '340 kPa'],
  [3.4, 'bar', 1, 'psi', '49 psi'],
  [3, 'bar', 2, 'psi', '43.5 psi'],
  [0, 'bar', 1, 'psi', '0 psi'],
  [700, 'kPa', 0, 'bar', '7.00 bar'],
  [7, 'kPa', 0, 'psi', '1.0 psi'],
  [689.5, 'kPa', 1, 'psi', '100.00 psi'],
  [100, 'psi', 0, 'kPa', '689 kPa'],
  [100, 'psi', 0, 'bar', '6.89 bar'],
  [-0.04, 'bar', 2, 'psi', '-0.6 psi'],
] as const)('%d %s with %d decimals in %s is %s', (value, unit, decimals, pressure, is) => {
  expect(text(shown(value, unit, { pressure }, decimals))).toBe(is)
})

test.each([
  [39.8, 'degC', 1, 'degF', '103.6 °F'],
  [100, 'degC', 0, 'degF', '212 °F'],
  [-40, 'degC', 0, 'degF', '-40 °F'],
  [-17.8, 'degC', 1, 'degF', '0.0 °F'],
  [212, 'degF', 0, 'degC', '100.0 °C'],
] as const)('%d %s with %d decimals in %s is %s', (value, unit, decimals, temperature, is) => {
  expect(text(shown(value, unit, { temperature }, decimals))).toBe(is)
})

test('two neighbours of the source are never the same text', () => {
  for (const [unit, step] of [
    ['bar', 0.1],
    ['kPa', 1],
    ['psi', 1],
  ] as const)
    for (const pressure of ['bar', 'kPa', 'psi'] as const) {
      const decimals = step === 0.1 ? 1 : 0
      const all = Array.from({ length: 200 }, (_, n) =>
        shown(Number((n * step).toFixed(1)), unit, { pressure }, decimals),
      )
      expect(new Set(all.map(({ number }) => number)).size).toBe(200)
    }
})

test('what was not chosen, or is of another kind, stays as the controller gives it', () => {
  expect(text(shown(0.3, 'bar', {}))).toBe('0.3 bar')
  expect(text(shown(0.3, 'bar', { pressure: 'bar', temperature: 'degF' }))).toBe('0.3 bar')
  expect(text(shown(50, 'Hz', { pressure: 'psi', temperature: 'degF' }))).toBe('50 Hz')
  expect(text(shown(7, null, { pressure: 'psi' }))).toBe('7 ')
  expect(unitFor('degC', { temperature: 'degF' })).toBe('degF')
  expect(unitFor(undefined, { temperature: 'degF' })).toBeUndefined()
})

test('a choice is kept, and nothing else is believed', () => {
  const kept = new Map<string, string>()
  const store = {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, value: string) => void kept.set(key, value),
  }
  keepChoice({ pressure: 'psi', temperature: 'degF' }, () => store)
  expect(keptChoice(() => store)).toEqual({ pressure: 'psi', temperature: 'degF' })
  for (const [key] of kept) kept.set(key, '{"pressure":"furlong","temperature":7}')
  expect(keptChoice(() => store)).toEqual({})
  for (const [key] of kept) kept.set(key, 'null')
  expect(keptChoice(() => store)).toEqual({})
})

test('without storage the page works the same', () => {
  const none = () => {
    throw new Error('denied')
  }
  expect(keptChoice(none)).toEqual({})
  expect(() => keepChoice({ pressure: 'psi' }, none)).not.toThrow()
})
