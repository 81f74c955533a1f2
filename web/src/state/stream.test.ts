import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { type Heard, type Source } from './source'
import { Stream } from './stream.svelte'

class FakeSource implements Source {
  closed = false
  #listeners = new Map<string, (event: Heard) => void>()

  constructor(readonly after: string | undefined) {}

  addEventListener(type: string, listener: (event: Heard) => void): void {
    this.#listeners.set(type, listener)
  }

  close(): void {
    this.closed = true
  }

  emit(type: string, data?: unknown, lastEventId = ''): void {
    this.#listeners.get(type)?.({ data, lastEventId })
  }
}

let sources: FakeSource[]
let heard: [string, unknown][]
let gone: number
let stream: Stream

const last = () => sources.at(-1)!
const open = () => last().emit('snapshot', '{"devices":[]}', 'a1')
const values = (id = '') => last().emit('values', '{}', id)
const later = (ms: number) => vi.advanceTimersByTime(ms)

function started(told?: () => void): Stream {
  const stream = new Stream(
    (after) => {
      sources.push(new FakeSource(after))
      return last()
    },
    (name, payload) => heard.push([name, payload]),
    told,
  )
  stream.connect()
  return stream
}

beforeEach(() => {
  vi.useFakeTimers({ now: 1_000_000 })
  vi.spyOn(Math, 'random').mockReturnValue(0.5)
  sources = []
  heard = []
  gone = 0
  stream = started()
})

afterEach(() => {
  stream.stop()
  vi.restoreAllMocks()
  vi.useRealTimers()
})

describe('while all is well', () => {
  test('it is live when the snapshot and the state of every device have come', () => {
    last().emit('snapshot', '{"devices":[1,2]}')
    last().emit('state', '{"device":"gen1"}')
    expect(stream.phase).toBe('connecting')
    last().emit('state', '{"device":"gen2"}')
    expect(stream.phase).toBe('live')
    last().emit('values', '{"rate":"fast"}')
    expect(heard.map(([name]) => name)).toEqual(['snapshot', 'state', 'state', 'values'])
    expect(heard[3]?.[1]).toEqual({ rate: 'fast' })
  })

  test('a site without devices is live with its snapshot', () => {
    open()
    expect(stream.phase).toBe('live')
  })

  test('states without a snapshot, for a reader that fell behind, do not end that', () => {
    open()
    last().emit('state', '{"device":"gen1"}')
    expect(stream.phase).toBe('live')
    later(20_000)
    expect(sources).toHaveLength(2)
    expect(stream.phase).toBe('live')
  })

  test('a snapshot in between does not end that', () => {
    open()
    last().emit('snapshot', '{"devices":[1]}')
    expect(stream.phase).toBe('live')
  })

  test('a change before the snapshot is dropped', () => {
    last().emit('values', '{}')
    expect(heard).toEqual([])
    expect(stream.phase).toBe('connecting')
  })
})

describe('when the connection is lost', () => {
  test('it says so at once and comes back by itself', () => {
    open()
    vi.advanceTimersByTime(4000)
    last().emit('error')
    expect(stream.phase).toBe('lost')
    expect(stream.heardAt).toBe(1_000_000)
    expect(stream.retryAt).toBe(1_005_000)
    vi.advanceTimersByTime(1000)
    expect(sources).toHaveLength(2)
    expect(stream.retryAt).toBeUndefined()
    open()
    expect(stream.phase).toBe('live')
  })

  test('it tries less often, but never less than each ten seconds', () => {
    const waits = Array.from({ length: 6 }, () => {
      last().emit('error')
      const wait = stream.retryAt! - Date.now()
      vi.advanceTimersByTime(wait)
      return wait
    })
    expect(waits).toEqual([1000, 2000, 4000, 8000, 10_000, 10_000])
  })

  test('a success starts the waits anew', () => {
    last().emit('error')
    vi.advanceTimersByTime(1000)
    last().emit('error')
    vi.advanceTimersByTime(2000)
    open()
    last().emit('error')
    expect(stream.retryAt! - Date.now()).toBe(1000)
  })

  test('what a source that was given up still says is not heard', () => {
    open()
    const old = last()
    stream.connect()
    old.emit('values', '{}')
    old.emit('error')
    expect(old.closed).toBe(true)
    expect(heard).toHaveLength(1)
    expect(stream.phase).toBe('live')
  })

  test('an event that is no JSON means a new snapshot, not half a state', () => {
    const told = vi.spyOn(console, 'error').mockReturnValue()
    open()
    last().emit('values', '{"half":')
    expect(stream.phase).toBe('lost')
    expect(told).toHaveBeenCalledOnce()
  })
})

describe('a stream that is opened again', () => {
  test('goes on after the last event', () => {
    open()
    values('a2')
    last().emit('error')
    later(1000)
    expect(sources.map(({ after }) => after)).toEqual([undefined, 'a2'])
    expect(stream.phase).toBe('lost')
    last().emit('resumed', '{}')
    expect(stream.phase).toBe('live')
    values('a3')
    last().emit('error')
    later(1000)
    expect(last().after).toBe('a3')
  })

  test('begins anew after half a state, and goes on after the last whole one', () => {
    open()
    last().emit('snapshot', '{"devices":[1]}', 'a1')
    last().emit('error')
    later(1000)
    expect(last().after).toBe('a1')
    vi.spyOn(console, 'error').mockReturnValue()
    last().emit('resumed', '{')
    later(3000)
    expect(last().after).toBeUndefined()
  })

  test('for something else than before begins anew', () => {
    open()
    stream.renew()
    expect(last().after).toBeUndefined()
    expect(stream.phase).toBe('live')
    later(1000)
    expect(stream.phase).toBe('connecting')
    open()
    expect(stream.phase).toBe('live')
  })

  test('begins anew where somebody was told that it is gone', () => {
    stream.stop()
    stream = started(() => (gone += 1))
    last().emit('error')
    expect(gone).toBe(0)
    later(1000)
    open()
    values('a2')
    last().emit('error')
    expect(gone).toBe(1)
    later(1000)
    expect(last().after).toBeUndefined()
    open()
    stream.stop()
    expect(gone).toBe(2)
  })
})

describe('when nothing is said', () => {
  test('a silent stream is opened anew, and is lost when nobody answers then', () => {
    open()
    later(20_000)
    expect(sources).toHaveLength(2)
    expect(stream.phase).toBe('live')
    later(1000)
    expect(stream.phase).toBe('connecting')
    later(14_000)
    expect(stream.phase).toBe('lost')
  })

  test('a gateway that spoke each second is missed soon', () => {
    open()
    for (let second = 0; second < 10; second++) {
      later(1000)
      values()
    }
    later(4000)
    expect(sources).toHaveLength(2)
    later(1000)
    expect(stream.phase).toBe('connecting')
  })

  test('a gateway that has little to say is not missed sooner each time', () => {
    open()
    for (let step = 0; step < 1001; step++) {
      later(10)
      values()
    }
    later(4000)
    expect(sources).toHaveLength(2)
    last().emit('resumed', '{}')
    later(15_000)
    expect(sources).toHaveLength(2)
    expect(stream.phase).toBe('live')
  })

  test('a gateway that never answers the first time is lost too', () => {
    later(15_000)
    expect(stream.phase).toBe('lost')
    expect(stream.heardAt).toBeUndefined()
  })

  test('a state that does not come whole is lost', () => {
    last().emit('snapshot', '{"devices":[1,2]}')
    later(15_000)
    expect(stream.phase).toBe('lost')
  })

  test('waking up after sleep asks again and is not live before the answer, waking up at once does neither', () => {
    open()
    stream.wake()
    expect(sources).toHaveLength(1)
    vi.setSystemTime(1_060_000)
    stream.wake()
    expect(sources).toHaveLength(2)
    expect(stream.phase).toBe('connecting')
  })
})
