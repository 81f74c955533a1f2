// The page of the imitation: asks for each controller's state once a second, and has its switches.
import { draw } from './plant.js'

const EVERY_MS = 1000
const STEPS = { '1 s': 1, '10 s': 10, '1 min': 60, '10 min': 600 }
const SPEEDS = [0.1, 1, 2, 5, 10, 60, 600, 3600]
/** As many events as somebody reads. */
const LATEST = 50
const TOKEN = 'busbar-imitation-token'

/** What an instructor most often wants to happen: lever, position, what it is called, and what undoes it. */
const SWITCHES = [
  ['mains', 'failed', 'Fail the mains', 'Give the mains back'],
  ['grid', 'failed', 'Fail the grid', 'Give the grid back'],
  ['src1', 'failed', 'Fail source 1', 'Give source 1 back'],
  ['src2', 'failed', 'Fail source 2', 'Give source 2 back'],
  ['tank', 0, 'Drain the tank'],
  ['tank', 100, 'Fill the tank'],
  ['radiator', 'blocked', 'Block the radiator', 'Clear the radiator'],
  ['oil', 'leaking', 'Open an oil leak', 'Mend the oil leak'],
  ['battery', 'flat', 'Flatten the battery', 'Renew the battery'],
  ['breaker.genset', 'will_not_close', 'Jam the genset breaker', 'Free the genset breaker'],
  ['switch.qtie', 'will_not_close', 'Jam the bus tie', 'Free the bus tie'],
  ['air_filter', 'clogged', 'Clog the air filter', 'Clean the air filter'],
  ['emergency_stop', 'pressed', 'Press emergency stop', 'Release emergency stop'],
]

/** What the events call things, and what people do. */
const STATES = {
  'state.engine': 'State',
  'state.transfer': 'Transfer',
  'state.genset': 'Genset',
  'state.src1': 'Source 1',
  'state.src2': 'Source 2',
  mode: 'Mode',
}
const BREAKERS = {
  mains: 'Mains breaker',
  genset: 'Genset breaker',
  busbar: 'Busbar breaker',
  load: 'Load breaker',
  src1: 'QS1',
  src2: 'QS2',
  tie: 'QTIE',
}

const $ = (id) => document.getElementById(id)
/** Belongs to the controller that is shown now; another one begins anew. */
let shown
/** The point that says what it is doing, in more words than the vocabulary has. */
let statePoint
let controllers = []
let asking

/** An element with properties, and what is in it. */
function h(name, properties = {}, ...children) {
  const { aria = {}, ...rest } = properties
  const made = Object.assign(document.createElement(name), rest)
  for (const [key, value] of Object.entries(aria)) made.setAttribute(`aria-${key}`, value)
  made.append(...children)
  return made
}

class Refused extends Error {
  constructor(status, detail) {
    super(detail)
    this.status = status
  }
}

/** One request to the API; what it refuses is an error with its sentence. */
async function ask(path, method = 'GET', body) {
  const token = sessionStorage.getItem(TOKEN)
  const headers = {
    ...(token && { authorization: `Bearer ${token}` }),
    ...(body && { 'content-type': 'application/json' }),
  }
  const url = new URL(`api/v1/controllers${path}`, document.baseURI)
  const answer = await fetch(url, { method, headers, body: body && JSON.stringify(body) })
  const said = await answer.json().catch(() => ({}))
  if (!answer.ok) throw new Refused(answer.status, said.detail ?? `the imitation answers ${answer.status}`)
  return said
}

function tell(problem) {
  $('problem').hidden = !problem
  // Told again it would be heard again.
  if ($('problem').textContent !== problem) $('problem').textContent = problem
}

function failed(error) {
  const isRefused = error instanceof Refused
  if (isRefused && error.status === 401) {
    $('token').hidden = false
    $('site').hidden = true
  }
  if (!isRefused || error.status === 404) controllers = []
  // What was not heard lately looks it.
  $('site').classList.toggle('lost', !isRefused)
  tell(isRefused ? error.message : 'No connection to the imitation. What is shown is as it was last heard.')
}

/** Does something to the controller that is shown, says so, and shows what became of it. */
async function act(said, path, method, body) {
  try {
    await ask(`/${shown.id}${path}`, method, body)
    $('said').textContent = said
    await refresh()
    return true
  } catch (error) {
    failed(error)
    return false
  }
}

const pull = (lever, position) =>
  act(`${lever.name}: ${worded(lever, position)}`, `/levers/${lever.id}`, 'PUT', { position })
const worded = (lever, position) =>
  typeof position === 'number' ? `${round(position)} ${unitOf(lever.numbers)}`.trim() : spaced(position)
/** A unit as people write it. */
const unitOf = (numbers) =>
  ({ degC: '°C', deg: '°', 'm3/min': 'm³/min' })[numbers?.unit] ?? numbers?.unit ?? ''
const spaced = (word) => word.replaceAll('_', ' ')
const round = (number) => Math.round(number * 100) / 100
const isHealthy = (lever) => lever.back === null
/** Seconds as a clock shows them. */
function clock(seconds) {
  const part = (of) => String(Math.floor(of) % 60).padStart(2, '0')
  return `${Math.floor(seconds / 3600)}:${part(seconds / 60)}:${part(seconds)}`
}
const leverOf = (id) => shown.levers.find((lever) => lever.id === id)

/**
 * Puts new children into an element only where they are others. Whoever was at one of them by keyboard is at the one in
 * its place afterwards, or where nothing is left at the heading.
 */
function fill(element, key, make) {
  const now = JSON.stringify(key)
  if (element.dataset.key === now) return
  element.dataset.key = now
  const places = () => [...element.querySelectorAll('a, button, select')]
  const place = places().indexOf(document.activeElement)
  element.replaceChildren(...make())
  if (place < 0) return
  const there = places()
  const next = there[Math.min(place, there.length - 1)] ?? element.parentElement.querySelector('[tabindex]')
  next?.focus()
}

function showControllers() {
  fill($('controllers'), [controllers.map(({ id, name }) => [id, name]), shown?.id], () =>
    controllers.map(({ id, name }) =>
      h('a', { href: `#${id}`, aria: id === shown?.id ? { current: 'page' } : {} }, name),
    ),
  )
}

function showPlant(values) {
  const { vendor, model, unit, endpoints, seed } = shown
  $('name').textContent = shown.name
  $('about').textContent = `${vendor} ${model}, unit ${unit} at ${endpoints.join(', ')}, seed ${seed}`
  const state = values.get(statePoint)?.value
  const mode = values.get('mode')?.value
  $('state').textContent = `State: ${spaced(state ?? 'not known')} · Mode: ${spaced(mode ?? 'not known')}`
  $('drawing').replaceChildren(draw(shown, values))
  const active = shown.active.length > 0 ? shown.active : [{ label: 'No alarm is active' }]
  fill($('active'), [shown.id, active], () =>
    active.map(({ class: kind, label }) =>
      h('li', { className: kind ?? '' }, kind ? h('strong', {}, spaced(kind)) : '', ` ${label}`),
    ),
  )
  showScenario()
}

function showScenario() {
  const { scenario } = shown
  $('scenario').hidden = !scenario
  if (!scenario) return
  const { title, steps, taken, failed, held } = scenario
  const ends = { true: 'over, all expectations held', false: `over, ${failed} failed` }
  const goesOn = `step ${taken} of ${steps}${failed > 0 ? `, ${failed} failed` : ''}`
  $('scenario').textContent = `Scenario: ${title}, ${ends[held] ?? goesOn}`
}

/** One thing that was done, and what undoes it. */
const done = (what, undo, name, act) =>
  h('li', {}, h('span', {}, what), h('button', { onclick: act, aria: { label: name } }, undo))

/** Everything that is not as it was: levers, injected alarms, pinned points. */
function showPulled(pins) {
  const levers = shown.levers.filter((lever) => !isHealthy(lever))
  const count = levers.length + shown.injected.length + pins.length
  $('nothing').hidden = count > 0
  $('normal').hidden = count === 0
  const held = levers.map(({ id, position, back, words }) => [id, words.length > 0 ? position : back])
  fill($('pulled'), [shown.id, held, shown.injected.map(({ id }) => id), pins], () => [
    ...levers.map((lever) =>
      done(`${lever.name}: ${worded(lever, lever.position)}`, 'Put back', `Put ${lever.name} back`, () =>
        pull(lever, lever.back),
      ),
    ),
    ...shown.injected.map(({ id, label, class: kind }) =>
      done(`${label} (${spaced(kind)}): injected`, 'Let go', `Let ${label} go`, () =>
        act(`${label}: let go`, `/alarms/${id}`, 'DELETE'),
      ),
    ),
    ...pins.map(({ point, value }) =>
      done(`${point} = ${value ?? 'absent'}: pinned`, 'Let go', `Let ${point} go`, () =>
        act(`${point}: let go`, `/pins/${point}`, 'DELETE'),
      ),
    ),
  ])
}

/** An event as people tell it. */
function told(text) {
  const [, signal, label] = /^([\w.]+) .*?\((.*)\)$/.exec(text) ?? []
  if (STATES[signal]) return `${STATES[signal]}: ${label}`
  const [, not, breaker] = /^(not )?breaker\.(\w+)\.closed$/.exec(text) ?? []
  if (breaker) return `${BREAKERS[breaker] ?? `Breaker ${breaker}`} ${not ? 'open' : 'closed'}`
  if (/^(not )?mains\.failed$/.test(text))
    return text.startsWith('not') ? 'The mains are back' : 'The mains have failed'
  return text.charAt(0).toUpperCase() + spaced(text.slice(1))
}

function showLately(events) {
  const latest = events.slice(0, LATEST)
  fill($('lately'), [shown.id, latest], () =>
    latest.length > 0
      ? latest.map(({ at_s, kind, text }) =>
          h(
            'li',
            { className: kind },
            h('span', { className: 'time' }, clock(at_s)),
            h('span', {}, told(text)),
          ),
        )
      : [h('li', {}, 'Nothing has happened since this imitation was started.')],
  )
}

function showClock() {
  const { time_s, speed, paused } = shown.clock
  $('time').textContent = clock(time_s)
  $('paused').hidden = !paused
  const speeds = [...new Set([...SPEEDS, speed])].sort((one, other) => one - other)
  fill($('clock'), [shown.id, paused, speed], () => [
    h('button', { onclick: () => change({ paused: !paused }) }, paused ? 'Go on' : 'Pause'),
    ...Object.entries(STEPS).map(([name, seconds]) =>
      h('button', { onclick: () => act(`Stepped ${name}`, '/steps', 'POST', { seconds }) }, `+ ${name}`),
    ),
    h(
      'label',
      {},
      'Speed',
      h(
        'select',
        { onchange: ({ target }) => change({ speed: Number(target.value) }) },
        ...speeds.map((each) => h('option', { value: each, selected: each === speed }, `${each} ×`)),
      ),
    ),
  ])
}

const change = (to) =>
  act('paused' in to ? (to.paused ? 'Paused' : 'Goes on') : `Speed ${to.speed}`, '/clock', 'PUT', to)

function showSwitches() {
  const known = SWITCHES.filter(([id]) => leverOf(id))
  $('switches').parentElement.hidden = known.length === 0
  fill($('switches'), [shown.id, known.map(([id]) => isHealthy(leverOf(id)))], () =>
    known.map(([id, to, name, undo]) => {
      const lever = leverOf(id)
      const back = undo !== undefined && !isHealthy(lever)
      const position = back ? lever.back : to
      return h('button', { className: 'big', onclick: () => pull(lever, position) }, back ? undo : name)
    }),
  )
}

function showLevers() {
  fill($('levers'), [shown.id], () => shown.levers.map(leverForm))
  find()
  $('levers').parentElement.hidden = shown.levers.length === 0
  for (const lever of shown.levers) {
    const form = document.querySelector(`#levers [data-lever="${lever.id}"]`)
    form.querySelector('small').textContent = worded(lever, lever.position)
    const meaning = lever.words.find((word) => word.id === lever.position)?.meaning ?? ''
    form.querySelector('p').textContent = meaning
    for (const button of form.querySelectorAll('[data-word]'))
      button.setAttribute('aria-pressed', button.dataset.word === lever.position)
  }
}

/** Shows the levers whose name, id or words hold what is looked for. */
function find() {
  const wanted = $('find').value.trim().toLowerCase()
  for (const form of document.querySelectorAll('#levers [data-lever]'))
    form.hidden = !`${form.textContent} ${form.dataset.lever}`.toLowerCase().includes(wanted)
}

function leverForm(lever) {
  const { numbers } = lever
  const form = h(
    'fieldset',
    {},
    h('legend', {}, `${lever.name} `, h('small')),
    h(
      'div',
      { className: 'row' },
      ...lever.words.map(({ id, meaning }) => {
        const button = h('button', { title: meaning, onclick: () => pull(lever, id) }, spaced(id))
        button.dataset.word = id
        return button
      }),
      ...(numbers ? [numberForm(numbers, lever.name, (to) => pull(lever, to))] : []),
    ),
    h('p'),
  )
  form.dataset.lever = lever.id
  return form
}

function numberForm(numbers, name, set) {
  const { min, max } = numbers
  const input = h('input', { type: 'number', min, max, step: 'any', required: true, aria: { label: name } })
  input.placeholder = `${min} to ${max}`
  const onsubmit = (event) => {
    event.preventDefault()
    void set(Number(input.value))
  }
  return h(
    'form',
    { className: 'row', onsubmit },
    h('label', {}, input, unitOf(numbers)),
    h('button', {}, 'Set'),
  )
}

/** What does not change by itself: asked for once, when another controller is shown. */
async function begin(id) {
  const [alarms, points] = await Promise.all([ask(`/${id}/alarms`), ask(`/${id}/points`)])
  statePoint = points.find(({ signal }) => signal === 'state.transfer' || signal === 'state.engine')?.id
  $('alarms').replaceChildren(...alarms.map(({ id, label }) => h('option', { value: id, label })))
  $('points').replaceChildren(...points.map(({ id, name }) => h('option', { value: id, label: name })))
  for (const form of [$('inject'), $('pin')]) form.reset()
  await showSettings(id)
}

async function showSettings(id) {
  const settings = await ask(`/${id}/settings`)
  const set = (setting) => async (value) => {
    if (await act(`${setting.name}: ${value}`, `/settings/${setting.id}`, 'PUT', { value }))
      await showSettings(id)
  }
  $('settings').parentElement.hidden = settings.length === 0
  $('settings').replaceChildren(
    ...settings.map((setting) =>
      h(
        'fieldset',
        {},
        h('legend', {}, `${setting.name} `, h('small', {}, `${round(setting.value)} ${unitOf(setting)}`)),
        numberForm(setting, setting.name, set(setting)),
      ),
    ),
  )
}

/** Asks for everything that is shown and shows it. One at a time: what asks meanwhile waits for the next. */
async function refresh() {
  while (asking) await asking
  asking = show().finally(() => (asking = undefined))
  await asking
}

async function show() {
  // Which there are does not change while the imitation runs; another one may have taken its place.
  if (controllers.length === 0) controllers = await ask('')
  const chosen = controllers.find(({ id }) => location.hash === `#${id}`) ?? controllers[0]
  if (!chosen) return
  const { id } = chosen
  if (id !== shown?.id) await begin(id)
  const state = statePoint ? ask(`/${id}/values?name=${statePoint}`) : []
  const asked = [ask(`/${id}`), ask(`/${id}/values`), state, ask(`/${id}/pins`), ask(`/${id}/events`)]
  const [next, signals, more, pins, events] = await Promise.all(asked)
  shown = next
  document.title = `${shown.name} · Imitation`
  showControllers()
  showPlant(new Map([...signals, ...more].map((value) => [value.name, value])))
  showClock()
  showSwitches()
  showLevers()
  showPulled(pins)
  showLately(events)
  $('token').hidden = true
  $('site').hidden = false
}

async function live() {
  for (;;) {
    if (!document.hidden) {
      try {
        await refresh()
        if ($('site').classList.replace('lost', 'heard')) tell('')
      } catch (error) {
        failed(error)
      }
    }
    await new Promise((later) => setTimeout(later, EVERY_MS))
  }
}

$('inject').addEventListener('submit', (event) => {
  event.preventDefault()
  const alarm = new FormData(event.target).get('alarm').trim()
  tell('')
  void act(`${alarm}: injected`, `/alarms/${encodeURIComponent(alarm)}`, 'PUT')
})

$('pin').addEventListener('submit', (event) => {
  event.preventDefault()
  const [point, value] = ['point', 'value'].map((name) => new FormData(event.target).get(name).trim())
  tell('')
  void act(`${point}: pinned`, `/pins/${encodeURIComponent(point)}`, 'PUT', { value })
})

$('token').addEventListener('submit', (event) => {
  event.preventDefault()
  sessionStorage.setItem(TOKEN, new FormData(event.target).get('token'))
  tell('')
  void refresh().catch(failed)
})

$('normal').addEventListener('click', () => {
  // It goes away with what it undoes.
  $('pulled-title').focus()
  void act('All back to normal', '/normal', 'PUT')
})

$('find').addEventListener('input', find)
addEventListener('hashchange', () => void refresh().catch(failed))
document.addEventListener('click', () => tell(''), { capture: true })
void live()
