// What the page is made of, in one place: the clock, the streams, the site, and the points fetched beside them.
import { parseRoute, type Route } from '../logic/route'
import type { PointsView } from '../logic/types'
import { cardOf, cardSignals, signalsOf, tilesOf } from '../logic/vitals'
import { Clock } from './clock.svelte'
import { Site, type Device } from './site.svelte'
import { apiOf, eventsAt, type Early, type Source } from './source'
import { Stream } from './stream.svelte'

const RETRY_MS = 3000

export class Page {
  clock = new Clock()
  site: Site
  /** Tells of all devices what their cards show, and their alarms. */
  stream: Stream
  route = $state.raw<Route>(parseRoute(location.hash))
  /** Nobody looks at this page now. */
  hidden = $state(document.hidden)

  #api = apiOf(document.baseURI)
  #signals: Set<string>
  #open: (address: string) => Source

  /**
   * `early` is a stream that was opened before this page was there, `cards` what the document knows of the points,
   * `signals` what the first stream asks for.
   */
  constructor(
    open: (address: string) => Source = (address) => new EventSource(address),
    early?: Early,
    cards: Record<string, PointsView> = {},
    signals: Iterable<string> = cardSignals(),
  ) {
    this.#open = open
    this.#signals = new Set(signals)
    this.site = new Site(cards)
    let waiting = early
    this.stream = new Stream(
      (after) => {
        const address = eventsAt(this.#api, { signal: [...this.#signals].join(','), last_event_id: after })
        const first = waiting
        waiting = undefined
        if (first?.address === address) return first
        first?.close()
        return open(address)
      },
      (name, payload) => this.site.apply(name, payload),
    )
  }

  start(): void {
    this.clock.start()
    this.stream.connect()
    addEventListener('hashchange', () => (this.route = parseRoute(location.hash)))
    addEventListener('online', () => this.stream.wake())
    addEventListener('pageshow', (event) => event.persisted && this.stream.wake())
    document.addEventListener('visibilitychange', () => {
      this.hidden = document.hidden
      if (!this.hidden) this.stream.wake()
    })
  }

  get live(): boolean {
    return this.stream.phase === 'live'
  }

  /** The device that the address names. */
  get device(): Device | undefined {
    return this.route.device === undefined ? undefined : this.site.device(this.route.device)
  }

  /** The device whose every value is shown: its stream is open while somebody looks, for a browser opens few. */
  get looked(): Device | undefined {
    return this.hidden || !this.live ? undefined : this.device
  }

  /** Keeps every value of a device up to date; what is returned ends that. */
  follow(device: Device): () => void {
    const stream = new Stream(
      (after) => this.#open(eventsAt(this.#api, { device: device.view.id, last_event_id: after })),
      (name, payload) => device.follow(name, payload),
      () => device.unfollow(),
    )
    stream.connect()
    return () => stream.stop()
  }

  /** Wants these signals of all devices too, for as long as the page lives. */
  want(signals: Iterable<string>): void {
    const before = this.#signals.size
    for (const signal of signals) this.#signals.add(signal)
    if (this.#signals.size > before && this.stream.phase !== 'lost') this.stream.renew()
  }

  /** Fetches what the points of a device are. */
  loadPoints(device: Device, signal: AbortSignal): Promise<void> {
    return this.#fetch(device, '', signal, ({ manual, groups, joined }) => {
      device.manual = manual
      device.joined = joined
      device.groups = groups
    })
  }

  /** Fetches what its card shows. */
  loadGlance(device: Device, signal: AbortSignal): Promise<void> {
    const card = cardOf(device.view.kind)
    const query = `?signal=${signalsOf(card).join(',')}`
    return this.#fetch(device, query, signal, ({ groups, joined }) => {
      device.glance = tilesOf(groups, joined, card)
    })
  }

  async #fetch(device: Device, query: string, signal: AbortSignal, take: (points: PointsView) => void) {
    const points = await this.again(`devices/${encodeURIComponent(device.view.id)}/points${query}`, signal)
    if (!signal.aborted) take(points as PointsView)
  }

  /** What the API has at `path`, asked for again and again until it is there or `signal` says stop. */
  async again(path: string, signal: AbortSignal): Promise<unknown> {
    while (!signal.aborted) {
      try {
        return await this.get(path, signal)
      } catch {
        // The stream's banner tells about a lost gateway; here it only takes longer.
        await new Promise((resolve) => setTimeout(resolve, RETRY_MS))
      }
    }
  }

  /** What the API has at `path`. */
  async get(path: string, signal: AbortSignal): Promise<unknown> {
    const asked = Date.now()
    const answer = await fetch(new URL(path, this.#api), { signal, headers: { accept: 'application/json' } })
    this.clock.compare(answer.headers.get('date'), asked, Date.now())
    if (!answer.ok) throw new Error(`${path}: ${answer.status}`)
    return answer.json()
  }
}
