// Every colour that carries text or a shape against every ground it stands on, in light and dark (WCAG 2.2 AA).
import { readFileSync } from 'node:fs'
import { join } from 'node:path'
import { describe, expect, test } from 'vitest'

const css = readFileSync(join(import.meta.dirname, '../app.css'), 'utf8')

function variables(text: string): Map<string, string> {
  return new Map(
    [...text.matchAll(/--([a-z-]+):\s*(#[0-9a-f]{6})/g)].map(([, name = '', value = '']) => [name, value]),
  )
}

const dark = css.indexOf('prefers-color-scheme: dark')
const light = variables(css.slice(0, dark))
const schemes = { light, dark: new Map([...light, ...variables(css.slice(dark))]) }

function luminance(hex: string): number {
  const [r = 0, g = 0, b = 0] = [1, 3, 5].map((at) => {
    const part = Number.parseInt(hex.slice(at, at + 2), 16) / 255
    return part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4
  })
  return 0.2126 * r + 0.7152 * g + 0.0722 * b
}

function contrast(a: string, b: string): number {
  const [low = 0, high = 0] = [luminance(a), luminance(b)].sort((x, y) => x - y)
  return (high + 0.05) / (low + 0.05)
}

const GROUNDS = ['ground', 'panel', 'inset']
const TEXT = 4.5
const SHAPE = 3
const PAIRS: [string, string[], number][] = [
  ['text', GROUNDS, TEXT],
  ['dim', GROUNDS, TEXT],
  ['accent', GROUNDS, TEXT],
  ['on-lost', ['lost'], TEXT],
  ['on-found', ['found'], TEXT],
  ['edge', ['panel'], SHAPE],
  ['shutdown', ['panel', 'inset'], SHAPE],
  ['load-dump', ['panel', 'inset'], SHAPE],
  ['trip', ['panel', 'inset'], SHAPE],
  ['warning-line', ['panel', 'inset'], SHAPE],
  ['indication', ['panel', 'inset'], SHAPE],
  ['on-sign', ['shutdown', 'load-dump', 'trip', 'indication'], SHAPE],
  ['on-warning', ['warning'], SHAPE],
]

describe.each(Object.entries(schemes))('in %s colours', (_, colours) => {
  const colour = (name: string) => colours.get(name) ?? expect.fail(`app.css has no --${name}`)
  test.each(PAIRS.flatMap(([name, on, least]) => on.map((ground) => [name, ground, least] as const)))(
    '%s stands out from %s by %d',
    (name, ground, least) => expect(contrast(colour(name), colour(ground))).toBeGreaterThanOrEqual(least),
  )
})

test('the measure is the one of the standard', () => {
  expect(contrast('#000000', '#ffffff')).toBeCloseTo(21)
  expect(contrast('#777777', '#ffffff')).toBeCloseTo(4.48, 2)
})
