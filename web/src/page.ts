// Starts the page in place of what came with the document.
import { mount } from 'svelte'
import './app.css'
import './first.css'
import App from './App.svelte'
import type { PointsView } from './logic/types'
import { Page } from './state/page.svelte'
import { written, type Early } from './state/source'

export function start(early: Early, signals: readonly string[]): void {
  const cards = (written('cards') ?? {}) as Record<string, PointsView>
  const page = new Page(undefined, early, cards, signals)
  page.start()
  const target = document.getElementById('page')
  if (target) mount(App, { target, props: { page } })
}
