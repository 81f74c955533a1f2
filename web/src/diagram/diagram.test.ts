// The diagram in a document of its own, on made-up values and on those of the page.
import { flushSync, mount, unmount, type Component } from 'svelte'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { device, group, point, START, value } from '../logic/samples'
import type { PointView } from '../logic/types'
import { Page } from '../state/page.svelte'
import { Device } from '../state/site.svelte'
import { providePage } from '../view/context'
import DiagramView from './Diagram.svelte'
import { HOSPITAL, lines, node, values } from './fixtures'
import SiteDiagram from './SiteDiagram.svelte'
import type { Diagram, Live } from './types'

const VOLTS = (value: number) => ({ value, unit: 'V' })
const KNOWN = {
  'genset-1 mains.voltage.average': VOLTS(231.4),
  'genset-1 mains.frequency': { value: 50.02, unit: 'Hz' },
  'genset-1 genset.voltage.average': VOLTS(0),
  'genset-2 genset.l1.voltage': { ...VOLTS(229), look: 'stale' },
  'genset-1 breaker.mains.closed': true,
  'genset-1 breaker.genset.closed': false,
  'switch-1 breaker.src1.closed': true,
  'switch-1 breaker.tie.closed': false,
  'compressor-1 compressor.loaded': false,
} as const

let app: Record<string, unknown>

function show(diagram: Diagram, live: Live, devices: string[] = []): void {
  app = mount(DiagramView, { target: document.body, props: { diagram, live, devices } })
  flushSync()
}

const label = (selector: string) =>
  document.querySelector(selector)?.getAttribute('aria-label')?.replaceAll('\u00a0', ' ')
const list = () =>
  [...document.querySelectorAll('li')].map((line) => line.textContent?.replaceAll('\u00a0', ' '))

beforeEach(() => {
  vi.useFakeTimers({ now: START, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
})

afterEach(async () => {
  await unmount(app)
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

test('every node and every breaker says how it is, and stands in the list', () => {
  show(HOSPITAL, values(KNOWN))
  const said = {
    utility: 'Utility feed: live, 231.4 V, 50.02 Hz',
    gen1: 'Genset 1: dead, 0 V',
    // A number that is not good is not shown, and tells nothing.
    gen2: 'Genset 2: not known',
    main: 'Main bus: live, fed by Utility feed',
    emergency: 'Emergency bus: not known',
    wards: 'Wards: live, fed by Utility feed',
    theatres: 'Operating theatres: not known',
    air: 'Air compressor: unloaded',
  }
  for (const [id, words] of Object.entries(said)) expect(label(`[data-node=${id}]`)).toBe(words)
  const breakers = [
    'Utility feed to Main bus: breaker closed',
    'Genset 1 to Main bus: breaker open',
    'Genset 2 to Emergency bus: breaker position not known',
    'Main bus to Wards: breaker closed',
    'Emergency bus to Operating theatres: breaker position not known',
    'Wards to Operating theatres: breaker open',
  ]
  breakers.forEach((words, index) => expect(label(`[data-connection="${index}"]`)).toBe(words))
  expect(list()).toEqual([...Object.values(said), ...breakers])
  expect(document.querySelector('summary')?.textContent).toContain('Not all of it is known.')
})

test('lines and breakers are drawn as they are, not in colour alone', () => {
  show(HOSPITAL, values(KNOWN))
  const wires = (index: number) =>
    [...document.querySelectorAll(`[data-connection="${index}"] .wire`)].map((wire) => wire.classList[1])
  const contact = (index: number) => document.querySelector(`[data-connection="${index}"] .contact`)
  expect(wires(0)).toEqual(['live', 'live'])
  expect(wires(1)).toEqual(['dead', 'live'])
  expect(wires(2)).toEqual(['unknown', 'unknown'])
  const shapes = [0, 1].map((index) =>
    contact(index)
      ?.getAttribute('d')
      ?.replace(/[\d. -]+/g, ''),
  )
  expect(shapes).toEqual(['MV', 'ML'])
  expect(document.querySelectorAll('.doubt')).toHaveLength(2)
})

test('a plain line has no breaker, and none of its halves says more than both ends', () => {
  const diagram = {
    nodes: [
      node('m', 'mains', { device: 'p', signals: 'mains' }),
      node('b', 'bus', { device: 'p', signals: 'src1' }),
    ],
    connections: lines('m-b'),
  }
  show(diagram, values({ 'p mains.l1.voltage': 230, 'p src1.l1.voltage': 0 }))
  expect(label('[data-connection]')).toBe('m to b: no breaker')
  expect(document.querySelector('.contact')).toBeNull()
  expect([...document.querySelectorAll('.wire')].map((wire) => wire.classList[1])).toEqual([
    'unknown',
    'unknown',
  ])
})

test('a node leads to its controller, where there is one', () => {
  show(HOSPITAL, values(KNOWN), ['genset-1'])
  expect(document.querySelector('[data-node=utility]')?.getAttribute('href')).toBe('#/devices/genset-1')
  expect(document.querySelector('[data-node=gen2]')?.hasAttribute('href')).toBe(false)
  expect(document.querySelector('[data-node=main]')?.hasAttribute('href')).toBe(false)
})

test('names are text, whatever stands in them', () => {
  const name = `<img src=x onerror=alert(1)>${'x'.repeat(170)}`
  show({ nodes: [node('m', 'mains', { name })], connections: [] }, values({}))
  expect(document.querySelector('img')).toBeNull()
  expect(document.querySelector('.name')?.textContent).toBe(name)
})

test('on the page the values come from the points that carry the signals, good only while it is live', async () => {
  const asked: string[] = []
  const flag = {
    bit: 4,
    id: 'mcb',
    label: 'Mains breaker',
    class: 'status',
    signal: 'breaker.mains.closed',
  } as const
  const points: PointView[] = [
    point('volts', { signal: 'mains.l1.voltage', unit: 'V' }),
    point('flags', { type: 'bits', bits: [flag] }),
  ]
  let reached = false
  vi.stubGlobal('fetch', async (address: URL) => {
    asked.push(address.pathname + address.search)
    if (!reached) throw new TypeError('network')
    return Response.json({ groups: [group('All', points)], joined: [] })
  })
  const page = new Page(() => ({ addEventListener: () => undefined, close: () => undefined }))
  const gen = new Device(device('g'))
  page.site.devices = [gen]
  page.stream.phase = 'live'
  const diagram = {
    nodes: [node('m', 'mains', { device: 'g', signals: 'mains' }), node('l', 'load')],
    connections: [{ from: 'm', to: 'l', device: 'g', breaker: 'breaker.mains.closed' }],
  }
  const Held: Component<{ diagram: Diagram }> = (anchor, props) => {
    providePage(page)
    return SiteDiagram(anchor, props)
  }
  app = mount(Held, { target: document.body, props: { diagram } })
  flushSync()
  expect(label('[data-node=m]')).toBe('m: not known')
  // It asks again until it is told.
  reached = true
  await vi.advanceTimersByTimeAsync(3000)
  expect(asked).toHaveLength(2)
  expect(asked[1]).toMatch(/devices\/g\/points\?signal=mains\.voltage\.average,.*,breaker\.mains\.closed$/)
  gen.take([value('volts', 230, { unit: 'V' }), value('flags', ['Mains breaker'], { set: [4] })], [])
  flushSync()
  expect(label('[data-node=m]')).toBe('m: live, 230 V')
  expect(label('[data-node=l]')).toBe('l: live, fed by m')
  gen.take([value('flags', [], { set: [] })], [])
  flushSync()
  expect(label('[data-connection]')).toBe('m to l: breaker open')
  expect(label('[data-node=l]')).toBe('l: dead')
  gen.view = { ...gen.view, identity: { verdict: 'wrong', detail: null, checked: null } }
  flushSync()
  expect(label('[data-node=m]')).toBe('m: not known')
  gen.view = device('g')
  flushSync()
  expect(label('[data-node=m]')).toBe('m: live, 230 V')
  page.stream.phase = 'lost'
  flushSync()
  expect(label('[data-node=m]')).toBe('m: not known')
  expect(label('[data-node=l]')).toBe('l: not known')
})

test('a site that draws nothing has no diagram', () => {
  const page = new Page(() => ({ addEventListener: () => undefined, close: () => undefined }))
  const Held: Component<{ diagram: Diagram }> = (anchor, props) => {
    providePage(page)
    return SiteDiagram(anchor, props)
  }
  app = mount(Held, { target: document.body, props: { diagram: { nodes: [], connections: [] } } })
  flushSync()
  expect(document.querySelector('section')).toBeNull()
})
