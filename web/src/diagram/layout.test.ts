import { describe, expect, test } from 'vitest'
import { HOSPITAL, lines, node } from './fixtures'
import { spread, type Layout, type Placed, type XY } from './geometry'
import { ladder } from './ladder'
import { layersOf } from './layers'
import { layoutOf } from './layout'
import { tracksOf, type Pin, type Route } from './tracks'
import { tree } from './tree'
import type { Diagram, NodeKind } from './types'

const KINDS: Record<string, NodeKind> = { m: 'mains', g: 'genset', b: 'bus', l: 'load', c: 'compressor' }

/** Nodes by the first letter of their id, lines as in the fixtures. */
function site(text: string, connections: string): Diagram {
  return { nodes: text.split(' ').map((id) => node(id, KINDS[id[0]!]!)), connections: lines(connections) }
}

const at = (layout: Layout, id: string) => layout.nodes.find((placed) => placed.id === id)!

interface Piece {
  connection: number
  node: string
  from: XY
  to: XY
}

const pieces = (layout: Layout): Piece[] =>
  layout.lines.flatMap(({ connection, halves }) =>
    halves.flatMap(({ node, points }) =>
      points.slice(1).map((to, index) => ({ connection, node, from: points[index]!, to })),
    ),
  )

const inside = (a: Placed, b: Placed) =>
  a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height

/** Two pieces that lie on each other over some length. */
function onEachOther(a: Piece, b: Piece): boolean {
  for (const [along, across] of [
    [0, 1],
    [1, 0],
  ] as const) {
    if (a.from[across] !== a.to[across] || b.from[across] !== b.to[across]) continue
    if (a.from[across] !== b.from[across]) continue
    const start = Math.max(Math.min(a.from[along], a.to[along]), Math.min(b.from[along], b.to[along]))
    const end = Math.min(Math.max(a.from[along], a.to[along]), Math.max(b.from[along], b.to[along]))
    if (end > start) return true
  }
  return false
}

/** What holds for every layout: all is there, nothing on anything else, every line leads to its nodes. */
function check(diagram: Diagram, layout: Layout): void {
  const faults: string[] = []
  const must = (holds: boolean, text: string) => holds || faults.push(text)
  expect(layout.nodes.map(({ id }) => id).sort()).toEqual(diagram.nodes.map(({ id }) => id).sort())
  for (const [index, a] of layout.nodes.entries()) {
    must(a.x >= 0 && a.x + a.width <= layout.width && a.y + a.height <= layout.height, `${a.id} is outside`)
    for (const b of layout.nodes.slice(index + 1)) must(!inside(a, b), `${a.id} is on ${b.id}`)
  }
  expect(layout.lines).toHaveLength(diagram.connections.filter(({ from, to }) => from !== to).length)
  for (const { connection, halves, breaker } of layout.lines) {
    const { from, to, breaker: signal } = diagram.connections[connection]!
    const [one, two] = halves
    const meeting = one.points.at(-1)!
    must(
      [one.node, two.node].sort().join() === [from, to].sort().join(),
      `line ${connection} leads elsewhere`,
    )
    must(meeting.join() === two.points.at(-1)!.join(), `line ${connection} is not whole`)
    must(breaker?.join() === (signal === null ? undefined : meeting.join()), `breaker ${connection}`)
    for (const { node, points } of halves) {
      const [x, y] = points[0]!
      const { x: left, y: top, symbol, height } = at(layout, node)
      must(x >= left && x <= left + symbol, `line ${connection} starts beside ${node}`)
      must([top, top + height, top + height / 2].includes(y), `line ${connection} starts off ${node}`)
    }
  }
  const all = pieces(layout)
  for (const [index, piece] of all.entries()) {
    const name = `line ${piece.connection}`
    must(piece.from[0] === piece.to[0] || piece.from[1] === piece.to[1], `${name} is slanted`)
    const [x, y] = [(piece.from[0] + piece.to[0]) / 2, (piece.from[1] + piece.to[1]) / 2]
    for (const { id, x: left, y: top, width, height } of layout.nodes)
      must(!(x > left && x < left + width && y > top && y < top + height), `${name} goes through ${id}`)
    for (const other of all.slice(index + 1))
      if (piece.connection !== other.connection && piece.node !== other.node)
        must(!onEachOther(piece, other), `${name} is on line ${other.connection}`)
  }
  for (const { connection, breaker } of layout.lines) {
    if (!breaker) continue
    const [x, y] = breaker
    for (const { connection: other, from, to } of all) {
      if (other === connection) continue
      const beside = Math.max(from[0], to[0]) <= x - 9 || Math.min(from[0], to[0]) >= x + 9
      const apart = Math.max(from[1], to[1]) <= y - 12 || Math.min(from[1], to[1]) >= y + 12
      must(beside || apart, `line ${other} goes through breaker ${connection}`)
    }
  }
  expect(faults).toEqual([])
}

const SITES: [name: string, diagram: Diagram][] = [
  ['nothing', { nodes: [], connections: [] }],
  ['one source', site('m', '')],
  ['two nodes', site('m l', 'm/l')],
  ['mains and genset on one bus', site('m g b l', 'm/b g/b b/l')],
  ['a hospital', HOSPITAL],
  [
    'a plant of four gensets',
    site('m g1 g2 g3 g4 b1 b2 l1 l2 l3', 'm/b1 g1/b2 g2/b2 g3/b2 g4/b2 b2/b1 b1/l1 b1/l2 b1/l3'),
  ],
  ['a ring', site('m b1 b2 b3', 'm/b1 b1/b2 b2/b3 b3/b1')],
  ['two sites in one', site('m1 l1 m2 l2 c', 'm1/l1 m2/l2')],
  ['sources only', site('m g', 'm/g')],
  ['no source', site('b l1 l2', 'b/l1 b/l2')],
  ['twice the same and a line to itself', { ...site('m b', 'm/b m/b'), connections: lines('m/b m-b b-b') }],
  ['unknown ends', site('m l', 'm/x y/l m/l')],
]

describe.each(SITES)('%s', (_, whole) => {
  const ids = new Set(whole.nodes.map(({ id }) => id))
  const diagram = {
    ...whole,
    connections: whole.connections.filter(({ from, to }) => ids.has(from) && ids.has(to)),
  }

  test('stands free in the wide layout', () => {
    const layout = tree(diagram)
    expect(layout).toBeDefined()
    check(diagram, layout!)
  })

  test('stands free row by row and fits 340', () => {
    const layout = ladder(diagram, 340)
    check(diagram, layout)
    expect(layout.width).toBeLessThanOrEqual(340)
  })

  test('is the same each time', () => {
    expect(layoutOf(diagram, 900)).toEqual(layoutOf(structuredClone(diagram), 900))
  })
})

test('where each is joined with each only the rows keep the lines apart', () => {
  const diagram = site('m1 m2 m3 l1 l2 l3', 'm1/l1 m1/l2 m1/l3 m2/l1 m2/l2 m2/l3 m3/l1 m3/l2 m3/l3')
  const layout = layoutOf(diagram, 2000)
  expect(layout).toEqual(ladder(diagram, 2000))
  check(diagram, layout)
})

/** A small generator: the same sites each time. */
function random(seed: number): (below: number) => number {
  let state = seed
  return (below) => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0
    return Math.floor((state / 2 ** 32) * below)
  }
}

test('200 made-up sites of up to 40 nodes stand free, whichever layout they get', () => {
  let wide = 0
  for (let seed = 1; seed <= 200; seed += 1) {
    const next = random(seed)
    const count = 2 + next(39)
    const ids = Array.from({ length: count }, (_, index) => `${'mgbbllc'[next(7)]}${index}`)
    const joined = Array.from({ length: next(count + count / 2) }, () => {
      const [a, b] = [next(count), next(count)]
      return a === b ? '' : `${ids[a]}${next(4) === 0 ? '-' : '/'}${ids[b]}`
    })
    const diagram = site(ids.join(' '), joined.join(' '))
    check(diagram, ladder(diagram, 340))
    const layout = tree(diagram)
    if (layout) check(diagram, layout)
    wide += layout ? 1 : 0
  }
  // The wide layout is there for nearly all.
  expect(wide).toBeGreaterThan(150)
})

test('where there is room it is drawn from the sources down, else row by row', () => {
  const wide = layoutOf(HOSPITAL, 1000)
  const y = (id: string) => at(wide, id).y
  expect(y('utility')).toBe(y('gen1'))
  expect(y('utility')).toBeLessThan(y('main'))
  expect(y('main')).toBeLessThan(y('wards'))
  expect(y('wards')).toBe(y('theatres'))
  const narrow = layoutOf(HOSPITAL, 340)
  expect(new Set(narrow.nodes.map(({ x }) => x)).size).toBe(1)
  expect(narrow.width).toBe(340)
})

test('a bus reaches over what hangs on it, so that its lines are straight', () => {
  const layout = tree(site('g1 g2 g3 b l1 l2', 'g1/b g2/b g3/b b/l1 b/l2'))!
  expect(at(layout, 'b').symbol).toBeGreaterThan(2 * at(layout, 'g1').width)
  const bent = layout.lines.filter(({ halves }) => halves.some(({ points }) => points.length > 2))
  expect(bent).toHaveLength(0)
})

test('no line spans more than from one layer to the next', () => {
  const { of, edges } = layersOf(site('m b1 b2 b3 l g', 'm-b1 b1-b2 b2-b3 b3-l m-l g-b3'))
  for (const { a, b } of edges) expect(Math.abs(of.get(a)! - of.get(b)!)).toBeLessThanOrEqual(1)
})

test('values that want the same place are moved apart evenly, others stay', () => {
  expect(spread([100, 100, 100], [10, 10, 10])).toEqual([90, 100, 110])
  expect(spread([0, 50, 52], [10, 10, 10])).toEqual([0, 46, 56])
  expect(spread([], [])).toEqual([])
})

test('of two lines at one place the upper one turns off first; a ring of them has no layout', () => {
  const pin = (x: number, side: Pin['side']): Pin => ({ node: '', x, side })
  const route = (connection: number, from: number, to: number): Route => ({
    connection,
    pins: [pin(from, 'top'), pin(to, 'bottom')],
    channel: 0,
  })
  const [down, up] = [route(0, 100, 300), route(1, 200, 100)]
  const tracks = tracksOf([up, down])!
  expect(tracks.get(down)).toBeLessThan(tracks.get(up)!)
  expect(tracksOf([route(0, 100, 300), route(1, 300, 100)])).toBeUndefined()
})
