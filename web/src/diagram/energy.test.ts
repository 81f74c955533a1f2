import { expect, test } from 'vitest'
import { figuresOf, flowOf, loadedOf, positionOf } from './energy'
import { HOSPITAL, lines, node, values } from './fixtures'
import { signalsOf } from './signals'
import type { Diagram, Live, Reading } from './types'

const NODES = [
  node('m', 'mains', { device: 'plc', signals: 'mains' }),
  node('g', 'genset', { device: 'plc', signals: 'genset' }),
  node('b', 'bus'),
  node('l', 'load'),
]
const SITE: Diagram = { nodes: NODES, connections: lines('m/b g/b b-l') }
const ON = { 'plc mains.l1.voltage': 230 }
const OFF = { 'plc mains.l1.voltage': 3 }
const REST = { 'plc genset.l1.voltage': 0, 'plc g/b': false }

const states = (diagram: Diagram, live: Live) =>
  Object.fromEntries([...flowOf(diagram, live).supply].map(([id, { energy }]) => [id, energy]))
const fedBy = (diagram: Diagram, live: Live, id: string) => flowOf(diagram, live).supply.get(id)?.from

test('a live source feeds what lies behind closed breakers and plain lines', () => {
  const live = values({ ...ON, ...REST, 'plc m/b': true })
  expect(states(SITE, live)).toEqual({ m: 'live', g: 'dead', b: 'live', l: 'live' })
  expect(fedBy(SITE, live, 'l')).toEqual(['m'])
  expect(fedBy(SITE, live, 'm')).toEqual([])
})

test('behind an open breaker all is dead', () => {
  expect(states(SITE, values({ ...ON, ...REST, 'plc m/b': false }))).toEqual({
    m: 'live',
    g: 'dead',
    b: 'dead',
    l: 'dead',
  })
})

test.each(['stale', 'bad', 'invalid', 'unread'] as const)(
  'a %s position or voltage makes nothing live or dead',
  (look) => {
    const position = values({ ...ON, ...REST, 'plc m/b': { value: true, look } })
    expect(states(SITE, position)).toMatchObject({ m: 'live', b: 'unknown', l: 'unknown' })
    const voltage = values({ ...REST, 'plc m/b': true, 'plc mains.l1.voltage': { value: 230, look } })
    expect(states(SITE, voltage)).toMatchObject({ m: 'unknown', b: 'unknown', l: 'unknown' })
  },
)

test('a source that nobody measures is not known, and so is what it may feed', () => {
  const diagram = { nodes: [node('m', 'mains'), node('b', 'bus')], connections: lines('m-b') }
  expect(states(diagram, values({}))).toEqual({ m: 'unknown', b: 'unknown' })
})

test('what no source is connected with is not called dead', () => {
  const diagram = { nodes: NODES, connections: lines('m/b b/g') }
  expect(states(diagram, values({ ...ON, ...REST, 'plc m/b': false, 'plc b/g': false }))).toMatchObject({
    b: 'dead',
    l: 'unknown',
  })
})

test('what is certainly live does not hang on another source that is not known', () => {
  const live = values({ ...ON, 'plc m/b': true, 'plc g/b': true })
  expect(states(SITE, live)).toEqual({ m: 'live', g: 'unknown', b: 'live', l: 'live' })
})

test('one phase is enough to be live; to be dead every voltage there is must say so', () => {
  const source = { nodes: NODES.slice(0, 1), connections: [] }
  const of = (known: Record<string, number | Partial<Reading>>) => states(source, values(known)).m
  expect(of({ ...OFF, 'plc mains.l2.voltage': 231 })).toBe('live')
  expect(of({ ...OFF, 'plc mains.l2.voltage': 0 })).toBe('dead')
  expect(of({ ...OFF, 'plc mains.l2.voltage': { look: 'unread' } })).toBe('unknown')
  expect(of({ ...ON, 'plc mains.l2.voltage': { look: 'bad' } })).toBe('live')
  expect(of({ 'plc mains.l1.voltage': 49.9 })).toBe('dead')
  expect(of({ 'plc mains.l1.voltage': 50 })).toBe('live')
})

test('energy goes through a closed tie, and round a ring of ties it comes to an end', () => {
  const diagram = {
    nodes: [NODES[0]!, node('a', 'bus'), node('b', 'bus'), node('c', 'bus')],
    connections: lines('m/a a/b b/c c/a'),
  }
  const ring = { 'plc a/b': true, 'plc b/c': true, 'plc c/a': true }
  expect(states(diagram, values({ ...ON, ...ring, 'plc m/a': true }))).toEqual({
    m: 'live',
    a: 'live',
    b: 'live',
    c: 'live',
  })
  const open = values({ ...ON, 'plc m/a': true, 'plc a/b': false, 'plc b/c': true, 'plc c/a': false })
  expect(states(diagram, open)).toEqual({ m: 'live', a: 'live', b: 'dead', c: 'dead' })
})

test('a measurement counts for more than what the breakers say', () => {
  const bus = node('b', 'bus', { device: 'plc', signals: 'src1' })
  const diagram = { nodes: [NODES[0]!, bus, NODES[3]!], connections: lines('m/b b-l') }
  const dead = values({ ...ON, 'plc m/b': true, 'plc src1.l1.voltage': 0 })
  expect(states(diagram, dead)).toEqual({ m: 'live', b: 'dead', l: 'dead' })
  const alive = values({ ...ON, 'plc m/b': false, 'plc src1.l1.voltage': 231 })
  expect(states(diagram, alive)).toEqual({ m: 'live', b: 'live', l: 'live' })
  expect(fedBy(diagram, alive, 'l')).toEqual([])
  // A measurement that is not good leaves it to the breakers.
  const lost = values({ ...ON, 'plc m/b': true, 'plc src1.l1.voltage': { value: 0, look: 'stale' } })
  expect(states(diagram, lost)).toEqual({ m: 'live', b: 'live', l: 'live' })
})

test('a dead source at a live bus stays dead: the other side does not feed it', () => {
  const live = values({ ...OFF, 'plc m/b': true, 'plc genset.l1.voltage': 229, 'plc g/b': true })
  expect(states(SITE, live)).toEqual({ m: 'dead', g: 'live', b: 'live', l: 'live' })
  expect(fedBy(SITE, live, 'b')).toEqual(['g'])
})

test('two sources in parallel are both named', () => {
  const live = values({ ...ON, 'plc m/b': true, 'plc genset.l1.voltage': 229, 'plc g/b': true })
  expect(fedBy(SITE, live, 'l')).toEqual(['m', 'g'])
})

test('a breaker that no device tells is unknown, a plain line has none', () => {
  expect(positionOf({ from: 'a', to: 'b', device: null, breaker: 'x' }, values({}))).toBe('unknown')
  expect(positionOf({ from: 'a', to: 'b', device: 'plc', breaker: 'x' }, values({}))).toBe('unknown')
  expect(positionOf({ from: 'a', to: 'b', device: null, breaker: null }, values({}))).toBeUndefined()
})

test('the signals wanted: of each device once, nothing of what is not measured', () => {
  const wanted = signalsOf(HOSPITAL)
  expect([...wanted.keys()]).toEqual(['genset-1', 'genset-2', 'switch-1', 'compressor-1'])
  expect(wanted.get('genset-1')).toContain('mains.voltage.average')
  expect(wanted.get('genset-1')).toContain('genset.power.active')
  expect(wanted.get('genset-1')).toContain('breaker.mains.closed')
  expect(wanted.get('switch-1')).toContain('breaker.tie.closed')
  expect(wanted.get('compressor-1')).toEqual(['compressor.loaded', 'compressor.discharge.pressure'])
  for (const signals of wanted.values()) expect(new Set(signals).size).toBe(signals.length)
  expect(signalsOf({ nodes: [node('b', 'bus')], connections: lines('b-b') }).size).toBe(0)
})

test('the figures of a source are one voltage, frequency and power, as far as it has them', () => {
  const volts = { value: 231, unit: 'V' }
  const live = values({ 'plc mains.l1.voltage': volts, 'plc mains.l2.voltage': 5, 'plc mains.frequency': 50 })
  expect(figuresOf(NODES[0]!, live).map(({ value }) => value)).toEqual([231, 50])
  expect(figuresOf(NODES[2]!, live)).toEqual([])
})

test('a compressor is loaded or not, and never by a value that is not good', () => {
  const air = node('air', 'compressor', { device: 'plc', signals: 'compressor' })
  expect(loadedOf(air, values({ 'plc compressor.loaded': true }))).toBe(true)
  expect(loadedOf(air, values({ 'plc compressor.loaded': { value: true, look: 'stale' } }))).toBeUndefined()
  expect(loadedOf(NODES[0]!, values({ 'plc mains.loaded': true }))).toBeUndefined()
})
