// How a site is connected, as the gateway tells it, and what the diagram needs to know of the values.
import type { components } from '../api'
import type { Look } from '../logic/quality'

type Schemas = components['schemas']

export type DiagramNode = Schemas['NodeView']
export type NodeKind = DiagramNode['kind']
export type Connection = Schemas['ConnectionView']

export interface Diagram {
  nodes: readonly DiagramNode[]
  connections: readonly Connection[]
}

export interface Reading {
  value: number | boolean | null
  unit: string | null
  look: Look
  /** How many decimals it has at most, where that is known. */
  decimals?: number
}

/** The values as they are now; undefined for a signal that the device does not have. */
export interface Live {
  value(device: string, signal: string): Reading | undefined
}
