// Which view the address names. The part after # stays in the browser, so a path prefix of a proxy never matters.

export interface Route {
  view: 'site' | 'device' | 'wires'
  device: string | undefined
  wire: string | undefined
}

export const SITE_LINK = '#/'

export function parseRoute(hash: string): Route {
  const [, view, rest] = /^#\/([a-z]+)(?:\/([^/]+))?$/.exec(hash) ?? []
  const id = rest ? decoded(rest) : undefined
  if (view === 'wires') return { view: 'wires', device: undefined, wire: id }
  if (view === 'devices' && id !== undefined) return { view: 'device', device: id, wire: undefined }
  return { view: 'site', device: undefined, wire: undefined }
}

export function wireLink(id?: string): string {
  return id === undefined ? '#/wires' : `#/wires/${encodeURIComponent(id)}`
}

export function deviceLink(id: string): string {
  return `#/devices/${encodeURIComponent(id)}`
}

function decoded(text: string): string | undefined {
  try {
    return decodeURIComponent(text)
  } catch {
    return undefined
  }
}
