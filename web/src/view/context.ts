// Every part of the page reaches the same clock, stream and site, and tells times the same way.
import { getContext, setContext } from 'svelte'
import { clockText, zoneOf } from '../logic/format'
import type { Page } from '../state/page.svelte'

export const PAGE = Symbol('page')

export const providePage = (page: Page): Page => setContext(PAGE, page)
export const usePage = (): Page => getContext<Page>(PAGE)

/** Whether a person followed a card: its page then takes the focus that went with the card. */
export const followed = { card: false }

export interface Times {
  /** The site's time zone, where times are told in it because the reader's is another. */
  readonly zone: string | undefined
  /** A time of the gateway: of day, with the date where it was another day. */
  at(time: number): string
  /** The same with the zone, where it stands alone. */
  full(time: number): string
}

export function useTimes(): Times {
  const page = usePage()
  return {
    get zone() {
      return zoneOf(page.site.view?.time_zone, page.clock.now)
    },
    at(time) {
      return clockText(time, page.clock.now, this.zone)
    },
    full(time) {
      return this.zone ? `${this.at(time)} ${this.zone}` : this.at(time)
    },
  }
}
