// The wide layout: sources above, what they feed below, as an electrician draws it.
import {
  BREAKER,
  GAP,
  MARGIN,
  PORT,
  ROW,
  spread,
  SYMBOL,
  TEXT,
  TRACK,
  type Layout,
  type Line,
  type Placed,
  type XY,
} from './geometry'
import { layersOf, type Edge, type Layers } from './layers'
import { tracksOf, type Pin, type Route } from './tracks'
import type { Diagram } from './types'

/** From the left edge of a node to that of the next. */
const PITCH = SYMBOL + TEXT + GAP
const SWEEPS = 6

/** Undefined where lines of different nodes would lie on each other. */
export function tree(diagram: Diagram): Layout | undefined {
  const plan = layersOf(diagram)
  const symbols = symbolsOf(diagram, plan)
  const xs = placesOf(plan, symbols)
  const routes = routesOf(plan, symbols, xs)
  const guarded = (route: Route) => diagram.connections[route.connection]?.breaker != null

  const nodes: Placed[] = []
  const lines: Line[] = []
  let y = MARGIN
  for (const [layer, ids] of plan.layers.entries()) {
    for (const id of ids) {
      const symbol = symbols.get(id) ?? SYMBOL
      nodes.push({ id, x: xs.get(id) ?? 0, y, width: symbol + TEXT, height: ROW, symbol })
    }
    y += ROW
    const channel = routes.filter((route) => route.channel === layer)
    const tracks = tracksOf(channel)
    if (!tracks) return undefined
    if (channel.length === 0) continue
    // A breaker stands where its line leaves the upper node; of two nodes of the lower layer, where it reaches them.
    const upper = channel.some((route) => guarded(route) && route.pins[0].side === 'top')
    const lower = channel.some((route) => guarded(route) && route.pins[0].side === 'bottom')
    const first = y + (upper ? BREAKER + 6 : TRACK / 2)
    const last = first + Math.max(0, Math.max(-1, ...tracks.values()) * TRACK)
    const bottom = last + (lower ? BREAKER + 6 : upper ? TRACK : BREAKER)
    for (const route of channel) {
      const track = first + (tracks.get(route) ?? 0) * TRACK
      const at = route.pins[0].side === 'top' ? y + BREAKER / 2 + 3 : bottom - BREAKER / 2 - 3
      lines.push(lineOf(route, { top: y, bottom, track, at }, guarded(route)))
    }
    y = bottom
  }
  const right = Math.max(0, ...nodes.map(({ x, width }) => x + width))
  return { width: right + MARGIN, height: y + MARGIN, nodes, lines, joints: [] }
}

/** A bus is as wide as the nodes on its busier side; anything else has room for its lines. */
function symbolsOf({ nodes }: Diagram, { edges, of }: Layers): Map<string, number> {
  return new Map(
    nodes.map(({ id, kind }) => {
      const own = edges.filter(({ a, b }) => a === id || b === id)
      const below = own.filter((edge) => sideOf(edge, id, of) === 'bottom').length
      const most = Math.max(1, below, own.length - below)
      const level = of.get(id) ?? 0
      const beside = own.filter(({ a, b }) => of.get(a) === of.get(b)).length
      const straight = level === 0 ? below - beside : Math.max(below, own.length - below - beside)
      // A line to the next bus leaves at an end, past those that go straight up and down.
      const wide = kind === 'bus' ? Math.max(0, straight - 1) * PITCH + 2 * beside * PORT : 0
      return [id, Math.max(SYMBOL + wide, (most - 1) * PORT + SYMBOL)]
    }),
  )
}

/** The side of a node that a connection leaves from: side by side they meet above, in the first layer below. */
function sideOf({ a, b }: Edge, id: string, of: ReadonlyMap<string, number>): 'top' | 'bottom' {
  const own = of.get(id) ?? 0
  const other = of.get(a === id ? b : a) ?? 0
  return other > own || (other === own && own === 0) ? 'bottom' : 'top'
}

/** The left edges: each node as near to the middle of its neighbours as the others let it. */
function placesOf({ layers, edges, of }: Layers, symbols: ReadonlyMap<string, number>): Map<string, number> {
  const xs = new Map<string, number>()
  const symbol = (id: string) => symbols.get(id) ?? SYMBOL
  const room = (id: string) => symbol(id) + TEXT + GAP
  for (const layer of layers) {
    let x = 0
    for (const id of layer) {
      xs.set(id, x)
      x += room(id)
    }
  }
  const middle = (id: string) => (xs.get(id) ?? 0) + symbol(id) / 2
  const settle = (layer: readonly string[]) => {
    const wanted = layer.map((id) => {
      const near = edges.flatMap(({ a, b }) => (a === id ? [b] : b === id ? [a] : []))
      const far = near.filter((other) => of.get(other) !== of.get(id))
      if (far.length === 0) return xs.get(id) ?? 0
      return far.reduce((sum, other) => sum + middle(other), 0) / far.length - symbol(id) / 2
    })
    spread(wanted, layer.map(room)).forEach((x, index) => xs.set(layer[index] ?? '', x))
  }
  for (let sweep = 0; sweep < SWEEPS; sweep += 1)
    for (const layer of sweep % 2 === 0 ? layers : [...layers].reverse()) settle(layer)
  const left = Math.min(...xs.values())
  for (const [id, x] of xs) xs.set(id, Math.round(x - left + MARGIN))
  return xs
}

/** Where each connection leaves its two nodes: as straight as the symbols are wide. */
function routesOf(
  { edges, of }: Layers,
  symbols: ReadonlyMap<string, number>,
  xs: ReadonlyMap<string, number>,
): Route[] {
  const pins = new Map<Edge, Pin[]>(edges.map((edge) => [edge, []]))
  const symbol = (id: string) => symbols.get(id) ?? SYMBOL
  const middle = (id: string) => (xs.get(id) ?? 0) + symbol(id) / 2
  const goalOf = (edge: Edge, id: string) => {
    const other = edge.a === id ? edge.b : edge.a
    return pins.get(edge)?.find(({ node }) => node === other)?.x ?? middle(other)
  }
  // The taps of a bus are where the others' lines are, so that these stay straight.
  const order = [...xs.keys()].sort((a, b) => symbol(a) - symbol(b))
  for (const id of order) {
    for (const side of ['top', 'bottom'] as const) {
      const own = edges
        .filter((edge) => (edge.a === id || edge.b === id) && sideOf(edge, id, of) === side)
        .map((edge) => ({ edge, goal: goalOf(edge, id) }))
        .sort((a, b) => a.goal - b.goal)
      const from = (xs.get(id) ?? 0) + SYMBOL / 2
      const to = from + symbol(id) - SYMBOL
      const goals = own.map(({ goal }) => Math.min(Math.max(goal, from), to))
      const spaced = spread(
        goals,
        own.map(() => PORT),
      )
      own.forEach(({ edge }, index) => {
        // Pushed together at an end they may stick out; there is room for all of them.
        const least = from + index * PORT
        const most = to - (own.length - 1 - index) * PORT
        const x = Math.round(Math.min(Math.max(spaced[index] ?? 0, least), most))
        pins.get(edge)?.push({ node: id, x, side: sideInChannel(side) })
      })
    }
  }
  return edges.flatMap((edge) => {
    const [one, two] = pins.get(edge) ?? []
    if (!one || !two) return []
    const ordered: [Pin, Pin] = one.side === 'bottom' && two.side === 'top' ? [two, one] : [one, two]
    const [a, b] = [of.get(edge.a) ?? 0, of.get(edge.b) ?? 0]
    const channel = a === b ? Math.max(0, a - 1) : Math.min(a, b)
    return [{ connection: edge.connection, pins: ordered, channel }]
  })
}

/** The bottom of a node is the top of the channel below it. */
function sideInChannel(side: 'top' | 'bottom'): 'top' | 'bottom' {
  return side === 'bottom' ? 'top' : 'bottom'
}

interface Heights {
  top: number
  bottom: number
  track: number
  /** Where the breaker stands. */
  at: number
}

function lineOf({ connection, pins: [one, two] }: Route, heights: Heights, guarded: boolean): Line {
  const { track, at } = heights
  const level = (pin: Pin) => (pin.side === 'top' ? heights.top : heights.bottom)
  const near: XY[] = [
    [one.x, level(one)],
    [one.x, at],
  ]
  const straight = one.side !== two.side && one.x === two.x
  const far: XY[] = straight
    ? [
        [two.x, level(two)],
        [two.x, at],
      ]
    : [
        [two.x, level(two)],
        [two.x, track],
        [one.x, track],
        [one.x, at],
      ]
  return {
    connection,
    halves: [
      { node: one.node, points: near },
      { node: two.node, points: far },
    ],
    breaker: guarded ? [one.x, at] : undefined,
  }
}
