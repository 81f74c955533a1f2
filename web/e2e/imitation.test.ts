// The page of the imitation in a real browser, on the real program: what is done there happens on the site, and the
// operator's page shows what the site makes of it.
import { type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest'
import { DESK, DOCS, PHONE, SHOTS, hear, hearStrangers, launch } from './browser'
import { Controller, Demo } from './busbar'

/** Three units share a line at 9600 baud, and a genset takes its time to start. */
const REACTS_MS = 60_000

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
  complaints = []
})

/** Opens a page of the program; whatever the browser complains about from here on is kept. */
async function open(
  address: string,
  viewport = DESK,
  colorScheme: 'light' | 'dark' = 'light',
): Promise<Page> {
  const page = await browser.newPage({ viewport, colorScheme })
  hear(page, complaints)
  hearStrangers(page, new URL('/', address).href, complaints)
  await page.goto(address)
  return page
}

const imitation = (id: string) => `${demo.address}imitation/#${id}`
const overflow = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)
const words = (text: string | null) => text?.replace(/\s+/g, ' ').trim() ?? ''
const press = (page: Page, name: string) => page.getByRole('button', { name, exact: true }).click()

/** What must stand in the drawing of each controller of the site. */
const SITE = [
  {
    id: 'genset-1',
    name: 'Genset 1',
    drawn: /Mains, .*Mains breaker, (open|closed).*Tank.*Radiator.*Battery/,
  },
  {
    id: 'genset-2',
    name: 'Genset 2',
    drawn: /Mains, .*Mains breaker, (open|closed).*Tank.*Radiator.*Battery/,
  },
  { id: 'switch-1', name: 'Transfer switch', drawn: /Source 1.*QS1, (open|closed).*Source 2.*QTIE/ },
  { id: 'compressor-1', name: 'Compressor', drawn: /Engine.*Load valve, (un)?loaded.*Receiver.*kPa.*Tank/ },
] as const

describe.each([
  ['desk', DESK, 'light'],
  ['phone', PHONE, 'dark'],
] as const)('on a %s', (look, viewport, scheme) => {
  test.each(SITE)(`in ${scheme} colours the plant of $name is drawn, live`, async ({ id, name, drawn }) => {
    const page = await open(imitation(id), viewport, scheme)
    await page.getByRole('heading', { level: 2, name, exact: true }).waitFor()
    expect(await page.getByRole('img').getAttribute('aria-label')).toMatch(drawn)
    const time = page.locator('#time')
    const before = await time.textContent()
    await expect.poll(() => time.textContent()).not.toBe(before)
    // No word of the drawing stands beyond its edge.
    const outside = await page.locator('#drawing svg').evaluate((svg) => {
      const { left, right } = svg.getBoundingClientRect()
      return [...svg.querySelectorAll('text')]
        .filter((text) => {
          const box = text.getBoundingClientRect()
          return box.left < left - 1 || box.right > right + 1
        })
        .map((text) => text.textContent)
    })
    expect(outside).toEqual([])
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}imitation-${id}-${look}-${scheme}.png`, fullPage: true })
    expect(complaints).toEqual([])
    await page.close()
  })
})

// The site tells a story meanwhile, so nothing is asked about what its gensets did before, or do afterwards.
test('at a choice the grid fails, and the site saves itself', { timeout: 3 * REACTS_MS }, async () => {
  const operator = await open(demo.address)
  const says = async (id: string, expected: RegExp) => {
    const card = operator.locator(`[data-device="${id}"]`)
    await expect.poll(async () => words(await card.innerText()), { timeout: REACTS_MS }).toMatch(expected)
  }
  await says('switch-1', /Source 2 voltage [1-9]/)

  // The way of a person: from the operator's page to the imitation, and there to the transfer switch.
  await operator.getByRole('link', { name: 'Imitation' }).click()
  await operator.getByRole('link', { name: 'Transfer switch' }).click()
  await operator.getByRole('heading', { level: 2, name: 'Transfer switch' }).waitFor()
  await press(operator, 'Fail the grid')
  await operator
    .getByRole('list', { name: 'What is pulled' })
    .getByText('Grid behind both sources: failed')
    .waitFor()
  await operator.screenshot({ path: `${SHOTS}imitation-failed.png`, fullPage: true })
  await operator.getByRole('link', { name: 'Operator’s page' }).click()

  await says('switch-1', /Source 1 voltage 0 V .*Source 2 voltage 0 V/)
  for (const id of ['genset-1', 'genset-2'])
    await says(id, /Mains voltage 0 V .*Mains breaker open .*Genset breaker closed Genset power [1-9]/)
  await operator.screenshot({ path: `${SHOTS}imitation-saved.png`, fullPage: true })

  const page = await open(imitation('genset-2'))
  await page.locator('#state').getByText('State: load on genset').waitFor()
  const lately = page.getByRole('list', { name: 'Lately' })
  await lately.getByText('Genset breaker closed').first().waitFor()
  await page.getByRole('link', { name: 'Transfer switch' }).click()
  await press(page, 'Give the grid back')
  await page.getByRole('button', { name: 'Fail the grid' }).waitFor()
  await says('switch-1', /Source 2 voltage [1-9]/)
  expect(complaints).toEqual([])
  await page.close()
  await operator.close()
})

test('by keyboard alone the clock is stopped, stepped, and goes on', async () => {
  const page = await open(imitation('switch-1'))
  const time = page.locator('#time')
  const key = async (name: string, then: string) => {
    await page.getByRole('button', { name, exact: true }).focus()
    await page.keyboard.press('Enter')
    await page.getByRole('status').getByText(then).waitFor()
  }
  await key('Pause', 'Paused')
  const before = (await time.textContent()) ?? ''
  await key('+ 1 min', 'Stepped 1 min')
  const seconds = (text: string) => text.split(':').reduce((sum, part) => 60 * sum + Number(part), 0)
  expect(seconds((await time.textContent()) ?? '') - seconds(before)).toBe(60)
  await key('Go on', 'Goes on')
  await page.getByLabel('Speed').selectOption('60 ×')
  await page.getByRole('status').getByText('Speed 60').waitFor()
  await page.getByLabel('Speed').selectOption('1 ×')
  await page.getByRole('status').getByText('Speed 1').waitFor()
  expect(complaints).toEqual([])
  await page.close()
})

// No story pulls a lever of this genset.
test('everything goes back to normal at one word, by keyboard, and whoever is there stays there', async () => {
  const page = await open(imitation('genset-1'))
  const at = () => page.evaluate(() => document.activeElement?.textContent)
  const pulled = page.getByRole('list', { name: 'What is pulled' })
  const key = async (name: string) => {
    await page.getByRole('button', { name, exact: true }).focus()
    await page.keyboard.press('Enter')
  }
  await key('Fail the mains')
  await pulled.getByText('Mains: failed').waitFor()
  await expect.poll(at).toBe('Give the mains back')
  await key('Jam the genset breaker')
  await pulled.getByText('will not close').waitFor()
  await page.getByLabel('Alarm', { exact: true }).fill('overload')
  await press(page, 'Inject')
  await pulled.getByText('(load dump): injected').waitFor()
  expect(await pulled.getByRole('listitem').count()).toBe(3)
  await key('Put Mains back')
  await expect.poll(() => pulled.getByRole('listitem').count()).toBe(2)
  await expect.poll(at).toBe('Put back')
  await key('All back to normal')
  await page.getByText('Nothing is pulled.').waitFor()
  expect(await at()).toBe('What is pulled')
  await page.getByRole('status').getByText('All back to normal').waitFor()
  expect(complaints).toEqual([])
  await page.close()
})

test('a page elsewhere changes nothing', async () => {
  const page = await browser.newPage()
  await page.route('http://elsewhere.example/**', (route) =>
    route.fulfill({ contentType: 'text/html', body: '<p>Elsewhere</p>' }),
  )
  await page.goto('http://elsewhere.example/')
  const one = `${demo.address}imitation/api/v1/controllers/compressor-1`
  const done = await page.evaluate(async (one) => {
    const tried = [
      ['PUT', 'levers/tank', '{"position":0}', 'cors'],
      ['PUT', 'normal', null, 'cors'],
      ['POST', 'steps', '{"seconds":3600}', 'cors'],
      ['POST', 'steps', '{"seconds":3600}', 'no-cors'],
      ['DELETE', 'pins/fuel_level', null, 'cors'],
    ] as const
    let through = 0
    for (const [method, path, body, mode] of tried) {
      const headers = { 'content-type': mode === 'cors' ? 'application/json' : 'text/plain' }
      const answer = await fetch(`${one}/${path}`, { method, body, mode, headers }).catch(() => null)
      if (answer?.ok) through += 1
    }
    navigator.sendBeacon(`${one}/steps`, new Blob(['{"seconds":3600}'], { type: 'text/plain' }))
    return through
  }, one)
  expect(done).toBe(0)
  const state = (await (await page.request.get(one)).json()) as {
    clock: { time_s: number }
    levers: { back: unknown }[]
  }
  expect(state.clock.time_s).toBeLessThan(3600)
  expect(state.levers.filter(({ back }) => back !== null)).toEqual([])
  await page.close()
})

test('a point is pinned and let go, and what cannot be is told in a sentence', async () => {
  const page = await open(imitation('genset-1'))
  await page.getByText('Pin a point').click()
  const pin = async (point: string, value: string) => {
    await page.getByLabel('Point', { exact: true }).fill(point)
    await page.getByLabel('Value', { exact: true }).fill(value)
    await press(page, 'Pin')
  }
  await pin('battery_voltage', '21.5')
  const pulled = page.getByRole('list', { name: 'What is pulled' })
  await pulled.getByText('battery_voltage = 21.5: pinned').waitFor()
  expect(await page.getByRole('img').getAttribute('aria-label')).toContain('Battery, 21.5 V')
  expect(complaints).toEqual([])
  await pin('battery_voltage', 'flat')
  await page.getByRole('alert').getByText('cannot set battery_voltage to `flat`').waitFor()
  await page.getByLabel('Alarm', { exact: true }).fill('no_such_alarm')
  await press(page, 'Inject')
  await page.getByRole('alert').getByText('the controller has no alarm `no_such_alarm`').waitFor()
  await press(page, 'Let battery_voltage go')
  await page.getByText('Nothing is pulled.').waitFor()
  expect(await page.getByRole('alert').isVisible()).toBe(false)
  await page.close()
})

test('of many levers the one that is looked for is pulled, and an injected alarm is told to the operator', async () => {
  const page = await open(imitation('genset-1'))
  const levers = page.locator('#levers').getByRole('group')
  await levers.first().waitFor()
  const before = await levers.count()
  expect(before).toBeGreaterThan(20)
  await page.getByRole('searchbox', { name: 'Find a lever' }).fill('radiator')
  await expect.poll(() => levers.count()).toBe(1)
  await levers.getByRole('button', { name: 'blocked' }).click()
  const pulled = page.getByRole('list', { name: 'What is pulled' })
  await pulled.getByText('Radiator: blocked').waitFor()
  expect(await levers.getByRole('button', { name: 'blocked' }).getAttribute('aria-pressed')).toBe('true')
  await press(page, 'Clear the radiator')
  await page.getByText('Nothing is pulled.').waitFor()

  await page.getByLabel('Alarm', { exact: true }).fill('warning_alarms.high_oil_temperature')
  await press(page, 'Inject')
  await pulled.getByText('(warning): injected').waitFor()
  await page.getByRole('list', { name: 'Active alarms' }).getByText('warning').first().waitFor()
  const alarms = async () =>
    (await page.request.get(new URL('api/v1/alarms', demo.address).href)).json() as Promise<{ id: string }[]>
  const told = async () => (await alarms()).some(({ id }) => id === 'high_oil_temperature')
  await expect.poll(told, { timeout: REACTS_MS }).toBe(true)
  await page.getByRole('button', { name: /^Let .* go$/ }).click()
  await expect.poll(told, { timeout: REACTS_MS }).toBe(false)
  expect(complaints).toEqual([])
  await page.close()
})

test('an imitation with a token asks for it', async () => {
  const one = await Controller.start('datakom-d', 'tcp://127.0.0.1:0', '--control', '127.0.0.1:0')
  const page = await browser.newPage({ viewport: PHONE })
  await page.goto(one.control)
  await page.getByRole('alert').getByText('a token is needed').waitFor()
  expect(await page.getByRole('img').count()).toBe(0)
  await page.getByLabel('Token').fill('this is another one')
  await press(page, 'Show it')
  await page.getByRole('alert').getByText('the token is another one').waitFor()
  await page.getByLabel('Token').fill(Controller.TOKEN)
  await press(page, 'Show it')
  await page.getByRole('heading', { level: 2, name: 'Datakom D-500' }).waitFor()
  expect(await page.getByRole('alert').isVisible()).toBe(false)

  await one.stop()
  await page.getByRole('alert').getByText('No connection to the imitation.').waitFor()
  await page.screenshot({ path: `${SHOTS}imitation-lost.png` })
  await page.close()
})

// Only when asked for, so that a test run leaves the tree as it was.
test.runIf(process.env.BUSBAR_SCREENSHOT === '1')('the picture of the documentation', async () => {
  const page = await open(imitation('genset-2'), { width: 1100, height: 700 })
  await press(page, 'Fail the mains')
  await page.locator('#state').getByText('State: load on genset').waitFor({ timeout: REACTS_MS })
  await page.screenshot({ path: `${DOCS}imitation.png` })
  await page.close()
})
