// The few values that say at a glance how a device is, found by signal, whoever made it.
import type { GroupView, JoinedPointView, PointView, ValueView } from './types'

interface Wanted {
  title: string
  /** The first that a device has fills the tile. */
  signals: readonly string[]
  /** A flag's words: not set, set. */
  words?: readonly [string, string]
}

const SWITCH = ['open', 'closed'] as const

/** In the order of the page. */
export const TILES: readonly Wanted[] = [
  { title: 'Mains voltage', signals: ['mains.voltage.average', 'mains.l1.voltage'] },
  { title: 'Mains frequency', signals: ['mains.frequency'] },
  { title: 'Mains breaker', signals: ['breaker.mains.closed'], words: SWITCH },
  { title: 'Source 1', signals: ['state.src1'] },
  { title: 'Source 1 switch', signals: ['breaker.src1.closed'], words: SWITCH },
  { title: 'Source 1 voltage', signals: ['src1.l1.voltage', 'src1.l1_l2.voltage'] },
  { title: 'Source 1 frequency', signals: ['src1.frequency'] },
  { title: 'Source 2', signals: ['state.src2'] },
  { title: 'Source 2 switch', signals: ['breaker.src2.closed'], words: SWITCH },
  { title: 'Source 2 voltage', signals: ['src2.l1.voltage', 'src2.l1_l2.voltage'] },
  { title: 'Source 2 frequency', signals: ['src2.frequency'] },
  { title: 'Bus tie', signals: ['breaker.tie.closed'], words: SWITCH },
  { title: 'Genset request', signals: ['state.genset'] },
  { title: 'Genset voltage', signals: ['genset.voltage.average', 'genset.l1.voltage'] },
  { title: 'Genset frequency', signals: ['genset.frequency'] },
  { title: 'Genset power', signals: ['genset.power.active'] },
  { title: 'Genset breaker', signals: ['breaker.genset.closed'], words: SWITCH },
  { title: 'Compressor', signals: ['compressor.loaded'], words: ['unloaded', 'loaded'] },
  { title: 'Discharge pressure', signals: ['compressor.discharge.pressure'] },
  { title: 'Discharge temperature', signals: ['compressor.discharge.temperature'] },
  { title: 'Engine speed', signals: ['engine.speed'] },
  { title: 'Oil pressure', signals: ['engine.oil.pressure'] },
  { title: 'Coolant', signals: ['engine.coolant.temperature'] },
  { title: 'Battery', signals: ['battery.voltage'] },
  { title: 'Fuel', signals: ['fuel.level'] },
  { title: 'Engine hours', signals: ['engine.hours', 'engine.ecu.hours'] },
  { title: 'Next service', signals: ['service.1.hours_left'] },
  { title: 'Source 1 supplied', signals: ['src1.supply.hours'] },
  { title: 'Source 2 supplied', signals: ['src2.supply.hours'] },
]

interface Head {
  /** Unique on the page of its device. */
  id: string
  title: string
  /** Its full name, as the profile has it. */
  name: string
}

export interface PointTile extends Head {
  kind: 'point'
  point: PointView
}

export interface FlagTile extends Head {
  kind: 'flag'
  point: PointView
  bit: number
  words: readonly [string, string]
}

export interface JoinedTile extends Head {
  kind: 'joined'
  joined: JoinedPointView
}

export type Tile = PointTile | FlagTile | JoinedTile

export function tilesOf(groups: readonly GroupView[], joined: readonly JoinedPointView[] = []): Tile[] {
  const points = groups.flatMap((group) => group.points)
  return TILES.flatMap((wanted) => {
    for (const signal of wanted.signals) {
      const tile = tileOf(wanted, signal, points, joined)
      if (tile) return [tile]
    }
    return []
  })
}

function tileOf(
  { title, words }: Wanted,
  signal: string,
  points: readonly PointView[],
  joined: readonly JoinedPointView[],
): Tile | undefined {
  if (words) {
    for (const point of points) {
      const bit = point.bits.find((bit) => bit.signal === signal)
      if (bit) {
        return {
          kind: 'flag',
          id: `${point.id}.${bit.id}`,
          title,
          name: bit.label,
          point,
          bit: bit.bit,
          words,
        }
      }
    }
    return undefined
  }
  const point = points.find((point) => point.signal === signal)
  if (point) return { kind: 'point', id: point.id, title, name: point.name, point }
  const whole = joined.find((joined) => joined.signal === signal)
  return whole && { kind: 'joined', id: signal, title, name: whole.meaning, joined: whole }
}

/** What a flag says; undefined while the word it is in has no value. */
export function flagText({ bit, words }: FlagTile, view: ValueView | undefined): string | undefined {
  if (!view?.set || view.quality === 'invalid') return undefined
  return view.set.includes(bit) ? words[1] : words[0]
}
