// The event stream: opens it, notices when it is gone or silent, and opens it again where it ended. What it carries is
// not its business.
import { EVENTS, type EventName, type Heard, type Source } from './source'

export type { EventName, Source } from './source'
export type Phase = 'connecting' | 'live' | 'lost'

/** So long may the whole state take, on a slow line too. */
const ANSWER_MS = 15_000
const LONGEST_WAIT_MS = 10_000
/** So long without a word, before it is known how often the gateway speaks, the stream is opened anew. */
const SILENCE_MS = 20_000
/** So long it is listened to before that is known. */
const LEARNING_MS = 10_000
/** Silence is more than four of the usual pauses, but never less than this: values may be five seconds old. */
const PAUSES = 4
const SILENCE_AT_LEAST_MS = 4000
/** A gateway that is there answers within this; until then, silence does not make the values stale. */
const DOUBT_MS = 1000

export class Stream {
  phase = $state<Phase>('connecting')
  /** Last time the gateway was heard. */
  heardAt = $state<number>()
  /** When the next attempt starts; undefined while one is under way. */
  retryAt = $state<number>()

  #open: (after: string | undefined) => Source
  #handle: (name: EventName, payload: unknown) => void
  #gone: (() => void) | undefined
  #source: Source | undefined
  #timer: ReturnType<typeof setTimeout> | undefined
  #failures = 0
  /** The last event that was taken: the next stream goes on after it. */
  #last: string | undefined
  /** How many devices' states are still to come; undefined before the first word. */
  #missing: number | undefined
  /** The longest pause between two words that was none of the gateway's absences. */
  #pause = 0
  /** When it was live for the first time. */
  #since: number | undefined

  /**
   * `open` opens a stream that goes on after the event of that id. With `gone`, which is told that values are not kept
   * up to date from now on, every stream after that begins from the start.
   */
  constructor(
    open: (after: string | undefined) => Source,
    handle: (name: EventName, payload: unknown) => void,
    gone?: () => void,
  ) {
    this.#open = open
    this.#handle = handle
    this.#gone = gone
  }

  /** Opens the stream, in place of the one there is. */
  connect(): void {
    this.#close()
    this.retryAt = undefined
    this.#missing = undefined
    const source = this.#open(this.#last)
    this.#source = source
    for (const name of EVENTS) {
      source.addEventListener(name, (event) => {
        if (source === this.#source) this.#receive(name, event)
      })
    }
    source.addEventListener('error', () => {
      if (source === this.#source) this.#fail()
    })
    this.#after(ANSWER_MS, () => this.#fail())
  }

  /** Asks for everything anew, because something else is asked for than before. */
  renew(): void {
    this.#last = undefined
    this.#doubt()
  }

  /** The page came back to the foreground or the network returned: the timers may have slept. */
  wake(): void {
    const silence = Date.now() - (this.heardAt ?? 0)
    if (this.phase !== 'lost' && silence <= this.#patience()) return
    if (this.phase === 'live') this.#turn('connecting')
    this.connect()
  }

  stop(): void {
    this.#close()
    this.#turn('connecting')
  }

  #receive(name: EventName, { data, lastEventId }: Heard): void {
    try {
      const payload: unknown = JSON.parse(String(data))
      if (name === 'snapshot') this.#missing = (payload as { devices: unknown[] }).devices.length
      else if (name === 'resumed') this.#missing = 0
      // Changes mean nothing before the state they change.
      else if (this.#missing === undefined) return
      // A reader that fell behind gets states without a snapshot.
      else if (name === 'state') this.#missing = Math.max(0, this.#missing - 1)
      this.#handle(name, payload)
    } catch (error) {
      // Half a state is worse than none: a snapshot sets it right.
      console.error(`unreadable event "${name}"`, error)
      this.#last = undefined
      this.#fail()
      return
    }
    this.#heard()
    if (this.#missing > 0) return
    this.#last = lastEventId || this.#last
    this.#since ??= Date.now()
    this.#turn('live')
    this.#failures = 0
  }

  /** A word was heard; what comes after how long without the next one. */
  #heard(): void {
    const now = Date.now()
    if (this.phase === 'live' && this.heardAt !== undefined) {
      this.#pause = Math.max(this.#pause, now - this.heardAt)
    }
    this.heardAt = now
    if (this.#missing) this.#after(ANSWER_MS, () => this.#fail())
    else this.#after(this.#patience(), () => this.#doubt())
  }

  /** Opens it anew, and until that answers nobody knows for long whether what is shown still holds. */
  #doubt(): void {
    this.connect()
    this.#after(DOUBT_MS, () => {
      this.#turn('connecting')
      this.#after(ANSWER_MS - DOUBT_MS, () => this.#fail())
    })
  }

  #patience(): number {
    if (this.#since === undefined || Date.now() - this.#since < LEARNING_MS) return SILENCE_MS
    return Math.min(SILENCE_MS, Math.max(SILENCE_AT_LEAST_MS, PAUSES * this.#pause))
  }

  #fail(): void {
    this.#close()
    this.#turn('lost')
    // Spread, so that many pages do not all come back in one instant.
    const wait = Math.min(1000 * 2 ** this.#failures, LONGEST_WAIT_MS) * (0.8 + 0.4 * Math.random())
    this.#failures += 1
    this.retryAt = Date.now() + wait
    this.#after(wait, () => this.connect())
  }

  #turn(phase: Phase): void {
    const was = this.phase
    this.phase = phase
    if (was !== 'live' || phase === 'live' || !this.#gone) return
    this.#last = undefined
    this.#gone()
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
