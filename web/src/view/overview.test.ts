// The overview in a document of its own, fed by a stream and answers that the test holds in its hands.
import { flushSync, mount, unmount } from 'svelte'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import App from '../App.svelte'
import {
  alarm,
  device,
  group,
  point,
  snapshot,
  stamp,
  START,
  Streams,
  value,
  type Whole,
} from '../logic/samples'
import { Page } from '../state/page.svelte'

let emit: (type: string, data?: unknown) => void
let page: Page
let app: Record<string, unknown>
let asked: string[]

function show(first: Whole): void {
  const streams = new Streams()
  emit = (type, data) => {
    streams.emit(type, data)
    flushSync()
  }
  page = new Page(streams.open)
  page.start()
  app = mount(App, { target: document.body, props: { page } })
  streams.tell(first)
  flushSync()
}

const card = (id: string) => document.querySelector<HTMLElement>(`[data-device="${id}"]`)!
const text = (element: Element | null) => element?.textContent?.replace(/\s+/g, ' ').trim()
const filled = (id: string) =>
  vi.waitFor(() => {
    flushSync()
    expect(card(id).querySelector('.values')).not.toBeNull()
  }, 5000)

beforeEach(() => {
  location.hash = ''
  asked = []
  vi.useFakeTimers({ now: START + 2000, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
  const groups = [group('Genset', [point('kw', { signal: 'genset.power.active', unit: 'kW' })])]
  vi.stubGlobal('fetch', async (address: URL) => {
    if (address.pathname.endsWith('/site')) return Response.json({ diagram: { nodes: [], connections: [] } })
    asked.push(address.pathname + address.search)
    return Response.json({ groups, joined: [] })
  })
})

afterEach(async () => {
  page.stream.stop()
  page.clock.stop()
  await unmount(app)
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

test('what the document knows of a card is filled when the state comes after it was drawn', () => {
  const points = [point('kw', { signal: 'genset.power.active', unit: 'kW' })]
  const streams = new Streams()
  page = new Page(streams.open, undefined, {
    'datakom-d': { manual: 'D-500 manual', groups: [group('Genset', points)], joined: [] },
  })
  page.start()
  app = mount(App, { target: document.body, props: { page } })
  const whole = snapshot([{ device: device('gen1'), values: [value('kw', 312)] }])
  streams.emit('snapshot', whole)
  flushSync()
  expect(card('gen1').querySelectorAll('dd.good .number')).toHaveLength(0)
  streams.emit('state', whole.states[0])
  flushSync()
  expect(text(card('gen1').querySelector('dd.good'))).toMatch(/^312 kW/)
  expect(asked).toEqual([])
})

test('a card a controller: what it is, does, and measures, and how old that is', async () => {
  const state = { code: 5, label: 'Cooling down', canonical: 'cooldown', timer_s: 67 }
  const view = device('gen1', { state, mode: { code: 4, label: 'AUTO', canonical: 'auto' } })
  show(
    snapshot([
      { device: view, values: [value('kw', 36.2, { unit: 'kW' })] },
      { device: device('gen2'), values: [] },
    ]),
  )
  await filled('gen1')
  expect(document.querySelectorAll('[data-device]')).toHaveLength(2)
  const of = text(card('gen1'))
  for (const fact of [
    'Genset gen1',
    'Datakom D-500 · genset',
    'Cooling down',
    'AUTO',
    'No active alarms',
    'Genset power 36.2 kW',
  ])
    expect(of).toContain(fact)
  expect(of).toContain('Online · heard 2 s ago')
  expect(text(card('gen2'))).toContain('State not known')
  // Only what the card shows was asked for, not the whole list of points.
  expect(asked).toHaveLength(2)
  expect(asked[0]).toContain('/devices/gen1/points?signal=mains.voltage.average,')

  emit('values', {
    device: 'gen1',
    joined: [],
    rate: 'fast',
    ts: stamp(2),
    changed: [value('kw', 36.9, { unit: 'kW' })],
  })
  expect(text(card('gen1'))).toContain('Genset power 36.9 kW')
  expect(text(card('gen1'))).toContain('1:07 min left')
  expect(card('gen1').querySelector('a')?.getAttribute('href')).toBe('#/devices/gen1')
})

test('alarms stand by class on the card, and summed for the site', () => {
  const alarms = [
    alarm('gen1', 1, 'warning'),
    alarm('gen1', 2, 'shutdown'),
    alarm('gen1', 3, 'shutdown'),
    alarm('gen1', 4, 'shutdown'),
  ]
  const counts = { shutdown: 3, load_dump: 0, trip: 0, warning: 1, indication: 0 }
  show(
    snapshot(
      [
        { device: device('gen1', { alarms: counts }), values: [] },
        { device: device('gen2', { alarms: { ...counts, shutdown: 0, warning: 2 } }), values: [] },
      ],
      alarms,
    ),
  )
  expect(text(card('gen1').querySelector('.counts'))).toBe('3 Shutdown 1 Warning')
  expect(text(card('gen1').querySelector('.alarms'))).toContain('and 1 more of this class')
  expect(text(document.querySelector('[aria-label="Active alarms of the site"]'))).toBe(
    '3 Shutdown 3 Warning',
  )
})

test('what is not heard looks it: a device that is gone, then the gateway', async () => {
  const fault = 'Genset gen2 cannot be read: unit 2 did not answer'
  show(
    snapshot([
      { device: device('gen1'), values: [value('kw', 1)] },
      {
        device: device('gen2', {
          online: false,
          fault,
          last_seen: stamp(-58),
          alarms_fault: 'alarms: not read',
        }),
        values: [value('kw', 7, { quality: 'bad' })],
      },
    ]),
  )
  await filled('gen2')
  expect(text(document.querySelector('[aria-label="Site"].sum'))).toContain('1 of 2 controllers answering')
  expect(text(card('gen2'))).toContain('Cannot be read: unit 2 did not answer')
  expect(text(card('gen2'))).toContain('Not answering · heard 1 min ago')
  expect(text(card('gen2'))).toContain('Alarms not known')
  expect(text(card('gen2').querySelector('.struck'))).toContain('7')
  expect(card('gen1').querySelector('dd.good')).not.toBeNull()
  emit('error')
  expect(card('gen1').querySelector('dd.good')).toBeNull()
  expect(text(card('gen1'))).toContain('Not live')
})

test('a device that was never heard shows no values, and says so', () => {
  show(snapshot([{ device: device('gen1', { online: false, last_seen: null }), values: [] }]))
  expect(text(card('gen1'))).toContain('No answer yet · not heard yet')
  expect(text(card('gen1'))).toContain('Alarms not known')
  expect(card('gen1').querySelector('.values')).toBeNull()
})

test('a name is text, whatever stands in it', () => {
  const name = `<img src=x onerror=alert(1)>${'W'.repeat(200)}`
  show(snapshot([{ device: device('gen1', { name }), values: [] }]))
  expect(card('gen1').querySelector('h2')?.textContent).toBe(name)
  expect(document.querySelector('img')).toBeNull()
})

test('what else is served here is a link, and a gateway alone has none', () => {
  const whole = snapshot([{ device: device('gen1'), values: [] }])
  show(whole)
  const links = () => [...document.querySelectorAll('nav a')].map((link) => link.getAttribute('href'))
  expect(links()).toEqual(['#/', '#/wires', '#/devices/gen1'])
  emit('site', { ...whole.site, beside: [{ name: 'Imitation', path: 'imitation/' }] })
  expect(links()).toEqual(['#/', '#/wires', 'imitation/', '#/devices/gen1'])
  expect(text(document.querySelector('nav a[href="imitation/"]'))).toBe('Imitation')
})
