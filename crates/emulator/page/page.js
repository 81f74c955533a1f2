// The page of the imitation: asks for each controller's state once a second, and has its switches.
import { draw } from './plant.js'

const EVERY_MS = 1000
const STEPS = { '1 s': 1, '10 s': 10, '1 min': 60, '10 min': 600 }
const SPEEDS = [0.1, 1, 2, 5, 10, 60, 600, 3600]
const TOKEN = 'busbar-imitation-token'

/** What a person most often wants to happen: lever, position, what it is called, and what undoes it. */
const SWITCHES = [
  ['mains', 'failed', 'Fail the mains', 'Give the mains back'],
  ['src1', 'failed', 'Fail source 1', 'Give source 1 back'],
  ['src2', 'failed', 'Fail source 2', 'Give source 2 back'],
  ['tank', 0, 'Drain the tank'],
  ['tank', 100, 'Fill the tank'],
  ['radiator', 'blocked', 'Block the radiator', 'Clear the radiator'],
  ['emergency_stop', 'pressed', 'Press emergency stop', 'Release emergency stop'],
]

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
const unitOf = (numbers) => ({ degC: '°C', deg: '°' })[numbers?.unit] ?? numbers?.unit ?? ''
const spaced = (word) => word.replaceAll('_', ' ')
const round = (number) => Math.round(number * 100) / 100
const isHealthy = (lever) => lever.words.length === 0 || lever.position === lever.words[0].id
const leverOf = (id) => shown.levers.find((lever) => lever.id === id)

/** Puts new children into an element only where they are others, so that what has the focus keeps it. */
function fill(element, key, make) {
  const now = JSON.stringify(key)
  if (element.dataset.key === now) return
  element.dataset.key = now
  element.replaceChildren(...make())
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
  const pulled = shown.levers.filter((lever) => !isHealthy(lever) && typeof lever.position === 'string')
  const list = pulled.map((lever) => `${lever.name} (${spaced(lever.position)})`)
  $('pulled').textContent = list.length > 0 ? `Pulled: ${list.join(' · ')}` : 'Nothing is pulled.'
}

function showClock() {
  const { time_s, speed, paused } = shown.clock
  const part = (seconds, of) => String(Math.floor(seconds) % of).padStart(2, '0')
  $('time').textContent = `${Math.floor(time_s / 3600)}:${part(time_s / 60, 60)}:${part(time_s, 60)}`
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

const change = (clock) =>
  act(
    'paused' in clock ? (clock.paused ? 'Paused' : 'Goes on') : `Speed ${clock.speed}`,
    '/clock',
    'PUT',
    clock,
  )

function showSwitches() {
  const known = SWITCHES.filter(([id]) => leverOf(id))
  $('switches').parentElement.hidden = known.length === 0
  fill($('switches'), [shown.id, known.map(([id]) => isHealthy(leverOf(id)))], () =>
    known.map(([id, to, name, undo]) => {
      const lever = leverOf(id)
      const back = undo !== undefined && !isHealthy(lever)
      const position = back ? lever.words[0].id : to
      return h('button', { className: 'big', onclick: () => pull(lever, position) }, back ? undo : name)
    }),
  )
}

function showLevers() {
  fill($('levers'), [shown.id], () => shown.levers.map(leverForm))
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

function showAlarms() {
  fill($('injected'), [shown.id, shown.injected.map(({ id }) => id)], () =>
    shown.injected.map(({ id, label, class: kind }) =>
      h(
        'li',
        {},
        h('span', {}, `${label} (${spaced(kind)})`),
        h(
          'button',
          {
            onclick: () => act(`${label}: let go`, `/alarms/${id}`, 'DELETE'),
            aria: { label: `Let ${label} go` },
          },
          'Let go',
        ),
      ),
    ),
  )
}

function showPins(pins) {
  fill($('pinned'), [shown.id, pins], () =>
    pins.map(({ point, value }) =>
      h(
        'li',
        {},
        h('span', {}, `${point} = ${value}`),
        h(
          'button',
          {
            onclick: () => act(`${point}: let go`, `/pins/${point}`, 'DELETE'),
            aria: { label: `Let ${point} go` },
          },
          'Let go',
        ),
      ),
    ),
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
  const asked = [ask(`/${id}`), ask(`/${id}/values`), state, ask(`/${id}/pins`)]
  const [next, signals, more, pins] = await Promise.all(asked)
  shown = next
  document.title = `${shown.name} · Imitation`
  showControllers()
  showPlant(new Map([...signals, ...more].map((value) => [value.name, value])))
  showClock()
  showSwitches()
  showLevers()
  showAlarms()
  showPins(pins)
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

addEventListener('hashchange', () => void refresh().catch(failed))
document.addEventListener('click', () => tell(''), { capture: true })
void live()
