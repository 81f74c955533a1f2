// The event stream: opens it, notices when it is gone or silent, and opens it again. What it carries is not its business.

export type Phase = 'connecting' | 'live' | 'lost'

const EVENTS = ['snapshot', 'state', 'values', 'device', 'alarms'] as const
export type EventName = (typeof EVENTS)[number]

/** What is used of an EventSource. */
export interface Source {
  addEventListener(type: string, listener: (event: { data?: unknown }) => void): void
  close(): void
}

/** A gateway that polls anything speaks each second; so long without a word, the stream is opened anew. */
const SILENCE_MS = 20_000
/** So long may the snapshot take, on a slow line too. */
const ANSWER_MS = 15_000
const LONGEST_WAIT_MS = 10_000

export class Stream {
  phase = $state<Phase>('connecting')
  /** Last time the gateway was heard. */
  heardAt = $state<number>()
  /** When the next attempt starts; undefined while one is under way. */
  retryAt = $state<number>()

  #open: () => Source
  #handle: (name: EventName, payload: unknown) => void
  #source: Source | undefined
  #timer: ReturnType<typeof setTimeout> | undefined
  #failures = 0

  constructor(open: () => Source, handle: (name: EventName, payload: unknown) => void) {
    this.#open = open
    this.#handle = handle
  }

  /** Opens the stream, in place of the one there is. */
  connect(): void {
    this.#close()
    this.retryAt = undefined
    const source = this.#open()
    this.#source = source
    let whole = false
    for (const name of EVENTS) {
      source.addEventListener(name, (event) => {
        if (source !== this.#source) return
        if (name === 'snapshot') whole = true
        // Changes mean nothing before the state they change.
        if (whole) this.#receive(name, event.data)
      })
    }
    source.addEventListener('error', () => {
      if (source === this.#source) this.#fail()
    })
    this.#after(ANSWER_MS, () => this.#fail())
  }

  /** The page came back to the foreground or the network returned: the timers may have slept. */
  wake(): void {
    const silence = Date.now() - (this.heardAt ?? 0)
    if (this.phase === 'lost' || silence > 5000) this.connect()
  }

  stop(): void {
    this.#close()
  }

  #receive(name: EventName, data: unknown): void {
    try {
      this.#handle(name, JSON.parse(String(data)))
    } catch (error) {
      // Half a state is worse than none: the next snapshot sets it right.
      console.error(`unreadable event "${name}"`, error)
      this.#fail()
      return
    }
    this.phase = 'live'
    this.heardAt = Date.now()
    this.#failures = 0
    this.#after(SILENCE_MS, () => this.connect())
  }

  #fail(): void {
    this.#close()
    this.phase = 'lost'
    // Spread, so that many pages do not all come back in one instant.
    const wait = Math.min(1000 * 2 ** this.#failures, LONGEST_WAIT_MS) * (0.8 + 0.4 * Math.random())
    this.#failures += 1
    this.retryAt = Date.now() + wait
    this.#after(wait, () => this.connect())
  }

  #after(ms: number, act: () => void): void {
    clearTimeout(this.#timer)
    this.#timer = setTimeout(act, ms)
  }

  #close(): void {
    clearTimeout(this.#timer)
    this.#source?.close()
    this.#source = undefined
  }
}
