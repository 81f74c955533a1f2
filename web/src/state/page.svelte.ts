// What the page is made of, in one place: the clock, the stream, the site, and the points fetched beside them.
import { parseRoute, type Route } from '../logic/route'
import type { PointsView } from '../logic/types'
import { cardOf, signalsOf, tilesOf } from '../logic/vitals'
import { Clock } from './clock.svelte'
import { Site, type Device } from './site.svelte'
import { Stream, type Source } from './stream.svelte'

const RETRY_MS = 3000

export class Page {
  clock = new Clock()
  site = new Site()
  stream: Stream
  route = $state.raw<Route>(parseRoute(location.hash))

  /** The API lies beside the page, wherever a proxy has put both. */
  #api = new URL('api/v1/', document.baseURI)

  constructor(open: (address: string) => Source = (address) => new EventSource(address)) {
    this.stream = new Stream(
      () => open(new URL('events', this.#api).href),
      (name, payload) => this.site.apply(name, payload),
    )
  }

  start(): void {
    this.clock.start()
    this.stream.connect()
    addEventListener('hashchange', () => (this.route = parseRoute(location.hash)))
    addEventListener('online', () => this.stream.wake())
    addEventListener('pageshow', (event) => event.persisted && this.stream.wake())
    document.addEventListener('visibilitychange', () => document.hidden || this.stream.wake())
  }

  get live(): boolean {
    return this.stream.phase === 'live'
  }

  /** The device that the address names. */
  get device(): Device | undefined {
    return this.route.device === undefined ? undefined : this.site.device(this.route.device)
  }

  /** Fetches what the points of a device are. */
  loadPoints(device: Device, signal: AbortSignal): Promise<void> {
    return this.#fetch(device, '', signal, ({ groups, joined }) => {
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

  /** Again and again until the points are there or `signal` says stop. */
  async #fetch(device: Device, query: string, signal: AbortSignal, take: (points: PointsView) => void) {
    while (!signal.aborted) {
      try {
        const path = `devices/${encodeURIComponent(device.view.id)}/points${query}`
        return take((await this.get(path, signal)) as PointsView)
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
