// The whole page in a document of its own, fed by a stream and an answer that the test holds in its hands.
import { flushSync, mount, unmount } from 'svelte'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import App from '../App.svelte'
import { deviceLink } from '../logic/route'
import {
  alarm,
  device,
  group,
  joined,
  point,
  snapshot,
  stamp,
  START,
  Streams,
  value,
  type Whole,
} from '../logic/samples'
import type { GroupView, JoinedPointView } from '../logic/types'
import { Page } from '../state/page.svelte'

const VOLTS = point('volts', {
  name: 'Volts',
  unit: 'V',
  address: 10246,
  plc: 410247,
  registers: 2,
  page: 11,
  doubt: 'sign',
})
const FLAGS = point('flags', {
  name: 'Flags',
  type: 'bits',
  bits: [
    { bit: 0, id: 'fuel', label: 'Fuel valve', class: 'status' },
    { bit: 1, id: 'horn', label: 'Horn', class: 'status' },
  ],
})

let emit: (type: string, data?: unknown) => void
let tell: (whole: Whole) => void
let page: Page
let app: Record<string, unknown>
let groups: GroupView[]
let whole: JoinedPointView[]

async function show(first: Whole): Promise<void> {
  const streams = new Streams()
  emit = (type, data) => {
    streams.emit(type, data)
    flushSync()
  }
  tell = (whole) => {
    streams.tell(whole)
    flushSync()
  }
  vi.stubGlobal('fetch', async () => Response.json({ groups, joined: whole }))
  location.hash = deviceLink(first.devices[0]?.id ?? '')
  page = new Page(streams.open)
  page.start()
  app = mount(App, { target: document.body, props: { page } })
  tell(first)
  await vi.waitFor(() => expect(document.querySelector('[data-point]')).not.toBeNull(), 5000)
  flushSync()
}

const line = (id: string) => document.querySelector<HTMLElement>(`[data-point="${id}"]`)!
const text = (element: Element | null) => element?.textContent?.replace(/\s+/g, ' ').trim()

beforeEach(() => {
  vi.useFakeTimers({ now: START + 2000, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
  groups = [group('Genset', [VOLTS, FLAGS])]
  whole = []
})

afterEach(async () => {
  page.stream.stop()
  page.clock.stop()
  await unmount(app)
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

test('a good value stands as it came, with unit and age, and ages each second', async () => {
  await show(snapshot([{ device: device('gen1'), values: [value('volts', 230.2)] }]))
  expect(text(line('volts').querySelector('.number'))).toBe('230.2')
  expect(text(line('volts').querySelector('.unit'))).toBe('V')
  expect(text(line('volts').querySelector('.age'))).toBe('good, 2 s')
  vi.advanceTimersByTime(3000)
  flushSync()
  expect(text(line('volts').querySelector('.age'))).toBe('good, 5 s')
  emit('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(5), changed: [] })
  expect(text(line('volts').querySelector('.age'))).toBe('good, 0 s')
})

test('a bad value is struck through and says why', async () => {
  const bad = value('volts', 230.2, { quality: 'bad', error: 'no answer from unit 1 within 1000 ms' })
  await show(snapshot([{ device: device('gen1'), values: [bad] }]))
  expect(text(line('volts').querySelector('.struck'))).toBe('230.2')
  expect(text(line('volts').querySelector('.age'))).toBe('bad, 2 s')
  expect(document.body.textContent).toContain('Bad: no answer from unit 1 within 1000 ms')
})

test('the reason is said once: at the device when all of it is gone, else at the group', async () => {
  const bad = value('volts', 230.2, { quality: 'bad', error: 'connection refused' })
  const gone = device('gen1', { online: false, fault: 'Genset 1 cannot be read: connection refused' })
  await show(snapshot([{ device: gone, values: [bad] }]))
  expect(document.body.textContent?.match(/connection refused/g)).toHaveLength(1)
  expect(text(document.querySelector('summary'))).toContain('1 bad')
  emit('device', device('gen1'))
  expect(text(document.querySelector('.reason'))).toBe('Bad: connection refused')
})

test('a point that has never been read says so, and has no unit', async () => {
  const never = value('volts', null, { quality: 'bad', ts: null, error: 'no answer' })
  await show(snapshot([{ device: device('gen1'), values: [never] }]))
  expect(text(line('volts').querySelector('.values'))).toBe('never read')
  expect(line('volts').querySelector('.unit')).toBeNull()
})

test('an invalid value is no number', async () => {
  await show(snapshot([{ device: device('gen1'), values: [value('volts', null, { quality: 'invalid' })] }]))
  expect(text(line('volts').querySelector('.values'))).toBe('no data')
  expect(line('volts').querySelector('.unit')).toBeNull()
})

test('address and number come on request, by a button', async () => {
  await show(snapshot([{ device: device('gen1'), values: [value('volts', 230.2, { raw: [2302, 0] })] }]))
  const button = line('volts').querySelector('button')!
  expect(button.getAttribute('aria-expanded')).toBe('false')
  expect(text(line('volts').querySelector('dl'))).toBeUndefined()
  button.click()
  flushSync()
  expect(button.getAttribute('aria-expanded')).toBe('true')
  const details = text(document.getElementById(button.getAttribute('aria-controls')!))
  for (const fact of [
    '10246 · 410247 · 0x2806 · 2 registers',
    'Point volts',
    'u16: unsigned, 16 bits',
    'Read 04:00:00, each round',
    '08FE 0000',
    'page 11',
    'does not say for certain whether it can be negative',
  ]) {
    expect(details).toContain(fact)
  }
})

test('a bit array shows the labels of the bits that are set', async () => {
  await show(snapshot([{ device: device('gen1'), values: [value('flags', ['Horn'], { set: [1] })] }]))
  expect(text(line('flags').querySelector('.values'))).toBe('Horn')
  emit('values', {
    device: 'gen1',
    joined: [],
    rate: 'fast',
    ts: stamp(3),
    changed: [value('flags', [], { set: [] })],
  })
  expect(text(line('flags').querySelector('.values'))).toBe('none set')
})

test('alarms are listed by class and said politely', async () => {
  await show(snapshot([{ device: device('gen1'), values: [] }]))
  expect(document.querySelector('.alarms')?.textContent).toContain('none')
  emit('alarms', { device: 'gen1', alarms: [alarm('gen1', 58, 'warning'), alarm('gen1', 54, 'shutdown')] })
  expect([...document.querySelectorAll('.alarms h4')].map(text)).toEqual(['Shutdown', 'Warning'])
  expect(text(document.querySelector('[aria-live="polite"]'))).toBe('Warning: Alarm 58. Shutdown: Alarm 54.')
})

test('no alarm is no news while an alarm word could not be read', async () => {
  const fault = 'shutdown_alarms: the device answered exception 2 (illegal address)'
  await show(snapshot([{ device: device('gen1', { alarms_fault: fault }), values: [] }]))
  const list = document.querySelector('.alarms')!
  expect(list.textContent).toContain('not known')
  expect(list.textContent).not.toContain('none')
  expect(list.textContent).toContain(fault)
  emit('device', device('gen1'))
  flushSync()
  expect(list.textContent).toContain('none')
  expect(list.textContent).not.toContain(fault)
})

test('a lost connection is told, and every value turns stale', async () => {
  await show(snapshot([{ device: device('gen1'), values: [value('volts', 230.2)] }]))
  emit('error')
  expect(text(document.querySelector('[role="alert"]'))).toContain('No connection to the gateway.')
  expect(text(line('volts').querySelector('.age'))).toBe('stale, 2 s')
  expect(text(document.querySelector('.summary'))).toContain('Not known')
  vi.advanceTimersByTime(1500)
  tell(snapshot([{ device: device('gen1'), values: [value('volts', 231)] }]))
  expect(text(document.querySelector('[role="alert"]'))).toBe('')
  expect(text(line('volts').querySelector('.number'))).toBe('231')
})

test('a device that does not answer says so in its own sentence', async () => {
  const fault = 'Genset 1 does not answer: no answer from unit 1 within 1000 ms'
  await show(snapshot([{ device: device('gen1', { online: false, fault }), values: [] }]))
  expect(text(document.querySelector('.fault'))).toBe(fault)
  expect(text(document.querySelector('.summary'))).toContain('Not answering')
})

test('the countdown runs between two rounds and stands still with the device', async () => {
  const state = { code: 5, label: 'Cranking', canonical: 'cranking', timer_s: 67 }
  await show(snapshot([{ device: device('gen1', { state }), values: [] }]))
  emit('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(2), changed: [] })
  expect(text(document.querySelector('.summary'))).toContain('1:07 min')
  vi.advanceTimersByTime(2000)
  flushSync()
  expect(text(document.querySelector('.summary'))).toContain('1:05 min')
  emit('values', { device: 'gen1', joined: [], rate: 'fast', ts: stamp(4), changed: [] })
  expect(text(document.querySelector('.summary'))).toContain('1:07 min')
})

test('hours out of several points stand at a glance and in full', async () => {
  groups = [
    group(
      'Counters',
      ['volts', 'hours', 'minutes', 'year'].map((id) => point(id)),
    ),
  ]
  whole = [
    joined('engine.hours', { meaning: 'Hours the engine has run', points: ['hours', 'minutes'] }),
    joined('clock', { unit: null, points: ['year'] }),
  ]
  const hours = {
    signal: 'engine.hours',
    value: 1234.5083,
    unit: 'h',
    quality: 'good',
    ts: stamp(0),
  } as const
  const clock = {
    signal: 'clock',
    value: '2026-11-23T07:30:59',
    unit: null,
    quality: 'good',
    ts: stamp(0),
  } as const
  const air1 = device('air1', { kind: 'compressor', profile: 'smartgen-acc1700' })
  await show(snapshot([{ device: air1, values: [value('volts', 1)], joined: [hours, clock] }]))
  expect(text(document.querySelector('[aria-label="At a glance"]'))).toBe('Engine hours 1234 h 30 min')
  expect(document.body.textContent).toContain('Hours the engine has run')
  expect(document.body.textContent).toContain('1234 h 30 min 30 s')
  expect(document.body.textContent).toContain('2026-11-23 07:30:59')
  const later = { ...hours, value: 1234.5167 }
  emit('values', { device: 'air1', joined: [later], rate: 'slow', ts: stamp(10), changed: [] })
  expect(document.body.textContent).toContain('1234 h 31 min 00 s')
  const bad = { ...later, quality: 'bad' }
  emit('values', { device: 'air1', joined: [bad], rate: 'slow', ts: stamp(20), changed: [] })
  expect(text(document.querySelector('[aria-label="At a glance"] .struck'))).toBe('1234 h 31 min')
  expect(text(line('hours').querySelector('.struck'))).toBe('1234 h 31 min 00 s')
})

test('a switch stands as its flag says', async () => {
  const position = point('position', {
    type: 'bits',
    bits: [{ bit: 4, id: 's1', label: 'S1 closed', class: 'status', signal: 'breaker.src1.closed' }],
  })
  groups = [group('Switch', [VOLTS, position])]
  const ats = device('ats1', { kind: 'transfer_switch' })
  await show(snapshot([{ device: ats, values: [value('position', ['S1 closed'], { set: [4] })] }]))
  const glance = () => text(document.querySelector('[aria-label="At a glance"]'))
  expect(glance()).toBe('Source 1 switch closed')
  const open = value('position', [], { set: [] })
  emit('values', { device: 'ats1', joined: [], rate: 'fast', ts: stamp(3), changed: [open] })
  expect(glance()).toBe('Source 1 switch open')
})
