// Starts the page in place of what came with the document.
import { mount } from 'svelte'
import './app.css'
import './first.css'
import App from './App.svelte'
import type { PointsView } from './logic/types'
import { Page } from './state/page.svelte'
import type { Early } from './state/source'

export function start(early: Early): void {
  const page = new Page(undefined, early, cards())
  page.start()
  const target = document.getElementById('page')
  if (target) mount(App, { target, props: { page } })
}

/** What the points are that the cards show, by profile, where the gateway wrote it into the document. */
function cards(): Record<string, PointsView> {
  try {
    return JSON.parse(document.getElementById('cards')?.textContent ?? '{}') as Record<string, PointsView>
  } catch {
    return {}
  }
}
