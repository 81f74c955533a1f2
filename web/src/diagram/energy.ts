// What is live: told by what is measured and by the breakers, unknown wherever a value is not good.
import { FIGURES, LOADED, VOLTAGES } from './signals'
import type { Connection, Diagram, DiagramNode, Live, Reading } from './types'

export type Energy = 'live' | 'dead' | 'unknown'
export type Position = 'closed' | 'open' | 'unknown'

export interface Supply {
  energy: Energy
  /** The ids of the live sources that certainly feed it, in the order of the site file. */
  from: readonly string[]
}

export interface Flow {
  supply: ReadonlyMap<string, Supply>
  /** The breaker of each connection; undefined for a plain line. */
  breakers: readonly (Position | undefined)[]
}

/** Below it a voltage is a remnant or a pick-up: the bound of extra-low voltage. */
const LIVE_V = 50

function read({ device, signals }: DiagramNode, part: string, live: Live): Reading | undefined {
  return device === null || signals === null ? undefined : live.value(device, `${signals}.${part}`)
}

/** The numbers that stand beside a node, good ones and others; the first voltage that there is. */
export function figuresOf(node: DiagramNode, live: Live): Reading[] {
  const wanted = node.kind === 'compressor' ? FIGURES.compressor : FIGURES.source
  return wanted.flatMap((parts) => {
    const readings = parts.flatMap((part) => read(node, part, live) ?? [])
    return readings.slice(0, 1)
  })
}

/** Whether a compressor delivers air; undefined while that is not known. */
export function loadedOf(node: DiagramNode, live: Live): boolean | undefined {
  const reading = node.kind === 'compressor' ? read(node, LOADED, live) : undefined
  return reading?.look === 'good' && typeof reading.value === 'boolean' ? reading.value : undefined
}

export function positionOf({ device, breaker }: Connection, live: Live): Position | undefined {
  if (breaker === null) return undefined
  const reading = device === null ? undefined : live.value(device, breaker)
  if (reading?.look !== 'good' || typeof reading.value !== 'boolean') return 'unknown'
  return reading.value ? 'closed' : 'open'
}

/** What its own voltages say of a node: one is enough to be live, all are needed to be dead. */
function measured(node: DiagramNode, live: Live): Energy | undefined {
  if (node.kind === 'compressor') return undefined
  const readings = VOLTAGES.flatMap((part) => read(node, part, live) ?? [])
  if (readings.length === 0) return undefined
  const volts = readings.map(({ value, look }) =>
    look === 'good' && typeof value === 'number' ? Math.abs(value) : undefined,
  )
  if (volts.some((value) => value !== undefined && value >= LIVE_V)) return 'live'
  return volts.every((value) => value !== undefined) ? 'dead' : 'unknown'
}

const isSource = ({ kind }: DiagramNode) => kind === 'mains' || kind === 'genset'

export function flowOf(diagram: Diagram, live: Live): Flow {
  const { nodes, connections } = diagram
  const breakers = connections.map((connection) => positionOf(connection, live))
  const own = new Map(
    nodes.map((node) => {
      const energy = measured(node, live)
      // Of a source nothing but its own measurement tells; of anything else what feeds it does too.
      return [node.id, isSource(node) ? (energy ?? 'unknown') : energy === 'unknown' ? undefined : energy]
    }),
  )
  const those = (...energies: Energy[]) =>
    nodes.map(({ id }) => id).filter((id) => energies.includes(own.get(id) as Energy))

  const closed = (index: number) => breakers[index] === undefined || breakers[index] === 'closed'
  const perhaps = (index: number) => breakers[index] !== 'open'
  // What is measured dead, or a source of which nothing is known, passes nothing on for certain.
  const sure = (starts: string[]) =>
    reach(diagram, starts, closed, (id) => own.get(id) !== 'dead' && own.get(id) !== 'unknown')
  const certain = sure(those('live'))
  const possible = reach(diagram, those('live', 'unknown'), perhaps, (id) => own.get(id) !== 'dead')
  // What no source and no measurement is connected with at all is not drawn in full: nobody knows.
  const known = reach(
    diagram,
    those('live', 'dead', 'unknown'),
    () => true,
    () => true,
  )
  const fed = nodes
    .filter((node) => isSource(node) && own.get(node.id) === 'live')
    .map(({ id }) => [id, sure([id])] as const)

  const supply = nodes.map(({ id }): [string, Supply] => {
    const flown = certain.has(id) ? 'live' : possible.has(id) || !known.has(id) ? 'unknown' : 'dead'
    const energy = own.get(id) ?? flown
    const from = energy === 'live' ? fed.filter(([source, all]) => source !== id && all.has(id)) : []
    return [id, { energy, from: from.map(([source]) => source) }]
  })
  return { supply: new Map(supply), breakers }
}

function reach(
  { connections }: Diagram,
  starts: readonly string[],
  passes: (connection: number) => boolean,
  enters: (node: string) => boolean,
): Set<string> {
  const found = new Set(starts)
  // A set grows while it is walked through.
  for (const at of found) {
    connections.forEach(({ from, to }, index) => {
      const next = from === at ? to : to === at ? from : undefined
      if (next !== undefined && passes(index) && enters(next)) found.add(next)
    })
  }
  return found
}
