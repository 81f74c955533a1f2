// The wires page in a document of its own, fed by answers that the test holds in its hands.
import { flushSync, mount, unmount } from 'svelte'
import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import App from '../App.svelte'
import { device, snapshot, START, Streams, unit, wire, wireDetail } from '../logic/samples'
import type { WireDetailView, WireView } from '../logic/types'
import { Page } from '../state/page.svelte'

let page: Page
let app: Record<string, unknown>
let wires: WireView[]
let details: Record<string, WireDetailView>
let reached: boolean

async function show(hash: string): Promise<void> {
  location.hash = hash
  const streams = new Streams()
  vi.stubGlobal('fetch', async (address: URL) => {
    if (!reached) throw new TypeError('network')
    const id = /wires\/(.+)$/.exec(address.pathname)?.[1]
    return Response.json(id === undefined ? wires : details[id])
  })
  page = new Page(streams.open)
  page.start()
  app = mount(App, { target: document.body, props: { page } })
  const dev1 = device('dev1', { name: 'Compressor <1>', kind: 'compressor' })
  streams.tell(snapshot([{ device: dev1, values: [] }]))
  flushSync()
}

const text = (element: Element | null) => element?.textContent?.replace(/\s+/g, ' ').trim()
const until = async (check: () => void) => {
  await vi.waitFor(() => {
    flushSync()
    check()
  }, 5000)
}

beforeEach(() => {
  vi.useFakeTimers({ now: START, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
  wires = [
    wire('bus'),
    wire('gen 2', { state: 'down', reason: 'tcp://h:502: connection refused: check the port' }),
  ]
  details = { bus: wireDetail('bus'), 'gen%202': wireDetail('gen 2', { wire: wires[1]! }) }
  reached = true
})

afterEach(async () => {
  page.stream.stop()
  page.clock.stop()
  await unmount(app)
  location.hash = ''
  vi.unstubAllGlobals()
  vi.useRealTimers()
})

test('all wires are listed and the first one is told in detail', async () => {
  await show('#/wires')
  await until(() => expect(text(document.querySelector('h2'))).toBe('Wire bus'))
  const rows = [...document.querySelectorAll('tbody')][0]?.querySelectorAll('tr')
  expect([...(rows ?? [])].map((row) => text(row.querySelector('th')))).toEqual(['bus', 'gen 2'])
  expect(document.querySelector('nav [aria-current]')?.textContent).toBe('Wires')
  const all = text(document.querySelector('main'))
  for (const fact of [
    'Connected',
    'CRC errors 2',
    'code 2: 3',
    'up to 2.0 ms 3',
    'Characters on the line 25 %',
    'Waiting for answers 5.0 %',
    'What Compressor <1> is polled with',
    'Every 1 s: 1 read, 37 characters, 47 ms of the line',
    'a pause of 500 ms after each read',
    'read anew in 547 ms',
    'Polling it takes 4.7 % of the line.',
  ]) {
    expect(all).toContain(fact)
  }
  // Every table has a name and heads.
  for (const table of document.querySelectorAll('table')) {
    expect(table.querySelector('caption')).not.toBeNull()
    expect(table.querySelectorAll('th[scope=col]').length).toBeGreaterThan(3)
  }
})

test('a wire that is down says why, and a unit that is silent when it is asked again', async () => {
  details['gen%202'] = wireDetail('gen 2', {
    wire: wires[1]!,
    units: [unit(7, { device: null, state: 'silent', next_probe_s: 12 })],
    plans: [],
  })
  await show('#/wires/gen%202')
  await until(() => expect(text(document.querySelector('h2'))).toBe('Wire gen 2'))
  expect(text(document.querySelector('[role=status].state'))).toBe(
    'Down: tcp://h:502: connection refused: check the port',
  )
  expect(text(document.querySelector('section[aria-labelledby=units] tbody'))).toContain(
    '7– Silent, asked again in 12 s',
  )
})

test('the figures are asked for again, and say so when they stand still', async () => {
  await show('#/wires')
  await until(() => expect(document.querySelector('h2')).not.toBeNull())
  details.bus = wireDetail('bus', { units: [unit(1, { requests: 4321 })] })
  await vi.advanceTimersByTimeAsync(2000)
  await until(() => expect(text(document.querySelector('main'))).toContain('4 321'))
  reached = false
  await vi.advanceTimersByTimeAsync(2000)
  await until(() => expect(text(document.querySelector('main'))).toContain('These figures stand still'))
  expect(text(document.querySelector('main'))).toContain('4 321')
})

test('more than the line can carry is said, and what a device refuses', async () => {
  const [plan] = wireDetail('bus').plans
  const refused = [{ function: 3, address: 100, count: 2, rates: [], characters: 17, ms: 20 }]
  details.bus = wireDetail('bus', { plans: [{ ...plan!, load: 1.31, refused }] })
  await show('#/wires')
  await until(() => expect(document.querySelector('h2')).not.toBeNull())
  const all = text(document.querySelector('main'))
  expect(all).toContain('takes 131 % of the line: more than there is, so its rates cannot be kept.')
  expect(all).toContain('It refuses to read 2 from 100')
})

test('a wire that is not there is no empty page', async () => {
  await show('#/wires/bus9')
  await until(() => expect(text(document.querySelector('main'))).toContain('This site has no wire “bus9”.'))
  expect(document.querySelectorAll('tbody tr')).toHaveLength(2)
})
