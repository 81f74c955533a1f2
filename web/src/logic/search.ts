// Finds points of a controller by what people know of them: a word, an id, an address, a 4xxxx number, a label.
import type { GroupView, PointView } from './types'

/** Why a point was found, where its name does not show it. */
export interface Hit {
  what: string
  text: string
}

export interface Found {
  /** The groups that have matches, each with those alone. */
  groups: GroupView[]
  /** Why, by point. */
  hits: Map<string, Hit[]>
  count: number
}

/** More of them help nobody. */
const MOST_HITS = 4

export function termsOf(query: string): string[] {
  return query.toLowerCase().split(/\s+/).filter(Boolean)
}

/** The points in which every term of the query is found. */
export function find(groups: readonly GroupView[], query: string): Found {
  const terms = termsOf(query)
  const hits = new Map<string, Hit[]>()
  const found: GroupView[] = []
  for (const group of groups) {
    const points = group.points.filter((point) => {
      const why = matchOf(point, group.title, terms)
      if (why) hits.set(point.id, why)
      return why !== undefined
    })
    if (points.length > 0) found.push({ ...group, points })
  }
  return { groups: found, hits, count: hits.size }
}

function matchOf(point: PointView, title: string, terms: readonly string[]): Hit[] | undefined {
  const why = new Map<string, Hit>()
  for (const term of terms) {
    const name = point.name.toLowerCase().includes(term) || title.toLowerCase().includes(term)
    const hits = name ? [] : hitsOf(point, term)
    if (!name && hits.length === 0) return undefined
    for (const hit of hits) why.set(`${hit.what} ${hit.text}`, hit)
  }
  return [...why.values()].slice(0, MOST_HITS)
}

function hitsOf(point: PointView, term: string): Hit[] {
  const has = (text: string | null | undefined) => text?.toLowerCase().includes(term) ?? false
  const hits: Hit[] = []
  if (addressed(point, term)) {
    const hex = `0x${hexText(point.address)}`
    hits.push({ what: 'address', text: `${point.address}, ${hex}, ${point.plc}` })
  }
  if (has(point.id)) hits.push({ what: 'id', text: point.id })
  if (has(point.signal)) hits.push({ what: 'signal', text: point.signal ?? '' })
  if (point.unit?.toLowerCase() === term) hits.push({ what: 'unit', text: point.unit })
  for (const { value, label } of point.choices)
    if (has(label)) hits.push({ what: `choice ${value}`, text: label })
  for (const { bit, label, id, signal } of point.bits)
    if (has(label) || has(id) || has(signal)) hits.push({ what: `bit ${bit}`, text: label })
  return hits
}

/** A number is an address or a 4xxxx number, whole or its beginning; with 0x, h or a letter it is hexadecimal. */
function addressed({ address, plc, registers }: PointView, term: string): boolean {
  if (/^\d+$/.test(term)) {
    const number = Number(term)
    if ((number >= address && number < address + registers) || (number >= plc && number < plc + registers))
      return true
    return term.length > 2 && (String(address).startsWith(term) || String(plc).startsWith(term))
  }
  const digits = /^0x([0-9a-f]{1,4})$|^([0-9a-f]{1,4})h$|^(?=.*\d)([0-9a-f]{4})$/.exec(term)
  const hex = digits?.[1] ?? digits?.[2] ?? digits?.[3]
  if (hex === undefined) return false
  const number = Number.parseInt(hex, 16)
  return (number >= address && number < address + registers) || hexText(address).toLowerCase() === hex
}

/** An address as four hex digits. */
export function hexText(address: number): string {
  return address.toString(16).toUpperCase().padStart(4, '0')
}

/** A text cut where terms stand in it: what is found, and what is between. */
export function marked(text: string, terms: readonly string[]): { text: string; found: boolean }[] {
  const lower = text.toLowerCase()
  // Where lower case has another length, places would not be the same.
  if (terms.length === 0 || lower.length !== text.length) return [{ text, found: false }]
  const hit = new Array<boolean>(text.length).fill(false)
  for (const term of terms)
    for (let at = lower.indexOf(term); at >= 0; at = lower.indexOf(term, at + 1))
      hit.fill(true, at, at + term.length)
  const parts: { text: string; found: boolean }[] = []
  for (const [at, found] of hit.entries()) {
    const last = parts.at(-1)
    if (last?.found === found) last.text += text.charAt(at)
    else parts.push({ text: text.charAt(at), found })
  }
  return parts
}
