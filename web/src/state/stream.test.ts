import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest'
import { Stream, type Source } from './stream.svelte'

class FakeSource implements Source {
  closed = false
  #listeners = new Map<string, (event: { data?: unknown }) => void>()

  addEventListener(type: string, listener: (event: { data?: unknown }) => void): void {
    this.#listeners.set(type, listener)
  }

  close(): void {
    this.closed = true
  }

  emit(type: string, data?: unknown): void {
    this.#listeners.get(type)?.({ data })
  }
}

let sources: FakeSource[]
let heard: [string, unknown][]
let stream: Stream

const last = () => sources.at(-1)!
const open = () => last().emit('snapshot', '{"site":1}')

beforeEach(() => {
  vi.useFakeTimers({ now: 1_000_000 })
  vi.spyOn(Math, 'random').mockReturnValue(0.5)
  sources = []
  heard = []
  stream = new Stream(
    () => {
      sources.push(new FakeSource())
      return last()
    },
    (name, payload) => heard.push([name, payload]),
  )
  stream.connect()
})

afterEach(() => {
  stream.stop()
  vi.restoreAllMocks()
  vi.useRealTimers()
})

describe('while all is well', () => {
  test('the snapshot makes it live and every event is passed on', () => {
    expect(stream.phase).toBe('connecting')
    open()
    last().emit('values', '{"rate":"fast"}')
    expect(stream.phase).toBe('live')
    expect(heard).toEqual([
      ['snapshot', { site: 1 }],
      ['values', { rate: 'fast' }],
    ])
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

describe('when nothing is said', () => {
  test('a silent stream is opened anew, and is lost when nobody answers then', () => {
    open()
    vi.advanceTimersByTime(20_000)
    expect(sources).toHaveLength(2)
    expect(stream.phase).toBe('live')
    vi.advanceTimersByTime(15_000)
    expect(stream.phase).toBe('lost')
  })

  test('a gateway that never answers the first time is lost too', () => {
    vi.advanceTimersByTime(15_000)
    expect(stream.phase).toBe('lost')
    expect(stream.heardAt).toBeUndefined()
  })

  test('waking up after sleep asks again, waking up at once does not', () => {
    open()
    stream.wake()
    expect(sources).toHaveLength(1)
    vi.setSystemTime(1_060_000)
    stream.wake()
    expect(sources).toHaveLength(2)
  })
})
