// The page tells the truth, looked at each second: while a wire is cut and comes back, while the gateway is gone, stands
// still or is started again, and when another controller answers than the site file says.
import { type Browser, type Page } from 'playwright-core'
import { afterAll, afterEach, beforeAll, describe, expect, test } from 'vitest'
import { launch } from './browser'
import { Controller, Demo, Gateway } from './busbar'
import { Proxy } from './proxy'

/** A value read each second may be five seconds old; then a time-out, a second try, and this look each second. */
const ALLOWED_S = 9
/** So long a page whose gateway says nothing more may take to notice. */
const SILENT_S = 7
/** A silent device is asked less and less often, and that is how long it takes to notice its return. */
const BACK_MS = 60_000

let browser: Browser
let page: Page
let stops: (() => Promise<void>)[] = []

beforeAll(async () => {
  browser = await launch()
})

afterAll(() => browser?.close())

afterEach(async () => {
  await page?.close()
  for (const stop of stops.reverse()) await stop()
  stops = []
})

/** Stopped when the test ends. */
function ends<One extends { stop(): Promise<void> }>(one: One): One {
  stops.push(() => one.stop())
  return one
}

const TCP = 'tcp://127.0.0.1:0'
const LINE = 'rtu://pty?baud=9600&parity=none&stop=1'

interface Member {
  id: string
  profile: string
  at: Controller
}

/** Each controller on a wire of its own, which has the same name. */
function siteOf(members: readonly Member[]): string {
  const parts = members.map(
    ({ id, profile, at }) => `
[[wires]]
id = "${id}"
endpoint = "${at.url}"
[[devices]]
id = "${id}"
name = "The ${id}"
profile = "${profile}"
wire = "${id}"
unit = 1
`,
  )
  return `[site]\nname = "Truth"\n${parts.join('')}`
}

interface Look {
  /** Seconds since what happened. */
  after: number
  live: string
  told: string
  cards: Record<string, Card>
  /** Lines of a controller's page. */
  lines: { good: number; stale: number; bad: number }
}

interface Card {
  good: number
  link: string
  /** Seconds since it was heard, as the card says; undefined when it says minutes, or nothing. */
  heard: number | undefined
  fault: string
}

async function look(since: number): Promise<Look> {
  const seen = await page.evaluate(() => {
    const text = (from: ParentNode, selector: string) =>
      from.querySelector(selector)?.textContent?.replace(/\s+/g, ' ').trim() ?? ''
    const count = (selector: string) => document.querySelectorAll(selector).length
    const cards = [...document.querySelectorAll<HTMLElement>('[data-device]')].map((card) => {
      const link = text(card, '.link')
      const heard = /heard (\d+) s ago/.exec(link)?.[1]
      const good = card.querySelectorAll('dd.good').length
      return [
        card.dataset.device ?? '',
        { good, link, heard: heard === undefined ? undefined : Number(heard), fault: text(card, '.fault') },
      ] as const
    })
    return {
      live: text(document, 'header .live'),
      told: text(document, '[role="alert"]'),
      cards: Object.fromEntries(cards),
      lines: {
        good: count('[data-point].good'),
        stale: count('[data-point].stale'),
        bad: count('[data-point].bad'),
      },
    }
  })
  return { after: (Date.now() - since) / 1000, ...seen }
}

/** A look each second for so long. */
async function looks(seconds: number, since: number, judge: (look: Look) => void): Promise<void> {
  for (let second = 1; second <= seconds; second++) {
    await page.waitForTimeout(Math.max(0, since + second * 1000 - Date.now()))
    judge(await look(since))
  }
}

async function open(address: string): Promise<void> {
  page = await browser.newPage({ viewport: { width: 1280, height: 900 } })
  await page.goto(address)
}

const goods = (id: string) => page.locator(`[data-device="${id}"] dd.good`).count()
const answers = (id: string) =>
  expect.poll(() => goods(id), { timeout: BACK_MS, interval: 250 }).toBeGreaterThan(4)

describe('a wire', () => {
  test('that is cut and comes back is told of, and of no other', async () => {
    const members = await Promise.all([
      Controller.start('datakom-d', TCP).then((at) => ({ id: 'genset', profile: 'datakom-d', at: ends(at) })),
      Controller.start('smartgen-acc1700', LINE).then((at) => ({
        id: 'compressor',
        profile: 'smartgen-acc1700',
        at: ends(at),
      })),
      Controller.start('smartgen-hat821si', 'rtu+tcp://127.0.0.1:0').then((at) => ({
        id: 'switch',
        profile: 'smartgen-hat821si',
        at: ends(at),
      })),
    ])
    const gateway = ends(await Gateway.start(siteOf(members)))
    await open(gateway.address)
    for (const { id } of members) await answers(id)

    for (const { id, at } of members.slice(0, 2)) {
      const others = members.filter((member) => member.id !== id)
      at.freeze()
      const since = Date.now()
      await looks(ALLOWED_S + 6, since, ({ after, live, cards }) => {
        expect(live).toMatch(/^Live/)
        for (const other of others) {
          expect(cards[other.id]?.link, `${other.id} after ${after} s`).toMatch(/^Online/)
          expect(cards[other.id]?.good, `${other.id} after ${after} s`).toBeGreaterThan(4)
        }
        const card = cards[id]!
        // Whatever it says of when it was heard, it was not heard since.
        if (card.heard !== undefined) expect(card.heard).toBeGreaterThan(after - 3)
        if (after < ALLOWED_S) return
        expect(card, `after ${after} s`).toMatchObject({
          good: 0,
          link: expect.stringMatching(/^Not answering/),
        })
        expect(card.fault).toMatch(/did not answer|no answer/i)
      })
      at.thaw()
      await answers(id)
    }
  }, 240_000)

  test('whose controller is gone is told of on its own page too, line by line', async () => {
    const at = ends(await Controller.start('datakom-d', TCP))
    const gateway = ends(await Gateway.start(siteOf([{ id: 'genset', profile: 'datakom-d', at }])))
    await open(`${gateway.address}#/devices/genset`)
    const lines = () => page.locator('[data-point].good').count()
    await expect.poll(lines, { timeout: BACK_MS }).toBeGreaterThan(60)
    const { url } = at
    await at.stop('SIGKILL')
    const since = Date.now()
    await looks(ALLOWED_S + 4, since, ({ after, lines }) => {
      if (after < ALLOWED_S) return
      expect(lines, `after ${after} s`).toMatchObject({ good: 0 })
      expect(lines.bad).toBeGreaterThan(60)
    })
    expect(await page.locator('.summary').innerText()).toMatch(/Not answering/)
    expect(await page.locator('.summary .fault').innerText()).toMatch(/refused/)
    ends(await Controller.start('datakom-d', url))
    await expect.poll(lines, { timeout: BACK_MS }).toBeGreaterThan(60)
  }, 180_000)
})

describe('the gateway', () => {
  test('that is killed is missed at once, and found again when it is back', async () => {
    const at = ends(await Controller.start('datakom-d', TCP))
    const site = siteOf([{ id: 'genset', profile: 'datakom-d', at }])
    const gateway = ends(await Gateway.start(site))
    await open(gateway.address)
    await answers('genset')
    await gateway.stop('SIGKILL')
    const since = Date.now()
    await looks(6, since, ({ after, live, told, cards }) => {
      if (after < 2) return
      expect(live).toMatch(/^No connection/)
      expect(told).toMatch(/No connection to the gateway.*Nothing below is live/)
      expect(cards.genset).toMatchObject({ good: 0, link: expect.stringMatching(/^Not live/) })
    })
    ends(await Gateway.start(site, gateway.port))
    await answers('genset')
    expect((await look(since)).live).toMatch(/^Live/)
  }, 120_000)

  test('that stands still without hanging up is missed too', async () => {
    const at = ends(await Controller.start('datakom-d', TCP))
    const gateway = ends(await Gateway.start(siteOf([{ id: 'genset', profile: 'datakom-d', at }])))
    await open(`${gateway.address}#/devices/genset`)
    const good = () => page.locator('[data-point].good').count()
    await expect.poll(good, { timeout: BACK_MS }).toBeGreaterThan(60)
    // It learns how often the gateway speaks.
    await page.waitForTimeout(12_000)
    gateway.freeze()
    const since = Date.now()
    await looks(SILENT_S + 4, since, ({ after, live, lines }) => {
      if (after < SILENT_S) return
      expect(live, `after ${after} s`).not.toMatch(/^Live/)
      expect(lines.good).toBe(0)
    })
    gateway.thaw()
    await expect.poll(good, { timeout: BACK_MS }).toBeGreaterThan(60)
  }, 120_000)

  test('behind a proxy, below a path: everything is found, and a cut stream goes on where it ended', async () => {
    const demo = ends(await Demo.start())
    const proxy = ends(await Proxy.start(demo.address, '/busbar/'))
    await open(proxy.address)
    await answers('genset-1')
    await page.getByRole('link', { name: 'Wires' }).click()
    await page.getByRole('heading', { name: 'Wire network' }).waitFor()
    await page.getByRole('link', { name: 'Genset 1', exact: true }).first().click()
    await expect
      .poll(() => page.locator('[data-point].good').count(), { timeout: BACK_MS })
      .toBeGreaterThan(60)
    await page.getByRole('link', { name: 'Overview' }).click()
    await answers('genset-1')
    const streams = () => proxy.asked.filter((path) => path.includes('/events?signal='))
    expect(streams()).toHaveLength(1)
    expect(streams()[0]).not.toContain('last_event_id')

    proxy.cut()
    await expect.poll(() => streams().length, { timeout: 15_000 }).toBe(2)
    expect(streams()[1]).toMatch(/last_event_id=./)
    await answers('genset-1')
    expect((await look(Date.now())).live).toMatch(/^Live/)
    expect(proxy.asked.filter((path) => !path.startsWith('/busbar/'))).toEqual([])
  }, 120_000)
})

describe('another controller than the site file says', () => {
  test('is a fault of its own, and no value of it is shown', async () => {
    const at = ends(await Controller.start('smartgen-acc1700', 'rtu+tcp://127.0.0.1:0'))
    const gateway = ends(await Gateway.start(siteOf([{ id: 'genset', profile: 'datakom-dkg705', at }])))
    await open(gateway.address)
    const verdict = async () => {
      const answer = await page.request.get(new URL('api/v1/devices/genset', gateway.address).href)
      return ((await answer.json()) as { identity: { verdict: string } }).identity.verdict
    }
    await expect.poll(verdict, { timeout: 30_000 }).toBe('wrong')
    const since = Date.now()
    await looks(5, since, ({ cards }) => {
      expect(cards.genset?.good).toBe(0)
      expect(cards.genset?.fault).not.toBe('')
    })
    await page.goto(`${gateway.address}#/devices/genset`)
    await page.locator('.summary .fault').waitFor()
    expect(await page.locator('[data-point].good').count()).toBe(0)
  }, 90_000)
})
