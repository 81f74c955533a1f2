// A group's points as lines of the page: the phases of one quantity share a line, everything else has its own.
import type { GroupView, PointView } from './types'

export interface Member {
  /** `L1`, `L23`; empty for a point that has its line alone. */
  label: string
  point: PointView
}

export interface Row {
  id: string
  name: string
  members: Member[]
}

/** Values that need the width of the page for themselves. */
const WIDE = new Set(['bits', 'bits2', 'trace', 'image', 'bytes'])

const PHASE = /(?:^|_)(l[123](?:_l[123])?)(?=_|$)/
const NUMERIC = new Set(['u8', 'i8', 'u16', 'i16', 'u32', 'i32', 'sm16', 'sm24', 'fraction8', 'fraction16'])

/** The lines of a group in the profile's order; a shared line stands where its first phase stands. */
export function rowsOf(group: GroupView): Row[] {
  const shared = new Map<string, Row>()
  const rows: Row[] = []
  for (const point of group.points) {
    const phase = phaseOf(point)
    const row = phase && shared.get(phase.key)
    if (row) {
      row.members.push({ label: phase.label, point })
      continue
    }
    const fresh: Row = { id: point.id, name: point.name, members: [{ label: phase?.label ?? '', point }] }
    if (phase) shared.set(phase.key, fresh)
    rows.push(fresh)
  }
  return rows.map((row) => ({ ...named(row), name: within(group.title, named(row).name) }))
}

function phaseOf(point: PointView): { key: string; label: string } | undefined {
  const token = PHASE.exec(point.id)?.[1]
  if (!token || !NUMERIC.has(point.type)) return undefined
  const kind = token.length > 2 ? 'line' : 'phase'
  return {
    key: [point.id.replace(token, kind), point.type, point.unit ?? ''].join(' '),
    label: token.toUpperCase().replace('_L', ''),
  }
}

/** A shared line drops the phase from its name; a phase that stayed alone keeps its name and has no label. */
function named(row: Row): Row {
  const [first] = row.members
  if (!first || row.members.length === 1) {
    return { ...row, members: row.members.map((member) => ({ ...member, label: '' })) }
  }
  const name = row.name
    .replace(/\bphase L[123][-_ ]?L[123]\b/i, 'line')
    .replace(/\s*\b(phase )?L[123]([-_ ]?L[123])?\b/i, '')
    .trim()
  return { ...row, name: name || row.name }
}

/** Under the heading "Genset", "Genset frequency" is "Frequency"; "Battery 2 voltage" stays as it is. */
function within(title: string, name: string): string {
  const rest = name.slice(title.length).trim()
  if (!name.toLowerCase().startsWith(`${title.toLowerCase()} `) || !/^[a-z]/i.test(rest)) return name
  return rest.charAt(0).toUpperCase() + rest.slice(1)
}

export function isWide(point: PointView): boolean {
  return WIDE.has(point.type)
}

/** A group that is only read when asked for starts closed. */
export function startsOpen(group: GroupView): boolean {
  return group.rate !== 'on_demand'
}

/** Lines a group takes on the page, title included: what the columns are balanced by. */
export function weightOf(group: GroupView): number {
  if (!startsOpen(group)) return 2
  return rowsOf(group).reduce(
    (sum, row) => sum + (row.members.some(({ point }) => isWide(point)) ? 2.5 : 1),
    2,
  )
}

/**
 * Deals the groups out to `count` columns, each to the lowest so far: the first groups of a profile come to the top.
 * It depends on the points alone: a value that changes never moves a group to another column.
 */
export function columnsOf(groups: readonly GroupView[], count: number): GroupView[][] {
  const columns = Array.from({ length: count }, () => ({ height: 0, groups: [] as GroupView[] }))
  for (const group of groups) {
    const lowest = columns.reduce((a, b) => (b.height < a.height ? b : a))
    lowest.height += weightOf(group)
    lowest.groups.push(group)
  }
  return columns.map((column) => column.groups)
}
