// The few values that say at a glance how a device is, found by signal, whoever made it.
import type { GroupView, PointView } from './types'

/** In the order of the page; the first signal that a device has fills the tile. */
const TILES: readonly { title: string; signals: readonly string[] }[] = [
  { title: 'Mains voltage', signals: ['mains.voltage.average', 'mains.l1.voltage'] },
  { title: 'Mains frequency', signals: ['mains.frequency'] },
  { title: 'Source 1 voltage', signals: ['src1.l1.voltage', 'src1.l1_l2.voltage'] },
  { title: 'Source 1 frequency', signals: ['src1.frequency'] },
  { title: 'Source 2 voltage', signals: ['src2.l1.voltage', 'src2.l1_l2.voltage'] },
  { title: 'Source 2 frequency', signals: ['src2.frequency'] },
  { title: 'Genset voltage', signals: ['genset.voltage.average', 'genset.l1.voltage'] },
  { title: 'Genset frequency', signals: ['genset.frequency'] },
  { title: 'Genset power', signals: ['genset.power.active'] },
  { title: 'Discharge pressure', signals: ['compressor.discharge.pressure'] },
  { title: 'Discharge temperature', signals: ['compressor.discharge.temperature'] },
  { title: 'Engine speed', signals: ['engine.speed'] },
  { title: 'Oil pressure', signals: ['engine.oil.pressure'] },
  { title: 'Coolant', signals: ['engine.coolant.temperature'] },
  { title: 'Battery', signals: ['battery.voltage'] },
  { title: 'Fuel', signals: ['fuel.level'] },
]

export interface Tile {
  title: string
  point: PointView
}

export function tilesOf(groups: readonly GroupView[]): Tile[] {
  const bySignal = new Map<string, PointView>()
  for (const point of groups.flatMap((group) => group.points)) {
    if (point.signal && !bySignal.has(point.signal)) bySignal.set(point.signal, point)
  }
  return TILES.flatMap(({ title, signals }) => {
    const point = signals.map((signal) => bySignal.get(signal)).find((found) => found !== undefined)
    return point ? [{ title, point }] : []
  })
}
