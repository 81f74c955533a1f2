// What stands between two programs: a reverse proxy that serves the gateway below a path, and that can be cut.
import { createServer, request, type IncomingMessage, type Server, type ServerResponse } from 'node:http'
import type { AddressInfo, Socket } from 'node:net'

export class Proxy {
  readonly address: string
  /** Every path that was asked for. */
  readonly asked: string[] = []
  #server: Server
  #sockets = new Set<Socket>()

  private constructor(server: Server, prefix: string) {
    this.#server = server
    this.address = `http://127.0.0.1:${(server.address() as AddressInfo).port}${prefix}`
  }

  /** Serves what is at `target` below `prefix`, which starts and ends with a slash, and nothing else. */
  static async start(target: string, prefix: string): Promise<Proxy> {
    const server = createServer((from, to) => proxy.#pass(from, to, target, prefix))
    server.on('connection', (socket) => {
      proxy.#sockets.add(socket)
      socket.once('close', () => proxy.#sockets.delete(socket))
    })
    await new Promise<void>((ready) => server.listen(0, '127.0.0.1', ready))
    const proxy = new Proxy(server, prefix)
    return proxy
  }

  /** Cuts every connection that is open now. */
  cut(): void {
    for (const socket of this.#sockets) socket.destroy()
  }

  async stop(): Promise<void> {
    this.cut()
    await new Promise((done) => this.#server.close(done))
  }

  #pass(from: IncomingMessage, to: ServerResponse, target: string, prefix: string): void {
    const path = from.url ?? '/'
    this.asked.push(path)
    if (!path.startsWith(prefix)) {
      to.writeHead(404).end()
      return
    }
    const { host } = new URL(target)
    const onward = request(
      new URL(path.slice(prefix.length - 1), target),
      { method: from.method ?? 'GET', headers: { ...from.headers, host } },
      (answer) => {
        to.writeHead(answer.statusCode ?? 502, answer.headers)
        answer.pipe(to)
      },
    )
    onward.on('error', () => to.destroy())
    to.on('close', () => onward.destroy())
    from.pipe(onward)
  }
}
