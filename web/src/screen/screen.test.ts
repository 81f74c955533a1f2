// The screen of a controller in a document of its own, fed by streams that the test holds in its hands.
import { flushSync, mount, unmount, type Component } from 'svelte'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { device, group, point, stamp, START, value } from '../logic/samples'
import type { ValueView } from '../logic/types'
import { Page } from '../state/page.svelte'
import { Device } from '../state/site.svelte'
import { providePage } from '../view/context'
import ScreenTab from './ScreenTab.svelte'

class FakeSource {
  static all: FakeSource[] = []
  closed = false
  listeners = new Map<string, (event: { data?: unknown }) => void>()

  constructor(readonly address: string) {
    FakeSource.all.push(this)
  }
  addEventListener(type: string, act: (event: { data?: unknown }) => void): void {
    this.listeners.set(type, act)
  }
  close(): void {
    this.closed = true
  }
  emit(type: string, data?: unknown): void {
    this.listeners.get(type)?.({ data: JSON.stringify(data) })
    flushSync()
  }
}

const last = () => FakeSource.all.at(-1)!
const text = (selector: string) => document.querySelector(selector)?.textContent?.replace(/\s+/g, ' ').trim()

const GROUPS = [
  group('Harmonics', [
    point('channel_thd', { rate: 'slow', unit: '%' }),
    point('channel_harmonic_3', { rate: 'slow', unit: '%', doubt: 'unit', page: 13 }),
    point('channel_harmonic_5', { rate: 'slow', unit: '%' }),
    point('selected_channel', { rate: 'slow', type: 'choice' }),
    point('scope', { rate: 'on_demand', type: 'trace', doubt: 'unit' }),
  ]),
  group('Display', [point('lcd', { rate: 'on_demand', type: 'image', doubt: 'pixel order', page: 14 })]),
]
const PICTURE = '01'.repeat(1024)

let page: Page
let gen: Device
let app: Record<string, unknown>
let hidden: boolean

async function open(): Promise<void> {
  document.querySelector('button')?.click()
  flushSync()
  await vi.waitFor(() => {
    flushSync()
    expect(document.querySelector('[data-point=lcd]')).not.toBeNull()
  }, 5000)
}

function state(values: ValueView[]): void {
  last().emit('snapshot', { site: {}, devices: [device('gen1')], alarms: [] })
  last().emit('state', { device: 'gen1', values, joined: [] })
}

function hide(now: boolean): void {
  hidden = now
  document.dispatchEvent(new Event('visibilitychange'))
  flushSync()
}

beforeEach(() => {
  vi.useFakeTimers({ now: START, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
  vi.stubGlobal('EventSource', FakeSource)
  hidden = false
  vi.spyOn(document, 'hidden', 'get').mockImplementation(() => hidden)
  FakeSource.all = []
  page = new Page(() => ({ addEventListener: () => undefined, close: () => undefined }))
  page.clock.start()
  gen = new Device(device('gen1'))
  gen.groups = GROUPS
  const Held: Component<{ device: Device }> = (anchor, props) => {
    providePage(page)
    return ScreenTab(anchor, props)
  }
  app = mount(Held, { target: document.body, props: { device: gen } })
  flushSync()
})

afterEach(async () => {
  page.clock.stop()
  await unmount(app)
  vi.restoreAllMocks()
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

test('nothing is read until it is opened, then only what is on it, and no more once it is closed', async () => {
  expect(FakeSource.all).toHaveLength(0)
  expect(document.querySelector('button')?.getAttribute('aria-expanded')).toBe('false')
  await open()
  expect(FakeSource.all).toHaveLength(1)
  const { pathname, searchParams } = new URL(last().address)
  expect(pathname).toMatch(/api\/v1\/events$/)
  expect(searchParams.get('device')).toBe('gen1')
  expect(searchParams.get('group')).toBe('harmonics,display')
  document.querySelector('button')?.click()
  flushSync()
  expect(last().closed).toBe(true)
  expect(document.querySelector('[data-point=lcd]')).toBeNull()
})

test('in the background nobody looks: the stream is closed, and opened anew on return', async () => {
  await open()
  state([value('lcd', PICTURE)])
  hide(true)
  expect(last().closed).toBe(true)
  vi.advanceTimersByTime(60_000)
  expect(FakeSource.all).toHaveLength(1)
  hide(false)
  expect(FakeSource.all).toHaveLength(2)
  // Until the gateway speaks again, what is there may have changed.
  expect(text('[data-point=lcd] header')).toContain('stale, 1 min')
  state([value('lcd', PICTURE, { ts: stamp(59) })])
  expect(text('[data-point=lcd] header')).toContain('good, 1 s')
})

test('leaving the page closes the stream', async () => {
  await open()
  await unmount(app)
  expect(last().closed).toBe(true)
  app = mount(ScreenTab, { target: document.body, props: { device: new Device(device('none')) } })
  flushSync()
  expect(document.querySelector('button')).toBeNull()
})

test('the display: being read, then drawn with the time it was read, and what is in doubt', async () => {
  await open()
  state([])
  expect(text('[data-point=lcd] .body')).toBe('Being read …')
  last().emit('values', {
    device: 'gen1',
    rate: 'on_demand',
    ts: stamp(0),
    changed: [value('lcd', PICTURE)],
    joined: [],
  })
  const image = document.querySelector('[data-point=lcd] [role=img]')
  expect(image?.getAttribute('aria-label')).toMatch(/^The display of Genset gen1 as a picture\./)
  expect(image?.querySelector('path')?.getAttribute('d')?.match(/M/g)).toHaveLength(8)
  expect(text('[data-point=lcd] header')).toMatch(/^Display read at \d\d:\d\d:\d\d, good, 0 s$/)
  expect(text('[data-point=lcd] details')).toContain('In doubt: pixel order (page 14 of the manual).')
  // A round that changed nothing read it anew.
  vi.advanceTimersByTime(3000)
  last().emit('values', { device: 'gen1', rate: 'on_demand', ts: stamp(2), changed: [], joined: [] })
  expect(text('[data-point=lcd] header')).toContain('good, 1 s')
})

test('what cannot be read says why, and the last good picture stays, marked', async () => {
  await open()
  const refused = { quality: 'bad', error: 'the device did not answer', ts: null, raw: null } as const
  state([value('lcd', null, refused)])
  expect(text('[data-point=lcd] .reason')).toBe('It cannot be read: the device did not answer')
  expect(document.querySelector('[data-point=lcd] [role=img]')).toBeNull()
  state([value('lcd', PICTURE)])
  state([value('lcd', null, { ...refused, ts: stamp(0) })])
  expect(text('[data-point=lcd] .reason')).toContain('Not read anew, this is the last one: the device')
  expect(document.querySelector('[data-point=lcd] [role=img]')).not.toBeNull()
  expect(text('[data-point=lcd] header')).toContain('bad,')
  state([value('lcd', 'ff')])
  expect(text('[data-point=lcd] .body')).toBe('What was read is no picture of 128 × 64 dots.')
  state([value('lcd', null, { quality: 'invalid' })])
  expect(text('[data-point=lcd] .body')).toBe('The controller says that it has none.')
})

test('a lost stream is told and makes the picture stale', async () => {
  await open()
  state([value('lcd', PICTURE)])
  last().emit('error')
  expect(document.body.textContent).toContain('There is no connection now')
  expect(text('[data-point=lcd] header')).toContain('stale')
})

test('the waveform has its channel, its range and every sample', async () => {
  await open()
  state([value('scope', [0, 320, -318, 1]), value('selected_channel', 'Mains voltage L1')])
  expect(text('[data-point=scope] h3')).toBe('Waveform: Mains voltage L1')
  expect(document.querySelector('[data-point=scope] [role=img]')?.getAttribute('aria-label')).toBe(
    '4 samples of Mains voltage L1 over one waveform, from -318 to 320',
  )
  expect(text('[data-point=scope] dl')).toBe('Lowest -318 Highest 320')
  expect(text('[data-point=scope] .all')).toBe('0, 320, -318, 1')
})

test('the harmonics: a bar each, the numbers in a table, no bar for what is not known', async () => {
  await open()
  state([
    value('channel_thd', 3.1, { unit: '%' }),
    value('channel_harmonic_3', 0.45, { unit: '%' }),
    value('channel_harmonic_5', 1.9, { unit: '%', quality: 'bad', error: 'no answer' }),
  ])
  const part = [...document.querySelectorAll('section')].find(
    (section) => section.querySelector('h3')?.textContent === 'Harmonics',
  )!
  expect(part.querySelectorAll('rect')).toHaveLength(1)
  expect(part.querySelector('[role=img]')?.getAttribute('aria-label')).toContain(
    'The highest is harmonic 3 with 0.45\u00a0%.',
  )
  const rows = [...part.querySelectorAll('tbody tr')].map((row) =>
    [...row.children].map((cell) => cell.textContent?.replace(/\s+/g, ' ').trim()),
  )
  expect(rows).toEqual([
    ['3', '0.45 %', 'good, 0 s'],
    ['5', '1.9 %', 'bad, 0 s'],
  ])
  expect(part.textContent).toContain('Total distortion')
})
