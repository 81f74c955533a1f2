// The picture of a controller's display, out of the registers that hold it.

/** Rows from the top, each from the left; true is a dark dot. */
export interface Picture {
  width: number
  height: number
  dark: readonly (readonly boolean[])[]
}

const WIDTH = 128
const HEIGHT = 64
const BYTES = (WIDTH * HEIGHT) / 8
/** Eight rows that a column's byte covers. */
const PAGE = 8

/**
 * Two bytes a register, the high byte first; a register holds two columns of eight dots, the left one in its low byte.
 * The first 64 registers are the eight rows at the bottom, their lowest bits the last row. Undefined for anything that
 * is not a picture of 128 x 64 dots.
 */
export function pictureOf(value: unknown): Picture | undefined {
  if (typeof value !== 'string' || value.length !== 2 * BYTES || !/^[0-9a-f]*$/i.test(value)) return undefined
  const dark = Array.from({ length: HEIGHT }, (_, y) => {
    const up = HEIGHT - 1 - y
    const page = Math.floor(up / PAGE)
    return Array.from({ length: WIDTH }, (_, x) => {
      // The right column of a pair comes first: x and its neighbour change places.
      const at = page * WIDTH + (x ^ 1)
      return ((Number.parseInt(value.slice(2 * at, 2 * at + 2), 16) >> (up % PAGE)) & 1) === 1
    })
  })
  return { width: WIDTH, height: HEIGHT, dark }
}

/** The dark dots as one path, a bar for each run of them in a row. */
export function pathOf({ dark }: Picture): string {
  return dark
    .flatMap((row, y) => runsOf(row).map(([start, length]) => `M${start} ${y}h${length}v1h-${length}z`))
    .join('')
}

function runsOf(row: readonly boolean[]): [start: number, length: number][] {
  const runs: [number, number][] = []
  row.forEach((on, x) => {
    const last = runs.at(-1)
    if (on && last && last[0] + last[1] === x) last[1] += 1
    else if (on) runs.push([x, 1])
  })
  return runs
}
