// Made-up views for the tests: each takes what the test is about and fills the rest.
import type { AlarmView, DeviceView, GroupView, PointView, Snapshot, ValueView } from './types'

export const START = Date.parse('2026-11-23T04:00:00Z')
export const stamp = (seconds: number): string => new Date(START + seconds * 1000).toISOString()

export function point(id: string, rest: Partial<PointView> = {}): PointView {
  return {
    id,
    name: id,
    address: 10246,
    plc: 410247,
    registers: 1,
    unit: null,
    type: 'u16',
    rate: 'fast',
    signal: null,
    doubt: null,
    page: null,
    choices: [],
    bits: [],
    ...rest,
  }
}

export function group(title: string, points: PointView[], rest: Partial<GroupView> = {}): GroupView {
  return { id: title.toLowerCase(), title, rate: 'fast', points, ...rest }
}

export function value(id: string, value: ValueView['value'], rest: Partial<ValueView> = {}): ValueView {
  return { id, value, unit: null, quality: 'good', ts: stamp(0), raw: [0], ...rest }
}

export function device(id: string, rest: Partial<DeviceView> = {}): DeviceView {
  return {
    id,
    name: `Genset ${id}`,
    profile: 'datakom-d',
    vendor: 'Datakom',
    kind: 'genset',
    model: 'D-500',
    wire: id,
    unit: 1,
    online: true,
    fault: null,
    state: null,
    mode: null,
    alarms_fault: null,
    alarms: { shutdown: 0, load_dump: 0, trip: 0, warning: 0, indication: 0 },
    last_seen: stamp(0),
    ...rest,
  }
}

export function alarm(id: string, bit: number, kind: AlarmView['class'], since = 0): AlarmView {
  const point = `${kind}_alarms`
  return { device: id, point, bit, id: `bit_${bit}`, label: `Alarm ${bit}`, class: kind, since: stamp(since) }
}

export function snapshot(devices: Snapshot['devices'], alarms: AlarmView[] = [], started = 0): Snapshot {
  return { site: { name: 'North hospital', version: '0.1.0', started: stamp(started) }, devices, alarms }
}
