// What a value means on this machine: its share of the nameplate, litres in the tank, volts against the nominal ones.
import type { DeviceView } from './types'

export interface Rated {
  text: string
  /** 0 to 1, for a small bar; undefined where a bar says nothing. */
  share?: number
  /** Below what the nameplate says: worth a sign. */
  low?: boolean
}

/** Undefined where the site file says nothing about it. */
export function ratedOf(
  signal: string | null,
  value: number,
  { power_kw: power, tank_l: tank, battery_v: nominal }: DeviceView['nameplate'],
): Rated | undefined {
  if (signal === 'genset.power.active' && power)
    return {
      text: `${Math.round((value / power) * 100)}\u00a0% of ${power}\u00a0kW`,
      share: within(value / power),
    }
  if (signal === 'fuel.level' && tank)
    return {
      text: `about ${Math.round((value / 100) * tank)}\u00a0L of ${tank}\u00a0L`,
      share: within(value / 100),
    }
  if (signal === 'battery.voltage' && nominal)
    return value < nominal
      ? { text: `below ${nominal}\u00a0V nominal`, low: true }
      : { text: `of ${nominal}\u00a0V nominal` }
  return undefined
}

function within(share: number): number {
  return Math.min(1, Math.max(0, share))
}
