// The real program, started for a test and stopped after it.
import { spawn, type ChildProcess } from 'node:child_process'
import { once } from 'node:events'
import { createInterface } from 'node:readline'
import { fileURLToPath } from 'node:url'
import { resolve } from 'node:path'

const WEB = fileURLToPath(new URL('..', import.meta.url))
const BINARY = resolve(WEB, process.env.BUSBAR ?? '../target/debug/busbar')

export class Demo {
  /** The page's address, as the program printed it. */
  readonly address: string
  #child: ChildProcess

  private constructor(address: string, child: ChildProcess) {
    this.address = address
    this.#child = child
  }

  /** `busbar demo` on a port of the system's choice, or on the one given. */
  static async start(port = '0'): Promise<Demo> {
    const child = spawn(BINARY, ['demo', '--listen', `127.0.0.1:${port}`], {
      stdio: ['ignore', 'pipe', 'pipe'],
    })
    const stray = () => child.kill('SIGKILL')
    process.once('exit', stray)
    child.once('exit', () => process.off('exit', stray))
    let complaint = ''
    child.stderr.on('data', (bytes: Buffer) => (complaint = (complaint + bytes.toString()).slice(-4000)))
    const address = await new Promise<string>((found, failed) => {
      child.once('error', (error) => failed(new Error(`${BINARY} does not start: ${error.message}`)))
      child.once('exit', (code) => failed(new Error(`${BINARY} demo ended with ${code}:\n${complaint}`)))
      createInterface({ input: child.stdout }).on('line', (line) => {
        const match = /http:\/\/127\.0\.0\.1:\d+\//.exec(line)
        if (match) found(match[0])
      })
    })
    return new Demo(address, child)
  }

  get port(): string {
    return new URL(this.address).port
  }

  /** Ends it as Ctrl-C would, and waits until it is gone. */
  async stop(): Promise<void> {
    if (this.#child.exitCode !== null || this.#child.signalCode !== null) return
    const gone = once(this.#child, 'exit')
    this.#child.kill('SIGINT')
    await gone
  }
}
