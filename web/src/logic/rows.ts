// A group's points as lines of the page: the phases of one quantity share a line, so do the parts of hours and clocks.
import type { GroupView, JoinedPointView, PointView } from './types'

export interface Member {
  /** `L1`, `L23`, `A`; empty for a point that has its line alone. */
  label: string
  point: PointView
}

export interface Row {
  id: string
  name: string
  members: Member[]
  /** What the members make up together, shown in their place. */
  joined?: JoinedPointView
}

/** Values that need the width of the page for themselves. */
const WIDE = new Set(['bits', 'bits2', 'trace', 'image', 'bytes'])

const NUMERIC = new Set(['u8', 'i8', 'u16', 'i16', 'u32', 'i32', 'sm16', 'sm24', 'fraction8', 'fraction16'])

/** How makers write a phase: its token in the id, and in the name the words that go when phases share a line. */
const PHASES = [
  {
    token: /(^|_)(l[123](?:_l[123])?)(?=_|$)/,
    line: /\b(?:[Pp]hase )?(?:[A-Z]{2} )?\(?L[123][-_ ]?L[123]\)?/,
    phase: /\s*\b(?:[Pp]hase )?(?:[A-Z] )?\(?L[123]\)?/,
  },
  { token: /(^|_)(ab|bc|ca|[abc])(?=_)/, line: /\b(?:AB|BC|CA) line\b/, phase: /\s*\b[ABC] phase\b/ },
] as const

/** The lines of a group in the profile's order; a shared line stands where its first point stands. */
export function rowsOf(group: GroupView, joined: readonly JoinedPointView[] = []): Row[] {
  const shared = new Map<string, Row>()
  const rows: Row[] = []
  for (const point of group.points) {
    const whole = joined.find(({ points }) => points.includes(point.id) && here(group, points[0]))
    const phase = whole ? { key: whole.signal, label: '' } : phaseOf(point)
    const row = phase && shared.get(phase.key)
    if (row) {
      row.members.push({ label: phase.label, point })
      continue
    }
    const fresh: Row = { id: point.id, name: point.name, members: [{ label: phase?.label ?? '', point }] }
    if (whole) Object.assign(fresh, { name: whole.meaning.replace(/, joined .*/, ''), joined: whole })
    if (phase) shared.set(phase.key, fresh)
    rows.push(fresh)
  }
  const named = rows.map((row) => (row.joined ? row : withoutPhase(row)))
  const mark = markOf(named)
  return named.map((row) => ({ ...row, name: within(mark, within(group.title, row.name)) }))
}

function here(group: GroupView, id: string | undefined): boolean {
  return group.points.some((point) => point.id === id)
}

function phaseOf(point: PointView): { key: string; label: string } | undefined {
  if (!NUMERIC.has(point.type)) return undefined
  for (const { token, line, phase } of PHASES) {
    const found = token.exec(point.id)?.[2]
    if (!found) continue
    const kind = found.length > 1 && !/^l\d$/.test(found) ? 'line' : 'phase'
    // Letters alone may be anything: the name must say so too.
    if (!/\d/.test(found) && !(kind === 'line' ? line : phase).test(point.name)) continue
    return {
      key: [point.id.replace(token, `$1${kind}`), point.type, point.unit ?? ''].join(' '),
      label: found.toUpperCase().replace('_L', ''),
    }
  }
  return undefined
}

/** A shared line drops the phase from its name; a phase that stayed alone keeps its name and has no label. */
function withoutPhase(row: Row): Row {
  if (row.members.length === 1) {
    return { ...row, members: row.members.map((member) => ({ ...member, label: '' })) }
  }
  let name = row.name
  for (const { line, phase } of PHASES) name = name.replace(line, 'line').replace(phase, '').trim()
  return { ...row, name: name || row.name }
}

/** A short mark that all lines of a group begin with, such as S1 or J1939. */
function markOf(rows: readonly Row[]): string {
  const [mark = ''] = rows[0]?.name.split(' ') ?? []
  const all = rows.length > 1 && rows.every(({ name }) => name.startsWith(`${mark} `))
  return all && /^[A-Z]+\d+$/.test(mark) ? mark : ''
}

/** Under the heading "Genset", "Genset frequency" is "Frequency"; "Battery 2 voltage" stays as it is. */
function within(title: string, name: string): string {
  const rest = name.slice(title.length).trim()
  if (!title || !name.toLowerCase().startsWith(`${title.toLowerCase()} `) || !/^[a-z]/i.test(rest))
    return name
  return capital(rest)
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1)
}

/** So many bits make an array whose labels are worth shortening. */
const MANY_BITS = 4

/** The labels of a bit array without the words that its own name and all of them begin or end with. */
export function shortLabels(point: PointView): (label: string) => string {
  const names = [point.name, ...point.bits.map(({ label }) => label)].map((name) => name.split(' '))
  const same = (at: (words: string[]) => string | undefined) =>
    names.every((words) => at(words) !== undefined && at(words) === at(names[0] ?? []))
  let [front, back] = [0, 0]
  if (point.bits.length >= MANY_BITS) {
    while (same((words) => words[front])) front += 1
    while (same((words) => words[words.length - 1 - back])) back += 1
  }
  return (label) => {
    const words = label.split(' ')
    const rest = words.slice(front, words.length - back).join(' ')
    return /^[a-z]/i.test(rest) ? capital(rest) : label
  }
}

export function isWide(point: PointView): boolean {
  return WIDE.has(point.type)
}

/** A group that is only read when asked for starts closed. */
export function startsOpen(group: GroupView): boolean {
  return group.rate !== 'on_demand'
}

/** So many lines are drawn or left out together. */
const CHUNK = 40

/** The lines in pieces, so that of a long group only what is near need be drawn. */
export function chunksOf<T>(rows: readonly T[]): T[][] {
  return Array.from({ length: Math.ceil(rows.length / CHUNK) }, (_, at) =>
    rows.slice(at * CHUNK, (at + 1) * CHUNK),
  )
}

/** Lines a group takes on the page, title included: what the columns are balanced by. */
export function weightOf(group: GroupView, joined: readonly JoinedPointView[] = []): number {
  if (!startsOpen(group)) return 2
  return rowsOf(group, joined).reduce(
    (sum, row) => sum + (row.members.some(({ point }) => isWide(point)) ? 2.5 : 1),
    2,
  )
}

/**
 * Deals the groups out to `count` columns, each to the lowest so far: the first groups of a profile come to the top.
 * It depends on the points alone: a value that changes never moves a group to another column.
 */
export function columnsOf(
  groups: readonly GroupView[],
  count: number,
  joined: readonly JoinedPointView[] = [],
): GroupView[][] {
  const columns = Array.from({ length: count }, () => ({ height: 0, groups: [] as GroupView[] }))
  for (const group of groups) {
    const lowest = columns.reduce((a, b) => (b.height < a.height ? b : a))
    lowest.height += weightOf(group, joined)
    lowest.groups.push(group)
  }
  return columns.map((column) => column.groups)
}
