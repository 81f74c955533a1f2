// What a controller has that is read only while somebody looks, told by its points.
import type { GroupView, PointView } from '../logic/types'

const DRAWN: readonly PointView['type'][] = ['image', 'trace']

export interface Harmonic {
  order: number
  point: PointView
}

/** The analysis of one channel: what it is, its waveform, what that is made of. */
export interface Analysis {
  trace: PointView
  channel: PointView | undefined
  distortion: PointView | undefined
  fundamental: PointView | undefined
  harmonics: readonly Harmonic[]
}

export interface Looked {
  /** The groups to ask for. */
  groups: readonly string[]
  /** Every point of these groups. */
  points: readonly PointView[]
  images: readonly PointView[]
  analyses: readonly Analysis[]
}

/** Undefined for a controller that has nothing of the kind. */
export function lookedAt(groups: readonly GroupView[]): Looked | undefined {
  const drawn = groups.filter(({ points }) => points.some(isDrawn))
  if (drawn.length === 0) return undefined
  const points = drawn.flatMap((group) => group.points)
  return {
    groups: drawn.map(({ id }) => id),
    points,
    images: points.filter(({ type }) => type === 'image'),
    analyses: drawn.flatMap(analysesOf),
  }
}

function isDrawn({ type, rate }: PointView): boolean {
  return rate === 'on_demand' && DRAWN.includes(type)
}

function analysesOf({ points }: GroupView): Analysis[] {
  const harmonics = points.flatMap((point): Harmonic[] => {
    const order = /(?:^|_)harmonic_(\d+)$/.exec(point.id)?.[1]
    return order === undefined ? [] : [{ order: Number(order), point }]
  })
  return points
    .filter(({ type }) => type === 'trace')
    .map((trace) => ({
      trace,
      channel: points.find(({ type, id }) => type === 'choice' && /(?:^|_)channel$/.test(id)),
      distortion: points.find(({ id }) => /(?:^|_)thd$/.test(id)),
      fundamental: points.find(({ id }) => /(?:^|_)fundamental$/.test(id)),
      harmonics: [...harmonics].sort((a, b) => a.order - b.order),
    }))
}
