// Where events come from. The first stream is opened before the page itself is there, and waits for it.

/** What the gateway sends. */
export const EVENTS = ['snapshot', 'state', 'resumed', 'values', 'device', 'alarms', 'site'] as const
export type EventName = (typeof EVENTS)[number]

export interface Heard {
  data?: unknown
  lastEventId?: string
}
type Listener = (event: Heard) => void

/** What is used of an EventSource. */
export interface Source {
  addEventListener(type: string, listener: Listener): void
  close(): void
}

/** An event stream whose events are kept until somebody listens, and then told in their order. */
export class Early implements Source {
  #source: Source
  #kept: [string, Heard][] = []
  #listeners = new Map<string, Listener>()
  #told = false

  constructor(
    readonly address: string,
    open: (address: string) => Source = (address) => new EventSource(address),
  ) {
    this.#source = open(address)
    for (const type of [...EVENTS, 'error']) {
      this.#source.addEventListener(type, (event) => {
        if (this.#told) this.#listeners.get(type)?.(event)
        else this.#kept.push([type, event])
      })
    }
  }

  addEventListener(type: string, listener: Listener): void {
    // All of its listeners come in one go; what they hear comes after them.
    if (this.#listeners.size === 0) queueMicrotask(() => this.#tell())
    this.#listeners.set(type, listener)
  }

  close(): void {
    this.#listeners.clear()
    this.#source.close()
  }

  #tell(): void {
    for (const [type, event] of this.#kept) this.#listeners.get(type)?.(event)
    this.#kept = []
    this.#told = true
  }
}

/** What the gateway wrote into the document under this id; undefined where it wrote nothing. */
export function written(id: string): unknown {
  try {
    return JSON.parse(document.getElementById(id)?.textContent ?? '') as unknown
  } catch {
    return undefined
  }
}

/** Where the events are: `api` is the API's own address, `query` what is asked for. */
export function eventsAt(api: URL, query: Record<string, string | undefined>): string {
  const address = new URL('events', api)
  for (const [key, value] of Object.entries(query)) {
    if (value) address.searchParams.set(key, value)
  }
  // Commas and slashes are plain in a query; escaped they would be a third of it.
  return address.href.replaceAll('%2C', ',')
}

/** The API lies beside the page, wherever a proxy has put both. */
export const apiOf = (page: string): URL => new URL('api/v1/', page)
