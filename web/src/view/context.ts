// Every part of the page reaches the same clock, stream and site.
import { getContext, setContext } from 'svelte'
import type { Page } from '../state/page.svelte'

const KEY = Symbol('page')

export const providePage = (page: Page): Page => setContext(KEY, page)
export const usePage = (): Page => getContext<Page>(KEY)
