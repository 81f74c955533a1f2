// A look at what is read only for those who look: a stream of its own, open while the screen is in sight.
import type { components } from '../api'
import { timeOf } from '../logic/format'
import type { Rate, ValuesEvent, ValueView } from '../logic/types'
import { Cell } from '../state/site.svelte'
import { Stream, type Phase, type Source } from '../state/stream.svelte'
import type { Looked } from './wanted'

type StateEvent = components['schemas']['StateEvent']

export class Look {
  /** When the last round of each rate was read. */
  rounds = $state<Partial<Record<Rate, number>>>({})
  /** In the background nobody looks. */
  away = $state(false)
  /** Something was heard since the stream was last opened. */
  #heard = $state(false)
  #stream: Stream
  #cells = new Map<string, Cell>()
  #watch = () => this.#see(document.hidden)

  constructor(
    device: string,
    { groups, points }: Looked,
    open: (address: string) => Source = (address) => new EventSource(address),
  ) {
    // What a reaction itself makes it does not follow: the cells are there before anything reads them.
    for (const { id } of points) this.cell(id)
    const address = new URL('api/v1/events', document.baseURI)
    address.searchParams.set('device', device)
    address.searchParams.set('group', groups.join(','))
    this.#stream = new Stream(
      () => open(address.href),
      (name: string, payload) => this.#apply(name, payload),
    )
  }

  start(): void {
    document.addEventListener('visibilitychange', this.#watch)
    const { hidden } = document
    this.away = hidden
    if (!hidden) this.#stream.connect()
  }

  stop(): void {
    document.removeEventListener('visibilitychange', this.#watch)
    this.#stream.stop()
  }

  get phase(): Phase {
    return this.#stream.phase
  }

  /** False while nothing new can come: what is shown may have changed since. */
  get live(): boolean {
    return this.phase === 'live' && this.#heard
  }

  cell(point: string): Cell {
    let cell = this.#cells.get(point)
    if (!cell) this.#cells.set(point, (cell = new Cell()))
    return cell
  }

  #see(hidden: boolean): void {
    if (hidden === this.away) return
    this.away = hidden
    this.#heard = false
    if (hidden) this.#stream.stop()
    else this.#stream.connect()
  }

  #apply(name: string, payload: unknown): void {
    this.#heard = true
    if (name === 'snapshot') this.rounds = {}
    if (name === 'state') this.#take((payload as StateEvent).values)
    if (name === 'values') {
      const { rate, ts, changed } = payload as ValuesEvent
      const read = timeOf(ts)
      if (read !== undefined) this.rounds[rate] = read
      this.#take(changed)
    }
  }

  #take(values: readonly ValueView[]): void {
    for (const value of values) this.cell(value.id).set(value)
  }
}
