import { readFileSync } from 'node:fs'
import { resolve } from 'node:path'
import { describe, expect, test } from 'vitest'
import { lampsOf } from './lamps'
import { deviceLink, parseRoute, SITE_LINK, wireLink } from './route'
import { group, joined, point, value } from './samples'
import { cardOf, feedText, flagText, signalsOf, TILES, tilesOf } from './vitals'

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

  test('of the wires leads to them, with or without one', () => {
    expect(parseRoute(wireLink())).toEqual({ view: 'wires', device: undefined, wire: undefined })
    expect(parseRoute(wireLink('bus 1/ö'))).toMatchObject({ view: 'wires', wire: 'bus 1/ö' })
  })

  test.each(['', SITE_LINK, '#/devices', '#/anything/else'])('%s leads to the overview', (hash) => {
    expect(parseRoute(hash).view).toBe('site')
  })
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
    expect(tiles.map(({ title, id }) => [title, id])).toEqual([
      ['Genset voltage', 'b'],
      ['Fuel', 'c'],
    ])
  })

  test('are none for a device without signals', () => expect(tilesOf([group('G', [point('a')])])).toEqual([]))

  test('of a transfer switch are its sources and where its switches stand', () => {
    const position = point('position', {
      type: 'bits',
      bits: [
        { bit: 4, id: 's1', label: 'S1 closed', class: 'status', signal: 'breaker.src1.closed' },
        { bit: 5, id: 's2', label: 'S2 closed', class: 'status' },
      ],
    })
    const tiles = tilesOf(
      [
        group('S', [
          point('s1_state', { signal: 'state.src1' }),
          point('v', { signal: 'src1.l1.voltage' }),
          position,
        ]),
      ],
      [joined('src1.supply.hours')],
    )
    expect(tiles.map(({ title, kind }) => [title, kind])).toEqual([
      ['Source 1', 'point'],
      ['Source 1 voltage', 'point'],
      ['Source 1 switch', 'flag'],
      ['Source 1 supplied', 'joined'],
    ])
    const flag = tiles[2]
    if (flag?.kind !== 'flag') throw new Error('a flag')
    expect(flagText(flag, value('position', ['S1 closed'], { set: [4] }))).toBe('closed')
    expect(flagText(flag, value('position', [], { set: [] }))).toBe('open')
    expect(flagText(flag, value('position', null, { quality: 'invalid' }))).toBeUndefined()
    expect(flagText(flag, undefined)).toBeUndefined()
  })

  test('which source carries a load follows from the three switches', () => {
    const bit = (bit: number, signal: string) => ({
      bit,
      id: signal,
      label: signal,
      class: 'status' as const,
      signal,
    })
    const switches = point('switches', {
      type: 'bits',
      bits: [bit(4, 'breaker.src1.closed'), bit(5, 'breaker.src2.closed')],
    })
    const tie = point('tie', { type: 'bits', bits: [bit(7, 'breaker.tie.closed')] })
    const feeds = tilesOf([group('S', [switches, tie])]).filter((tile) => tile.kind === 'feed')
    const loads = (closed: number[], tied: boolean) => {
      const word = value('switches', [], { set: closed })
      const tieWord = value('tie', [], { set: tied ? [7] : [] })
      return feeds.map((feed) => feedText(feed, [word, tieWord, word]))
    }
    expect(loads([4, 5], false)).toEqual(['on source 1', 'on source 2'])
    expect(loads([5], true)).toEqual(['on source 2', 'on source 2'])
    expect(loads([4], false)).toEqual(['on source 1', 'on none'])
    expect(loads([], true)).toEqual(['on none', 'on none'])
    expect(loads([4, 5], true)).toEqual(['on both sources', 'on both sources'])
    expect(feeds.map((feed) => feedText(feed, [undefined, undefined, undefined]))).toEqual([
      undefined,
      undefined,
    ])
    expect(tilesOf([group('S', [switches])]).some((tile) => tile.kind === 'feed')).toBe(false)
  })

  test.each([
    ['genset', 12],
    ['transfer_switch', 9],
    ['compressor', 9],
  ] as const)('on the card of a %s make whole rows', (kind, count) => {
    expect(cardOf(kind)).toHaveLength(count)
    expect(signalsOf(cardOf(kind)).length).toBeGreaterThan(0)
  })

  test('of a compressor are its discharge, whether it is loaded, and its hours', () => {
    const signals = ['compressor.discharge.pressure', 'compressor.discharge.temperature', 'engine.speed']
    const status = point('status', {
      type: 'bits',
      bits: [{ bit: 6, id: 'load', label: 'Load', class: 'status', signal: 'compressor.loaded' }],
    })
    const points = signals.map((signal) => point(signal, { signal }))
    const tiles = tilesOf([group('A', [...points, status])], [joined('engine.hours')])
    expect(tiles.map(({ title }) => title)).toEqual([
      'Compressor',
      'Discharge pressure',
      'Discharge temperature',
      'Engine speed',
      'Engine hours',
    ])
  })

  const PROFILES = resolve(process.cwd(), '../profiles')

  test('have signals that the vocabulary knows', () => {
    const vocabulary = readFileSync(`${PROFILES}/vocabulary.toml`, 'utf8')
    for (const signal of TILES.flatMap(({ signals }) => signals))
      expect(vocabulary).toContain(`id = "${signal}"`)
  })

  test.each([
    ['datakom-d', ['Mains voltage', 'Genset power', 'Genset breaker', 'Engine hours', 'Fuel']],
    ['datakom-dkg705', ['Mains voltage', 'Genset power', 'Genset breaker', 'Engine speed', 'Engine hours']],
    [
      'smartgen-hat821si',
      ['Source 1', 'Source 1 switch', 'Source 2 voltage', 'Bus tie', 'Source 2 supplied'],
    ],
    [
      'smartgen-acc1700',
      ['Compressor', 'Discharge pressure', 'Engine hours', 'Next service', 'Oil pressure'],
    ],
  ])('of %s are there', (profile, titles) => {
    const text = readFileSync(`${PROFILES}/${profile}/profile.toml`, 'utf8')
    const carried = new Set([...text.matchAll(/signal = "([^"]+)"/g)].map(([, signal]) => signal))
    const shown = TILES.filter(({ signals }) => signals.some((signal) => carried.has(signal)))
    expect(shown.map(({ title }) => title)).toEqual(expect.arrayContaining(titles))
  })
})
