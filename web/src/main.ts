// Opens the event stream before anything else, then fetches the page that shows it. The values that came with the
// document stay until the stream has newer ones.
import { signalsOf } from './diagram/signals'
import type { Diagram } from './diagram/types'
import { cardSignals } from './logic/vitals'
import { apiOf, Early, eventsAt, written } from './state/source'

// What the diagram shows is asked for with the cards, not after them with everything once more.
const diagram = written('diagram') as Diagram | undefined
const drawn = diagram ? [...signalsOf(diagram).values()].flat() : []
const signals = [...new Set([...cardSignals(), ...drawn])]
const early = new Early(eventsAt(apiOf(document.baseURI), { signal: signals.join(',') }))

import('./page').then(
  ({ start }) => start(early, signals),
  () => {
    early.close()
    const note = document.createElement('p')
    note.setAttribute('role', 'alert')
    note.textContent = 'The page could not be loaded whole, so nothing here is live: load it again.'
    document.getElementById('page')?.replaceChildren(note)
  },
)
