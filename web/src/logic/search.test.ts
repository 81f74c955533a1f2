import { describe, expect, test } from 'vitest'
import { group, point } from './samples'
import { find, marked, termsOf } from './search'

const GROUPS = [
  group('Genset', [
    point('genset_l1_voltage', {
      name: 'Phase L1 voltage',
      address: 10246,
      plc: 410247,
      registers: 2,
      unit: 'V',
      signal: 'genset.l1.voltage',
    }),
    point('mode', {
      name: 'Unit mode',
      address: 10605,
      plc: 410606,
      choices: [
        { value: 4, label: 'AUTO' },
        { value: 1, label: 'STOP' },
      ],
    }),
  ]),
  group('Alarms', [
    point('shutdown_alarms', {
      name: 'Shutdown alarms',
      address: 10504,
      plc: 410505,
      registers: 16,
      type: 'bits',
      bits: [
        { bit: 54, id: 'low_oil', label: 'Low oil pressure', class: 'shutdown' },
        { bit: 61, id: 'hot_oil', label: 'High oil temperature', class: 'shutdown' },
        { bit: 3, id: 'valve', label: 'Valve', class: 'status', signal: 'engine.fuel.valve' },
      ],
    }),
    point('coolant', { name: 'Coolant', address: 10362, plc: 410363, unit: 'degC' }),
  ]),
]
const ids = (query: string) => find(GROUPS, query).groups.flatMap(({ points }) => points.map(({ id }) => id))
const why = (query: string, id: string) =>
  find(GROUPS, query)
    .hits.get(id)
    ?.map(({ what, text }) => `${what} ${text}`)

describe('a point is found by', () => {
  test.each([
    ['its name', 'l1 VOLT', 'genset_l1_voltage'],
    ['its group and name', 'genset mode', 'mode'],
    ['its id', 'genset_l1', 'genset_l1_voltage'],
    ['its signal', 'genset.l1', 'genset_l1_voltage'],
    ['its unit', 'V', 'genset_l1_voltage'],
    ['its unit in print', '°C', 'coolant'],
    ['a choice', 'stop', 'mode'],
    ['a bit', 'low oil', 'shutdown_alarms'],
    ['a signal of a bit', 'fuel.valve', 'shutdown_alarms'],
    ['its address', '10246', 'genset_l1_voltage'],
    ['its second register', '10247', 'genset_l1_voltage'],
    ['the beginning of its address', '1060', 'mode'],
    ['its 4xxxx number', '410247', 'genset_l1_voltage'],
    ['its address in hexadecimal', '0x2806', 'genset_l1_voltage'],
    ['the same as PLC people write it', '2806h', 'genset_l1_voltage'],
    ['hexadecimal digits alone', '287a', 'coolant'],
  ])('%s', (_, query, id) => expect(ids(query)).toContain(id))

  test('nothing it does not have', () => {
    for (const query of ['nothing', '99999', '0xFFFF', '10', 'low oil nothing'])
      expect(ids(query)).toEqual([])
    expect(find(GROUPS, 'nothing').count).toBe(0)
  })
})

test('every term must be found, and the name is reason enough', () => {
  expect(ids('phase voltage')).toEqual(['genset_l1_voltage'])
  expect(why('voltage', 'genset_l1_voltage')).toEqual([])
  expect(why('10246', 'genset_l1_voltage')).toEqual(['address 10246, 0x2806, 410247'])
})

test('of many bits those are named that hold all of the terms', () => {
  expect(why('oil pressure', 'shutdown_alarms')).toEqual(['bit 54 Low oil pressure'])
  expect(why('hot_oil', 'shutdown_alarms')).toEqual(['bit 61 High oil temperature (hot_oil)'])
  expect(find(GROUPS, 'oil pressure').hits.get('shutdown_alarms')?.[0]?.bit).toBe(54)
})

test('matches are marked, overlapping ones as one, and the text stays whole', () => {
  const parts = marked('Oil pressure', termsOf('oil IL press'))
  expect(parts.filter(({ found }) => found).map(({ text }) => text)).toEqual(['Oil', 'press'])
  expect(parts.map(({ text }) => text).join('')).toBe('Oil pressure')
  expect(marked('İstanbul oil', ['oil'])).toEqual([{ text: 'İstanbul oil', found: false }])
})
