// The site as the gateway tells it: snapshot and states first, then changes, applied to what the page shows. One stream
// tells of all devices what their cards show; a second one tells all of the device that is looked at.
import { announcement } from '../logic/alarms'
import { decimalsOf, timeOf } from '../logic/format'
import type {
  AlarmsEvent,
  AlarmView,
  DeviceView,
  GroupView,
  JoinedPointView,
  JoinedView,
  PointsView,
  PointView,
  Rate,
  SiteInfo,
  Snapshot,
  StateEvent,
  ValuesEvent,
  ValueView,
} from '../logic/types'
import { cardOf, pointsOf, tilesOf, type Tile } from '../logic/vitals'
import type { EventName } from './source'

/** One point's value. Each has its own state, so that a change redraws one cell. */
export class Cell {
  view = $state.raw<ValueView>()
  /** The last good one, shown struck through while there is no better. */
  lastGood = $state.raw<ValueView>()
  /** The most decimals seen: keeps the decimal point in its place while the last digit comes and goes. */
  decimals = $state(0)

  set(view: ValueView): void {
    this.view = view
    if (view.quality === 'good' || view.quality === 'stale') this.lastGood = view
    if (typeof view.value === 'number') this.decimals = Math.max(this.decimals, decimalsOf(view.value))
  }
}

export class Device {
  view = $state.raw() as DeviceView
  alarms = $state.raw<readonly AlarmView[]>([])
  /** Title and revision of the manual behind the points, fetched with them. */
  manual = $state.raw('')
  /** What several points make up, fetched with the points. */
  joined = $state.raw<readonly JoinedPointView[]>([])
  /** What they make up now, by signal. */
  whole = $state<Record<string, JoinedView>>({})
  /** When the last round of each rate was read. */
  rounds = $state<Partial<Record<Rate, number>>>({})
  /** Which groups (`group/…`) and lines (`point/…`) were opened or closed here; kept when the layout changes. */
  opened = $state<Record<string, boolean>>({})
  /** A stream of its own keeps all of its values up to date. */
  followed = false
  #cells = new Map<string, Cell>()
  #groups = $state.raw<readonly GroupView[]>()
  #glance = $state.raw<readonly Tile[]>()
  /** What the stream of all devices told last: it holds again when the device's own stream is gone. */
  #shared = new Told()
  /** The last round that brought something else than failures. */
  #answered = $state<number>()

  constructor(view: DeviceView) {
    this.view = view
  }

  /** What the points are; undefined until it has been fetched. */
  get groups(): readonly GroupView[] | undefined {
    return this.#groups
  }

  set groups(groups: readonly GroupView[] | undefined) {
    this.#foresee(groups?.flatMap(({ points }) => points))
    this.#groups = groups
  }

  /** What its card in the overview is made of, fetched alone: the rest is much more. */
  get glance(): readonly Tile[] | undefined {
    return this.#glance
  }

  set glance(tiles: readonly Tile[] | undefined) {
    this.#foresee(tiles?.flatMap(pointsOf))
    this.#glance = tiles
  }

  /** A reaction does not follow what it makes itself: the cells are there before anything shows them. */
  #foresee(points: readonly PointView[] = []): void {
    for (const { id } of points) this.cell(id)
  }

  cell(point: string): Cell {
    let cell = this.#cells.get(point)
    if (!cell) this.#cells.set(point, (cell = new Cell()))
    return cell
  }

  /** The last sign of life. While a device answers, its rounds carry it; a round that failed is none. */
  get seenAt(): number | undefined {
    const { online, last_seen } = this.view
    const times = [timeOf(last_seen), online ? this.#answered : undefined]
    return times.reduce((a, b) => (a === undefined || (b !== undefined && b > a) ? b : a), undefined)
  }

  /**
   * Seconds left in its state. Counted on from the round that read them, never beyond: a timer that stands still is
   * shown standing still.
   */
  leftAt(now: number): number | undefined {
    const timer = this.view.state?.timer_s
    if (!timer) return undefined
    const since = Math.min(Math.max(0, now - (this.rounds.fast ?? now)), 10_000)
    return Math.max(0, timer - Math.floor(since / 1000))
  }

  /** Everything that the stream of all devices tells of its values. */
  share({ values, joined }: StateEvent): void {
    this.#shared = new Told()
    this.#shared.take(values, joined)
    if (!this.followed) this.#whole(values, joined)
  }

  /** A round that the stream of all devices tells of. */
  shareRound(event: ValuesEvent): void {
    this.#shared.take(event.changed, event.joined)
    this.#shared.rounds = { ...this.#shared.rounds, ...roundOf(event) }
    if (!this.followed) this.round(event)
  }

  /** What its own stream tells: its values. The other stream has the rest. */
  follow(name: EventName, payload: unknown): void {
    if (name === 'state') {
      const { values, joined } = payload as StateEvent
      this.followed = true
      this.#whole(values, joined)
    } else if (name === 'values') this.round(payload as ValuesEvent)
  }

  /** Its own stream is gone: what the other one does not tell is not kept up to date any more, and must look so. */
  unfollow(): void {
    if (!this.followed) return
    this.followed = false
    const { values, joined, rounds } = this.#shared
    for (const [id, cell] of this.#cells) {
      // Its own stream may have ended before it told what the other has told already, and tells once.
      const view = values.get(id) ?? (cell.view && outdated(cell.view))
      if (view) cell.set(view)
    }
    for (const [signal, view] of Object.entries(this.whole)) {
      this.whole[signal] = joined.get(signal) ?? outdated(view)
    }
    this.rounds = rounds
  }

  #whole(values: readonly ValueView[], joined: readonly JoinedView[]): void {
    this.rounds = {}
    this.#answered = undefined
    this.take(values, joined)
  }

  /** The last finished round of a rate and what it changed. */
  round(event: ValuesEvent): void {
    const { changed, joined } = event
    Object.assign(this.rounds, roundOf(event))
    // That a device is not heard any more is told after the values which say so.
    if (changed.length === 0 || changed.some(({ quality }) => quality !== 'bad')) {
      this.#answered = Math.max(this.#answered ?? 0, timeOf(event.ts) ?? 0) || undefined
    }
    this.take(changed, joined)
  }

  take(values: readonly ValueView[], joined: readonly JoinedView[]): void {
    for (const value of values) this.cell(value.id).set(value)
    for (const value of joined) this.whole[value.signal] = value
  }
}

/** Values, joined signals and rounds as they were told last. */
class Told {
  values = new Map<string, ValueView>()
  joined = new Map<string, JoinedView>()
  rounds: Partial<Record<Rate, number>> = {}

  take(values: readonly ValueView[], joined: readonly JoinedView[]): void {
    for (const value of values) this.values.set(value.id, value)
    for (const value of joined) this.joined.set(value.signal, value)
  }
}

function roundOf({ rate, ts }: ValuesEvent): Partial<Record<Rate, number>> {
  const read = timeOf(ts)
  return read === undefined ? {} : { [rate]: read }
}

function outdated<View extends ValueView | JoinedView>(view: View): View {
  return view.quality === 'good' ? { ...view, quality: 'stale' } : view
}

export class Site {
  view = $state.raw<SiteInfo>()
  devices = $state.raw<readonly Device[]>([])
  /** The latest change of the alarms in words, for a screen reader. */
  spoken = $state('')

  device(id: string): Device | undefined {
    return this.devices.find((device) => device.view.id === id)
  }

  /** What the cards of each profile are made of, where the document brought it along. */
  #cards: Record<string, PointsView>

  constructor(cards: Record<string, PointsView> = {}) {
    this.#cards = cards
  }

  /** What the stream of all devices tells. */
  apply(name: EventName, payload: unknown): void {
    switch (name) {
      case 'snapshot':
        return this.#snapshot(payload as Snapshot)
      case 'state': {
        const state = payload as StateEvent
        return this.device(state.device)?.share(state)
      }
      case 'values': {
        const values = payload as ValuesEvent
        return this.device(values.device)?.shareRound(values)
      }
      case 'device':
        return this.#device(payload as DeviceView)
      case 'alarms':
        return this.#alarms(payload as AlarmsEvent)
      case 'site':
        this.view = payload as SiteInfo
    }
  }

  #snapshot({ site, devices, alarms }: Snapshot): void {
    // Another gateway or another site file may have other points under the same names.
    const other =
      this.view !== undefined && (this.view.started !== site.started || this.view.revision !== site.revision)
    if (other) this.#cards = {}
    const before = this.devices.flatMap((device) => device.alarms)
    this.devices = devices.map((view) => {
      const device = (other ? undefined : this.device(view.id)) ?? this.#create(view)
      device.view = view
      device.alarms = alarms.filter((alarm) => alarm.device === view.id)
      return device
    })
    this.view = site
    this.#speak(announcement(before, alarms))
  }

  #create(view: DeviceView): Device {
    const device = new Device(view)
    const points = this.#cards[view.profile]
    if (points) device.glance = tilesOf(points.groups, points.joined, cardOf(view.kind))
    return device
  }

  #device(view: DeviceView): void {
    const device = this.device(view.id)
    if (device) device.view = view
  }

  #alarms({ device: id, alarms }: AlarmsEvent): void {
    const device = this.device(id)
    if (!device) return
    this.#speak(announcement(device.alarms, alarms))
    device.alarms = alarms
  }

  #speak(sentence: string): void {
    if (sentence) this.spoken = sentence
  }
}
