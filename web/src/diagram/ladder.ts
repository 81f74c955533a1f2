// The narrow layout: a row for each node, the lines beside them. It fits any site.
import { MARGIN, ROW, SYMBOL, type Layout, type Line, type XY } from './geometry'
import { layersOf } from './layers'
import type { Diagram } from './types'

/** Between two upright lines: a breaker's contacts have room. */
const LANE = 20
/** Words need that much, however many lines there are. */
const LEAST = 100
/** Longer lines of words are hard to follow back to their symbol. */
const MOST = 320

interface Run {
  connection: number
  /** Its ends, the upper first. */
  ends: readonly [string, string]
  rows: readonly [number, number]
}

export function ladder(diagram: Diagram, width: number): Layout {
  const { layers, edges } = layersOf(diagram)
  const order = layers.flat()
  const rowOf = new Map(order.map((id, row) => [id, row]))
  const runs = edges.map(({ connection, a, b }): Run => {
    const [upper, lower] = (rowOf.get(a) ?? 0) < (rowOf.get(b) ?? 0) ? [a, b] : [b, a]
    return { connection, ends: [upper, lower], rows: [rowOf.get(upper) ?? 0, rowOf.get(lower) ?? 0] }
  })
  const lanes = lanesOf(runs)
  const count = Math.max(0, ...lanes.values()) + (runs.length > 0 ? 1 : 0)
  const left = MARGIN + count * LANE
  // Lane 0 is the one next to the nodes.
  const laneX = (run: Run) => left - LANE / 2 - (lanes.get(run) ?? 0) * LANE
  const middle = (row: number) => MARGIN + row * ROW + ROW / 2

  const lines = runs.map((run): Line => {
    const x = laneX(run)
    const [upper, lower] = run.rows
    // Half a row down no other line turns off.
    const y = middle(upper) + ROW / 2
    return {
      connection: run.connection,
      halves: [
        {
          node: run.ends[0],
          points: [
            [left, middle(upper)],
            [x, middle(upper)],
            [x, y],
          ],
        },
        {
          node: run.ends[1],
          points: [
            [left, middle(lower)],
            [x, middle(lower)],
            [x, y],
          ],
        },
      ],
      breaker: diagram.connections[run.connection]?.breaker == null ? undefined : [x, y],
    }
  })
  const words = Math.min(MOST, Math.max(LEAST, width - left - SYMBOL - MARGIN))
  return {
    width: left + SYMBOL + words + MARGIN,
    height: order.length * ROW + 2 * MARGIN,
    nodes: order.map((id, row) => ({
      id,
      x: left,
      y: MARGIN + row * ROW,
      width: SYMBOL + words,
      height: ROW,
      symbol: SYMBOL,
    })),
    lines,
    joints: order.flatMap((id, row) =>
      jointsOf(runs.filter(({ ends }) => ends.includes(id)).map(laneX), middle(row)),
    ),
  }
}

/** Short lines next to the nodes. In one lane they meet at most in the row of a node that both lead to. */
function lanesOf(runs: readonly Run[]): Map<Run, number> {
  const lanes = new Map<Run, number>()
  const taken: Run[][] = []
  const length = ({ rows: [upper, lower] }: Run) => lower - upper
  for (const run of [...runs].sort((a, b) => length(a) - length(b))) {
    const free = taken.findIndex((lane) =>
      lane.every(({ rows: [upper, lower] }) => lower <= run.rows[0] || upper >= run.rows[1]),
    )
    const lane = free < 0 ? taken.push([]) - 1 : free
    taken[lane]?.push(run)
    lanes.set(run, lane)
  }
  return lanes
}

/** All but the outermost line of a node leave it from the side of another one. */
function jointsOf(xs: readonly number[], y: number): XY[] {
  const outermost = Math.min(...xs)
  return [...new Set(xs)].filter((x) => x > outermost).map((x): XY => [x, y])
}
