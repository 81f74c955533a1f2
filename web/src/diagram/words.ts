// The diagram in words: beside its symbols, for a screen reader, and as a list.
import { units } from '../view/units.svelte'
import { figuresOf, loadedOf, type Energy, type Flow, type Position } from './energy'
import type { Diagram, DiagramNode, Live, Reading } from './types'

export const ENERGY: Record<Energy, string> = { live: 'live', dead: 'dead', unknown: 'not known' }

export const POSITION: Record<Position, string> = {
  closed: 'closed',
  open: 'open',
  unknown: 'position not known',
}

/** A number with its unit; nothing where it is not good, for that nobody would see here. */
export function figureText({ value, unit, look, decimals }: Reading): string {
  return look === 'good' && typeof value === 'number' ? units.text(value, unit, decimals) : ''
}

/** The numbers beside a node. */
export function figuresText(node: DiagramNode, live: Live): string[] {
  return figuresOf(node, live).map(figureText).filter(Boolean)
}

/** Whether it is live; of a compressor, which has an engine of its own, what it does. */
export function stateText(node: DiagramNode, flow: Flow, live: Live): string {
  if (node.kind !== 'compressor') return ENERGY[flow.supply.get(node.id)?.energy ?? 'unknown']
  const loaded = loadedOf(node, live)
  return loaded === undefined ? ENERGY.unknown : loaded ? 'loaded' : 'unloaded'
}

/** `fed by Utility feed and Genset 1`; empty for what nothing is known to feed, and for what feeds others. */
export function fedText({ nodes }: Diagram, flow: Flow, { id, kind }: DiagramNode): string {
  if (kind === 'mains' || kind === 'genset') return ''
  const names = (flow.supply.get(id)?.from ?? []).map(
    (source) => nodes.find((node) => node.id === source)?.name ?? source,
  )
  const last = names.pop()
  return last === undefined ? '' : `fed by ${names.length > 0 ? `${names.join(', ')} and ` : ''}${last}`
}

/** `Utility feed: live, 231 V, 50 Hz`. */
export function nodeText(diagram: Diagram, node: DiagramNode, flow: Flow, live: Live): string {
  const parts = [stateText(node, flow, live), ...figuresText(node, live), fedText(diagram, flow, node)]
  return `${node.name}: ${parts.filter(Boolean).join(', ')}`
}

/** `Utility feed to Main bus: breaker closed`. */
export function connectionText({ nodes, connections }: Diagram, index: number, flow: Flow): string {
  const connection = connections[index]
  const name = (id: string | undefined) => nodes.find((node) => node.id === id)?.name ?? id
  const position = flow.breakers[index]
  return `${name(connection?.from)} to ${name(connection?.to)}: ${
    position === undefined ? 'no breaker' : `breaker ${POSITION[position]}`
  }`
}
