// The site as the gateway tells it: a snapshot first, then changes, applied to what the page shows.
import { announcement } from '../logic/alarms'
import { decimalsOf, timeOf } from '../logic/format'
import type {
  AlarmsEvent,
  AlarmView,
  DeviceView,
  GroupView,
  JoinedPointView,
  JoinedView,
  Rate,
  SiteInfo,
  Snapshot,
  ValuesEvent,
  ValueView,
} from '../logic/types'
import type { Tile } from '../logic/vitals'
import type { EventName } from './stream.svelte'

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
  /** What the points are; undefined until it has been fetched. */
  groups = $state.raw<readonly GroupView[]>()
  /** What several points make up, fetched with the points. */
  joined = $state.raw<readonly JoinedPointView[]>([])
  /** What its card in the overview is made of, fetched alone: the rest is much more. */
  glance = $state.raw<readonly Tile[]>()
  /** What they make up now, by signal. */
  whole = $state<Record<string, JoinedView>>({})
  /** When the last round of each rate was read. */
  rounds = $state<Partial<Record<Rate, number>>>({})
  /** Which groups (`group/…`) and lines (`point/…`) were opened or closed here; kept when the layout changes. */
  opened = $state<Record<string, boolean>>({})
  #cells = new Map<string, Cell>()

  constructor(view: DeviceView) {
    this.view = view
  }

  cell(point: string): Cell {
    let cell = this.#cells.get(point)
    if (!cell) this.#cells.set(point, (cell = new Cell()))
    return cell
  }

  /** The last sign of life. While a device answers, its rounds carry it; a round that failed is none. */
  get seenAt(): number | undefined {
    const { online, last_seen } = this.view
    const times = [timeOf(last_seen), ...(online ? [this.rounds.fast, this.rounds.slow] : [])]
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

  /** Everything the gateway knows of the values, after a gap in the stream. */
  reset(
    view: DeviceView,
    values: readonly ValueView[],
    joined: readonly JoinedView[],
    alarms: readonly AlarmView[],
  ): void {
    this.view = view
    this.alarms = alarms
    this.rounds = {}
    this.take(values, joined)
  }

  take(values: readonly ValueView[], joined: readonly JoinedView[]): void {
    for (const value of values) this.cell(value.id).set(value)
    for (const value of joined) this.whole[value.signal] = value
  }
}

export class Site {
  view = $state.raw<SiteInfo>()
  devices = $state.raw<readonly Device[]>([])
  /** The latest change of the alarms in words, for a screen reader. */
  spoken = $state('')

  device(id: string): Device | undefined {
    return this.devices.find((device) => device.view.id === id)
  }

  apply(name: EventName, payload: unknown): void {
    switch (name) {
      case 'snapshot':
        return this.#snapshot(payload as Snapshot)
      case 'values':
        return this.#values(payload as ValuesEvent)
      case 'device':
        return this.#device(payload as DeviceView)
      case 'alarms':
        return this.#alarms(payload as AlarmsEvent)
    }
  }

  #snapshot({ site, devices, alarms }: Snapshot): void {
    // A gateway that was started again may have other points under the same names.
    const restarted = this.view !== undefined && this.view.started !== site.started
    const before = this.devices.flatMap((device) => device.alarms)
    this.devices = devices.map(({ device: view, values, joined }) => {
      const device = (restarted ? undefined : this.device(view.id)) ?? new Device(view)
      device.reset(
        view,
        values,
        joined,
        alarms.filter((alarm) => alarm.device === view.id),
      )
      return device
    })
    this.view = site
    this.#speak(announcement(before, alarms))
  }

  #values({ device: id, rate, ts, changed, joined }: ValuesEvent): void {
    const device = this.device(id)
    if (!device) return
    const read = timeOf(ts)
    if (read !== undefined) device.rounds[rate] = read
    device.take(changed, joined)
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
