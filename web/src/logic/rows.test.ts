import { expect, test } from 'vitest'
import { columnsOf, rowsOf } from './rows'
import { group, point } from './samples'

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
