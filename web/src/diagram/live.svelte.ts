// The values behind the diagram: which point carries which signal is asked for, what it reads now is on the page already.
import { isWrong } from '../logic/fleet'
import { standing } from '../logic/quality'
import type { PointsView, PointView } from '../logic/types'
import type { Page } from '../state/page.svelte'
import { signalsOf } from './signals'
import type { Diagram, Live, Reading } from './types'

/** The point of a signal, and its bit where it is a flag. */
interface Carrier {
  point: PointView
  bit: number | undefined
}

/** By device, then by signal. */
type Carriers = Readonly<Record<string, ReadonlyMap<string, Carrier>>>

export class SiteLive implements Live {
  #page: Page
  #carriers = $state.raw<Carriers>({})

  constructor(page: Page) {
    this.#page = page
  }

  /** Asks every device of the diagram which points carry what it shows, until told or stopped. */
  async start(diagram: Diagram, stop: AbortSignal): Promise<void> {
    // After a reload the same id may be another controller.
    this.#carriers = {}
    await Promise.all([...signalsOf(diagram)].map(([device, signals]) => this.#ask(device, signals, stop)))
  }

  value(device: string, signal: string): Reading | undefined {
    const carriers = this.#carriers[device]
    // Until the device's points are known, whatever is asked for may be there.
    if (!carriers) return { value: null, unit: null, look: 'unread' }
    const carrier = carriers.get(signal)
    if (!carrier) return undefined
    const { point, bit } = carrier
    const known = this.#page.site.device(device)
    // What another device says is nothing about this one.
    if (!known || isWrong(known.view)) return { value: null, unit: null, look: 'unread' }
    const { view, decimals } = known.cell(point.id)
    const { look } = standing(view, undefined, 0, this.#page.live)
    if (bit !== undefined) return { value: view?.set?.includes(bit) ?? null, unit: null, look }
    return { value: typeof view?.value === 'number' ? view.value : null, unit: point.unit, look, decimals }
  }

  async #ask(device: string, signals: readonly string[], stop: AbortSignal): Promise<void> {
    const path = `devices/${encodeURIComponent(device)}/points?signal=${signals.join(',')}`
    const points = await this.#page.again(path, stop)
    if (stop.aborted) return
    const { groups } = points as PointsView
    // What is read later is there before anything follows it.
    for (const point of groups.flatMap(({ points }) => points)) this.#page.site.device(device)?.cell(point.id)
    this.#carriers = { ...this.#carriers, [device]: carriersOf(groups, new Set(signals)) }
  }
}

function carriersOf(groups: PointsView['groups'], wanted: ReadonlySet<string>): Map<string, Carrier> {
  const found = new Map<string, Carrier>()
  for (const point of groups.flatMap(({ points }) => points)) {
    if (point.signal && wanted.has(point.signal)) found.set(point.signal, { point, bit: undefined })
    for (const { bit, signal } of point.bits)
      if (signal && wanted.has(signal)) found.set(signal, { point, bit })
  }
  return found
}
