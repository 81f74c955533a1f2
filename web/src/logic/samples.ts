// Made-up views for the tests: each takes what the test is about and fills the rest.
import type {
  AlarmView,
  DeviceView,
  GroupView,
  JoinedPointView,
  JoinedView,
  PointView,
  Snapshot,
  StateEvent,
  UnitView,
  ValueView,
  WireDetailView,
} from './types'

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

export function joined(signal: string, rest: Partial<JoinedPointView> = {}): JoinedPointView {
  return { signal, meaning: `Meaning of ${signal}`, unit: 'h', rate: 'slow', points: [], ...rest }
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
    models: ['D-300', 'D-500', 'D-700'],
    wire: id,
    unit: 1,
    online: true,
    fault: null,
    state: null,
    mode: null,
    alarms_fault: null,
    alarms: { shutdown: 0, load_dump: 0, trip: 0, warning: 0, indication: 0 },
    last_seen: stamp(0),
    identity: { verdict: 'confirmed', detail: 'it says that it is a D-500', checked: stamp(0) },
    desired: null,
    nameplate: { power_kw: null, tank_l: null, battery_v: null },
    ...rest,
  }
}

export function alarm(id: string, bit: number, kind: AlarmView['class'], since = 0): AlarmView {
  const point = `${kind}_alarms`
  return { device: id, point, bit, id: `bit_${bit}`, label: `Alarm ${bit}`, class: kind, since: stamp(since) }
}

interface Told {
  device: DeviceView
  values: ValueView[]
  joined?: JoinedView[]
}

/** A snapshot, and the states that come after it. */
export type Whole = Snapshot & { states: StateEvent[] }

export function snapshot(devices: Told[], alarms: AlarmView[] = [], started = 0, revision = 1): Whole {
  return {
    site: {
      name: 'North hospital',
      version: '0.1.0',
      started: stamp(started),
      time_zone: null,
      revision,
      config: { loaded: stamp(started), refused: null },
      beside: [],
    },
    devices: devices.map(({ device }) => device),
    alarms,
    states: devices.map(({ device: { id }, values, joined = [] }) => ({ device: id, values, joined })),
  }
}

/** Streams that a test speaks for: each word goes to all that are open. */
export class Streams {
  /** The addresses that were asked for. */
  asked: string[] = []
  #open: {
    close(): void
    listeners: Map<string, (event: { data?: unknown; lastEventId?: string }) => void>
  }[] = []

  open = (address: string) => {
    this.asked.push(address)
    const listeners = new Map<string, (event: { data?: unknown; lastEventId?: string }) => void>()
    const source = {
      listeners,
      addEventListener: (type: string, act: (event: { data?: unknown }) => void) =>
        void listeners.set(type, act),
      close: () => void (this.#open = this.#open.filter((one) => one !== source)),
    }
    this.#open.push(source)
    return source
  }

  emit(type: string, data?: unknown, lastEventId = ''): void {
    for (const { listeners } of [...this.#open]) {
      listeners.get(type)?.({ data: JSON.stringify(data), lastEventId })
    }
  }

  tell(whole: Whole): void {
    this.emit('snapshot', whole)
    for (const state of whole.states) this.emit('state', state)
  }
}

const LATENCY = {
  count: 4,
  min_ms: 1.2,
  mean_ms: 3.25,
  max_ms: 12,
  buckets: [
    { up_to_ms: 1, count: 0 },
    { up_to_ms: 2, count: 3 },
    { up_to_ms: 5, count: 0 },
    { up_to_ms: 20, count: 1 },
    { up_to_ms: null, count: 0 },
  ],
}
const TIME = { busy_s: 25, busy_share: 0.25, waiting_s: 5, waiting_share: 0.05 }

export function unit(id: number, rest: Partial<UnitView> = {}): UnitView {
  return {
    unit: id,
    device: `dev${id}`,
    state: 'answering',
    next_probe_s: null,
    requests: 5,
    answers: 4,
    timeouts: 1,
    retries: 1,
    held: 0,
    exceptions: [],
    late: 0,
    crc_errors: 0,
    garbage: 0,
    bytes_in: 1234,
    bytes_out: 60,
    latency: LATENCY,
    time: TIME,
    ...rest,
  }
}

export function wire(id: string, rest: Partial<WireDetailView['wire']> = {}): WireDetailView['wire'] {
  return {
    id,
    endpoint: 'rtu:///dev/ttyUSB0?baud=9600&parity=none&stop=1',
    state: 'connected',
    reason: null,
    statistics: {
      requests: 5,
      answers: 4,
      timeouts: 1,
      retries: 1,
      exceptions: [{ code: 2, count: 3 }],
      late: 0,
      wrong_unit: 0,
      wrong_function: 0,
      wrong_length: 0,
      wrong_echo: 0,
      wrong_protocol: 0,
      crc_errors: 2,
      garbage: 7,
      echoes: 0,
      held: 0,
      reconnects: 0,
      bytes_in: 1234,
      bytes_out: 60,
      latency_ms: 3.25,
    },
    ...rest,
  }
}

export function wireDetail(id: string, rest: Partial<WireDetailView> = {}): WireDetailView {
  const read = { function: 3, address: 36, count: 12, characters: 37, ms: 46.5 }
  return {
    wire: wire(id),
    latency: LATENCY,
    open_s: 100,
    time: TIME,
    units: [unit(1)],
    plans: [
      {
        device: 'dev1',
        unit: 1,
        spacing_ms: 500,
        rounds: [
          { rates: ['fast'], every_s: 1, reads: [{ ...read, rates: ['fast'] }], characters: 37, ms: 46.5 },
        ],
        refused: [],
        refresh_ms: 546.5,
        load: 0.0465,
      },
    ],
    ...rest,
  }
}
