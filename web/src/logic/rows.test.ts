import { expect, test } from 'vitest'
import { columnsOf, rowsOf, shortLabels } from './rows'
import { group, joined, point } from './samples'

const voltage = (phase: string, name: string) =>
  point(`genset_${phase}_voltage`, { name: `Genset phase ${name} voltage`, type: 'u32', unit: 'V' })

test('phases share a line, line-to-line voltages another', () => {
  const rows = rowsOf(
    group('Genset', [
      voltage('l1', 'L1'),
      voltage('l2', 'L2'),
      voltage('l3', 'L3'),
      voltage('l1_l2', 'L1-L2'),
      voltage('l2_l3', 'L2-L3'),
      voltage('l3_l1', 'L3-L1'),
      point('genset_frequency', { name: 'Genset frequency', unit: 'Hz' }),
    ]),
  )
  expect(rows.map(({ name, members }) => [name, members.map(({ label }) => label)])).toEqual([
    ['Voltage', ['L1', 'L2', 'L3']],
    ['Line voltage', ['L12', 'L23', 'L31']],
    ['Frequency', ['']],
  ])
})

test.each([
  ['genset_l1_voltage', 'genset_l2_voltage', 'Genset phase U (L1) voltage', 'Voltage', ['L1', 'L2']],
  [
    'genset_l1_l2_voltage',
    'genset_l2_l3_voltage',
    'Genset phase UV (L1-L2) voltage',
    'Line voltage',
    ['L12', 'L23'],
  ],
  ['s1_a_active_power', 's1_b_active_power', 'Genset A phase active power', 'Active power', ['A', 'B']],
  ['s1_ab_voltage', 's1_bc_voltage', 'Genset AB line voltage', 'Line voltage', ['AB', 'BC']],
] as const)('%s and %s share a line', (one, other, name, shown, labels) => {
  const rows = rowsOf(group('Genset', [point(one, { name }), point(other, { name })]))
  expect(rows.map(({ name, members }) => [name, members.map(({ label }) => label)])).toEqual([
    [shown, labels],
  ])
})

test('a letter alone is no phase', () => {
  expect(rowsOf(group('X', [point('input_a_level'), point('input_b_level')]))).toHaveLength(2)
})

test('a mark that all lines of a group begin with is not said again', () => {
  const rows = (names: string[]) =>
    rowsOf(
      group(
        'Source 1',
        names.map((name) => point(name, { name })),
      ),
    ).map(({ name }) => name)
  expect(rows(['S1 frequency', 'S1 current'])).toEqual(['Frequency', 'Current'])
  expect(rows(['S1 frequency', 'S2 current'])).toEqual(['S1 frequency', 'S2 current'])
  expect(rows(['Multi genset power', 'Multi genset load'])).toEqual([
    'Multi genset power',
    'Multi genset load',
  ])
})

test('hours, minutes and seconds share a line, under what they make up', () => {
  const parts = ['hours', 'minutes', 'seconds'].map((id) => point(id))
  const run = joined('engine.hours', { meaning: 'Hours run', points: ['hours', 'minutes', 'seconds'] })
  const rows = rowsOf(group('Counters', [...parts, point('starts')]), [run])
  expect(rows.map(({ name, members, joined }) => [name, members.length, joined?.signal])).toEqual([
    ['Hours run', 3, 'engine.hours'],
    ['starts', 1, undefined],
  ])
})

test('a bit says only what its array does not', () => {
  const bits = (name: string, labels: string[]) =>
    point('p', {
      name,
      type: 'bits',
      bits: labels.map((label, bit) => ({ bit, id: label, label, class: 'status' })),
    })
  const inputs = [1, 2, 3, 4].map((input) => `Input module 5 input ${input}`)
  expect(shortLabels(bits('Input module 5', inputs))(inputs[1] ?? '')).toBe('Input 2')
  const closed = [1, 2, 3, 4].map((load) => `LOAD1 ATS${load} closed`)
  expect(shortLabels(bits('LOAD1 ATS closed', closed))(closed[3] ?? '')).toBe('ATS4')
  expect(shortLabels(bits('Alarms', closed))(closed[3] ?? '')).toBe('LOAD1 ATS4 closed')
  expect(shortLabels(bits('LED', ['LED 1', 'LED 2', 'LED 3', 'LED 4']))('LED 2')).toBe('LED 2')
})

test('phases that are not next to each other in the map still share a line', () => {
  const rows = rowsOf(group('Genset', [voltage('l1', 'L1'), point('other'), voltage('l2', 'L2')]))
  expect(rows.map(({ members }) => members.length)).toEqual([2, 1])
})

test('another unit, another type or words never share a line', () => {
  const rows = rowsOf(
    group('X', [
      point('a_l1', { unit: 'V' }),
      point('a_l2', { unit: 'kV' }),
      point('b_l1', { type: 'i16' }),
      point('b_l2', { type: 'u16' }),
      point('c_l1', { type: 'choice' }),
      point('c_l2', { type: 'choice' }),
    ]),
  )
  expect(rows).toHaveLength(6)
  expect(rows.every(({ members }) => members.length === 1 && members[0]?.label === '')).toBe(true)
})

test('a phase without its sisters keeps its whole name', () => {
  expect(rowsOf(group('Mains', [voltage('l1', 'L1')]))[0]?.name).toBe('Genset phase L1 voltage')
})

test('every point has exactly one place', () => {
  const points = ['l1', 'l2', 'l3', 'l1_l2', 'l2_l3'].map((phase) => voltage(phase, phase)).concat(point('z'))
  const placed = rowsOf(group('G', points)).flatMap(({ members }) => members.map(({ point }) => point.id))
  expect(placed.toSorted()).toEqual(points.map(({ id }) => id).toSorted())
})

test('the heading is not said again in each name, unless nothing sensible remained', () => {
  const names = ['Battery voltage', 'Battery 2 voltage', 'Battery', 'Charger voltage']
  const rows = rowsOf(
    group(
      'Battery',
      names.map((name, index) => point(`p${index}`, { name })),
    ),
  )
  expect(rows.map(({ name }) => name)).toEqual(['Voltage', 'Battery 2 voltage', 'Battery', 'Charger voltage'])
})

test('the first groups stand at the top of the columns, and none is lost', () => {
  const groups = ['A', 'B', 'C', 'D', 'E'].map((title, index) =>
    group(
      title,
      Array.from({ length: index === 0 ? 20 : 5 }, (_, at) => point(`${title}${at}`)),
    ),
  )
  const columns = columnsOf(groups, 3)
  expect(columns.map((column) => column[0]?.title)).toEqual(['A', 'B', 'C'])
  expect(columns.map((column) => column.length)).toEqual([1, 2, 2])
  expect(columnsOf(groups, 1)).toEqual([groups])
  expect(columnsOf([], 2)).toEqual([[], []])
})
