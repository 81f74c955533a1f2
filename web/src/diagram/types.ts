// How a site is connected, as the gateway tells it, and what the diagram needs to know of the values.
import type { Look } from '../logic/quality'

export type NodeKind = 'mains' | 'genset' | 'bus' | 'load' | 'compressor'

export interface DiagramNode {
  id: string
  kind: NodeKind
  name: string
  /** The device that measures it; null where none does. */
  device: string | null
  /** Which object of that device's signals describes it. */
  signals: string | null
}

export interface Connection {
  from: string
  to: string
  device: string | null
  /** The signal that tells its breaker's position; null for a plain line. */
  breaker: string | null
}

export interface Diagram {
  nodes: readonly DiagramNode[]
  connections: readonly Connection[]
}

export interface Reading {
  value: number | boolean | null
  unit: string | null
  look: Look
}

/** The values as they are now; undefined for a signal that the device does not have. */
export interface Live {
  value(device: string, signal: string): Reading | undefined
}
