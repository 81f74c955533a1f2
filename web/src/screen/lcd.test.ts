import { expect, test } from 'vitest'
import { pathOf, pictureOf } from './lcd'

/** The hex of a display buffer in which only these bits are set: page, byte of the page, bit. */
function buffer(...bits: [page: number, byte: number, bit: number][]): string {
  const bytes = new Uint8Array(1024)
  for (const [page, byte, bit] of bits) bytes[page * 128 + byte]! |= 1 << bit
  return [...bytes].map((byte) => byte.toString(16).padStart(2, '0')).join('')
}

const dots = (hex: string) =>
  pictureOf(hex)!.dark.flatMap((row, y) => row.flatMap((on, x) => (on ? [[x, y]] : [])))

test('the corners: the low byte is the left column, the lowest bit of the first page the last row', () => {
  expect(dots(buffer([0, 1, 0]))).toEqual([[0, 63]])
  expect(dots(buffer([0, 0, 0]))).toEqual([[1, 63]])
  expect(dots(buffer([0, 1, 7]))).toEqual([[0, 56]])
  expect(dots(buffer([7, 1, 7]))).toEqual([[0, 0]])
  expect(dots(buffer([7, 126, 7]))).toEqual([[127, 0]])
  expect(dots(buffer([0, 126, 0]))).toEqual([[127, 63]])
})

test('a letter as the display holds it comes out upright and not mirrored', () => {
  // An L of five rows in the upper left corner: its stem in column 0, its foot in columns 1 and 2.
  const stem = [7, 6, 5, 4, 3].map((bit): [number, number, number] => [7, 1, bit])
  const picture = pictureOf(buffer(...stem, [7, 0, 3], [7, 3, 3]))!
  const rows = picture.dark.slice(0, 6).map((row) =>
    row
      .slice(0, 4)
      .map((on) => (on ? '#' : '.'))
      .join(''),
  )
  expect(rows).toEqual(['#...', '#...', '#...', '#...', '###.', '....'])
})

test('the path has one bar for each run of dots', () => {
  expect(pathOf(pictureOf(buffer())!)).toBe('')
  expect(pathOf(pictureOf(buffer([7, 1, 7], [7, 0, 7], [7, 2, 7]))!)).toBe('M0 0h2v1h-2zM3 0h1v1h-1z')
  expect(pathOf(pictureOf('ff'.repeat(1024))!).match(/M/g)).toHaveLength(64)
})

test('what is no picture is none', () => {
  for (const value of [null, undefined, 5, '', 'ff', 'zz'.repeat(1024), 'ff'.repeat(1025), ['ff']])
    expect(pictureOf(value)).toBeUndefined()
})
