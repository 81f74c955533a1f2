import { expect, test } from 'vitest'
import { group, point } from '../logic/samples'
import { lookedAt } from './wanted'

const LCD = point('lcd', { type: 'image', rate: 'on_demand', registers: 512 })
const SCOPE = point('scope', { type: 'trace', rate: 'on_demand', registers: 100 })
const slow = (id: string, rest = {}) => point(id, { rate: 'slow', ...rest })

test('a controller that has nothing to look at has no screen', () => {
  expect(lookedAt([])).toBeUndefined()
  const other = group('Other', [point('volts'), point('address', { type: 'bytes', rate: 'on_demand' })])
  expect(lookedAt([other])).toBeUndefined()
})

test('only the groups with something to draw are asked for, whatever they are called', () => {
  const looked = lookedAt([group('Genset', [point('volts')]), group('Panel', [LCD])])
  expect(looked).toEqual({ groups: ['panel'], points: [LCD], images: [LCD], analyses: [] })
})

test('an analysis is told by its points, the harmonics in their order', () => {
  const points = [
    slow('channel_thd'),
    slow('channel_fundamental'),
    slow('channel_harmonic_11'),
    slow('channel_harmonic_3'),
    slow('selected_channel', { type: 'choice' }),
    SCOPE,
  ]
  const [analysis] = lookedAt([group('Waves', points)])!.analyses
  expect(analysis?.harmonics.map(({ order }) => order)).toEqual([3, 11])
  expect(analysis?.trace).toBe(SCOPE)
  expect(analysis?.channel?.id).toBe('selected_channel')
  expect(analysis?.distortion?.id).toBe('channel_thd')
  expect(analysis?.fundamental?.id).toBe('channel_fundamental')
})

test('a trace alone is enough', () => {
  const looked = lookedAt([group('Scope', [SCOPE])])
  expect(looked?.analyses).toEqual([
    { trace: SCOPE, channel: undefined, distortion: undefined, fundamental: undefined, harmonics: [] },
  ])
})
