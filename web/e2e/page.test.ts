// The page in a real browser, on the real program: an imitated controller, polled over a real socket.
import { copyFile, mkdir } from 'node:fs/promises'
import { fileURLToPath } from 'node:url'
import { chromium, type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest'
import { Demo } from './busbar'

const SHOTS = fileURLToPath(new URL('shots/', import.meta.url))
const README_PICTURE = fileURLToPath(new URL('../../docs/screenshot.png', import.meta.url))

const DESK = { width: 1280, height: 900 }
const PHONE = { width: 360, height: 740 }

let browser: Browser
let demo: Demo
let complaints: string[] = []

beforeAll(async () => {
  await mkdir(SHOTS, { recursive: true })
  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    // Root has no sandbox; nothing but the page under test is opened.
    args: ['--no-sandbox'],
  })
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
async function open(viewport = DESK, colorScheme: 'light' | 'dark' = 'light'): Promise<Page> {
  const page = await browser.newPage({ viewport, colorScheme })
  page.on('console', (message) => {
    if (message.type() === 'error' || message.type() === 'warning')
      complaints.push(`console: ${message.text()}`)
  })
  page.on('pageerror', (error) => complaints.push(`error: ${error.message}`))
  page.on('requestfailed', (request) => complaints.push(`failed: ${request.url()}`))
  page.on('response', (answer) => {
    if (answer.status() >= 400) complaints.push(`${answer.status()}: ${answer.url()}`)
  })
  page.on('request', (request) => {
    if (!request.url().startsWith(demo.address))
      complaints.push(`a request to somebody else: ${request.url()}`)
  })
  await page.goto(demo.address)
  return page
}

/** All groups are there and a number stands in the first line of the genset. */
async function filled(page: Page): Promise<void> {
  await page.locator('[data-point] .number').first().waitFor()
  await page.waitForFunction(() => document.querySelectorAll('[data-point] .number').length > 60)
}

const overflow = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)

describe.each([
  ['desk', DESK, 'light'],
  ['desk', DESK, 'dark'],
  ['phone', PHONE, 'light'],
  ['phone', PHONE, 'dark'],
] as const)('on a %s', (name, viewport, scheme) => {
  test(`in ${scheme} colours the controller is shown, live`, async () => {
    const page = await open(viewport, scheme)
    await filled(page)

    const state = page.getByTestId('state')
    expect(await state.textContent()).not.toMatch(/^\s*(not known)?\s*$/)
    expect(await page.getByTestId('mode').textContent()).toMatch(/[A-Z]/i)
    expect(await page.getByRole('heading', { level: 1 }).textContent()).not.toBe('')
    await page.getByText('Live', { exact: true }).waitFor()

    // One number changes while nobody touches anything.
    const before = await page.locator('[data-point] .number').allTextContents()
    await page.waitForFunction(
      (old) => {
        const now = [...document.querySelectorAll('[data-point] .number')].map((number) => number.textContent)
        return now.length === old.length && now.some((text, index) => text !== old[index])
      },
      before,
      { timeout: 20_000 },
    )

    // Numbers as the gateway gives them: no float tail, no exponent.
    for (const text of await page.locator('.number').allTextContents()) {
      expect(text).toMatch(/^-?\d+(\.\d{1,4})?$/)
    }
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}${name}-${scheme}.png` })
    await page.screenshot({ path: `${SHOTS}${name}-${scheme}-whole.png`, fullPage: true })

    // The widest thing there is, a list of 142 named bits, fits too.
    await page.locator('[data-point="shutdown_alarms"] > button').click()
    await page.getByText('Genset low frequency').first().waitFor()
    expect(await overflow(page)).toBe(0)
    expect(complaints).toEqual([])
    await page.close()
  })
})

test.each([
  ['desk', DESK, 'light'],
  ['phone', PHONE, 'dark'],
] as const)('on a %s the wires tell what goes over them', async (name, viewport, scheme) => {
  const page = await open(viewport, scheme)
  await page.getByRole('link', { name: 'Wires' }).click()
  await page.getByRole('heading', { name: /^Wire / }).waitFor()
  await page.getByText('Connected').first().waitFor()
  const requests = () => page.locator('dl dd').first().textContent()
  const before = await requests()
  await expect.poll(requests, { timeout: 10_000 }).not.toBe(before)
  await page.getByText('Every read').first().click()
  expect(await page.getByRole('table').count()).toBeGreaterThan(2)
  expect(await overflow(page)).toBe(0)
  await page.screenshot({ path: `${SHOTS}wires-${name}-${scheme}.png`, fullPage: true })
  expect(complaints).toEqual([])
  await page.close()
})

test('what the page shows is what the API says', async () => {
  const page = await open()
  await filled(page)
  const get = async (path: string) => (await page.request.get(new URL(path, demo.address).href)).json()
  const [device] = (await get('api/v1/devices')) as { id: string }[]
  const numbers = async () =>
    new Map(
      ((await get(`api/v1/devices/${device?.id}/values`)) as { id: string; value: unknown }[])
        .filter(({ value }) => typeof value === 'number')
        .map(({ id, value }) => [id, String(value)]),
    )
  // Whatever did not move between two looks at the API must stand on the page between them.
  const differing = async () => {
    const before = await numbers()
    const shown = await page.evaluate(() =>
      [...document.querySelectorAll<HTMLElement>('[data-point]')].map(
        (line) => [line.dataset.point ?? '', line.querySelector('.number')?.textContent] as const,
      ),
    )
    const after = await numbers()
    const still = shown.filter(([id]) => before.has(id) && before.get(id) === after.get(id))
    return still.length < 30
      ? ['too few that stand still']
      : still.filter(([id, text]) => text !== before.get(id))
  }
  await expect.poll(differing, { timeout: 20_000 }).toEqual([])
  expect(complaints).toEqual([])
  await page.close()
})

test('by keyboard alone: a line opens and tells address and 4xxxx number', async () => {
  const page = await open()
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
  await filled(page)
  const answer = await page.request.get(demo.address)
  expect(answer.headers()['content-security-policy']).toContain("default-src 'self'")
  expect(complaints).toEqual([])
  await page.close()
})

test('works below a path prefix, as behind a reverse proxy', async () => {
  const page = await browser.newPage({ viewport: DESK })
  page.on('pageerror', (error) => complaints.push(`error: ${error.message}`))
  const prefix = new URL('site/north/', demo.address).href
  await page.route(`${demo.address}**`, async (route) => {
    const url = route.request().url()
    if (!url.startsWith(prefix)) return route.fulfill({ status: 404 })
    // A stream cannot be replayed through the test: that it asks for the right one is what counts here.
    if (url.includes('/events')) return route.abort()
    return route.fulfill({ response: await route.fetch({ url: url.replace(prefix, demo.address) }) })
  })
  const asked = page.waitForRequest(`${prefix}api/v1/events*`)
  await page.goto(prefix)
  await asked
  await page.getByRole('alert').getByText('No connection to the gateway.').waitFor()
  expect(complaints).toEqual([])
  await page.close()
})

test('a gateway that goes away is told within seconds, and it comes back by itself', async () => {
  const own = await Demo.start()
  const page = await browser.newPage({ viewport: DESK })
  await page.goto(own.address)
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

  const again = await Demo.start(own.port)
  await told.waitFor({ state: 'detached' })
  await page.waitForFunction(() => document.querySelectorAll('[data-point].good').length > 30)
  await page.close()
  await again.stop()
})

// Only when asked for, so that a test run leaves the tree as it was.
test.runIf(process.env.BUSBAR_SCREENSHOT === '1')(
  'the picture of the README',
  async () => {
    const page = await open()
    await filled(page)
    // The demonstration starts its genset by itself and runs low on fuel: the picture shows it at work, with a warning.
    await page.waitForFunction(
      () =>
        /on load/i.test(document.querySelector('[data-testid="state"]')?.textContent ?? '') &&
        document.querySelector('.alarms .warning'),
      undefined,
      { timeout: 300_000 },
    )
    await page.screenshot({ path: `${SHOTS}readme.png` })
    await copyFile(`${SHOTS}readme.png`, README_PICTURE)
    await page.close()
  },
  310_000,
)
