import { describe, expect, test } from 'vitest'
import { alarm, device, group, point, snapshot, stamp, START, value } from '../logic/samples'
import { Site } from './site.svelte'

function started(): Site {
  const site = new Site()
  site.apply(
    'snapshot',
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
    site.apply('snapshot', snapshot([{ device: device('gen1'), values: [value('volts', 231)] }]))
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
    site.apply('snapshot', snapshot([{ device: device('gen1'), values: [] }], [], 60))
    expect(site.device('gen1')).not.toBe(before)
    expect(site.device('gen1')?.cell('volts').view).toBeUndefined()
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
    site.apply('snapshot', snapshot([{ device: device('gen1'), values: [] }], [alarm('gen1', 58, 'warning')]))
    expect(site.spoken).toBe('')
  })
})

test('a device event replaces the head of its device only', () => {
  const site = started()
  site.apply('device', device('gen2', { online: false, fault: 'Genset 2 does not answer' }))
  expect(site.devices.map(({ view }) => view.online)).toEqual([true, false])
})
