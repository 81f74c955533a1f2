import { describe, expect, test } from 'vitest'
import { lampsOf } from './lamps'
import { deviceLink, parseRoute } from './route'
import { group, point } from './samples'
import { tilesOf } from './vitals'

describe('the address', () => {
  test.each(['gen1', 'ATS north/2', 'ö%'])('of device %s leads back to it', (id) => {
    expect(parseRoute(deviceLink(id)).device).toBe(id)
  })

  test.each(['', '#', '#/', '#/devices/', '#/wires/a', '#/devices/%E0%A4%A', '#/devices/a/b'])(
    '%s names none',
    (hash) => {
      expect(parseRoute(hash).device).toBeUndefined()
    },
  )
})

describe('lamps', () => {
  test('a code has its name where the profile gives one', () => {
    const led = point('leds', { type: 'bits2', choices: [{ value: 2, label: 'Quick flash' }] })
    expect(lampsOf(led, [0, 2, 3]).map(({ label }) => label)).toEqual(['code 0', 'Quick flash', 'code 3'])
  })
})

describe('the values at a glance', () => {
  test('are found by signal, the better signal first', () => {
    const tiles = tilesOf([
      group('G', [
        point('a', { signal: 'genset.l1.voltage' }),
        point('b', { signal: 'genset.voltage.average' }),
        point('c', { signal: 'fuel.level' }),
      ]),
    ])
    expect(tiles.map(({ title, point }) => [title, point.id])).toEqual([
      ['Genset voltage', 'b'],
      ['Fuel', 'c'],
    ])
  })

  test('are none for a device without signals', () => expect(tilesOf([group('G', [point('a')])])).toEqual([]))
})
