// What only those see who look, in a real browser on the real program: a controller's own screen, and the diagram.
import { type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest'
import { SHOTS, hear, launch } from './browser'
import { pictureOf } from '../src/screen/lcd'
import { Demo } from './busbar'

type Look = readonly [name: string, viewport: { width: number; height: number }, scheme: 'light' | 'dark']
const LOOKS: readonly Look[] = [
  ['desk', { width: 1280, height: 900 }, 'light'],
  ['phone', { width: 360, height: 740 }, 'dark'],
]
/** The whole picture is 32 reads. */
const READ_MS = 20_000
const LCD = '[data-point=lcd]'

interface Value {
  id: string
  value: unknown
  ts: string
}

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

async function open(hash: string, [, viewport, colorScheme]: Look): Promise<Page> {
  const page = await browser.newPage({ viewport, colorScheme })
  hear(page, complaints)
  await page.goto(demo.address + hash)
  return page
}

const get = async (page: Page, path: string) =>
  (await page.request.get(new URL(`api/v1/${path}`, demo.address).href)).json()

async function valueOf(page: Page, id: string): Promise<Value | undefined> {
  const values = (await get(page, 'devices/genset-1/values')) as Value[]
  return values.find((value) => value.id === id)
}

const overflow = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth)

/** How many dots of the display are dark, counted in what is drawn. */
const drawn = (page: Page) =>
  page
    .locator(`${LCD} svg path`)
    .evaluate((path) =>
      [...(path.getAttribute('d') ?? '').matchAll(/h(\d+)v/g)].reduce((sum, [, run]) => sum + Number(run), 0),
    )

describe.each(LOOKS)('on a %s', (...look) => {
  const [name, , scheme] = look

  test('the display, the waveform and the harmonics are read while they are looked at, and not after', async () => {
    const page = await open('#/devices/genset-1', look)
    const button = page.getByRole('button', { name: 'Screen of the controller' })
    await button.waitFor()
    await button.focus()
    await page.keyboard.press('Enter')
    await page.locator(`${LCD} [role=img]`).waitFor({ timeout: READ_MS })
    await page.locator('[data-point=scope] [role=img]').waitFor({ timeout: READ_MS })
    expect(await drawn(page)).toBeGreaterThan(300)
    // The picture on the page is one that the gateway has, dot for dot.
    const same = async () => {
      const picture = pictureOf((await valueOf(page, 'lcd'))?.value)
      return picture?.dark.flat().filter(Boolean).length === (await drawn(page))
    }
    await expect.poll(same, { timeout: READ_MS }).toBe(true)
    expect(await page.locator('[data-point=scope] .all').textContent()).toMatch(/^(-?\d+, ){99}-?\d+$/)
    await page.getByText('As a table').click()
    const rows = page.getByRole('table').locator('tbody tr')
    expect(await rows.count()).toBe(15)
    expect(await rows.first().innerText()).toMatch(/^3\s+\d+(\.\d+)?\s%/)
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}screen-${name}-${scheme}.png`, fullPage: true })

    // It is read again and again while it is open, ...
    const first = (await valueOf(page, 'lcd'))?.ts ?? ''
    await expect
      .poll(async () => (await valueOf(page, 'lcd'))?.ts ?? '', { timeout: READ_MS })
      .not.toBe(first)
    // ... and after it is closed no more: a round under way may end, then it stands still while others go on.
    await button.click()
    await page.locator(LCD).waitFor({ state: 'detached' })
    const still = async () => {
      const [before, others] = [await valueOf(page, 'lcd'), await valueOf(page, 'mains_l1_voltage')]
      await expect
        .poll(async () => (await valueOf(page, 'mains_l1_voltage'))?.ts, { timeout: READ_MS })
        .not.toBe(others?.ts)
      return before?.ts === (await valueOf(page, 'lcd'))?.ts
    }
    await expect.poll(still, { timeout: READ_MS }).toBe(true)
    expect(complaints).toEqual([])
    await page.close()
  })

  test('the diagram shows the whole site in drawing and words, and leads to the controllers', async () => {
    const page = await open('', look)
    const diagram = page.getByRole('region', { name: 'Single-line diagram' })
    await diagram.waitFor()
    const { nodes, connections } = (
      (await get(page, 'site')) as { diagram: Record<string, { id: string }[]> }
    ).diagram
    expect(nodes?.length).toBeGreaterThan(3)
    expect(await diagram.locator('[data-node]').count()).toBe(nodes?.length)
    expect(await diagram.locator('[data-connection]').count()).toBe(connections?.length)
    // The slow line has answered too: nothing is unknown any more.
    await expect
      .poll(
        () => diagram.locator('[data-node]').evaluateAll((all) => all.map((node) => node.ariaLabel).join()),
        {
          timeout: 30_000,
        },
      )
      .not.toContain('not known')
    await diagram.getByText('In words').click()
    expect(await diagram.locator('li').count()).toBe((nodes?.length ?? 0) + (connections?.length ?? 0))
    expect(await overflow(page)).toBe(0)
    await page.screenshot({ path: `${SHOTS}diagram-${name}-${scheme}.png`, fullPage: true })

    // By keyboard from a node to its controller.
    await diagram.locator('a[data-node]').first().focus()
    await page.keyboard.press('Enter')
    await page.waitForFunction(() => location.hash.startsWith('#/devices/'))
    expect(complaints).toEqual([])
    await page.close()
  })
})
