// Which view the address names. The part after # stays in the browser, so a path prefix of a proxy never matters.

export interface Route {
  view: 'device'
  device: string | undefined
}

export function parseRoute(hash: string): Route {
  const [, view, id] = /^#\/([a-z]+)\/([^/]+)$/.exec(hash) ?? []
  return { view: 'device', device: view === 'devices' && id ? decoded(id) : undefined }
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
