import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { device, snapshot, START, Streams, value } from '../logic/samples'
import { cardSignals } from '../logic/vitals'
import { Page } from './page.svelte'
import { Early, type Heard, type Source } from './source'

let page: Page
let streams: Streams

const asked = (index: number) => new URL(streams.asked[index] ?? '').searchParams

beforeEach(() => {
  vi.useFakeTimers({ now: START })
  location.hash = ''
  streams = new Streams()
  page = new Page(streams.open)
})

afterEach(() => {
  page.stream.stop()
  vi.useRealTimers()
})

test('one stream asks for what the cards of all devices show', () => {
  page.stream.connect()
  expect(asked(0).get('signal')?.split(',')).toEqual(cardSignals())
  expect(asked(0).has('device')).toBe(false)
})

test('somebody who wants more signals gets them with everything else, and asking twice costs nothing', () => {
  page.stream.connect()
  streams.tell(snapshot([]))
  page.want(['state.engine', cardSignals()[0]!])
  page.want(['state.engine'])
  expect(streams.asked).toHaveLength(2)
  expect(asked(1).get('signal')?.split(',')).toEqual([...cardSignals(), 'state.engine'])
  expect(asked(1).has('last_event_id')).toBe(false)
})

test('a second stream has every value of the device that is looked at, while the first one lives', () => {
  page.stream.connect()
  expect(page.looked).toBeUndefined()
  streams.tell(snapshot([{ device: device('gen1'), values: [value('volts', 230)] }]))
  page.route = { view: 'device', device: 'gen1', wire: undefined }
  const gen1 = page.looked!
  const stop = page.follow(gen1)
  expect(Object.fromEntries(asked(1))).toEqual({ device: 'gen1' })
  streams.tell(snapshot([{ device: device('gen1'), values: [value('oil', 4)] }]))
  expect(gen1.cell('oil').view?.quality).toBe('good')
  page.hidden = true
  expect(page.looked).toBeUndefined()
  stop()
  expect(gen1.followed).toBe(false)
})

test('the stream that was opened early is taken once, if it asks for the same', () => {
  const closed: string[] = []
  const listeners = new Map<string, (event: Heard) => void>()
  const open = (address: string): Source => ({
    addEventListener: (type, act) => listeners.set(type, act),
    close: () => closed.push(address),
  })
  page.stream.connect()
  const address = streams.asked[0]!
  const other = new Page(streams.open, new Early(address, open))
  other.stream.connect()
  expect(streams.asked).toHaveLength(1)
  other.stream.connect()
  expect(closed).toEqual([address])
  expect(streams.asked).toHaveLength(2)
  other.stream.stop()

  const third = new Page(streams.open, new Early('elsewhere', open))
  third.stream.connect()
  expect(closed).toEqual([address, 'elsewhere'])
  expect(streams.asked).toHaveLength(3)
  third.stream.stop()
})
