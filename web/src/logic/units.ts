// The unit a person reads a value in. A converted number keeps the resolution that it came with, and claims no more.
import { decimalsOf, numberText, unitText } from './format'

export const PRESSURES = ['bar', 'kPa', 'psi'] as const
export const TEMPERATURES = ['degC', 'degF'] as const

/** What a person chose; undefined: as the controller gives it. */
export interface Choice {
  pressure?: (typeof PRESSURES)[number] | undefined
  temperature?: (typeof TEMPERATURES)[number] | undefined
}

/** A value as it stands on the page. */
export interface Shown {
  number: string
  /** The unit in print: `°C`, `kPa`. Empty where there is none. */
  unit: string
}

// 1 psi is a pound-force (4.4482216152605 N) on a square inch (645.16 mm2), both exact by definition.
const KPA: Readonly<Record<string, number>> = { bar: 100, kPa: 1, psi: 4.4482216152605 / 0.64516 }

/** The unit that a value of this unit is read in. */
export function unitFor(unit: string | null | undefined, choice: Choice): string | null | undefined {
  if (unit && unit in KPA) return choice.pressure ?? unit
  return unit === 'degC' || unit === 'degF' ? (choice.temperature ?? unit) : unit
}

/** The value in the chosen unit. `decimals`: how many the source has, where its last digit is a zero now. */
export function shown(
  value: number,
  unit: string | null | undefined,
  choice: Choice,
  decimals = decimalsOf(value),
): Shown {
  const to = unitFor(unit, choice)
  if (!unit || !to || to === unit) return { number: numberText(value), unit: unitText(unit) }
  const [factor, offset] = turn(unit, to)
  const step = 10 ** -Math.max(decimals, decimalsOf(value)) * factor
  const text = (value * factor + offset).toFixed(decimalsFor(step))
  return { number: /^-0\.?0*$/.test(text) ? text.slice(1) : text, unit: unitText(to) }
}

/** Factor and offset from one unit to the other. */
function turn(from: string, to: string): [number, number] {
  if (from === 'degC') return [1.8, 32]
  if (from === 'degF') return [1 / 1.8, -32 / 1.8]
  return [(KPA[from] ?? 1) / (KPA[to] ?? 1), 0]
}

/** The fewest decimals that still tell two neighbours of this distance apart. */
function decimalsFor(step: number): number {
  return Math.max(0, Math.ceil(-Math.log10(step) - 1e-9))
}

const KEY = 'busbar.units'

/** The choice kept in this browser; none where nothing is kept, or nothing that is understood. */
export function keptChoice(store: () => Pick<Storage, 'getItem'> = () => localStorage): Choice {
  try {
    const { pressure, temperature } = JSON.parse(store().getItem(KEY) ?? '{}') as Choice
    return {
      pressure: PRESSURES.find((unit) => unit === pressure),
      temperature: TEMPERATURES.find((unit) => unit === temperature),
    }
  } catch {
    return {}
  }
}

/** Keeps it where the browser lets us; the page works the same without. */
export function keepChoice(choice: Choice, store: () => Pick<Storage, 'setItem'> = () => localStorage): void {
  try {
    store().setItem(KEY, JSON.stringify(choice))
  } catch {
    // Storage is switched off or full: the choice lasts as long as the page.
  }
}
