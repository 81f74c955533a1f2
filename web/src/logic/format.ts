// Numbers, units and times as text. A number is never rounded: what the gateway sent is what is shown.
import type { DeviceView, JoinedView } from './types'

/** The digits of a number as JSON carried them: no exponent, no float tail, no grouping. */
export function numberText(value: number): string {
  const text = String(value)
  const match = /^(-?)(\d)(?:\.(\d+))?e([+-]\d+)$/.exec(text)
  if (!match) return text
  const [, sign = '', first = '', rest = '', power = '0'] = match
  const digits = first + rest
  const point = 1 + Number(power)
  if (point <= 0) return `${sign}0.${'0'.repeat(-point)}${digits}`
  return sign + digits.padEnd(point, '0')
}

/** How many digits stand behind the decimal point. */
export function decimalsOf(value: number): number {
  const text = numberText(value)
  const dot = text.indexOf('.')
  return dot < 0 ? 0 : text.length - dot - 1
}

const UNITS: Record<string, string> = {
  degC: '°C',
  degF: '°F',
  deg: '°',
  ohm: 'Ω',
  kohm: 'kΩ',
  m3: 'm³',
  'm3/h': 'm³/h',
}

export function unitText(unit: string | null | undefined): string {
  return unit ? (UNITS[unit] ?? unit) : ''
}

const KINDS = { genset: 'genset', transfer_switch: 'transfer switch', compressor: 'compressor' }

/** What a controller is: maker, model (or those it may be), kind. */
export function kindText({ vendor, model, models, kind }: DeviceView): string {
  return `${vendor} ${model ?? models.join(' / ')} · ${KINDS[kind]}`
}

/** What is wrong with reaching a device, where its name stands already. */
export function faultText({ name, fault }: DeviceView): string {
  const rest = fault?.startsWith(`${name} `) ? fault.slice(name.length + 1) : (fault ?? '')
  return rest.charAt(0).toUpperCase() + rest.slice(1)
}

/** A word of the vocabulary as the panels write it: `auto` is `AUTO`, `load_test` is `LOAD TEST`. */
export function panelText(word: string): string {
  return word.replaceAll('_', ' ').toUpperCase()
}

/** An age in the fewest characters that still tell: `3 s`, `12 min`, `5 h`, `3 d`. */
export function ageText(ms: number): string {
  const seconds = Math.max(0, Math.floor(ms / 1000))
  if (seconds < 60) return `${seconds} s`
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`
  if (seconds < 48 * 3600) return `${Math.floor(seconds / 3600)} h`
  return `${Math.floor(seconds / 86400)} d`
}

/** A duration that a person watches: `8 s`, `2 min 05 s`, `3 h 20 min`, `2 d 4 h`. */
export function durationText(ms: number): string {
  const seconds = Math.max(0, Math.floor(ms / 1000))
  const minutes = Math.floor(seconds / 60)
  const hours = Math.floor(minutes / 60)
  if (minutes === 0) return `${seconds} s`
  if (hours === 0) return `${minutes} min ${pad(seconds % 60)} s`
  if (hours < 48) return `${hours} h ${pad(minutes % 60)} min`
  return `${Math.floor(hours / 24)} d ${hours % 24} h`
}

/** What is left of a countdown: `7 s`, `1:07 min`, `1:02:07 h`. */
export function countdownText(seconds: number): string {
  const whole = Math.max(0, Math.ceil(seconds))
  if (whole < 60) return `${whole} s`
  const minutes = Math.floor(whole / 60)
  if (minutes < 60) return `${minutes}:${pad(whole % 60)} min`
  return `${Math.floor(minutes / 60)}:${pad(minutes % 60)}:${pad(whole % 60)} h`
}

/** A number of hours as a counter has it: `1234 h 30 min`, with the seconds unless it is to be brief. */
export function hoursText(hours: number, brief = false): string {
  // Hours come to four decimals, so that the second they stand for is certain.
  const seconds = Math.round(Math.abs(hours) * 3600)
  const minutes = Math.floor(seconds / 60)
  const text = `${hours < 0 ? '-' : ''}${Math.floor(minutes / 60)} h ${pad(minutes % 60)} min`
  return brief ? text : `${text} ${pad(seconds % 60)} s`
}

/** What several points make up, in full. */
export function joinedText(view: JoinedView | undefined): string {
  if (typeof view?.value === 'number') return hoursText(view.value)
  if (typeof view?.value === 'string') return view.value.replace('T', ' ')
  if (view?.quality === 'invalid') return 'no data'
  return view?.quality === 'bad' && !view.ts ? 'never read' : 'not read yet'
}

const IN_ZONE = new Map<string, Intl.DateTimeFormat | undefined>()

/** Writes times in a zone; undefined where the browser does not know it. */
function formatOf(zone: string): Intl.DateTimeFormat | undefined {
  if (!IN_ZONE.has(zone)) {
    try {
      // Swedish writes dates as ISO 8601 does.
      const format = new Intl.DateTimeFormat('sv', {
        timeZone: zone,
        dateStyle: 'short',
        timeStyle: 'medium',
      })
      IN_ZONE.set(zone, format)
    } catch {
      IN_ZONE.set(zone, undefined)
    }
  }
  return IN_ZONE.get(zone)
}

/** The site's time zone where its clocks differ from the reader's now; times are then told in it, and it is named. */
export function zoneOf(zone: string | null | undefined, now: number): string | undefined {
  const format = zone ? formatOf(zone) : undefined
  return zone && format && format.format(now) !== localText(now) ? zone : undefined
}

/** Time of day in the zone, or else in the reader's, with the date in front unless it is today. */
export function clockText(time: number, now: number, zone?: string): string {
  const format = zone ? formatOf(zone) : undefined
  const [at, today] = format ? [format.format(time), format.format(now)] : [localText(time), localText(now)]
  return at.slice(0, 10) === today.slice(0, 10) ? at.slice(11) : at
}

function localText(time: number): string {
  const at = new Date(time)
  const day = `${at.getFullYear()}-${pad(at.getMonth() + 1)}-${pad(at.getDate())}`
  return `${day} ${pad(at.getHours())}:${pad(at.getMinutes())}:${pad(at.getSeconds())}`
}

/** Registers as the manuals and the command line write them: four hex digits each. */
export function registersText(registers: readonly number[]): string {
  return registers.map((register) => register.toString(16).toUpperCase().padStart(4, '0')).join(' ')
}

/** A time stamp of the gateway in milliseconds; undefined when there is none. */
export function timeOf(stamp: string | null | undefined): number | undefined {
  if (!stamp) return undefined
  const time = Date.parse(stamp)
  return Number.isNaN(time) ? undefined : time
}

function pad(value: number): string {
  return String(value).padStart(2, '0')
}
