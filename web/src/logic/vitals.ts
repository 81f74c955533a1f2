// The few values that say at a glance how a device is, found by signal, whoever made it.
import type { DeviceView, GroupView, JoinedPointView, PointView, ValueView } from './types'

type Kind = DeviceView['kind']

interface Wanted {
  title: string
  /** The first that a device has fills the tile; all of them are needed where they make a feed. */
  signals: readonly string[]
  /** A flag's words: not set, set. */
  words?: readonly [string, string]
  /** The load on this side of a bus tie: its own switch, the tie, the other side's switch. */
  feed?: 1 | 2
  /** The kinds on whose card in the overview it stands, three in a row; the rest is for the page of the device. */
  card?: readonly Kind[]
}

const SWITCH = ['open', 'closed'] as const
const GENSET: Kind[] = ['genset']
const ATS: Kind[] = ['transfer_switch']
const AIR: Kind[] = ['compressor']
const ENGINE: Kind[] = ['genset', 'compressor']
const [QS1, QS2, QTIE] = ['breaker.src1.closed', 'breaker.src2.closed', 'breaker.tie.closed']

/** In the order of the page. */
export const TILES: readonly Wanted[] = [
  { title: 'Mains voltage', signals: ['mains.voltage.average', 'mains.l1.voltage'], card: GENSET },
  { title: 'Mains frequency', signals: ['mains.frequency'], card: GENSET },
  { title: 'Mains breaker', signals: ['breaker.mains.closed'], words: SWITCH, card: GENSET },
  { title: 'Source 1', signals: ['state.src1'], card: ATS },
  { title: 'Source 1 voltage', signals: ['src1.l1.voltage', 'src1.l1_l2.voltage'], card: ATS },
  { title: 'Source 1 frequency', signals: ['src1.frequency'] },
  { title: 'Source 1 switch', signals: [QS1], words: SWITCH, card: ATS },
  { title: 'Source 2', signals: ['state.src2'], card: ATS },
  { title: 'Source 2 voltage', signals: ['src2.l1.voltage', 'src2.l1_l2.voltage'], card: ATS },
  { title: 'Source 2 frequency', signals: ['src2.frequency'] },
  { title: 'Source 2 switch', signals: [QS2], words: SWITCH, card: ATS },
  { title: 'Bus tie', signals: [QTIE], words: SWITCH, card: ATS },
  { title: 'Load side 1', signals: [QS1, QTIE, QS2], feed: 1, card: ATS },
  { title: 'Load side 2', signals: [QS2, QTIE, QS1], feed: 2, card: ATS },
  { title: 'Genset', signals: ['state.genset'] },
  { title: 'Genset voltage', signals: ['genset.voltage.average', 'genset.l1.voltage'], card: GENSET },
  { title: 'Genset frequency', signals: ['genset.frequency'], card: GENSET },
  { title: 'Genset breaker', signals: ['breaker.genset.closed'], words: SWITCH, card: GENSET },
  { title: 'Genset power', signals: ['genset.power.active'], card: GENSET },
  { title: 'Compressor', signals: ['compressor.loaded'], words: ['unloaded', 'loaded'], card: AIR },
  { title: 'Discharge pressure', signals: ['compressor.discharge.pressure'], card: AIR },
  { title: 'Discharge temperature', signals: ['compressor.discharge.temperature'], card: AIR },
  { title: 'Engine speed', signals: ['engine.speed'], card: ENGINE },
  { title: 'Oil pressure', signals: ['engine.oil.pressure'], card: ENGINE },
  { title: 'Coolant', signals: ['engine.coolant.temperature'], card: ENGINE },
  { title: 'Battery', signals: ['battery.voltage'], card: GENSET },
  { title: 'Fuel', signals: ['fuel.level'], card: ENGINE },
  { title: 'Engine hours', signals: ['engine.hours', 'engine.ecu.hours'], card: AIR },
  { title: 'Next service', signals: ['service.1.hours_left'], card: AIR },
  { title: 'Source 1 supplied', signals: ['src1.supply.hours'] },
  { title: 'Source 2 supplied', signals: ['src2.supply.hours'] },
]

/** The tiles of a card. */
export function cardOf(kind: Kind): readonly Wanted[] {
  return TILES.filter(({ card }) => card?.includes(kind))
}

/** Every signal that these tiles may be filled with. */
export function signalsOf(wanted: readonly Wanted[]): string[] {
  return [...new Set(wanted.flatMap(({ signals }) => signals))]
}

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

export interface Flag {
  point: PointView
  bit: number
}

export interface FlagTile extends Head, Flag {
  kind: 'flag'
  words: readonly [string, string]
}

export interface FeedTile extends Head {
  kind: 'feed'
  side: 1 | 2
  /** Its own switch, the tie, the other side's switch. */
  flags: readonly Flag[]
}

export interface JoinedTile extends Head {
  kind: 'joined'
  joined: JoinedPointView
}

export type Tile = PointTile | FlagTile | FeedTile | JoinedTile

export function tilesOf(
  groups: readonly GroupView[],
  joined: readonly JoinedPointView[] = [],
  wanted: readonly Wanted[] = TILES,
): Tile[] {
  const points = groups.flatMap((group) => group.points)
  return wanted.flatMap((one): Tile[] => {
    if (one.feed) {
      const flags = one.signals.flatMap((signal) => flagOf(signal, points) ?? [])
      if (flags.length < one.signals.length) return []
      const name = 'Which source its switches connect it with'
      return [{ kind: 'feed', id: `feed/${one.feed}`, title: one.title, name, side: one.feed, flags }]
    }
    for (const signal of one.signals) {
      const tile = tileOf(one, signal, points, joined)
      if (tile) return [tile]
    }
    return []
  })
}

function flagOf(signal: string, points: readonly PointView[]) {
  for (const point of points) {
    const about = point.bits.find((bit) => bit.signal === signal)
    if (about) return { point, bit: about.bit, about }
  }
  return undefined
}

function tileOf(
  { title, words }: Wanted,
  signal: string,
  points: readonly PointView[],
  joined: readonly JoinedPointView[],
): Tile | undefined {
  if (words) {
    const flag = flagOf(signal, points)
    if (!flag) return undefined
    const { point, bit, about } = flag
    return { kind: 'flag', id: `${point.id}.${about.id}`, title, name: about.label, point, bit, words }
  }
  const point = points.find((point) => point.signal === signal)
  if (point) return { kind: 'point', id: point.id, title, name: point.name, point }
  const whole = joined.find((joined) => joined.signal === signal)
  return whole && { kind: 'joined', id: signal, title, name: whole.meaning, joined: whole }
}

function isSet(bit: number, view: ValueView | undefined): boolean | undefined {
  return view?.set && view.quality !== 'invalid' ? view.set.includes(bit) : undefined
}

/** What a flag says; undefined while the word it is in has no value. */
export function flagText({ bit, words }: FlagTile, view: ValueView | undefined): string | undefined {
  const set = isSet(bit, view)
  return set === undefined ? undefined : words[set ? 1 : 0]
}

/** Which source the switches connect a load with; undefined while one of them is not known. */
export function feedText(
  { side, flags }: FeedTile,
  views: readonly (ValueView | undefined)[],
): string | undefined {
  const [own, tie, other] = flags.map(({ bit }, index) => isSet(bit, views[index]))
  if (own === undefined || tie === undefined || other === undefined) return undefined
  if (own && tie && other) return 'on both sources'
  if (own) return `on source ${side}`
  return tie && other ? `on source ${3 - side}` : 'on none'
}
