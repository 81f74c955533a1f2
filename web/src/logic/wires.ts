// What is said of wires: counters in plain words, how their time was used, how long answers took, what is polled.
import type { LatencyView, PlannedRound, Rate, UnitView, WireTime, WireView } from './types'

/** A count with its digits in groups of three, so that millions can be told from thousands. */
export function countText(count: number): string {
  return String(count).replace(/\B(?=(\d{3})+$)/g, '\u202f')
}

/** Bytes in the unit that leaves one to three digits before the point. */
export function bytesText(bytes: number): string {
  if (bytes < 1000) return `${bytes} B`
  const [value, unit] =
    bytes < 1_000_000 ? [bytes / 1e3, 'kB'] : bytes < 1e9 ? [bytes / 1e6, 'MB'] : [bytes / 1e9, 'GB']
  return `${value.toFixed(value < 100 ? 1 : 0)} ${unit}`
}

/** Milliseconds as a person reads them: `0.35 ms`, `3.2 ms`, `41 ms`, `1.2 s`. */
export function msText(ms: number | null | undefined): string {
  if (ms === null || ms === undefined) return '–'
  if (ms < 1) return `${ms.toFixed(2)} ms`
  if (ms < 10) return `${ms.toFixed(1)} ms`
  return ms < 1000 ? `${Math.round(ms)} ms` : `${(ms / 1000).toFixed(1)} s`
}

/** A share of 0 to 1: `0 %`, `0.4 %`, `23 %`. */
export function shareText(share: number | null | undefined): string {
  if (share === null || share === undefined) return '–'
  const percent = share * 100
  return `${percent > 0 && percent < 10 ? percent.toFixed(1) : Math.round(percent)} %`
}

export const STATE_WORDS: Record<WireView['state'], string> = {
  connected: 'Connected',
  connecting: 'Connecting',
  down: 'Down',
}

export function unitWords(unit: UnitView): string {
  switch (unit.state) {
    case 'answering':
      return 'Answering'
    case 'missing':
      return 'Did not answer'
    case 'silent':
      return `Silent, asked again in ${Math.ceil(unit.next_probe_s ?? 0)} s`
    case 'unknown':
      return 'Not known yet'
  }
}

/** `code 2: 3, code 6: 1`; a dash when there was none. */
export function exceptionsText(exceptions: readonly { code: number; count: number }[]): string {
  return exceptions.map(({ code, count }) => `code ${code}: ${countText(count)}`).join(', ') || '–'
}

export interface Counter {
  title: string
  value: string
  meaning: string
  /** Something a person should look at. */
  bad: boolean
}

/** What went over a wire; what is usually nought is left out while it is. */
export function countersOf({ statistics: of }: WireView): Counter[] {
  const plain = (title: string, value: string, meaning: string): Counter => ({
    title,
    value,
    meaning,
    bad: false,
  })
  const fault = (title: string, count: number, meaning: string): Counter[] =>
    count > 0 ? [{ title, value: countText(count), meaning, bad: true }] : []
  const exceptions = of.exceptions.length > 0
  return [
    plain('Requests', countText(of.requests), 'sent, repeats included'),
    plain('Answers', countText(of.answers), 'taken, exceptions included'),
    {
      ...plain('Time-outs', countText(of.timeouts), 'requests that had no answer in time'),
      bad: of.timeouts > 0,
    },
    {
      ...plain('CRC errors', countText(of.crc_errors), 'frames with a wrong checksum'),
      bad: of.crc_errors > 0,
    },
    {
      ...plain('Exceptions', exceptionsText(of.exceptions), 'answers by which a device refused'),
      bad: exceptions,
    },
    {
      ...plain('Late answers', countText(of.late), 'came after their time was up, and were dropped'),
      bad: of.late > 0,
    },
    plain('Repeats', countText(of.retries), 'reads that were sent once more'),
    plain('Sent', bytesText(of.bytes_out), 'bytes that left'),
    plain('Received', bytesText(of.bytes_in), 'bytes that came'),
    ...fault('Noise', of.garbage, 'bytes that belong to no frame'),
    ...fault('Echoes', of.echoes, 'own requests that a converter sent back'),
    ...fault('Held back', of.held, 'polls of silent units, so that the others keep their pace'),
    ...fault('Wrong unit', of.wrong_unit, 'answers from another unit than was asked'),
    ...fault('Wrong function', of.wrong_function, 'answers with another function than was asked'),
    ...fault('Wrong length', of.wrong_length, 'answers with more or less data than was asked for'),
    ...fault('Wrong echo', of.wrong_echo, 'confirmations of another write than was sent'),
    ...fault('Wrong protocol', of.wrong_protocol, 'frames that are no Modbus'),
    ...fault('Reconnected', of.reconnects, 'times the wire was connected again'),
  ]
}

export interface Bar {
  label: string
  count: number
  /** 0 to 100, of the fullest. */
  size: number
}

/** How long answers took, from the first bucket that has any to the last. */
export function barsOf({ buckets }: LatencyView): Bar[] {
  const most = Math.max(0, ...buckets.map(({ count }) => count))
  if (most === 0) return []
  const bars = buckets.map(({ up_to_ms, count }, index) => ({
    label:
      up_to_ms === null ? `over ${msText(buckets[index - 1]?.up_to_ms ?? 0)}` : `up to ${msText(up_to_ms)}`,
    count,
    size: (count / most) * 100,
  }))
  const filled = bars.map(({ count }) => count > 0)
  return bars.slice(filled.indexOf(true), filled.lastIndexOf(true) + 1)
}

export interface Span {
  kind: 'busy' | 'waiting' | 'free'
  title: string
  share: number
}

/** The time of a wire, shared out. Over TCP nobody knows how long the bytes were on the way. */
export function spansOf({ busy_share, waiting_share }: WireTime): Span[] {
  const busy = busy_share ?? 0
  const waiting = Math.min(waiting_share, 1 - busy)
  const spans: Span[] = [
    { kind: 'busy', title: 'Characters on the line', share: busy },
    { kind: 'waiting', title: 'Waiting for answers', share: waiting },
    { kind: 'free', title: 'Free', share: 1 - busy - waiting },
  ]
  return busy_share === null ? spans.slice(1) : spans
}

const RATES: Record<Rate, string> = { fast: 'fast', slow: 'slow', once: 'once', on_demand: 'on demand' }

export function ratesText(rates: readonly Rate[]): string {
  return rates.map((rate) => RATES[rate]).join(', ')
}

/** When a round comes: `Every 1 s`, `Every 10 s, with the one above`, `At the start and after an absence`. */
export function whenText({ every_s, rates }: PlannedRound): string {
  if (every_s === null) return 'At the start, and when the device comes back'
  const every = `Every ${every_s} s`
  return rates.length > 1 ? `${every}, slow points with the fast ones` : every
}
