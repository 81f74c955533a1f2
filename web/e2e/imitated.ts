// A gateway that says what a test wants: for sites that no demonstration has.
import { once } from 'node:events'
import { readFile } from 'node:fs/promises'
import { createServer, type Server } from 'node:http'
import type { AddressInfo } from 'node:net'
import { extname, join } from 'node:path'
import { fileURLToPath } from 'node:url'
import type { snapshot } from '../src/logic/samples'
import type { PointsView } from '../src/logic/types'

const DIST = fileURLToPath(new URL('../dist', import.meta.url))
const TYPES: Record<string, string> = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.svg': 'image/svg+xml',
}

type Told = ReturnType<typeof snapshot>

export class Imitated {
  readonly address: string
  #server: Server

  private constructor(server: Server) {
    this.#server = server
    this.address = `http://127.0.0.1:${(server.address() as AddressInfo).port}/`
  }

  /** The page as it was built, with this site: `points` are those of each of its devices. */
  static async start(told: Told, points: PointsView): Promise<Imitated> {
    const server = createServer((request, answer) => {
      const path = new URL(request.url ?? '/', 'http://site').pathname
      if (path === '/api/v1/events') {
        answer.writeHead(200, { 'content-type': 'text/event-stream' })
        const { states, ...whole } = told
        const events = [['snapshot', whole], ...states.map((state) => ['state', state])] as const
        for (const [name, data] of events) answer.write(`event: ${name}\ndata: ${JSON.stringify(data)}\n\n`)
      } else if (path === '/api/v1/site') {
        answer.writeHead(200, { 'content-type': 'application/json' })
        answer.end(
          JSON.stringify({ ...told.site, devices: told.devices, diagram: { nodes: [], connections: [] } }),
        )
      } else if (path.endsWith('/points')) {
        answer.writeHead(200, { 'content-type': 'application/json' })
        answer.end(JSON.stringify(points))
      } else {
        const file = join(DIST, path === '/' ? 'index.html' : path)
        readFile(file).then(
          (bytes) =>
            answer
              .writeHead(200, {
                'content-type': TYPES[extname(file)] ?? 'application/octet-stream',
                'content-security-policy': "default-src 'self'",
              })
              .end(bytes),
          () => answer.writeHead(404).end(),
        )
      }
    })
    server.listen(0, '127.0.0.1')
    await once(server, 'listening')
    return new Imitated(server)
  }

  async stop(): Promise<void> {
    this.#server.close()
    this.#server.closeAllConnections()
    await once(this.#server, 'close')
  }
}
