// Opens the event stream before anything else, then fetches the page that shows it. The values that came with the
// document stay until the stream has newer ones.
import { cardSignals } from './logic/vitals'
import { apiOf, Early, eventsAt } from './state/source'

const early = new Early(eventsAt(apiOf(document.baseURI), { signal: cardSignals().join(',') }))

import('./page').then(
  ({ start }) => start(early),
  () => {
    early.close()
    const note = document.createElement('p')
    note.setAttribute('role', 'alert')
    note.textContent = 'The page could not be loaded whole, so nothing here is live: load it again.'
    document.getElementById('page')?.replaceChildren(note)
  },
)
