// The measures of the diagram and the shapes that a layout is made of; all lengths in the units of the drawing.

export type XY = readonly [x: number, y: number]

/** A node: its symbol at the left of its box, its words at the right. */
export interface Placed {
  id: string
  x: number
  y: number
  width: number
  height: number
  /** How much of the width the symbol takes. */
  symbol: number
}

/** One end of a connection, in the state of its node. */
export interface Half {
  node: string
  points: readonly XY[]
}

export interface Line {
  /** Index of the connection. */
  connection: number
  halves: readonly [Half, Half]
  /** The middle of the breaker, on a vertical stretch; undefined for a plain line. */
  breaker: XY | undefined
}

export interface Layout {
  width: number
  height: number
  nodes: readonly Placed[]
  lines: readonly Line[]
  /** Where lines of one node part. */
  joints: readonly XY[]
}

/** The side of a symbol, and the width of a node that has one connection at a side. */
export const SYMBOL = 40
/** The room of the words. */
export const TEXT = 120
export const ROW = 60
export const GAP = 14
/** Between two lines that leave a node side by side. */
export const PORT = 26
/** Between two lines that run side by side. */
export const TRACK = 12
/** The height of a breaker with its contacts. */
export const BREAKER = 30
export const MARGIN = 8

/**
 * Values as near as can be to those wanted, in their order and with room between them: neighbours that would come too
 * close are moved together.
 */
export function spread(wanted: readonly number[], rooms: readonly number[]): number[] {
  // Without the room before it each value only must not be below the one before: a block has the mean of its members.
  const before = rooms.map((_, index) => rooms.slice(0, index).reduce((sum, room) => sum + room, 0))
  const blocks: { sum: number; count: number }[] = []
  wanted.forEach((value, index) => {
    blocks.push({ sum: value - (before[index] ?? 0), count: 1 })
    for (;;) {
      const [a, b] = blocks.slice(-2)
      if (!a || !b || a.sum / a.count <= b.sum / b.count) break
      blocks.splice(-2, 2, { sum: a.sum + b.sum, count: a.count + b.count })
    }
  })
  const flat = blocks.flatMap(({ sum, count }) => Array.from({ length: count }, () => sum / count))
  return flat.map((value, index) => value + (before[index] ?? 0))
}
