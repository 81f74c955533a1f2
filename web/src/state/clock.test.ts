import { afterEach, beforeEach, expect, test, vi } from 'vitest'
import { Clock } from './clock.svelte'

const NOW = Date.parse('2026-11-23T04:00:00.300Z')

beforeEach(() => {
  vi.useFakeTimers({ now: NOW })
})

afterEach(() => {
  vi.useRealTimers()
})

test('ticks on the full second', () => {
  const clock = new Clock()
  clock.start()
  vi.advanceTimersByTime(699)
  expect(clock.now).toBe(NOW)
  vi.advanceTimersByTime(1)
  expect(clock.now % 1000).toBe(0)
  vi.advanceTimersByTime(1000)
  expect(clock.now).toBe(NOW + 1700)
  clock.stop()
})

test('follows a gateway whose clock is another', () => {
  const clock = new Clock()
  clock.compare('Mon, 23 Nov 2026 04:10:00 GMT', NOW, NOW)
  expect(clock.now - clock.local).toBe(10 * 60_000 + 200)
})

test.each(['Mon, 23 Nov 2026 04:00:00 GMT', 'Mon, 23 Nov 2026 03:59:59 GMT', 'nonsense', null])(
  'a Date header of %s is no reason to differ',
  (header) => {
    const clock = new Clock()
    clock.compare(header, NOW - 600, NOW)
    expect(clock.now).toBe(clock.local)
  },
)
