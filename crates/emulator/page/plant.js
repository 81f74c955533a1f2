// Draws the plant of a controller as SVG, out of the values that a client reads and the levers that are pulled.

const SVG = 'http://www.w3.org/2000/svg'
/** Below this a line is dead, V. */
const ALIVE = 20

function element(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name)
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value)
  made.append(...children)
  return made
}

const path = (d, kind) => element('path', { d, class: kind })
const text = (x, y, kind, ...words) => element('text', { x, y, class: kind }, words.join(' '))
const line = (d, live) => path(d, live ? 'live' : 'dead')

/** A number with its unit, as a person reads it; a dash where nobody can tell. */
function shown(value, decimals = 0) {
  if (typeof value?.value !== 'number') return '–'
  const unit = { degC: '°C' }[value.unit] ?? value.unit ?? ''
  return `${value.value.toFixed(decimals)} ${unit}`.trim()
}

/** What there is to draw from: values by name, and where levers stand. */
class Look {
  constructor(values, levers) {
    this.values = values
    this.levers = levers
  }

  get(name) {
    return this.values.get(name)
  }

  word(name) {
    return String(this.get(name)?.value ?? 'not known').replaceAll('_', ' ')
  }

  /** The voltages of three phases. */
  phases(source) {
    return ['l1', 'l2', 'l3'].map((phase) => this.get(`${source}.${phase}.voltage`)?.value)
  }

  isLive(source) {
    return this.phases(source).some((volts) => volts > ALIVE)
  }

  isClosed(breaker) {
    return this.get(`breaker.${breaker}.closed`)?.value === true
  }

  /** The word that a lever stands at, where it is not that of a healthy plant. */
  pulled(id) {
    const lever = this.levers.find((lever) => lever.id === id)
    return lever && lever.words.length > 0 && lever.position !== lever.words[0].id
      ? String(lever.position).replaceAll('_', ' ')
      : undefined
  }
}

/** Three voltages with one unit. */
function voltages(phases) {
  const known = phases.filter((volts) => volts !== undefined)
  const [scale, decimals, unit] = Math.max(0, ...known) < 1000 ? [1, 0, 'V'] : [1000, 2, 'kV']
  const shown = phases.map((volts) => (volts === undefined ? '–' : (volts / scale).toFixed(decimals)))
  return `${shown.join('/')} ${unit}`
}

/** A source with a letter or a wave in it, its voltages, its frequency, and what it gives. */
function source(look, id, name, x, letter) {
  const wave = `M${x - 9} 42c4 -10 9 -10 9 0s5 10 9 0`
  return [
    text(x, 14, 'strong middle', name),
    element('circle', { cx: x, cy: 42, r: 18, class: look.isLive(id) ? 'live' : 'dead' }),
    letter ? text(x, 46, 'strong middle', letter) : path(wave, 'body'),
    line(`M${x} 60V86`, look.isLive(id)),
    text(x + 26, 40, '', voltages(look.phases(id))),
    text(x + 26, 55, '', shown(look.get(`${id}.frequency`), 1)),
    ...(look.get(`${id}.power.active`) ? [text(x + 26, 70, '', shown(look.get(`${id}.power.active`)))] : []),
  ]
}

/** A switch in a line that goes down. */
function breaker(look, id, name, x, y, live, lever) {
  const closed = look.isClosed(id)
  const stuck = look.pulled(lever)
  return [
    line(closed ? `M${x} ${y}V${y + 24}` : `M${x} ${y + 24}l-12 -22`, closed && live),
    path(`M${x - 4} ${y - 4}l8 8m-8 0l8 -8`, 'body'),
    text(x + 10, y + 10, '', name),
    text(x + 10, y + 24, 'strong', closed ? 'closed' : 'open'),
    ...(stuck ? [text(x + 10, y + 38, 'wrong', stuck)] : []),
  ]
}

function load(x, y, name, live, power) {
  return [
    line(`M${x} ${y}V${y + 24}`, live),
    path(`M${x - 8} ${y + 24}h16l-8 13z`, 'solid'),
    text(x + 14, y + 24, 'strong', name),
    text(x + 14, y + 38, '', power),
  ]
}

/** Tank, radiator, oil and battery of an engine. */
function supplies(look, y) {
  const level = Math.min(100, Math.max(0, look.get('fuel.level')?.value ?? 0))
  const height = (level / 100) * 44
  const blocked = look.pulled('radiator')
  return [
    element('rect', { x: 12, y: y + 50 - height, width: 50, height, class: 'level' }),
    element('rect', { x: 12, y: y + 6, width: 50, height: 44, class: 'body' }),
    text(12, y + 66, 'strong', 'Tank'),
    text(12, y + 80, '', shown(look.get('fuel.level'))),
    element('rect', { x: 102, y: y + 6, width: 50, height: 44, class: 'body' }),
    path(`M112 ${y + 6}v44m10 -44v44m10 -44v44m10 -44v44`, 'body'),
    ...(blocked ? [path(`M102 ${y + 6}l50 44m0 -44l-50 44`, 'wrong')] : []),
    text(102, y + 66, 'strong', 'Radiator'),
    text(102, y + 80, '', shown(look.get('engine.coolant.temperature'))),
    ...(blocked ? [text(102, y + 94, 'wrong', blocked)] : []),
    ...[
      ['Engine', shown(look.get('engine.speed'))],
      ['Oil', shown(look.get('engine.oil.pressure'))],
      ['Battery', shown(look.get('battery.voltage'), 1)],
    ].flatMap(([name, value], row) => [
      text(200, y + 20 + 22 * row, 'strong', name),
      text(348, y + 20 + 22 * row, 'end', value),
    ]),
  ]
}

function genset(look) {
  const live = { mains: look.isLive('mains'), genset: look.isLive('genset') }
  const feeds = Object.keys(live).filter((id) => live[id] && look.isClosed(id))
  const power = feeds.reduce((sum, id) => sum + (look.get(`${id}.power.active`)?.value ?? 0), 0)
  const fed = feeds.length > 0
  return [
    300,
    ...source(look, 'mains', 'Mains', 50),
    ...source(look, 'genset', 'Genset', 230, 'G'),
    ...breaker(look, 'mains', 'Mains breaker', 50, 86, live.mains, 'breaker.mains'),
    ...breaker(look, 'genset', 'Genset breaker', 230, 86, live.genset, 'breaker.genset'),
    line('M50 110V140M230 110V140', fed),
    path('M20 140H340', fed ? 'live bus' : 'dead'),
    ...load(140, 140, 'Load', fed, fed ? `${power.toFixed(0)} kW` : 'without supply'),
    ...supplies(look, 190),
  ]
}

function transferSwitch(look) {
  const live = { src1: look.isLive('src1'), src2: look.isLive('src2') }
  const own = { 1: live.src1 && look.isClosed('src1'), 2: live.src2 && look.isClosed('src2') }
  const tied = look.isClosed('tie')
  const fed = { 1: own[1] || (tied && own[2]), 2: own[2] || (tied && own[1]) }
  const side = (number, x) => [
    ...source(look, `src${number}`, `Source ${number}`, x),
    ...breaker(look, `src${number}`, `QS${number}`, x, 86, live[`src${number}`], `switch.qs${number}`),
    line(`M${x} 110V150`, fed[number]),
    path(`M${x - 35} 150H${x + 65}`, fed[number] ? 'live bus' : 'dead'),
    ...load(x, 150, `Load ${number}`, fed[number], fed[number] ? 'fed' : 'without supply'),
    text(x - 35, 214, 'dim', look.word(`state.src${number}`)),
  ]
  return [
    226,
    ...side(1, 50),
    ...side(2, 225),
    line(tied ? 'M115 150H190' : 'M115 150H138l24 -14M167 150H190', tied && (fed[1] || fed[2])),
    text(152, 176, 'middle', 'QTIE'),
    text(152, 190, 'strong middle', tied ? 'closed' : 'open'),
  ]
}

function compressor(look) {
  const turning = (look.get('engine.speed')?.value ?? 0) > 0
  const loaded = look.get('compressor.loaded')?.value === true
  return [
    244,
    element('rect', { x: 12, y: 34, width: 64, height: 44, class: 'body' }),
    text(44, 60, 'strong middle', 'Engine'),
    text(44, 94, 'middle', shown(look.get('engine.speed'))),
    line('M76 56H112', turning),
    path('M112 38l44 8v20l-44 8z', 'body'),
    text(112, 28, 'strong', 'Compressor'),
    text(112, 94, '', shown(look.get('compressor.discharge.temperature'))),
    line('M156 56H190M214 56H244', turning && loaded),
    path('M190 46v20l24 -20v20z', loaded ? 'solid' : 'body'),
    text(202, 86, 'middle', 'Load valve'),
    text(202, 100, 'strong middle', loaded ? 'loaded' : 'unloaded'),
    element('rect', { x: 244, y: 26, width: 60, height: 60, rx: 22, class: 'body' }),
    text(274, 18, 'strong middle', 'Receiver'),
    text(274, 60, 'middle', shown(look.get('compressor.discharge.pressure'))),
    path('M304 56h30m-8 -6l10 6l-10 6', 'body'),
    text(348, 44, 'end', 'Air'),
    ...supplies(look, 124),
  ]
}

const DRAWINGS = { genset, transfer_switch: transferSwitch, compressor }

/** The drawing, and in words what is on it. */
export function draw(controller, values) {
  const look = new Look(values, controller.levers)
  const [height, ...parts] = DRAWINGS[controller.kind](look)
  const said = parts.filter((part) => part.tagName === 'text').map((part) => part.textContent)
  const label = `The plant of ${controller.name}: ${said.join(', ')}`
  return element('svg', { viewBox: `0 0 360 ${height}`, role: 'img', 'aria-label': label }, ...parts)
}
