// What a point is, in words for its details.
import type { PointView, Rate } from './types'

export const RATES: Readonly<Record<Rate, string>> = {
  fast: 'each round',
  slow: 'less often',
  once: 'at the start',
  on_demand: 'on demand',
}

const TYPES: Readonly<Record<string, string>> = {
  u8: 'unsigned, 8 bits',
  i8: 'signed, 8 bits',
  u16: 'unsigned, 16 bits',
  i16: 'signed, 16 bits',
  u32: 'unsigned, 32 bits, low register first',
  i32: 'signed, 32 bits, low register first',
  sm16: 'sign and magnitude, 16 bits',
  sm24: 'sign and magnitude, 24 bits',
  bits: 'a name for each bit',
  bits2: 'fields of two bits',
  choice: 'a name for each code',
}

export function typeText({ type }: Pick<PointView, 'type'>): string {
  const words = TYPES[type]
  return words ? `${type}: ${words}` : type
}
