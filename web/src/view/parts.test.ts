// Parts of the page alone, on devices that a test makes: search, units, what a device should be, many of them.
import { flushSync, mount, unmount, type Component } from 'svelte'
import { afterAll, afterEach, beforeAll, beforeEach, describe, expect, test, vi } from 'vitest'
import { alarm, device as deviceView, group, point, snapshot, stamp, START, value } from '../logic/samples'
import type { DeviceView, GroupView, ValueView } from '../logic/types'
import { Page } from '../state/page.svelte'
import { Device } from '../state/site.svelte'
import { tilesOf } from '../logic/vitals'
import ConfigBanner from './ConfigBanner.svelte'
import { PAGE } from './context'
import DevicePage from './DevicePage.svelte'
import Overview from './Overview.svelte'
import SkipLink from './SkipLink.svelte'
import { units } from './units.svelte'

let page: Page
let part: Record<string, unknown>

function put<Props extends Record<string, unknown>>(component: Component<Props>, props: Props): void {
  part = mount(component, { target: document.body, props, context: new Map([[PAGE, page]]) })
  flushSync()
}

function made(id: string, groups: GroupView[], values: ValueView[], rest: Partial<DeviceView> = {}): Device {
  const device = new Device(deviceView(id, rest))
  device.groups = groups
  device.glance = tilesOf(groups)
  device.take(values, [])
  return device
}

const one = (selector: string) => document.querySelector<HTMLElement>(selector)!
const all = (selector: string) => [...document.querySelectorAll<HTMLElement>(selector)]
const text = (element: Element | null) => element?.textContent?.replace(/\s+/g, ' ').trim() ?? ''

function type(query: string): void {
  const field = one('input[type=search]') as HTMLInputElement
  field.value = query
  field.dispatchEvent(new Event('input', { bubbles: true }))
  flushSync()
}

function press(key: string, at: EventTarget = document.body): void {
  at.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true, cancelable: true }))
  flushSync()
}

/** What is watched for coming near; the page has one observer for all of it. */
const watched = new Map<Element, (entries: unknown[]) => void>()
const seen = (target: Element, near: boolean) => {
  watched.get(target)?.([{ target, isIntersecting: near }])
  flushSync()
}
const before = globalThis.IntersectionObserver

beforeAll(() => {
  globalThis.IntersectionObserver = class {
    constructor(private act: (entries: unknown[]) => void) {}
    observe = (element: Element) => void watched.set(element, this.act)
    unobserve = (element: Element) => void watched.delete(element)
  } as unknown as typeof IntersectionObserver
})

afterAll(() => {
  globalThis.IntersectionObserver = before
})

beforeEach(() => {
  vi.useFakeTimers({ now: START + 2000, toFake: ['Date', 'setTimeout', 'clearTimeout'] })
  page = new Page(() => ({ addEventListener: () => undefined, close: () => undefined }))
  page.stream.phase = 'live'
  page.site.view = snapshot([]).site
})

afterEach(async () => {
  await unmount(part)
  units.set({ pressure: undefined, temperature: undefined })
  localStorage.clear()
  vi.useRealTimers()
  vi.unstubAllGlobals()
})

const OIL = point('oil', { name: 'Oil pressure', unit: 'bar', signal: 'engine.oil.pressure', address: 10361 })
const HEAT = point('heat', { name: 'Coolant', unit: 'degC', signal: 'engine.coolant.temperature' })
const BITS = point('bits', {
  name: 'Alarms',
  type: 'bits',
  bits: [
    { bit: 1, id: 'estop', label: 'Emergency stop', class: 'shutdown' },
    { bit: 2, id: 'fuel', label: 'Low fuel', class: 'warning' },
  ],
})
const PHASES = ['l1', 'l2', 'l3'].map((phase) =>
  point(`mains_${phase}_voltage`, { name: `Mains phase ${phase.toUpperCase()} voltage`, unit: 'V' }),
)
const GROUPS = [
  group('Engine', [OIL, HEAT]),
  group('Words', [BITS]),
  group('Mains', PHASES),
  group('Display', [point('lcd', { name: 'Image', rate: 'on_demand' })], { rate: 'on_demand' }),
]
const VALUES = [value('oil', 3.4), value('heat', 39.8), value('bits', ['Low fuel'], { set: [2] })]

describe('the points of a controller', () => {
  beforeEach(() => put(DevicePage, { device: made('gen1', GROUPS, VALUES) }))

  test('are drawn where their group is open, and counted', () => {
    expect(text(one('search [role=status]'))).toBe('7 points')
    expect(one('[data-point=oil]')).not.toBeNull()
    expect(one('[data-point=lcd]')).toBeNull()
  })

  test('are found by a word, marked, and all are back when Escape is pressed', () => {
    type('oil')
    expect(all('[data-point]').map(({ dataset }) => dataset.point)).toEqual(['oil'])
    expect(all('mark').map(text)).toEqual(['Oil'])
    expect(text(one('search [role=status]'))).toBe('1 of 7 points')
    press('Escape', one('input[type=search]'))
    expect(all('[data-point]')).toHaveLength(4)
  })

  test('a group that was closed shows what was found in it, and is closed again after', () => {
    type('image')
    expect(one('[data-point=lcd]')).not.toBeNull()
    type('')
    expect(one('[data-point=lcd]')).toBeNull()
  })

  test('a bit that was found says whether it is set', () => {
    type('emergency')
    expect(text(one('.why'))).toBe('bit 1 Emergency stop: clear')
    type('low fuel')
    expect(text(one('.why'))).toBe('bit 2 Low fuel: set')
  })

  test('one phase that was found stands with the others, under its name', () => {
    type('mains_l2')
    expect(all('[data-point]')).toHaveLength(1)
    expect(text(one('.why'))).toBe('L2 id mains_l2_voltage')
  })

  test('that match nothing are said to be none, with what can be searched', () => {
    type('nonsense')
    expect(text(document.body)).toContain('No point matches. Names, groups, ids, signals')
    one('.none button').click()
    flushSync()
    expect(all('[data-point]')).toHaveLength(4)
  })

  test('/ goes to the search, but is a letter where somebody writes', () => {
    press('/')
    expect(document.activeElement).toBe(one('input[type=search]'))
    const event = new KeyboardEvent('keydown', { key: '/', bubbles: true, cancelable: true })
    one('input[type=search]').dispatchEvent(event)
    expect(event.defaultPrevented).toBe(false)
  })

  test('all groups close and open at once', () => {
    one('.turn').click()
    flushSync()
    expect(all('[data-point]')).toHaveLength(0)
    one('.turn').click()
    flushSync()
    expect(all('[data-point]')).toHaveLength(5)
  })

  test('are read in the unit that was chosen, at a glance too, and raw stays raw', () => {
    const select = (name: string, unit: string) => {
      const box = all('select').find((box) =>
        text(box.closest('label')).startsWith(name),
      ) as HTMLSelectElement
      box.value = unit
      box.dispatchEvent(new Event('change', { bubbles: true }))
      flushSync()
    }
    select('Pressure', 'kPa')
    select('Temperature', 'degF')
    expect(text(one('[data-point=oil] .values'))).toBe('340')
    expect(text(one('[data-point=oil] > .unit'))).toBe('kPa')
    expect(text(one('[data-point=heat] .values'))).toBe('103.6')
    expect(text(one('[aria-label="At a glance"]'))).toBe('Oil pressure 340 kPa Coolant 103.6 °F')
    one('[data-point=oil] > button').click()
    flushSync()
    expect(text(one('[data-point=oil] dl'))).toContain('As given 3.4 bar')
    expect(text(one('[data-point=oil] dl'))).toContain('Registers 0000')
    expect(localStorage.getItem('busbar.units')).toBe('{"pressure":"kPa","temperature":"degF"}')
    select('Pressure', '')
    expect(text(one('[data-point=oil] > .unit'))).toBe('bar')
  })
})

test('an address is copied by a press, without TLS too, and the focus stays', async () => {
  put(DevicePage, { device: made('gen1', GROUPS, VALUES) })
  const copied: string[] = []
  vi.stubGlobal('navigator', { clipboard: undefined })
  document.execCommand = () => {
    copied.push((document.activeElement as HTMLTextAreaElement).value)
    return true
  }
  one('[data-point=oil] > button').click()
  flushSync()
  const button = one('[aria-label="Copy address 10361"]')
  button.focus()
  button.click()
  await vi.waitFor(() => expect(copied).toEqual(['10361']))
  await vi.waitFor(() => {
    flushSync()
    expect(text(one('[data-point=oil] dd'))).toContain('copied')
  })
  expect(document.activeElement).toBe(button)
})

describe('another device', () => {
  const detail = 'it says that it is a D-300, and the site file wants a D-500'
  const wrong: Partial<DeviceView> = {
    identity: { verdict: 'wrong', detail, checked: stamp(0) },
    fault: `Genset gen1 is not what the site file says: ${detail}`,
    state: { code: 1, label: 'Old state', canonical: null, timer_s: 5 },
    mode: { code: 1, label: 'Old mode', canonical: null },
  }

  test('has no values on the card, and is said to be another', () => {
    page.site.devices = [made('gen1', GROUPS, VALUES, wrong)]
    put(Overview, {})
    const card = text(one('[data-device=gen1]'))
    expect(card).toContain('Another device answers here.')
    expect(card).toContain(detail)
    for (const old of ['Old state', 'Old mode', '3.4', 'Online', 'No active alarms'])
      expect(card).not.toContain(old)
    expect(text(one('[aria-label=Site].sum'))).toContain('0 of 1 controller answering')
    expect(text(one('[aria-label=Site].sum'))).toContain('1 where another device answers')
  })

  test('has no values on its page', () => {
    put(DevicePage, { device: made('gen1', GROUPS, VALUES, wrong) })
    expect(text(one('.fault'))).toContain('Another device answers here, so no values are shown.')
    expect(all('[data-point]')).toHaveLength(0)
    expect(text(one('.alarms'))).toContain('not known')
    expect(text(document.body)).not.toContain('Old')
  })
})

test('a mode that is not the desired one says so in words and with a sign', () => {
  const manual = { code: 2, label: 'MANUAL', canonical: 'manual' }
  const device = made('gen1', GROUPS, VALUES, { mode: manual, desired: { mode: 'auto', met: false } })
  page.site.devices = [device]
  put(Overview, {})
  expect(text(one('.doing'))).toContain('MANUAL should be AUTO')
  expect(one('.differs svg')).not.toBeNull()
  expect(text(one('.sum'))).toContain('1 not as desired')
  device.view = { ...device.view, mode: null, desired: { mode: 'auto', met: null } }
  flushSync()
  expect(text(one('.doing'))).toContain('not known should be AUTO')
  expect(one('.differs')).toBeNull()
  expect(text(one('.sum'))).not.toContain('desired')
  device.view = { ...device.view, mode: manual, desired: { mode: 'manual', met: true } }
  flushSync()
  expect(text(one('.doing'))).not.toContain('should')
})

test('the nameplate gives load, litres and volts a measure; a value that is bad has none', () => {
  const groups = [
    group('Genset', [
      point('kw', { unit: 'kW', signal: 'genset.power.active' }),
      point('fuel', { unit: '%', signal: 'fuel.level' }),
      point('volts', { unit: 'V', signal: 'battery.voltage' }),
    ]),
  ]
  const nameplate = { power_kw: 110, tank_l: 900, battery_v: 24 }
  const device = made('gen1', groups, [value('kw', 55), value('fuel', 50), value('volts', 23.1)], {
    nameplate,
  })
  page.site.devices = [device]
  put(Overview, {})
  const card = () => text(one('[data-device=gen1]'))
  expect(card()).toContain('55 kW 50 % of 110 kW')
  expect(card()).toContain('about 450 L of 900 L')
  expect(card()).toContain('below 24 V nominal')
  expect(all('rect.part').map((bar) => bar.getAttribute('width'))).toEqual(['50', '50'])
  device.take([value('kw', 55, { quality: 'bad' })], [])
  flushSync()
  expect(card()).not.toContain('of 110 kW')
})

test('a state that is not current is marked, in words too', () => {
  const state = { code: 1, label: 'Genset on load', canonical: 'loaded', timer_s: null }
  page.site.devices = [made('gen1', GROUPS, VALUES, { state, online: false, fault: 'gone' })]
  put(Overview, {})
  expect(text(one('.doing'))).toContain('stale: Genset on load')
})

describe('many controllers', () => {
  beforeEach(() => {
    const modes = [true, false, null]
    page.site.devices = Array.from({ length: 200 }, (_, index) =>
      made(`gen${index}`, GROUPS, VALUES, { desired: { mode: 'auto', met: modes[index % 3] ?? null } }),
    )
    page.site.devices[190]!.alarms = [alarm('gen190', 1, 'shutdown')]
    page.site.devices[190]!.view = {
      ...page.site.devices[190]!.view,
      alarms: { shutdown: 1, load_dump: 0, trip: 0, warning: 0, indication: 0 },
    }
  })

  test('are listed all, drawn while near, searched, chosen and put in order', async () => {
    put(Overview, {})
    await vi.waitFor(() => {
      flushSync()
      expect(text(one('.bar [role=status]'))).toBe('200 of 200 shown')
    }, 5000)
    expect(all('[data-device]')).toHaveLength(200)
    expect(all('[data-device] .doing')).toHaveLength(0)
    seen(one('[data-device=gen5]'), true)
    expect(all('[data-device] .doing')).toHaveLength(1)
    expect(text(one('[data-device=gen5]'))).toContain('Oil pressure 3.4 bar')
    seen(one('[data-device=gen5]'), false)
    expect(all('[data-device] .doing')).toHaveLength(0)

    type('genset gen19')
    expect(all('[data-device]')).toHaveLength(11)
    type('nobody')
    expect(text(document.body)).toContain('No controller is like that.')
    one('.none button').click()
    flushSync()

    const show = all('select').find((box) =>
      text(box.closest('label')).startsWith('Show'),
    ) as HTMLSelectElement
    show.value = 'differs'
    show.dispatchEvent(new Event('change', { bubbles: true }))
    flushSync()
    expect(all('[data-device]')).toHaveLength(67)
    show.value = 'all'
    show.dispatchEvent(new Event('change', { bubbles: true }))
    one('input[type=checkbox]').click()
    flushSync()
    expect(one('[data-device]').dataset.device).toBe('gen190')
  }, 30_000)
})

test('the lines of a controller with very many points are drawn while they are near', () => {
  const points = Array.from({ length: 2000 }, (_, index) => point(`p${index}`, { name: `Point ${index}` }))
  put(DevicePage, { device: made('gen1', [group('All', points)], []) })
  expect(text(one('search [role=status]'))).toBe('2000 points')
  expect(all('[data-point]')).toHaveLength(0)
  const pieces = [...watched.keys()]
  seen(pieces[1]!, true)
  expect(all('[data-point]').map(({ dataset }) => dataset.point)).toEqual(
    points.slice(40, 80).map(({ id }) => id),
  )
  seen(pieces[1]!, false)
  expect(all('[data-point]')).toHaveLength(0)
  type('Point 1999')
  expect(text(one('search [role=status]'))).toBe('1 of 2000 points')
  seen([...watched.keys()][0]!, true)
  expect(all('[data-point]').map(({ dataset }) => dataset.point)).toEqual(['p1999'])
})

test('a site file that was refused is told with when and why, until one is accepted', () => {
  put(ConfigBanner, {})
  expect(text(document.body)).not.toContain('refused')
  const site = snapshot([]).site
  const reason = 'site.toml:14:1: the wire `line` is not defined <b>'
  page.site.view = {
    ...site,
    time_zone: 'Asia/Kathmandu',
    config: { loaded: stamp(0), refused: { at: stamp(1), reason } },
  }
  flushSync()
  expect(text(document.body)).toContain('The new site file was refused at 09:45:01 Asia/Kathmandu.')
  expect(text(document.body)).toContain('The one loaded at 09:45:00 Asia/Kathmandu goes on running.')
  expect(one('.reason').textContent).toBe(reason)
  page.site.view = site
  flushSync()
  expect(text(document.body)).not.toContain('refused')
})

test('the skip link leads to the values', () => {
  const main = document.body.appendChild(document.createElement('main'))
  put(SkipLink, {})
  one('button').click()
  expect(document.activeElement).toBe(main)
  main.remove()
})
