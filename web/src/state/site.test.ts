import { describe, expect, test } from 'vitest'
import { alarm, device, group, point, snapshot, stamp, START, value, type Whole } from '../logic/samples'
import { Site } from './site.svelte'

function tell(site: Site, whole: Whole): void {
  site.apply('snapshot', whole)
  for (const state of whole.states) site.apply('state', state)
}

function started(): Site {
  const site = new Site()
  tell(
    site,
    snapshot(
      [
        { device: device('gen1'), values: [value('volts', 230.2), value('amps', 12)] },
        { device: device('gen2'), values: [value('volts', 0)] },
      ],
      [alarm('gen1', 58, 'warning')],
    ),
  )
  return site
}

describe('a snapshot', () => {
  test('holds the devices in order, each with its own values and alarms', () => {
    const site = started()
    expect(site.view?.name).toBe('North hospital')
    expect(site.devices.map(({ view }) => view.id)).toEqual(['gen1', 'gen2'])
    expect(site.device('gen1')?.cell('volts').view?.value).toBe(230.2)
    expect(site.device('gen2')?.cell('volts').view?.value).toBe(0)
    expect(site.device('gen1')?.alarms).toHaveLength(1)
    expect(site.device('gen2')?.alarms).toEqual([])
  })

  test('after a gap keeps the device and what was fetched of it, and takes the new values', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    gen1.groups = [group('G', [point('volts')])]
    site.apply('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(9), changed: [] })
    tell(site, snapshot([{ device: device('gen1'), values: [value('volts', 231)] }]))
    expect(site.devices).toEqual([gen1])
    expect(gen1.groups).toHaveLength(1)
    expect(gen1.cell('volts').view?.value).toBe(231)
    // The rounds before the gap say nothing about the values after it.
    expect(gen1.rounds).toEqual({})
    expect(gen1.alarms).toEqual([])
  })

  test('of a gateway that was started again begins from nothing', () => {
    const site = started()
    const before = site.device('gen1')
    tell(site, snapshot([{ device: device('gen1'), values: [] }], [], 60))
    expect(site.device('gen1')).not.toBe(before)
    expect(site.device('gen1')?.cell('volts').view).toBeUndefined()
  })
})

describe('another site file', () => {
  test('may have other points under the same names', () => {
    const site = started()
    const before = site.device('gen1')
    tell(site, snapshot([{ device: device('gen1'), values: [] }], [], 0, 2))
    expect(site.device('gen1')).not.toBe(before)
    expect(site.device('gen1')?.cell('volts').view).toBeUndefined()
  })

  test('that is refused changes nothing but what is known of it', () => {
    const site = started()
    const gen1 = site.device('gen1')
    const refused = { at: stamp(9), reason: 'site.toml:3:1: no' }
    site.apply('site', { ...site.view, config: { loaded: stamp(0), refused } })
    expect(site.view?.config.refused).toEqual(refused)
    expect(site.device('gen1')).toBe(gen1)
  })
})

describe('a device with a stream of its own', () => {
  const all = { device: 'gen1', values: [value('volts', 231), value('oil', 4.2)], joined: [] }
  const round = (volts: number) => ({
    device: 'gen1',
    joined: [],
    rate: 'fast',
    ts: stamp(3),
    changed: [value('volts', volts)],
  })

  test('is told by that one alone, from its state on', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    site.apply('values', round(232))
    expect(gen1.cell('volts').view?.value).toBe(232)
    gen1.follow('state', all)
    expect(gen1.cell('volts').view?.value).toBe(231)
    site.apply('values', round(233))
    expect(gen1.cell('volts').view?.value).toBe(231)
    gen1.follow('values', round(234))
    expect(gen1.cell('volts').view?.value).toBe(234)
  })

  test('keeps its own values when the other stream begins anew', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    gen1.follow('state', all)
    tell(site, snapshot([{ device: device('gen1'), values: [value('volts', 229)] }]))
    expect(gen1.cell('volts').view?.value).toBe(231)
  })

  test('loses it: what nobody tells any more is stale, the rest is told by the other', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    gen1.follow('state', all)
    // Told by the other while its own was on the way still.
    site.apply('values', round(232))
    gen1.unfollow()
    expect(gen1.cell('oil').view).toMatchObject({ value: 4.2, quality: 'stale' })
    expect(gen1.cell('volts').view).toMatchObject({ value: 232, quality: 'good' })
    expect(gen1.cell('amps').view?.value).toBe(12)
    site.apply('values', round(235))
    expect(gen1.cell('volts').view?.value).toBe(235)
  })
})

describe('what the document knows of the cards', () => {
  const cards = {
    'datakom-d': {
      manual: 'D-500 manual',
      groups: [group('Genset', [point('hz', { signal: 'genset.frequency' })])],
      joined: [],
    },
  }

  test('is taken for the devices of that profile, and not after a restart', () => {
    const site = new Site(cards)
    const one = [
      { device: device('gen1'), values: [] },
      { device: device('ats1', { profile: 'smartgen-hat821si', kind: 'transfer_switch' }), values: [] },
    ]
    tell(site, snapshot(one))
    expect(site.device('gen1')?.glance?.map(({ title }) => title)).toEqual(['Genset frequency'])
    expect(site.device('ats1')?.glance).toBeUndefined()
    tell(site, snapshot(one, [], 60))
    expect(site.device('gen1')?.glance).toBeUndefined()
  })
})

describe('values', () => {
  test('change what they name and date the round', () => {
    const site = started()
    site.apply('values', {
      device: 'gen1',
      joined: [],
      rate: 'fast',
      ts: stamp(3),
      changed: [value('volts', 229.9)],
    })
    const gen1 = site.device('gen1')!
    expect(gen1.cell('volts').view?.value).toBe(229.9)
    expect(gen1.cell('amps').view?.value).toBe(12)
    expect(gen1.rounds).toEqual({ fast: START + 3000 })
    expect(gen1.seenAt).toBe(START + 3000)
    expect(site.device('gen2')?.cell('volts').view?.value).toBe(0)
  })

  test('of a round that failed are no sign of life', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    site.apply('device', device('gen1', { online: false, last_seen: stamp(2) }))
    site.apply('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(30), changed: [] })
    expect(gen1.seenAt).toBe(START + 2000)
    site.apply('device', device('gen1', { online: false, last_seen: null }))
    expect(gen1.seenAt).toBeUndefined()
    // The values say it before the device does.
    site.apply('device', device('gen1', { online: true, last_seen: stamp(2) }))
    const bad = value('volts', null, { quality: 'bad', error: 'no answer' })
    site.apply('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(33), changed: [bad] })
    expect(gen1.seenAt).toBe(START + 30_000)
    site.apply('device', device('gen1', { online: false, last_seen: null }))
    expect(gen1.seenAt).toBeUndefined()
  })

  test('age with the round of their own rate', () => {
    const site = started()
    const gen1 = site.device('gen1')!
    site.apply('values', {
      device: 'gen1',
      joined: [],
      rate: 'slow',
      ts: stamp(3),
      changed: [value('flow', 21.4)],
    })
    site.apply('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(9), changed: [] })
    expect(gen1.rounds).toEqual({ slow: START + 3000, fast: START + 9000 })
  })

  test('of an unknown device change nothing', () => {
    const site = started()
    site.apply('values', {
      device: 'gen9',
      joined: [],
      rate: 'fast',
      ts: stamp(3),
      changed: [value('volts', 1)],
    })
    expect(site.devices).toHaveLength(2)
  })

  test('that turn bad leave the last good one in reach', () => {
    const site = started()
    const cell = site.device('gen1')!.cell('volts')
    cell.set(value('volts', null, { quality: 'bad', error: 'no answer' }))
    expect(cell.view?.quality).toBe('bad')
    expect(cell.lastGood?.value).toBe(230.2)
  })

  test('keep room for the most decimals seen', () => {
    const cell = started().device('gen1')!.cell('volts')
    cell.set(value('volts', 49.98))
    cell.set(value('volts', 50))
    expect(cell.decimals).toBe(2)
  })
})

describe('alarms', () => {
  test('replace the list of their device and are said aloud', () => {
    const site = started()
    expect(site.spoken).toBe('Warning: Alarm 58.')
    site.apply('alarms', { device: 'gen1', alarms: [alarm('gen1', 54, 'shutdown')] })
    expect(site.device('gen1')?.alarms.map(({ bit }) => bit)).toEqual([54])
    expect(site.spoken).toBe('Shutdown: Alarm 54. Cleared: Alarm 58.')
  })

  test('that did not change are not said again after a reconnection', () => {
    const site = started()
    site.spoken = ''
    tell(site, snapshot([{ device: device('gen1'), values: [] }], [alarm('gen1', 58, 'warning')]))
    expect(site.spoken).toBe('')
  })
})

test('a device event replaces the head of its device only', () => {
  const site = started()
  site.apply('device', device('gen2', { online: false, fault: 'Genset 2 does not answer' }))
  expect(site.devices.map(({ view }) => view.online)).toEqual([true, false])
})
