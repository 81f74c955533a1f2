// Which nodes stand side by side: as many lines away from a source, what belongs together next to each other.
import type { Diagram, DiagramNode } from './types'

/** A connection between two nodes that are there and are not the same. */
export interface Edge {
  connection: number
  a: string
  b: string
}

export interface Layers {
  layers: readonly (readonly string[])[]
  /** The layer of each node. */
  of: ReadonlyMap<string, number>
  edges: readonly Edge[]
}

const SWEEPS = 4

export function edgesOf({ nodes, connections }: Diagram): Edge[] {
  const ids = new Set(nodes.map(({ id }) => id))
  return connections.flatMap(({ from, to }, connection) =>
    from !== to && ids.has(from) && ids.has(to) ? [{ connection, a: from, b: to }] : [],
  )
}

/** No connection spans more than from one layer to the next: a node is in the layer after its nearest neighbour. */
export function layersOf(diagram: Diagram): Layers {
  const edges = edgesOf(diagram)
  const next = (id: string) => edges.flatMap(({ a, b }) => (a === id ? [b] : b === id ? [a] : []))
  const of = new Map<string, number>()
  const part = new Map<string, number>()
  const parts = partsOf(diagram.nodes, next)
  parts.forEach((members, index) => {
    for (const [id, layer] of distances(rootsOf(members), next)) of.set(id, layer)
    for (const { id } of members) part.set(id, index)
  })

  const depth = Math.max(-1, ...of.values()) + 1
  const layers = Array.from({ length: depth }, (_, layer) =>
    parts.flat().flatMap(({ id }) => (of.get(id) === layer ? [id] : [])),
  )
  const place = new Map<string, number>()
  const number = (layer: string[]) => layer.forEach((id, index) => place.set(id, index))
  layers.forEach(number)
  for (let sweep = 0; sweep < SWEEPS; sweep += 1) {
    for (const layer of sweep % 2 === 0 ? layers : [...layers].reverse()) {
      const mean = new Map(layer.map((id) => [id, meanOf(id, next(id), place)]))
      const key = (id: string) => mean.get(id) ?? 0
      layer.sort((a, b) => (part.get(a) ?? 0) - (part.get(b) ?? 0) || key(a) - key(b))
      number(layer)
    }
  }
  return { layers, of, edges }
}

/** Its neighbours' places count, and its own a little, so that it stays where it is for no reason. */
function meanOf(id: string, near: readonly string[], place: ReadonlyMap<string, number>): number {
  const own = place.get(id) ?? 0
  return near.reduce((sum, other) => sum + (place.get(other) ?? 0), own * 0.01) / (near.length + 0.01)
}

/** What hangs together, in the order of the site file. */
function partsOf(nodes: readonly DiagramNode[], next: (id: string) => string[]): DiagramNode[][] {
  const left = new Set(nodes)
  return nodes.flatMap((start) => {
    if (!left.has(start)) return []
    const found = distances([start.id], next)
    const members = nodes.filter(({ id }) => found.has(id))
    for (const member of members) left.delete(member)
    return [members]
  })
}

/** Where the energy comes from; where nothing says so, what the site file names first. */
function rootsOf(members: readonly DiagramNode[]): string[] {
  const sources = members.filter(({ kind }) => kind === 'mains' || kind === 'genset')
  return (sources.length > 0 ? sources : members.slice(0, 1)).map(({ id }) => id)
}

/** How many lines each node is away from the nearest root. */
function distances(roots: readonly string[], next: (id: string) => string[]): Map<string, number> {
  const found = new Map(roots.map((id) => [id, 0]))
  // A map grows while it is walked through.
  for (const [id, distance] of found)
    for (const other of next(id)) if (!found.has(other)) found.set(other, distance + 1)
  return found
}
