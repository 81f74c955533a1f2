// Two-bit fields (LEDs, inputs): each code by its name where the profile has one, else as the number it is.
import type { PointView } from './types'

export interface Lamp {
  field: number
  code: number
  label: string
}

export function lampsOf(point: PointView, codes: readonly (string | number)[]): Lamp[] {
  return codes.map((value, field) => {
    const code = Number(value)
    return {
      field,
      code,
      label: point.choices.find((choice) => choice.value === code)?.label ?? `code ${code}`,
    }
  })
}
