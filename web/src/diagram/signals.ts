// Which signals a diagram is drawn from: small, for the first stream asks for them before the diagram itself is there.
import type { Diagram, DiagramNode } from './types'

export const VOLTAGES = ['voltage.average', 'l1.voltage', 'l2.voltage', 'l3.voltage', 'l1_l2.voltage']
export const FIGURES = {
  source: [VOLTAGES, ['frequency'], ['power.active']],
  compressor: [['discharge.pressure']],
}
export const LOADED = 'loaded'

/** The signals that the diagram shows or judges by, of each device. */
export function signalsOf({ nodes, connections }: Diagram): Map<string, string[]> {
  const wanted = new Map<string, Set<string>>()
  const want = (device: string | null, signal: string) => {
    if (device === null) return
    const signals = wanted.get(device) ?? new Set()
    wanted.set(device, signals.add(signal))
  }
  for (const node of nodes) for (const signal of measuredBy(node)) want(node.device, signal)
  for (const { device, breaker } of connections) if (breaker !== null) want(device, breaker)
  return new Map([...wanted].map(([device, signals]) => [device, [...signals]]))
}

function measuredBy({ kind, signals }: DiagramNode): string[] {
  if (signals === null) return []
  const parts = kind === 'compressor' ? [LOADED, ...FIGURES.compressor.flat()] : FIGURES.source.flat()
  return parts.map((part) => `${signals}.${part}`)
}
