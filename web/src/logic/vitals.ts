// The few values that say at a glance how a device is, found by signal, whoever made it.
import tiles from './tiles.json'
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

/** In the order of the page. The gateway writes the first values into the document by the same list. */
export const TILES = tiles as unknown as readonly Wanted[]

/** The tiles of a card. */
export function cardOf(kind: Kind): readonly Wanted[] {
  return TILES.filter(({ card }) => card?.includes(kind))
}

/** Every signal that a card may ask for, whatever its kind. */
export function cardSignals(): string[] {
  return signalsOf(TILES.filter(({ card }) => card))
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
