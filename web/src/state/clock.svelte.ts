// The time that ages are counted by: this machine's clock, ticking once a second, set right when the gateway's differs.

/** A difference below this is latency and the whole seconds of a Date header, not a wrong clock. */
const TOLERANCE_MS = 2000

export class Clock {
  /** Milliseconds by the gateway's clock. */
  now = $state(Date.now())
  /** Milliseconds by this machine's, for what happened on this machine. */
  local = $state(Date.now())
  #offset = 0
  #timer: ReturnType<typeof setTimeout> | undefined

  start(): void {
    this.#tick()
  }

  stop(): void {
    clearTimeout(this.#timer)
  }

  /** Compares with the Date header of an answer that was asked for and came at these times of this machine. */
  compare(header: string | null, asked: number, came: number): void {
    const whole = header ? Date.parse(header) : NaN
    if (Number.isNaN(whole)) return
    const offset = whole + 500 - (asked + came) / 2
    this.#offset = Math.abs(offset) > TOLERANCE_MS ? offset : 0
    this.#set()
  }

  /** All ages change in the same instant, on the full second. */
  #tick(): void {
    this.#set()
    this.#timer = setTimeout(() => this.#tick(), 1000 - (this.now % 1000))
  }

  #set(): void {
    this.local = Date.now()
    this.now = this.local + this.#offset
  }
}
