import { expect, test } from 'vitest'
import { apiOf, Early, eventsAt, type Heard, type Source } from './source'

class Fake implements Source {
  closed = false
  listeners = new Map<string, (event: Heard) => void>()
  addEventListener(type: string, listener: (event: Heard) => void): void {
    this.listeners.set(type, listener)
  }
  close(): void {
    this.closed = true
  }
}

test('the events lie beside the page, under whatever prefix', () => {
  const api = apiOf('http://host/site/north/?x#/devices/gen1')
  expect(eventsAt(api, { signal: 'a.b,c.d', last_event_id: undefined })).toBe(
    'http://host/site/north/api/v1/events?signal=a.b,c.d',
  )
  expect(eventsAt(api, { device: 'a&b' })).toBe('http://host/site/north/api/v1/events?device=a%26b')
})

test('what was said before somebody listens is told in its order, then what comes', async () => {
  const fake = new Fake()
  const early = new Early('x', () => fake)
  const say = (type: string, data: string) => fake.listeners.get(type)?.({ data })
  say('snapshot', '1')
  say('state', '2')
  const heard: unknown[] = []
  for (const type of ['state', 'snapshot', 'values']) {
    early.addEventListener(type, ({ data }) => heard.push(data))
  }
  say('values', '3')
  await Promise.resolve()
  say('values', '4')
  expect(heard).toEqual(['1', '2', '3', '4'])
})

test('a stream that is closed says nothing more', async () => {
  const fake = new Fake()
  const early = new Early('x', () => fake)
  const heard: unknown[] = []
  fake.listeners.get('error')?.({})
  early.addEventListener('error', () => heard.push('error'))
  early.close()
  await Promise.resolve()
  expect(heard).toEqual([])
  expect(fake.closed).toBe(true)
})
