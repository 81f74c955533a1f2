// What every test in a real browser needs: the browser, where its pictures go, and an ear for what a page complains about.
import { mkdir } from 'node:fs/promises'
import { fileURLToPath } from 'node:url'
import { chromium, type Browser, type Page } from 'playwright-core'

/** Pictures that people look at after a run. */
export const SHOTS = fileURLToPath(new URL('shots/', import.meta.url))
/** Those that the documents show. */
export const DOCS = fileURLToPath(new URL('../../docs/', import.meta.url))

export const DESK = { width: 1280, height: 900 }
export const PHONE = { width: 360, height: 740 }

export async function launch(): Promise<Browser> {
  await mkdir(SHOTS, { recursive: true })
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    // Root has no sandbox; nothing but the page under test is opened.
    args: ['--no-sandbox'],
  })
}

/** Adds whatever goes wrong on a page from here on. */
export function hear(page: Page, complaints: string[]): void {
  page.on('console', (message) => {
    if (message.type() === 'error' || message.type() === 'warning')
      complaints.push(`console: ${message.text()}`)
  })
  page.on('pageerror', (error) => complaints.push(`error: ${error.message}`))
}

/** Adds every request to another place than this one. */
export function hearStrangers(page: Page, place: string, complaints: string[]): void {
  page.on('request', (request) => {
    if (!request.url().startsWith(place)) complaints.push(`a request to somebody else: ${request.url()}`)
  })
}
