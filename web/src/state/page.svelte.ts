// What the page is made of, in one place: the clock, the stream, the site, and the points fetched beside them.
import { parseRoute, type Route } from '../logic/route'
import type { PointsView } from '../logic/types'
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

  /** The device that the address names, or the first. */
  get device(): Device | undefined {
    const wanted = this.route.device
    return wanted === undefined ? this.site.devices[0] : this.site.device(wanted)
  }

  /** Fetches what the points of a device are, again and again until it is there or `signal` says stop. */
  async loadPoints(device: Device, signal: AbortSignal): Promise<void> {
    while (!signal.aborted && !device.groups) {
      try {
        const path = `devices/${encodeURIComponent(device.view.id)}/points`
        const points = (await this.get(path, signal)) as PointsView
        device.joined = points.joined
        device.groups = points.groups
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
