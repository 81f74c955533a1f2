// The page in a real browser, on the real program: a site of four imitated controllers, one polled over a real socket,
// three over one pseudo-terminal.
import { type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest'
import { DESK, DOCS, PHONE, SHOTS, hear, hearStrangers, launch } from './browser'
import { Demo } from './busbar'

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

/** Opens the page; whatever the browser complains about from here on is kept. */
async function open(hash = '', viewport = DESK, colorScheme: 'light' | 'dark' = 'light'): Promise<Page> {
  const page = await browser.newPage({ viewport, colorScheme })
  hear(page, complaints)
  page.on('requestfailed', (request) => {
    // A stream or request that the page itself ends, because nobody looks any more, is none that failed.
    if (request.failure()?.errorText !== 'net::ERR_ABORTED') complaints.push(`failed: ${request.url()}`)
  })
  page.on('response', (answer) => {
    if (answer.status() >= 400) complaints.push(`${answer.status()}: ${answer.url()}`)
  })
  hearStrangers(page, demo.address, complaints)
  await page.goto(demo.address + hash)
  return page
}

/** The site of `busbar demo`, and how many numbers the page of each controller has at least. */
const SITE = [
  { id: 'genset-1', name: 'Genset 1', numbers: 60, glance: /Mains voltage.*Genset power.*Fuel/ },
  { id: 'genset-2', name: 'Genset 2', numbers: 60, glance: /Mains voltage.*Genset power.*Fuel/ },
  {
    id: 'switch-1',
    name: 'Transfer switch',
    numbers: 60,
    glance: /Source 1 switch (open|closed).*Bus tie (open|closed).*Load side 1 on .*Load side 2 on /,
  },
  {
    id: 'compressor-1',
    name: 'Compressor',
    numbers: 40,
    glance: /Compressor (un)?loaded.*Discharge pressure \d+ kPa.*Engine hours \d+ h \d\d min/,
  },
] as const
const hashOf = (id: string) => `#/devices/${id}`
/** Three units share a line at 9600 baud: what is read less often comes each 20 s. */
const LINE_MS = 25_000

const words = (text: string | null) => text?.replace(/\s+/g, ' ').trim() ?? ''

/** The page of a controller is there, with so many numbers. */
async function filled(page: Page, numbers = 60): Promise<void> {
  await page.waitForFunction(
    (least) => document.querySelectorAll('[data-point] .number').length >= least,
    numbers,
    { timeout: LINE_MS },
  )
}

/** Until what the selector finds says something else than now, while nobody touches anything. */
async function changes(page: Page, selector: string): Promise<void> {
  const before = await page.locator(selector).allTextContents()
  expect(before.length).toBeGreaterThan(0)
  await expect
    .poll(() => page.locator(selector).allTextContents(), { timeout: LINE_MS, interval: 250 })
    .not.toEqual(before)
}

const overflow = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)

const cardOf = (id: string) => `[data-device="${id}"]`

/** Every controller answers and its card has its values. */
async function overview(page: Page): Promise<void> {
  await page.getByText('4 of 4 controllers answering').waitFor()
  for (const { id } of SITE)
    await page
      .locator(`${cardOf(id)} .values .number`)
      .nth(1)
      .waitFor()
}

const LOOKS = [
  ['desk', DESK, 'light'],
  ['desk', DESK, 'dark'],
  ['phone', PHONE, 'light'],
  ['phone', PHONE, 'dark'],
] as const

describe.each(LOOKS)('on a %s', (name, viewport, scheme) => {
  test(`in ${scheme} colours all four controllers are shown at a glance, live`, async () => {
    const page = await open('', viewport, scheme)
    await overview(page)
    expect(await page.locator('[data-device]').count()).toBe(SITE.length)
    await page.getByText('Live', { exact: true }).waitFor()
    for (const { id, name, glance } of SITE) {
      const card = words(await page.locator(cardOf(id)).innerText())
      expect(card).toMatch(new RegExp(`^${name} .* State .* Mode .* Online · heard \\d+ s ago$`))
      expect(card).toMatch(glance)
      expect(card).not.toContain('not known')
    }
    await Promise.all(SITE.map(({ id }) => changes(page, `${cardOf(id)} dd`)))
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}overview-${name}-${scheme}.png`, fullPage: true })
    expect(complaints).toEqual([])
    await page.close()
  })
})

describe.each([LOOKS[0], LOOKS[3]])('on a %s', (name, viewport, scheme) => {
  test.each(SITE)(`in ${scheme} colours $name is shown, live`, async ({ id, numbers, glance }) => {
    const page = await open(hashOf(id), viewport, scheme)
    await filled(page, numbers)
    expect(await page.getByTestId('state').textContent()).not.toMatch(/^\s*(not known)?\s*$/)
    expect(await page.getByTestId('mode').textContent()).toMatch(/[A-Z]/i)
    await page.getByText('Online').waitFor()
    await expect.poll(async () => words(await page.getByLabel('At a glance').innerText())).toMatch(glance)
    await changes(page, '[data-point] .values')

    // Numbers as the gateway gives them: no float tail, no exponent.
    for (const text of await page.locator('.number').allTextContents()) {
      expect(text).toMatch(/^-?\d+(\.\d{1,4})?$/)
    }
    // A line says its name once, and no part of it is left hanging.
    for (const text of await page.locator('[data-point] > button').allTextContents()) {
      expect(words(text)).not.toMatch(/\(\)|^$/)
    }
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}${id}-${name}-${scheme}.png`, fullPage: true })
    expect(complaints).toEqual([])

    // In whatever state it is, the page is no wider: every word is now as long as the longest.
    await page.evaluate(() => {
      for (const value of document.querySelectorAll('.words .value, [data-testid]'))
        value.textContent = 'Synchronization for load transfer to mains'
    })
    expect(await overflow(page)).toBe(0)
    await page.close()
  })

  test(`in ${scheme} colours the widest thing there is, a list of 142 named bits, fits`, async () => {
    const page = await open(hashOf('genset-1'), viewport, scheme)
    await page.locator('[data-point="shutdown_alarms"] > button').click()
    await page.getByText('Genset low frequency').first().waitFor()
    expect(await overflow(page)).toBe(0)
    await page.close()
  })

  test(`in ${scheme} colours the wires tell what goes over them`, async () => {
    const page = await open('', viewport, scheme)
    await page.getByRole('link', { name: 'Wires' }).click()
    await page.getByRole('heading', { name: 'Wire network' }).waitFor()
    await page.getByRole('link', { name: 'line', exact: true }).click()
    await page.getByRole('heading', { name: 'Wire line' }).waitFor()
    expect(await page.getByText('Connected').count()).toBe(3)

    // The three units of the line, each with its device and with requests that grow.
    const rows = page.getByRole('region', { name: 'Units of the wire' }).locator('tbody tr')
    await expect.poll(() => rows.count(), { timeout: LINE_MS }).toBe(3)
    for (const [index, { name }] of SITE.slice(1).entries()) {
      const row = rows.nth(index)
      expect(words(await row.innerText())).toMatch(new RegExp(`^${index + 1} ${name} Answering`))
      const requests = async () =>
        Number(words(await row.locator('td').nth(2).textContent()).replace(/\s/g, ''))
      const before = await requests()
      expect(before).toBeGreaterThan(0)
      await expect.poll(requests, { timeout: 15_000 }).toBeGreaterThan(before)
    }
    await page.getByText('Every read').first().click()
    expect(await page.getByRole('table').count()).toBeGreaterThan(2)
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}wires-${name}-${scheme}.png`, fullPage: true })
    expect(complaints).toEqual([])
    await page.close()
  })
})

test.each(SITE)('what the page shows of $name is what the API says', async ({ id, numbers: least }) => {
  const page = await open(hashOf(id))
  await filled(page, least)
  const get = async (path: string) => (await page.request.get(new URL(path, demo.address).href)).json()
  const numbers = async () =>
    new Map(
      ((await get(`api/v1/devices/${id}/values`)) as { id: string; value: unknown }[])
        .filter(({ value }) => typeof value === 'number')
        .map(({ id, value }) => [id, String(value)]),
    )
  // Whatever did not move between two looks at the API must stand on the page between them.
  const differing = async () => {
    const before = await numbers()
    const shown = await page.evaluate(() =>
      [...document.querySelectorAll<HTMLElement>('[data-point]:has(.number)')].map(
        (line) => [line.dataset.point ?? '', line.querySelector('.number')?.textContent] as const,
      ),
    )
    const after = await numbers()
    const still = shown.filter(([id]) => before.has(id) && before.get(id) === after.get(id))
    return still.length < 10
      ? ['too few that stand still']
      : still.filter(([id, text]) => text !== before.get(id))
  }
  await expect.poll(differing, { timeout: 20_000 }).toEqual([])
  expect(complaints).toEqual([])
  await page.close()
})

test('by keyboard alone: a card leads to its controller, a line opens and tells address and 4xxxx number', async () => {
  const page = await open()
  await overview(page)
  await page.locator(`${cardOf('genset-1')} a`).focus()
  await page.keyboard.press('Enter')
  await page.getByRole('heading', { level: 2, name: 'Genset 1' }).waitFor()
  expect(new URL(page.url()).hash).toBe(hashOf('genset-1'))
  await filled(page)
  const button = page.locator('[data-point] > button').first()
  await button.focus()
  await page.keyboard.press('Enter')
  expect(await button.getAttribute('aria-expanded')).toBe('true')
  const address = page.locator('[data-point] dl dd').first()
  const [register, plc] = ((await address.textContent()) ?? '')
    .split('·')
    .map((part) => Number.parseInt(part))
  // Five digits end at address 9998; every register of a D-500 lies above.
  expect(plc).toBe(400001 + (register ?? NaN))
  await page.keyboard.press('Enter')
  expect(await button.getAttribute('aria-expanded')).toBe('false')
  await page.close()
})

test('the page holds under a strict content security policy', async () => {
  const page = await open()
  await overview(page)
  const answer = await page.request.get(demo.address)
  expect(answer.headers()['content-security-policy']).toContain("default-src 'self'")
  expect(complaints).toEqual([])
  await page.close()
})

test('a gateway that goes away is told within seconds, and it comes back by itself', async () => {
  const own = await Demo.start()
  const page = await browser.newPage({ viewport: DESK })
  await page.goto(own.address + hashOf('genset-1'))
  await filled(page)
  const told = page.getByRole('alert').getByText('No connection to the gateway.')
  expect(await told.count()).toBe(0)

  await own.stop()
  await told.waitFor()
  // The old values stay, marked: every line that had a good value is stale now, and says so.
  await page.waitForFunction(() => document.querySelectorAll('[data-point].good').length === 0)
  expect(await page.locator('[data-point].stale').count()).toBeGreaterThan(30)
  expect(await page.locator('[data-point].stale .age').first().textContent()).toMatch(/stale,\s+\d+ s/)
  await page.screenshot({ path: `${SHOTS}lost.png` })
  await page.getByRole('link', { name: 'Overview' }).click()
  await page.getByText('As last heard:').waitFor()
  expect(await page.locator(`${cardOf('genset-1')} dd.stale`).count()).toBeGreaterThan(5)
  expect(await page.locator('[data-device] dd.good').count()).toBe(0)
  await page.screenshot({ path: `${SHOTS}lost-overview.png` })

  const again = await Demo.start(own.port)
  await told.waitFor({ state: 'detached' })
  await page
    .locator(`${cardOf('genset-1')} dd.good`)
    .first()
    .waitFor()
  await page.getByRole('link', { name: 'Genset 1', exact: true }).first().click()
  await page.waitForFunction(() => document.querySelectorAll('[data-point].good').length > 30)
  await page.close()
  await again.stop()
})

// Only when asked for, so that a test run leaves the tree as it was.
test.runIf(process.env.BUSBAR_SCREENSHOT === '1')(
  'the pictures of the README',
  async () => {
    const page = await open('', { width: 1280, height: 850 })
    await overview(page)
    // The demonstration tells a story: the picture shows a genset at work, and an alarm.
    await page.waitForFunction(
      () =>
        /on load/i.test(document.querySelector('[data-device="genset-1"] .doing')?.textContent ?? '') &&
        document.querySelector('[data-device] .alarms .what'),
      undefined,
      { timeout: 300_000 },
    )
    await page.screenshot({ path: `${DOCS}screenshot.png`, fullPage: true })
    await page.goto(demo.address + hashOf('genset-1'))
    await page.getByRole('button', { name: 'Screen of the controller' }).click()
    for (const part of ['The display', 'samples of', 'A bar for each harmonic'])
      await page.getByRole('img', { name: part }).waitFor({ timeout: LINE_MS })
    await expect.poll(() => page.getByLabel('Screen', { exact: true }).locator('text=?').count()).toBe(0)
    await page.getByLabel('Screen', { exact: true }).screenshot({ path: `${DOCS}screen.png` })
    await page.setViewportSize({ width: 1280, height: 640 })
    await page.goto(`${demo.address}#/wires/line`)
    await page.getByRole('heading', { name: 'Wire line' }).waitFor()
    await page.screenshot({ path: `${DOCS}wires.png` })
    await page.close()
  },
  310_000,
)
