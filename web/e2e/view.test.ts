// What a person does with overview and controller page, in a real browser: on the demonstration, and on sites that are
// larger, stranger or worse than it is.
import { type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, expect, test } from 'vitest'
import { DESK, PHONE, SHOTS, hear, launch } from './browser'
import { alarm, device, group, point, snapshot, stamp, value } from '../src/logic/samples'
import { Demo } from './busbar'
import { Imitated } from './imitated'

const GENSET = '#/devices/genset-1'
/** Three units share a line at 9600 baud: what is read less often comes each 20 s. */
const LINE_MS = 25_000

let browser: Browser
let demo: Demo
let complaints: string[] = []

beforeAll(async () => {
  browser = await launch()
  demo = await Demo.start()
})

afterAll(async () => {
  await browser?.close()
  await demo?.stop()
})

afterEach(() => {
  const told = complaints
  complaints = []
  expect(told).toEqual([])
})

type Look = NonNullable<Parameters<Browser['newContext']>[0]>

async function open(address: string, look: Look = {}): Promise<Page> {
  const context = await browser.newContext({ viewport: DESK, colorScheme: 'light', ...look })
  const page = await context.newPage()
  hear(page, complaints)
  await page.goto(address)
  return page
}

const shot = (page: Page, name: string) => page.screenshot({ path: `${SHOTS}${name}.png`, fullPage: true })

const overflow = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)

const filled = (page: Page) =>
  page.waitForFunction(() => document.querySelectorAll('[data-point] .number').length >= 60, undefined, {
    timeout: LINE_MS,
  })

const line = (page: Page, id: string) => page.locator(`[data-point="${id}"]`)
const words = async (page: Page, selector: string) =>
  ((await page.locator(selector).first().textContent()) ?? '').replace(/\s+/g, ' ').trim()

test('a point is found by a word, an address, a 4xxxx number, and the label of a bit', async () => {
  const page = await open(demo.address + GENSET)
  await filled(page)
  const all = await page.locator('[data-point]').count()
  await page.keyboard.press('/')
  expect(await page.evaluate(() => document.activeElement?.getAttribute('type'))).toBe('search')

  await page.keyboard.type('oil pressure')
  await line(page, 'oil_pressure').waitFor()
  expect(await page.locator('[data-point]').count()).toBeLessThan(10)
  expect(await line(page, 'oil_pressure').locator('mark').first().textContent()).toBe('Oil')
  await shot(page, 'search-desk-light')

  for (const [query, why] of [
    ['10246', 'address 10246'],
    ['410247', '410247'],
    ['0x2806', '0x2806'],
  ] as const) {
    await page.getByLabel('Find a point').fill(query)
    await expect.poll(() => words(page, '.why')).toContain(why)
    expect(await page.locator('[data-point]').count()).toBe(1)
  }
  await page.getByLabel('Find a point').fill('low frequency')
  await expect.poll(() => words(page, '.why')).toMatch(/bit \d+ .*low frequency/i)

  await page.getByLabel('Find a point').fill('no such thing')
  await page.getByText('No point matches.').waitFor()
  expect(await page.locator('[data-point]').count()).toBe(0)
  await shot(page, 'search-none-desk-light')
  await page.keyboard.press('Escape')
  await expect.poll(() => page.locator('[data-point]').count()).toBe(all)
  await page.context().close()
})

test('units are what the reader chose, on points and cards, over a reload', async () => {
  const page = await open(demo.address + GENSET)
  await filled(page)
  const unit = () => words(page, '[data-point="oil_pressure"] .unit')
  expect(await unit()).toBe('bar')
  await page.getByLabel('Pressure').selectOption('psi')
  await page.getByLabel('Temperature').selectOption('degF')
  expect(await unit()).toBe('psi')
  expect(await words(page, '[data-point="engine_temperature"] .unit')).toBe('°F')
  const given = await (
    await page.request.get(
      new URL('api/v1/devices/genset-1/values?point=engine_temperature', demo.address).href,
    )
  ).json()
  const celsius = (given as { value: number }[])[0]!.value
  const shown = Number(await words(page, '[data-point="engine_temperature"] .number'))
  // The machine may have moved between the two looks, not by 10 degrees.
  expect(Math.abs(shown - (celsius * 1.8 + 32))).toBeLessThan(18)

  await page.reload()
  await filled(page)
  expect(await unit()).toBe('psi')
  await page.goto(demo.address)
  await page.locator('[data-device="genset-1"]').getByText('psi').waitFor()
  await page.locator('[data-device="compressor-1"]').getByText('°F').first().waitFor()
  await page.getByLabel('Pressure').selectOption('')
  await page.locator('[data-device="genset-1"]').getByText('bar', { exact: true }).waitFor()
  await page.context().close()
})

test('by keyboard alone: from the card to a point, its details, a copy of its address, and back', async () => {
  const page = await open(demo.address, { permissions: ['clipboard-read', 'clipboard-write'] })
  const card = page.locator('[data-device="genset-1"] a')
  await card.waitFor()
  const focused = () => page.evaluate(() => document.activeElement?.textContent?.trim() ?? '')
  for (
    let tabs = 0;
    tabs < 40 && !(await card.evaluate((link) => link === document.activeElement));
    tabs += 1
  )
    await page.keyboard.press('Tab')
  await page.keyboard.press('Enter')
  await page.getByRole('heading', { level: 2, name: 'Genset 1' }).waitFor()
  // The focus went along: it is on the heading, not lost with the card.
  await expect.poll(focused).toBe('Genset 1')
  await filled(page)
  await page.keyboard.press('/')
  await page.keyboard.type('oil_pressure')
  await line(page, 'oil_pressure').waitFor()
  const button = line(page, 'oil_pressure').locator('button').first()
  for (
    let tabs = 0;
    tabs < 12 && !(await button.evaluate((one) => one === document.activeElement));
    tabs += 1
  )
    await page.keyboard.press('Tab')
  await page.keyboard.press('Enter')
  expect(await button.getAttribute('aria-expanded')).toBe('true')
  await page.keyboard.press('Tab')
  await page.keyboard.press('Enter')
  await line(page, 'oil_pressure').getByText('copied').waitFor()
  const address = await page.evaluate(() => navigator.clipboard.readText())
  expect(await words(page, '[data-point="oil_pressure"] dd .text')).toBe(address)
  await shot(page, 'details-desk-light')
  await page.keyboard.press('/')
  await page.keyboard.press('Escape')
  await expect.poll(() => page.locator('[data-point]').count()).toBeGreaterThan(60)
  await page.context().close()
})

test.each(['light', 'dark'] as const)(
  'on a phone in %s colours search, details and units have room',
  async (scheme) => {
    const page = await open(demo.address + GENSET, { viewport: PHONE, colorScheme: scheme, hasTouch: true })
    await filled(page)
    await page.getByLabel('Find a point').fill('voltage')
    await page.getByLabel('Pressure').selectOption('kPa')
    await page.locator('[data-point] > button').first().click()
    await page.locator('[data-point] dl').first().waitFor()
    expect(await overflow(page)).toBe(0)
    await shot(page, `search-phone-${scheme}`)
    // As large as at 200 %: half as many points in the width.
    await page.setViewportSize({ width: 640, height: 450 })
    expect(await overflow(page)).toBe(0)
    await page.context().close()
  },
)

const HOSTILE = [
  `<img src=x onerror=alert(1)>${'W'.repeat(200)}`,
  '\u202Egnp.exe\u202C مولد كهرباء رقم ١',
  'מחולל 2 (דרום)',
]

/** A site of `count` devices in every condition there is. */
function site(count: number) {
  const at = (index: number) => {
    const id = `gen${index + 1}`
    const view = device(id, {
      name: HOSTILE[index] ?? `Tower ${index + 1}`,
      state: { code: 12, label: 'Genset on load', canonical: 'loaded', timer_s: null },
      mode: { code: 1, label: 'AUTO', canonical: 'auto' },
      nameplate: { power_kw: 110, tank_l: 900, battery_v: 24 },
      desired: { mode: 'auto', met: true },
    })
    if (index % 7 === 3) {
      view.mode = { code: 2, label: 'MANUAL', canonical: 'manual' }
      view.desired = { mode: 'auto', met: false }
    }
    if (index % 7 === 4) {
      view.online = false
      view.fault = `${view.name} cannot be read: unit 1 did not answer within 1s, asked 2 times`
      view.last_seen = stamp(-3600)
    }
    if (index % 7 === 5) {
      const detail = 'it says that it is a D-300, and the site file wants a D-500'
      view.identity = { verdict: 'wrong', detail, checked: stamp(0) }
      view.fault = `${view.name} is not what the site file says: ${detail}; connect the right device`
    }
    if (index % 7 === 6) view.alarms = { ...view.alarms, shutdown: 1, warning: 2 }
    return {
      device: view,
      values: [value('kw', 36.2), value('fuel', 24.9), value('battery', 23.1), value('oil', 4.2)],
    }
  }
  const devices = Array.from({ length: count }, (_, index) => at(index))
  const alarms = devices
    .filter(({ device }) => device.alarms.shutdown > 0)
    .flatMap(({ device: { id } }) => [
      alarm(id, 1, 'shutdown', -90),
      alarm(id, 2, 'warning', -60),
      alarm(id, 3, 'warning', -30),
    ])
  const told = snapshot(devices, alarms)
  told.site.time_zone = 'Asia/Kathmandu'
  return told
}

const GLANCE = {
  groups: [
    group('Genset', [
      point('kw', { name: 'Genset power', signal: 'genset.power.active', unit: 'kW' }),
      point('fuel', { name: 'Fuel level', signal: 'fuel.level', unit: '%' }),
      point('battery', { name: 'Battery voltage', signal: 'battery.voltage', unit: 'V' }),
      point('oil', { name: 'Oil pressure', signal: 'engine.oil.pressure', unit: 'bar' }),
    ]),
  ],
  manual: 'D-500 manual',
  joined: [],
}

test.each([
  ['desk', DESK, 'light'],
  ['phone', PHONE, 'dark'],
] as const)(
  'names of any kind and devices in any condition fit, on a %s',
  async (name, viewport, colorScheme) => {
    const gateway = await Imitated.start(site(7), GLANCE)
    const page = await open(gateway.address, { viewport, colorScheme })
    await page.locator('[data-device="gen7"] .values').waitFor()
    expect(await overflow(page)).toBe(0)
    expect(await page.locator('img').count()).toBe(0)
    expect(await words(page, '[data-device="gen4"] .doing')).toContain('MANUAL should be AUTO')
    expect(await words(page, '[data-device="gen6"]')).toContain('Another device answers here.')
    expect(await page.locator('[data-device="gen6"] .values').count()).toBe(0)
    expect(await words(page, '[data-device="gen1"]')).toContain('33 % of 110 kW')
    expect(await words(page, '[data-device="gen1"]')).toContain('about 224 L of 900 L')
    expect(await words(page, '[data-device="gen1"]')).toContain('below 24 V nominal')
    await shot(page, `conditions-${name}-${colorScheme}`)
    for (const id of ['gen1', 'gen2', 'gen6', 'gen7']) {
      await page.goto(`${gateway.address}#/devices/${id}`)
      await page.locator('.summary').waitFor()
      if (id === 'gen6') expect(await page.locator('[data-point]').count()).toBe(0)
      else await page.locator('[data-point="kw"] .number').waitFor()
      expect(await overflow(page)).toBe(0)
      await shot(page, `conditions-${id}-${name}-${colorScheme}`)
    }
    await page.context().close()
    await gateway.stop()
  },
)

test('a thousand controllers are searched, chosen and put in order, and only those near are drawn', async () => {
  const gateway = await Imitated.start(site(1000), GLANCE)
  const page = await open(gateway.address)
  await page.getByText('1000 of 1000 shown').waitFor()
  await page.locator('[data-device="gen7"] .values').waitFor()
  expect(await page.locator('[data-device]').count()).toBe(1000)
  expect(await page.locator('[data-device] .doing').count()).toBeLessThan(60)
  await page.locator('[data-device="gen1000"]').scrollIntoViewIfNeeded()
  await page.locator('[data-device="gen1000"] .doing').waitFor()
  await page.getByLabel('Find a controller').fill('tower 99')
  await page.getByText('19 of 1000 shown').waitFor()
  await page.getByLabel('Find a controller').fill('')
  await page.getByLabel('Show').selectOption('differs')
  await page.getByText('143 of 1000 shown').waitFor()
  await page.getByLabel('Show').selectOption('all')
  await page.getByLabel('Most urgent first').check()
  await expect.poll(() => page.locator('[data-device]').first().getAttribute('data-device')).toBe('gen7')
  await page.screenshot({ path: `${SHOTS}fleet-desk-light.png` })
  await page.setViewportSize(PHONE)
  expect(await overflow(page)).toBe(0)
  await page.screenshot({ path: `${SHOTS}fleet-phone-light.png` })
  await page.getByLabel('Find a controller').fill('nobody')
  await page.getByText('No controller is like that.').waitFor()
  await page.context().close()
  await gateway.stop()
})

test('a controller of 2,000 points opens, scrolls and is searched', async () => {
  const groups = Array.from({ length: 20 }, (_, at) =>
    group(
      `Part ${at + 1}`,
      Array.from({ length: 100 }, (_, index) =>
        point(`p${at * 100 + index}`, {
          name: `Measurement ${at * 100 + index}`,
          address: 1000 + at * 100 + index,
        }),
      ),
    ),
  )
  const values = Array.from({ length: 2000 }, (_, index) => value(`p${index}`, index))
  const gateway = await Imitated.start(snapshot([{ device: device('gen1'), values }]), {
    manual: 'D-500 manual',
    groups,
    joined: [],
  })
  const page = await open(`${gateway.address}#/devices/gen1`)
  await page.getByText('2000 points').waitFor()
  await line(page, 'p0').waitFor()
  expect(await page.locator('[data-point]').count()).toBeLessThan(600)
  await page.evaluate(() => scrollTo(0, document.body.scrollHeight))
  await page.getByText('Measurement 1999').waitFor()
  await page.evaluate(() => scrollTo(0, 0))
  // Looked at, never judged: how long one letter takes until the page has drawn again.
  const took = await page.evaluate(async () => {
    const field = document.querySelector<HTMLInputElement>('input[type=search]')!
    const start = performance.now()
    field.value = 'measurement 1234'
    field.dispatchEvent(new Event('input', { bubbles: true }))
    await new Promise((drawn) => requestAnimationFrame(() => setTimeout(drawn)))
    return performance.now() - start
  })
  console.log(`search over 2000 points: ${took.toFixed(0)} ms`)
  await page.getByText('2 of 2000 points').waitFor()
  await shot(page, 'points-2000')
  await page.context().close()
  await gateway.stop()
})
