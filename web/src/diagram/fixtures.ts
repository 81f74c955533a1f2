// Made-up sites for the tests of the diagram.
import type { Connection, Diagram, DiagramNode, Live, NodeKind, Reading } from './types'

export function node(id: string, kind: NodeKind, rest: Partial<DiagramNode> = {}): DiagramNode {
  return { id, kind, name: id, device: null, signals: null, ...rest }
}

/** `a-b` is a plain line, `a/b` one with a breaker that the device `plc` tells by the signal `a/b`. */
export function lines(text: string): Connection[] {
  return text
    .split(' ')
    .filter(Boolean)
    .map((line) => {
      const [from = '', to = ''] = line.split(/[-/]/)
      const breaker = line.includes('/') ? line : null
      return { from, to, device: breaker && 'plc', breaker }
    })
}

/** Readings by `device signal`; a bare value is a good one. */
export function values(known: Record<string, number | boolean | Partial<Reading>>): Live {
  return {
    value(device, signal) {
      const reading = known[`${device} ${signal}`]
      if (reading === undefined) return undefined
      const whole = typeof reading === 'object' ? reading : { value: reading }
      return { value: null, unit: null, look: 'good', ...whole }
    },
  }
}

/** A hospital: mains and two gensets, a switch with a tie between its two loads, an engine-driven compressor. */
export const HOSPITAL: Diagram = {
  nodes: [
    node('utility', 'mains', { name: 'Utility feed', device: 'genset-1', signals: 'mains' }),
    node('gen1', 'genset', { name: 'Genset 1', device: 'genset-1', signals: 'genset' }),
    node('gen2', 'genset', { name: 'Genset 2', device: 'genset-2', signals: 'genset' }),
    node('main', 'bus', { name: 'Main bus' }),
    node('emergency', 'bus', { name: 'Emergency bus', device: 'switch-1', signals: 'src2' }),
    node('wards', 'load', { name: 'Wards', device: 'switch-1', signals: 'load1' }),
    node('theatres', 'load', { name: 'Operating theatres', device: 'switch-1', signals: 'load2' }),
    node('air', 'compressor', { name: 'Air compressor', device: 'compressor-1', signals: 'compressor' }),
  ],
  connections: [
    { from: 'utility', to: 'main', device: 'genset-1', breaker: 'breaker.mains.closed' },
    { from: 'gen1', to: 'main', device: 'genset-1', breaker: 'breaker.genset.closed' },
    { from: 'gen2', to: 'emergency', device: 'genset-2', breaker: 'breaker.genset.closed' },
    { from: 'main', to: 'wards', device: 'switch-1', breaker: 'breaker.src1.closed' },
    { from: 'emergency', to: 'theatres', device: 'switch-1', breaker: 'breaker.src2.closed' },
    { from: 'wards', to: 'theatres', device: 'switch-1', breaker: 'breaker.tie.closed' },
  ],
}
